"""The settle step at work: from a device that lies still to limits of rest."""

from imucal_wizard.procedure.ledger import KeptHold
from imucal_wizard.procedure.limits import coarse, fine
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.plan import Step
from imucal_wizard.procedure.scene import Scene
from imucal_wizard.procedure.settle import Settling, noise_of
from imucal_wizard.procedure.state import EventKind, Status
from imucal_wizard.procedure.stillness import Limits, Noise

LEAST_WINDOWS = 15
"""The fewest windows from which noise is taken when the whole length of rest never comes."""

KEPT_EACH_SECOND = 20
"""Windows that are kept for a second of the rest wanted: twice what it has."""
UNIT_DOUBTED = 1.25
"""Gravity that is off by more than this factor says that the unit is another."""


class SettleStage:
    """Measures the noise and sets the limits of the steps that follow.

    Args:
        scene: what all steps see.
        step: what the step needs.
        known: noise that is known beforehand; then the step is done before it begins.

    Attributes:
        noise: what the limits are made of, or None.
        makeshift: the noise is that of a rest shorter than asked for.
        why: why the present moment is no rest, or "".
    """

    def __init__(self, scene: Scene, step: Step, known: Noise | None = None) -> None:
        self._scene = scene
        self.seconds = step.seconds
        self._settling = Settling(scene.units, scene.resolution, keep=1)
        self.noise = known
        self.finished = known is not None
        self.makeshift = False
        self.why = ""

    @property
    def tally(self) -> tuple[float, float]:
        """Seconds of rest, seconds wanted."""
        done = self.seconds if self.finished else min(self._scene.held, self.seconds)
        return done, self.seconds

    def enter(self) -> None:
        """Begin again, with coarse limits."""
        self.finished = False
        self.why = ""
        scene = self._scene
        keep = max(round(self.seconds * KEPT_EACH_SECOND), KEPT_EACH_SECOND)
        self._settling = Settling(scene.units, scene.resolution, keep=keep)
        self.prepare()

    def prepare(self) -> None:
        """Coarse limits, as soon as it is known what one gravity reads."""
        if self._scene.upright.known:
            self._scene.watch.set_limits(self.coarse())

    def assume(self) -> None:
        """Limits from noise that was known beforehand, as soon as one gravity is."""
        scene = self._scene
        if self.noise is not None and scene.watch.limits is None and scene.upright.known:
            scene.watch.set_limits(self.fine(self.noise))

    def coarse(self) -> Limits:
        """Limits before any noise is known."""
        scene = self._scene
        return coarse(scene.upright.radius, scene.units, gyroscope=scene.has_gyroscope)

    def fine(self, noise: Noise) -> Limits:
        """Limits from the noise, with the resolution as it is known by now."""
        scene = self._scene
        return fine(noise, scene.resolution.steps, scene.upright.radius, scene.units)

    def refine(self) -> None:
        """A smaller step than all before was seen: the floor of the limits may change."""
        if self.noise is not None and self.finished:
            self._scene.watch.adapt(self.fine(self.noise))

    def admits(self, moment: Moment) -> bool:
        """Whether a window within the coarse limits belongs to the run; keeps the reason."""
        self._settling.remember(moment)
        if not self._scene.watch.still:
            self._settling.broken()
            self.why = self._scene.watch.reason or "samples are missing"
            return False
        self.why = self._settling.add(moment, self._scene.upright.radius)
        return not self.why

    def follow(self, moment: Moment) -> None:
        """Nothing more than `admits` has seen."""

    def completed(self, kept: KeptHold) -> None:
        """Ten seconds of rest are over: set the limits."""
        self.noise = self._settling.noise(any_window=kept.hold.hand_held)
        self.makeshift = False
        if self.noise is None:
            return
        scene = self._scene
        scene.watch.set_limits(self.fine(self.noise))
        self.finished = True
        scene.emit(EventKind.HOLD_TAKEN, f"Noise measured: {scene.units.noise_text(self.noise)}.")
        self._doubt()

    def make_do(self) -> bool:
        """Settle for the longest rest so far, when the whole length never came."""
        windows = self._settling.longest
        noise = noise_of(windows) if len(windows) >= LEAST_WINDOWS else None
        if noise is None:
            return False
        self.noise, self.makeshift = noise, True
        scene = self._scene
        scene.watch.set_limits(self.fine(noise))
        self.finished = True
        scene.emit(
            EventKind.WARNING,
            f"{self.seconds:.0f} s of rest never came: the noise is that of the longest rest, "
            f"{scene.units.noise_text(noise)}.",
        )
        return True

    def _doubt(self) -> None:
        """Say so when gravity does not look like gravity."""
        units = self._scene.units
        if not units.accelerometer_known:
            return
        size = self._scene.upright.radius
        if not 1.0 / UNIT_DOUBTED < size / units.gravity < UNIT_DOUBTED:
            self._scene.emit(
                EventKind.WARNING,
                f"Gravity reads {size:.3g} m/s² instead of {units.gravity:.3g}: "
                "check the accelerometer's unit in the source step.",
            )

    def view(self) -> Status:
        """Put it down and leave it."""
        return Status(
            instruction="PUT IT DOWN",
            detail=f"leave it alone for {self.seconds:.0f} s: its noise is measured",
            progress=self.tally,
        )
