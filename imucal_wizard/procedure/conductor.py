"""Moment by moment: is the device still, and what follows from it."""

from dataclasses import replace

import numpy as np

from imucal_wizard.procedure.collected import Collected
from imucal_wizard.procedure.field.record import FieldRecord
from imucal_wizard.procedure.field.words import left_out
from imucal_wizard.procedure.holding import Holding
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.plan import Procedure
from imucal_wizard.procedure.route import Route
from imucal_wizard.procedure.scales import Scales, excess
from imucal_wizard.procedure.scene import Scene
from imucal_wizard.procedure.state import EventKind, StepKind
from imucal_wizard.procedure.stillness import Noise
from imucal_wizard.procedure.taking import Taking

HAND_HELD = 10.0
"""A hand moves a device by at most this many times the coarse limits; more is another matter."""


class Conductor:
    """What a moment does to the procedure.

    Attributes:
        scene: what all steps see.
        holding: the still run under way.
        route: which step comes when.
        taking: what keeps the holds.
        record: the magnetometer's samples.
        elapsed: seconds of samples so far.
    """

    def __init__(
        self,
        procedure: Procedure,
        units: Scales,
        gyroscope_range: float | None,
        noise: Noise | None = None,
    ) -> None:
        self.scene = Scene(procedure, units, gyroscope_range)
        self.holding = Holding(self.scene)
        self.route = Route(self.scene, self.holding, noise)
        self.taking = Taking(self.scene, self.holding, self.route)
        self.record = FieldRecord()
        self.elapsed = 0.0
        self._broke = ""

    def follow(self, moment: Moment) -> None:
        """Take one moment."""
        scene, was_still = self.scene, self.scene.still
        scene.time = moment.end
        scene.has_gyroscope = moment.rate is not None
        if moment.field is not None and len(moment.field):
            self.record.add(moment.field)
            scene.has_magnetometer = True
        self.elapsed += moment.seconds
        self._learn(moment)
        scene.still = self._judge(moment)
        if was_still and not scene.still:
            self._break(moment)
        elif not scene.still:
            self.holding.fresh()
        self.taking.remember(moment)
        self.holding.add(moment)
        scene.passage.add(moment, still=scene.still)
        if scene.still:
            self._rest(began=not was_still)
        scene.held = self.holding.counted
        self._follow_step(moment)
        if scene.still:
            self.taking.consider()
        self._be_patient(moment)

    def _follow_step(self, moment: Moment) -> None:
        """The step at work sees the moment, and may have all it needs with it."""
        stage = self.route.stage
        before = stage.finished
        stage.follow(moment)
        if stage.finished and not before:
            self.route.advance()

    def end(self) -> None:
        """No more samples: a hold is complete as it is, and so are the circles."""
        self.holding.restart()
        if self.route.step is StepKind.FIELD:
            self.route.field.end()

    def collected(self) -> Collected:
        """Everything that has been measured and not taken back or left out."""
        gathered, series = self.route.field.gathered, self.record.series()
        collected = replace(self.holding.collected(), steps=self.scene.resolution.steps)
        if series is None or StepKind.FIELD in self.route.skipped:
            return replace(collected, magnetometer=series)
        return replace(
            collected,
            magnetometer=series,
            field_spans=gathered.survey.spans(),
            field_left_out=left_out(gathered.survey, gathered.unit),
        )

    def _learn(self, moment: Moment) -> None:
        """Which way is up, and how fine the readings are."""
        scene, reading = self.scene, moment.mean_a
        if not scene.upright.known or not (scene.ledger.holds or scene.still):
            # The first samples may come from a device in mid-air; the newest guess is the best.
            scene.upright.begin(reading)
        self.route.settle.assume()
        scene.up = scene.upright.up(reading) if np.isfinite(reading).all() else None
        if scene.resolution.see(moment) and self.route.step is not StepKind.SETTLE:
            self.route.settle.refine()

    def _judge(self, moment: Moment) -> bool:
        watch, settle = self.scene.watch, self.route.settle
        if self.route.step is not StepKind.SETTLE:
            return watch.judge(moment)
        if watch.limits is None:
            settle.prepare()
        watch.judge(moment)
        return settle.admits(moment)

    def _rest(self, *, began: bool) -> None:
        """The device is at rest, and perhaps in a hold that is kept."""
        scene, run = self.scene, self.scene.run
        if began and self.route.asking and not run.used:
            scene.emit(EventKind.STILL, "Still: keep it so.")
        if run.kept is not None and not run.kept.dropped:
            scene.passage.rest(run.kept)

    def _break(self, moment: Moment) -> None:
        """The still run ends with the block before this one."""
        scene, run, asking = self.scene, self.scene.run, self.route.asking
        if run.kept is not None:
            self.holding.finish()
            if asking:
                scene.emit(EventKind.MOVED, "Moving.")
        elif asking and not run.used:
            what, self._broke = "Moved" if moment.full else "Interrupted", self._why(moment)
            scene.emit(
                EventKind.HOLD_BROKEN,
                f"{what} after {self.holding.seconds:.1f} s: {self._broke}. Hold it again.",
            )
        self.holding.fresh()

    def _why(self, moment: Moment) -> str:
        if self.route.step is StepKind.SETTLE and self.route.settle.why:
            return self.route.settle.why
        return self.scene.watch.reason or ("samples are missing" if not moment.full else "it moved")

    def _be_patient(self, moment: Moment) -> None:
        """Count how long a hold has been asked for in vain; open the ways out."""
        scene, watch, route = self.scene, self.scene.watch, self.route
        content = scene.still and (scene.run.used or route.step in scene.run.told)
        if not route.asking or content:
            watch.rest()
            return
        enough = route.step is StepKind.SETTLE and watch.exhausted_in(moment.seconds)
        if enough and route.settle.make_do():
            route.advance()
            return
        what = watch.wait(moment.seconds)
        reason = watch.reason or f"again and again {self._broke or 'it moves'}"
        if what == "stuck":
            text = f"No rest for {watch.waiting:.0f} s: {reason}. {self._way_out()}"
            scene.emit(EventKind.STUCK, text)
        elif what == "loosened":
            text = f"The limits are {watch.loosened:.0f} times wider now: {reason}."
            scene.emit(EventKind.WARNING, text)

    def _way_out(self) -> str:
        """What to do about a device that does not come to rest."""
        worst = self.scene.watch.worst
        if self.route.step is not StepKind.SETTLE:
            return "Lean it on something."
        if worst is not None and excess(worst) < HAND_HELD:
            return "Lay it down where nothing shakes it."
        return "If it does lie still, its units are wrong: go back to the source."
