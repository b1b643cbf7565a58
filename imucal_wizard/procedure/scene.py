"""What every step of the procedure sees: the present moment, what is kept, and a voice."""

from dataclasses import dataclass, field
from typing import Protocol

from imucal_wizard.procedure.ledger import KeptHold, KeptRotation, Ledger
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.passage import Passage
from imucal_wizard.procedure.plan import Procedure
from imucal_wizard.procedure.resolution import Resolution
from imucal_wizard.procedure.scales import Scales
from imucal_wizard.procedure.state import Event, EventKind, Status, StepKind
from imucal_wizard.procedure.upright import Upright
from imucal_wizard.procedure.watch import Watch
from imucal_wizard.readings import FloatArray


@dataclass(eq=False)
class Run:
    """The present still run.

    Attributes:
        kept: the hold it has become, once it was long enough.
        told: the steps that have been told of it; each is told once.
        used: it counts no more: it was taken back, or is another step's; move the device first.
        complete: the kept hold grows no more.
    """

    kept: KeptHold | None = None
    told: set[StepKind] = field(default_factory=set)
    used: bool = False
    complete: bool = False


class Scene:
    """The present moment, shared by the machine and its steps."""

    def __init__(self, procedure: Procedure, units: Scales, gyroscope_range: float | None) -> None:
        self.procedure = procedure
        self.units = units
        self.gyroscope_range = gyroscope_range
        self.ledger = Ledger()
        self.watch = Watch(units)
        self.upright = Upright(counts=not units.accelerometer_known)
        self.resolution = Resolution()
        self.run = Run()
        self.passage = Passage()
        self.motion: KeptRotation | None = None
        self.time = 0.0
        self.held = 0.0
        self.still = False
        self.up: FloatArray | None = None
        self.has_gyroscope = True
        self.has_magnetometer = False
        self._events: list[Event] = []
        self.last_event: Event | None = None

    def emit(self, kind: EventKind, text: str) -> None:
        """Say that something happened now."""
        self.last_event = Event(kind, self.time, text)
        self._events.append(self.last_event)

    def drain(self) -> tuple[Event, ...]:
        """The events since the last call."""
        events, self._events = tuple(self._events), []
        return events

    def direction(self, kept: KeptHold) -> FloatArray | None:
        """Up during a hold, as well as it is known by now."""
        return self.upright.up(kept.hold.accelerometer)


class Stage(Protocol):
    """One step at work."""

    @property
    def seconds(self) -> float:
        """How long a hold must last, s; 0 when none is asked for."""

    def enter(self) -> None:
        """The step begins, or is come back to."""

    def completed(self, kept: KeptHold) -> None:
        """A hold has become long enough, or was when the step began."""

    def follow(self, moment: Moment) -> None:
        """Another moment has passed."""

    @property
    def finished(self) -> bool:
        """Whether the step has all it needs."""

    @property
    def tally(self) -> tuple[float, float]:
        """How much is done and how much is wanted, in the step's own unit."""

    def view(self) -> Status:
        """What this step alone has to show."""
