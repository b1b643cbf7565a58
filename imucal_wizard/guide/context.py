"""The state that all steps share: present block, measurements, events."""

from dataclasses import field
from typing import Protocol

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.measurements import KeptHold, KeptRotation, Measurements
from imucal_wizard.guide.plan import Procedure
from imucal_wizard.guide.scales import Scales
from imucal_wizard.guide.state import Event, Status
from imucal_wizard.guide.stillness_watch import StillnessWatch
from imucal_wizard.guide.up_direction import UpEstimate
from imucal_wizard.measurement.rounding import Resolution
from imucal_wizard.measurement.stillness import Block


@dataclass(eq=False)
class StillRun:
    """The present still run.

    Attributes:
        kept: the hold made from it, once it was long enough.
        received: the steps that have received it; each receives it once.
        used: it no longer counts for a step; the device must move before the next hold.
        complete: the kept hold no longer grows.
    """

    kept: KeptHold | None = None
    received: set[StepKind] = field(default_factory=set)
    used: bool = False
    complete: bool = False


class Context:
    """The state that the state machine shares with its steps.

    Attributes:
        procedure: the plan.
        units: units of the readings.
        gyroscope_range: full scale of the gyroscope in its unit, or None.
        measurements: the holds, rotations and circles.
        watch: the limits of rest.
        up_estimate: provisional bias and magnitude of gravity.
        resolution: resolution of each axis.
        run: the present still run.
        start: the kept hold that the present motion starts from, or None.
        start_lost: why there is no such hold, or "".
        motion: the motion that ended in the newest hold, or None.
        time: end of the newest block, s.
        held: seconds of the present hold that count.
        still: the device is at rest.
        up: up direction in the body frame, or None.
        has_gyroscope: the stream has a gyroscope.
        has_magnetometer: the stream has had samples of a magnetometer.
        last_event: the newest event, or None.
    """

    def __init__(self, procedure: Procedure, units: Scales, gyroscope_range: float | None) -> None:
        self.procedure = procedure
        self.units = units
        self.gyroscope_range = gyroscope_range
        self.measurements = Measurements()
        self.watch = StillnessWatch(units)
        self.up_estimate = UpEstimate(counts=not units.accelerometer_known)
        self.resolution = Resolution()
        self.run = StillRun()
        self.start: KeptHold | None = None
        self.start_lost = ""
        self.motion: KeptRotation | None = None
        self.time = 0.0
        self.held = 0.0
        self.still = False
        self.up: FloatArray | None = None
        self.has_gyroscope = True
        self.has_magnetometer = False
        self.last_event: Event | None = None
        self._events: list[Event] = []

    def emit(self, kind: EventKind, text: str) -> None:
        """Report an event at the present time."""
        self.last_event = Event(kind, self.time, text)
        self._events.append(self.last_event)

    def drain(self) -> tuple[Event, ...]:
        """The events since the last call."""
        events, self._events = tuple(self._events), []
        return events

    def direction(self, kept: KeptHold) -> FloatArray | None:
        """Up direction during a hold by the present estimate; None in free fall."""
        return self.up_estimate.up(kept.hold.accelerometer)


class Stage(Protocol):
    """The logic of one step."""

    @property
    def seconds(self) -> float:
        """How long a hold must last, s; 0 if the step needs no hold."""

    @property
    def finished(self) -> bool:
        """Whether the step has all measurements that it needs."""

    @property
    def tally(self) -> tuple[float, float]:
        """How much is done and how much is needed, in the step's own unit."""

    @property
    def holds_here(self) -> bool:
        """Whether a hold where the device is now would serve the step."""

    def enter(self) -> None:
        """Begin the step, or return to it."""

    def follow(self, block: Block) -> None:
        """Take the next block."""

    def completed(self, kept: KeptHold) -> None:
        """Take a hold that is long enough."""

    def view(self) -> Status:
        """The step's part of the status."""
