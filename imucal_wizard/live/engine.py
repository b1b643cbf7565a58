"""From bytes to decisions without threads: stream, procedure, and what is shown and written of it.

Bytes and commands in the same order make the same state to the last bit, whenever they come.
"""

from collections import deque
from collections.abc import Sequence

from imucal_wizard.devices.setup import StreamSetup
from imucal_wizard.live.course import Course
from imucal_wizard.live.journal import Journal
from imucal_wizard.live.settings import Settings
from imucal_wizard.live.snapshot import Snapshot, StreamStatus
from imucal_wizard.live.stream import Stream
from imucal_wizard.live.view import View
from imucal_wizard.procedure.collected import Collected
from imucal_wizard.procedure.state import Event, EventKind, Status, StepKind
from imucal_wizard.procedure.steps import Listener
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
        journal: the same.
        settings: the same.
        finished: nothing more will come.
    """

    def __init__(
        self,
        setup: StreamSetup | None = None,
        settings: Settings | None = None,
        *,
        source: str = "",
        journal: Journal | None = None,
    ) -> None:
        self.journal = journal or Journal()
        self.settings = settings or Settings()
        self.finished = False
        self._listener: Listener | None = None
        self._events: deque[Event] = deque(maxlen=EVENTS_KEPT)
        self._event_count = 0
        self._stream = Stream(setup or StreamSetup(), source)
        self._course = Course(self.settings)
        self._view = View()

    def listen(self, listener: Listener | None) -> None:
        """Tell somebody of the status after each block of samples and each command.

        Ask for it before the first sample.
        """
        self._listener = listener
        self._course = Course(self.settings, listener, waiting=self._course.waiting)

    def restart(self, noise: Noise | None = None) -> None:
        """Forget every sample; what has happened stays counted.

        Args:
            noise: of the device at rest, where it is known already.
        """
        self._stream.restart()
        self._begin_again(Course(self.settings, self._listener, noise))

    def _begin_again(self, course: Course) -> None:
        self._course = course
        self._view = View(self._view.serial)
        self.finished = False

    @property
    def source(self) -> str:
        """What is read, in words."""
        return self._stream.source

    @property
    def samples(self) -> int:
        """How many samples the procedure has been fed."""
        return self._course.samples

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
        was_ready = self._stream.intake.ready
        readings = self._stream.read(pieces)
        if not was_ready:
            self._resolved()
        self._view.changed()
        if readings is not None:
            self.receive_readings(readings)
        self._remark()

    def _resolved(self) -> None:
        """Write down how the stream is read once everything about it is known."""
        if self._stream.intake.ready:
            self.journal.resolved(self._stream.intake.setup)

    def _remark(self) -> None:
        """Say what is new about the stream and the session."""
        for kind, text in self._stream.remarks(self.step, self.journal.problem):
            self.tell(kind, text)

    def receive_readings(self, readings: Readings, rate: float = 0.0) -> None:
        """Take samples that are decoded already, all sensors at the same times.

        Args:
            readings: the samples.
            rate: samples per second of the whole, where it is known; 0 to take it from these.
        """
        if not len(readings):
            return
        self._stream.note(readings.warnings)
        if not self._course.begun:
            rate = self._stream.intake.rate or rate or readings.accelerometer.rate
            self._view.begin(rate, readings)
            self._happened(self._course.begin(readings, rate))
        self._view.feed(readings)
        self._happened(self._course.feed(readings))

    def command(self, name: str, argument: str = "") -> None:
        """Do what the operator asks for; before the first sample it is done with that sample."""
        self.journal.command(self.samples, name, argument)
        self._happened(self._course.command(name, argument))
        self._view.changed()

    def set_setup(self, setup: StreamSetup) -> None:
        """Read the stream in another way from now on; the procedure begins anew."""
        self.journal.new_setup(self.samples, setup)
        before, readings = self._course, self._stream.reconfigure(setup)
        self._begin_again(Course(self.settings, self._listener, waiting=before.waiting))
        if before.begun:
            self.tell(EventKind.WARNING, "the stream is read anew: the procedure begins again")
        self._resolved()
        if readings is not None:
            self.receive_readings(readings)

    def end(self) -> None:
        """Nothing more will come: what waits for more is complete as it is."""
        rest = self._stream.intake.flush()
        if rest is not None:
            self.receive_readings(rest)
        self._happened(self._course.flush())
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
            self._stream.flow.heard(arrival)
        self._remark()
        if self._stream.flow.silent(arrival):
            self._view.changed()

    def connected(self, source: str) -> None:
        """The port is open; what is read there, in words."""
        self._stream.source = source
        self.link("")

    def link(self, problem: str) -> None:
        """What is wrong with the port; ``""`` when nothing is."""
        self._stream.flow.link(problem)
        self._view.changed()

    def tell(self, kind: EventKind, text: str) -> None:
        """Let something be known that the procedure does not know of."""
        self._happened((Event(kind, self._course.time, text),))

    def note(self, text: str) -> None:
        """The same, to be found again in the warnings of the stream and of the result."""
        self._stream.note((text,))
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
        return self._course.step

    def status(self) -> Status:
        """The procedure at this moment."""
        return self._course.status()

    @property
    def makeshift(self) -> Noise | None:
        """The noise of a rest that was shorter than asked for, where that had to do; else None."""
        return self._course.makeshift

    def collected(self) -> Collected:
        """What has been measured."""
        return self._course.collected()

    def snapshot(self) -> Snapshot:
        """A frozen picture; the same object again when nothing has changed since."""
        events = (tuple(self._events), self._event_count)
        return self._view.snapshot(self._stream_status, self.status, events, self.finished)

    def busy(self, text: str) -> Snapshot:
        """A picture that shows nothing yet but what is being done."""
        return self._view.bare(StreamStatus(source=self.source, problem=text))

    def _stream_status(self) -> StreamStatus:
        return self._stream.status(self._view.rate, self.samples, self.journal.problem)
