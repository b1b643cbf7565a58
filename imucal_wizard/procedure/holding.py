"""The still run under way and the hold that it has become."""

from imucal_wizard.procedure.collected import Collected
from imucal_wizard.procedure.holds import Hold, HoldBuilder
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.scene import Run, Scene

LONGEST_HOLD = 300.0
"""A hold ends after this, s: it says nothing more, and memory stays flat."""


class Holding:
    """Gathers the blocks of the present run; keeps its hold as long as the device is still."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._builder = HoldBuilder()
        self._earlier = 0.0

    def add(self, moment: Moment) -> None:
        """Take the next block, still or not."""
        self._builder.add(moment.block, self._scene.still)
        run = self._scene.run
        if self._builder.seconds >= LONGEST_HOLD:
            if run.kept is not None:
                self.finish()
                self._earlier += self._builder.seconds
                run.complete = True
            self._builder.drop()

    @property
    def seconds(self) -> float:
        """How long the run has lasted, guards off."""
        return self._builder.seconds

    @property
    def counted(self) -> float:
        """How much of it counts for what is asked; 0 where the device must be moved first."""
        run = self._scene.run
        if run.used:
            return 0.0
        return self._builder.seconds + (self._earlier if run.kept is not None else 0.0)

    def hold(self) -> Hold | None:
        """The hold so far, guards off."""
        return self._builder.hold()

    def finish(self) -> None:
        """Bring the kept hold up to the whole run; the gyroscope rests where it rested."""
        scene = self._scene
        kept = scene.run.kept
        if kept is None or kept.dropped or scene.run.complete:
            return
        hold = self._builder.hold()
        if hold is not None:
            kept.update(hold)
        if kept.hold.gyroscope is not None and scene.watch.loosened == 1.0:
            scene.watch.rest_at(kept.hold.gyroscope)

    def fresh(self) -> None:
        """The device moves: the next run has nothing yet."""
        self._scene.run = Run()
        self._earlier = 0.0

    def restart(self) -> None:
        """A hold begins now, whatever the device did before."""
        self.finish()
        self._builder.drop()
        self.fresh()
        self._scene.still = False
        self._scene.held = 0.0

    def collected(self) -> Collected:
        """Everything kept; a hold that is still growing as long as it is by now."""
        run, ledger = self._scene.run, self._scene.ledger
        kept, grown = run.kept, self._builder.hold()
        if kept is None or kept.dropped or run.complete or grown is None:
            return ledger.collected()
        before = kept.hold
        kept.update(grown)
        try:
            return ledger.collected()
        finally:  # decisions never depend on whether somebody looked
            kept.hold = before
