"""From bytes to decisions without threads: Intake, Machine, and what is shown and written of them.

Bytes and commands in the same order make the same state to the last bit, whenever they come.
"""

from collections import deque
from collections.abc import Sequence

from imucal_wizard.devices.intake import Intake, StreamSetup
from imucal_wizard.errors import UsageError
from imucal_wizard.live.health import Health
from imucal_wizard.live.journal import Journal
from imucal_wizard.live.remarks import Remarks
from imucal_wizard.live.settings import Settings
from imucal_wizard.live.snapshot import Snapshot, StreamStatus
from imucal_wizard.live.stream import stream_status
from imucal_wizard.live.view import View
from imucal_wizard.procedure.state import Collected, Event, EventKind, Status, StepKind
from imucal_wizard.procedure.steps import Listener, Machine
from imucal_wizard.procedure.stillness import Noise
from imucal_wizard.readings import Readings

EVENTS_KEPT = 50
_QUIET_EVENTS = frozenset({EventKind.STILL, EventKind.MOVED, EventKind.STUCK})
"""Events that change nothing of what has been measured."""


class Engine:
    """One stream and its procedure.

    Args:
        setup: what is known of the stream.
        settings: how the procedure is carried out.
        source: what is read, in words.
        journal: where everything is written down.

    Attributes:
        listener: told of the status after each block of samples and each command; set it before
            the first sample.
    """

    def __init__(
        self,
        setup: StreamSetup | None = None,
        settings: Settings | None = None,
        *,
        source: str = "",
        journal: Journal | None = None,
    ) -> None:
        self.source = source
        self.journal = journal or Journal()
        self.settings = settings or Settings()
        self.listener: Listener | None = None
        self.finished = False
        self._setup = setup or StreamSetup()
        self._events: deque[Event] = deque(maxlen=EVENTS_KEPT)
        self._event_count = 0
        self._health = Health()
        self._view = View()
        self.restart()

    def restart(self, noise: Noise | None = None) -> None:
        """Forget every sample; what has happened stays counted.

        Args:
            noise: of the device at rest, where it is known already.
        """
        self._noise = noise
        self.intake = Intake(self._setup)
        self._machine: Machine | None = None
        self._waiting: list[tuple[str, str]] = []
        self._fed = 0
        self._time = 0.0
        self._noted: tuple[str, ...] = ()
        self._remarks = Remarks()
        self._view = View(self._view.serial)
        self.finished = False

    @property
    def samples(self) -> int:
        """How many samples the procedure has been fed."""
        return self._fed

    def receive(self, data: bytes, arrival: float) -> None:
        """Take bytes.

        Args:
            data: as they came.
            arrival: when, s, on a clock that never goes back.
        """
        self.receive_all(((data, arrival),))

    def receive_all(self, pieces: Sequence[tuple[bytes, float]]) -> None:
        """Take several pieces, each with its arrival: the same decisions as one by one, sooner."""
        for data, arrival in pieces:
            self.journal.raw(arrival, data)
            self._health.heard(arrival)
        was_ready = self.intake.ready
        readings = self.intake.feed_all(pieces)
        if not was_ready and self.intake.ready:
            self.journal.resolved(self.intake.setup)
        self._view.changed()
        if readings is not None:
            self.receive_readings(readings)
        self._remark()

    def _remark(self) -> None:
        """Say what is new about the stream and the session."""
        stalled = self._health.stalled(self.intake)
        step, unwritten = self.step, self.journal.problem
        for kind, text in self._remarks.new(step, self.intake.warnings, stalled, unwritten):
            self.tell(kind, text)

    def receive_readings(self, readings: Readings, rate: float = 0.0) -> None:
        """Take samples that are decoded already, all sensors at the same times.

        Args:
            readings: the samples.
            rate: samples per second of the whole, where it is known; 0 to take it from these.
        """
        if not len(readings):
            return
        self._noted = tuple(dict.fromkeys((*self._noted, *readings.warnings)))
        machine = self._machine or self._begin(readings, rate)
        self._fed += len(readings)
        self._time = float(readings.accelerometer.time[-1])
        self._view.feed(readings)
        self._happened(machine.feed(readings))

    def _begin(self, readings: Readings, rate: float) -> Machine:
        """The machine, now that rate and units are known; it obeys what was ordered before."""
        rate = self.intake.rate or rate or readings.accelerometer.rate
        machine = self._machine = self.settings.machine(readings, rate, self._noise, self.listener)
        self._view.begin(rate, readings)
        waiting, self._waiting = self._waiting, []
        for name, argument in waiting:
            self._obey(machine, name, argument)
        return machine

    def command(self, name: str, argument: str = "") -> None:
        """Do what the operator asks for; before the first sample it is done with that sample."""
        self.journal.command(self._fed, name, argument)
        if self._machine is None:
            self._waiting.append((name, argument))
        else:
            self._obey(self._machine, name, argument)

    def _obey(self, machine: Machine, name: str, argument: str) -> None:
        try:
            self._happened(machine.command(name, argument))
        except UsageError as error:
            self.tell(EventKind.WARNING, str(error))
        self._view.changed()

    def set_setup(self, setup: StreamSetup) -> None:
        """Read the stream in another way from now on; the procedure begins anew."""
        self.journal.new_setup(self._fed, setup)
        intake, waiting, begun = self.intake, self._waiting, self._machine is not None
        self._setup = setup
        self.restart()
        self._waiting = waiting
        if begun:
            self.tell(EventKind.WARNING, "the stream is read anew: the procedure begins again")
        self.intake, readings = intake.reconfigured(setup)
        if self.intake.ready:
            self.journal.resolved(self.intake.setup)
        if readings is not None:
            self.receive_readings(readings)

    def end(self) -> None:
        """Nothing more will come: what waits for more is complete as it is."""
        rest = self.intake.flush()
        if rest is not None:
            self.receive_readings(rest)
        if self._machine is not None:
            self._happened(self._machine.flush())
        self.finished = True
        self._view.changed()

    def close(self) -> None:
        """Let go of the session; nothing more will come."""
        self.finished = True
        self.journal.close()
        self._view.changed()

    def idle(self, arrival: float, *, expected: bool = False) -> None:
        """Nothing came until now; where that is ``expected`` it is no silence."""
        self.journal.idle()
        if expected:
            self._health.heard(arrival)
        self._remark()
        if self._health.silent(arrival):
            self._view.changed()

    def link(self, problem: str) -> None:
        """The port is open (``""``), or what is wrong with it."""
        self._health.link(problem)
        self._view.changed()

    def tell(self, kind: EventKind, text: str) -> None:
        """Let something be known that the procedure does not know of."""
        self._happened((Event(kind, self._time, text),))

    def note(self, text: str) -> None:
        """The same, to be found again in the warnings of the stream and of the result."""
        self._noted = (*self._noted, text)
        self.tell(EventKind.WARNING, text)

    def _happened(self, events: Sequence[Event]) -> None:
        if not events:
            return
        self._events.extend(events)
        self._event_count += len(events)
        self._view.changed()
        if any(event.kind not in _QUIET_EVENTS for event in events):
            self.journal.found(self.collected(), events)
            self.journal.step(str(self.step))

    @property
    def step(self) -> StepKind:
        """The step at work; sooner told than the whole status."""
        return self._machine.step if self._machine is not None else StepKind.SOURCE

    def status(self) -> Status:
        """The procedure at this moment."""
        return self._machine.status() if self._machine is not None else Status()

    @property
    def makeshift(self) -> Noise | None:
        """The noise of a rest that was shorter than asked for, where that had to do; else None."""
        return None if self._machine is None else self._machine.makeshift

    def collected(self) -> Collected:
        """What has been measured."""
        return self._machine.collected() if self._machine is not None else Collected((), ())

    def snapshot(self) -> Snapshot:
        """A frozen picture; the same object again when nothing has changed since."""
        return self._view.snapshot(
            self._stream, self.status, (tuple(self._events), self._event_count), self.finished
        )

    def busy(self, text: str) -> Snapshot:
        """A picture that shows nothing yet but what is being done."""
        return self._view.bare(StreamStatus(source=self.source, problem=text))

    def _stream(self) -> StreamStatus:
        return stream_status(
            self.intake,
            self._health,
            source=self.source,
            rate=self._view.rate,
            samples=self._fed,
            unwritten=self.journal.problem,
            noted=self._noted,
        )
