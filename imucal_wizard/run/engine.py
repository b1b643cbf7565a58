"""The engine: from bytes to decisions, without threads.

The same bytes and commands in the same order give a bit-identical state, whatever their timing.
"""

import json
import pickle
from collections.abc import Iterator, Sequence

from imucal_wizard.acquire.files.session_file import DESCRIBE_COMMAND
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.acquire.stream_corrections import since
from imucal_wizard.core.description import Description
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import Readings
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.state import Event, Status
from imucal_wizard.guide.state_machine import Listener, StateMachine
from imucal_wizard.guide.steps.recheck import Planner
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.measurement.stillness import Noise
from imucal_wizard.run.announcements import Announcements
from imucal_wizard.run.journal import Journal
from imucal_wizard.run.link_health import LinkHealth, Notification, Notifications
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.snapshot import Snapshot, StreamStatus
from imucal_wizard.run.snapshot_maker import SnapshotMaker

CHECKPOINT_SECONDS = 120.0
"""Seconds of samples after which the state is kept again: a resume replays them in a second."""
CHECKPOINT_SAMPLES = 200_000
"""The same in samples, for fast streams."""
CHECKPOINT_BYTES = 50_000
"""Bytes of checkpoints per second of samples at most; a large state is kept less often."""
_STATE = (
    "_stream",
    "_machine",
    "_noise",
    "_time",
    "_waiting",
    "_announcements",
    "_view",
    "samples",
)
"""The attributes that a checkpoint keeps."""
_QUIET_EVENTS = frozenset({EventKind.STILL, EventKind.MOVED, EventKind.STUCK})
"""Events that do not change the measurements."""


class DecodedStream:
    """Decodes bytes to samples and collects warnings and problems.

    Args:
        setup: known properties of the stream.
        source: description of the source.

    Attributes:
        source: description of the source; a port adds the device once it is open.
        intake: the intake of the bytes; unused if a recording is played.
        link_health: state of the link.
    """

    def __init__(self, setup: StreamSetup, source: str) -> None:
        self.source = source
        self.link_health = LinkHealth()
        self._setup = setup
        self.restart()

    def restart(self) -> None:
        """Start again with the next bytes and the same setup."""
        self._begin(Intake(self._setup))

    def _begin(self, intake: Intake) -> None:
        self.intake = intake
        self._noted: tuple[str, ...] = ()
        self._signs = 0
        self._notifications = Notifications()

    def read(self, pieces: Sequence[tuple[bytes, float]]) -> Readings | None:
        """The samples in new bytes, each piece with its arrival; None if there are none."""
        for _, arrival in pieces:
            self.link_health.heard(arrival)
        return self.intake.feed_all(pieces)

    def signs_changed(self) -> bool:
        """Whether the new readings have signs that earlier ones lack."""
        before, self._signs = self._signs, len(self.intake.signs)
        return self._signs != before

    def reconfigure(self, setup: StreamSetup) -> Readings | None:
        """Use another setup from now on; returns the samples in the bytes kept so far."""
        intake, readings = self.intake.reconfigured(setup)
        self._setup = setup
        self._begin(intake)
        return readings

    def note(self, texts: Sequence[str]) -> None:
        """Add warnings from elsewhere, each once."""
        self._noted = tuple(dict.fromkeys((*self._noted, *texts)))

    def notifications(self, step: StepKind) -> Iterator[Notification]:
        """The new notifications in a step."""
        stalled = self.link_health.stalled(self.intake)
        return self._notifications.new(step, self.intake.warnings, stalled)

    def status(self, rate: float, samples: int, unwritten: str) -> StreamStatus:
        """The status of the stream for the screens.

        Args:
            rate: samples per second if no bytes are read.
            samples: number of samples that the procedure has received.
            unwritten: why what was received is not on the disk yet, or "".
        """
        intake = self.intake
        return StreamStatus(
            source=self.source,
            format=intake.format,
            connected=self.link_health.connected,
            problem=self.link_health.problem(intake, unwritten),
            busy=self.link_health.busy,
            stalled=bool(self.link_health.stalled(intake)),
            unwritten=unwritten,
            rate=intake.measured_rate if intake.samples > 0 else rate,
            samples=samples,
            lost=intake.dropped,
            malformed=intake.malformed,
            digits=intake.digits,
            warnings=tuple(dict.fromkeys((*intake.warnings, *self._noted))),
            needs=intake.needs,
            columns=intake.columns,
            line=intake.preview.line,
            values=intake.preview.values,
        )


class Engine:
    """A stream and its procedure.

    Before the first sample, rate and units are unknown and there is no procedure; commands wait for
    it. ``status``, ``step`` and ``collected`` are what is decided; a snapshot shows only what is on
    the disk. Methods that write raise ``SessionError`` once the disk has failed.

    Args:
        setup: known properties of the stream.
        settings: settings of the procedure.
        source: description of the source.
        journal: journal of the session.
        planner: chooses the poses of a recheck.

    Attributes:
        journal: the same.
        settings: the same.
        samples: number of samples that the procedure has received.
        finished: whether the source has ended.
    """

    def __init__(
        self,
        setup: StreamSetup | None = None,
        settings: ProcedureSettings | None = None,
        *,
        source: str = "",
        journal: Journal | None = None,
        planner: Planner | None = None,
    ) -> None:
        self._planner = planner
        self.journal = journal or Journal()
        self.settings = settings or ProcedureSettings()
        self._listener: Listener | None = None
        self._announcements = Announcements()
        self._stream = DecodedStream(setup or StreamSetup(), source)
        self._waiting: list[tuple[str, str]] = []
        self._view = SnapshotMaker()
        self._begin_again()

    def _begin_again(self, noise: Noise | None = None) -> None:
        """Restart the procedure with the next sample."""
        self._machine: StateMachine | None = None
        self._noise = noise
        self._time = 0.0
        self._kept_until = CHECKPOINT_SECONDS, CHECKPOINT_SAMPLES
        self._view = SnapshotMaker(self._view.serial)
        self.samples = 0
        self.finished = False

    def listen(self, listener: Listener | None) -> None:
        """Call a listener with the instruction after each block of samples and each command.

        Args:
            listener: called from the first sample on; must be set before it.
        """
        self._listener = listener

    def restart(self, noise: Noise | None = None) -> None:
        """Drop the samples but keep the event counters.

        Args:
            noise: noise of the device at rest, if already known.
        """
        self._stream.restart()
        self._waiting.clear()
        self._begin_again(noise)

    @property
    def source(self) -> str:
        """Description of the source for the user."""
        return self._stream.source

    def receive(self, data: bytes, arrival: float) -> None:
        """Receive bytes.

        Args:
            data: the bytes.
            arrival: arrival, s, on a monotonic clock.
        """
        self.receive_all(((data, arrival),))

    def receive_all(self, pieces: Sequence[tuple[bytes, float]]) -> None:
        """Receive several pieces with their arrivals: faster, with the same decisions."""
        for data, arrival in pieces:
            self.journal.raw(arrival, data)
        was_ready = self._stream.intake.ready
        readings = self._stream.read(pieces)
        if not was_ready:
            self._resolved()
        self._view.changed()
        self._notify()  # in the step before these samples, however many come together
        if self._stream.signs_changed() and self._machine is not None:
            begun = self.step is not StepKind.SOURCE
            self._begin_again()
            if begun:
                self.note("the readings before had wrong signs: the procedure begins again")
            readings = readings and since(readings, self._stream.intake.signed_since)
        if readings is not None:
            self.receive_readings(readings)
        if self._time >= self._kept_until[0] or self.samples >= self._kept_until[1]:
            self._kept_until = self._next_checkpoint(self.journal.checkpoint(self.state))

    def _next_checkpoint(self, size: int) -> tuple[float, int]:
        """Time, s, and number of samples of the next checkpoint.

        Args:
            size: of the last one, bytes.
        """
        scale = max(1.0, size / (CHECKPOINT_BYTES * CHECKPOINT_SECONDS))
        samples = self.samples + round(scale * CHECKPOINT_SAMPLES)
        return self._time + scale * CHECKPOINT_SECONDS, samples

    def state(self) -> bytes:
        """Everything received and decided so far, for ``restore``."""
        return pickle.dumps({name: getattr(self, name) for name in _STATE}, pickle.HIGHEST_PROTOCOL)

    def restore(self, state: bytes) -> None:
        """Continue from a state, as if the same bytes and commands had been received.

        Args:
            state: what ``state`` of this program has made; nothing else, because loading it can run
                any code.
        """
        source, link, serial = self._stream.source, self._stream.link_health, self._view.serial
        vars(self).update(pickle.loads(state))  # noqa: S301 - the seal is checked
        self._stream.source, self._stream.link_health = source, link
        self._view.count_from(serial)
        self._kept_until = self._next_checkpoint(len(state))
        if self._machine is not None:
            self._machine.listen(self._listener)

    def _resolved(self) -> None:
        """Store the setup of the stream once it is complete."""
        if self._stream.intake.ready:
            self.journal.resolved(self._stream.intake.setup)

    def _notify(self) -> None:
        """Emit the new notifications about the stream and the session."""
        for kind, text in self._stream.notifications(self.step):
            self.emit(kind, text)

    def receive_readings(self, readings: Readings, rate: float = 0.0) -> None:
        """Receive decoded samples, all sensors at the same times.

        Args:
            readings: the samples.
            rate: samples per second of the recording, if known; 0 to determine it from these
                samples.
        """
        if not len(readings):
            return
        self._stream.note(readings.warnings)
        if self._machine is None:
            rate = self._stream.intake.rate or rate or readings.accelerometer.rate
            self._view.begin(rate, readings)
            known = rate, self._noise, self._listener, self._planner
            self._machine = self.settings.machine(readings, *known)
            waiting, self._waiting = self._waiting, []
            for order in waiting:
                self._emit(self._execute(self._machine, *order))
        self.samples += len(readings)
        self._time = float(readings.accelerometer.time[-1])
        self._view.feed(readings)
        self._emit(self._machine.feed(readings))

    def command(self, name: str, argument: str = "") -> None:
        """Carry out a command; before the first sample, commands wait for that sample."""
        self.journal.command(self.samples, name, argument)
        if self._machine is None:
            self._waiting.append((name, argument))
        else:
            self._decided(self._execute(self._machine, name, argument))

    def _execute(self, machine: StateMachine, name: str, argument: str) -> Sequence[Event]:
        try:
            return machine.command(name, argument)
        except UsageError as error:
            return (Event(EventKind.WARNING, self._time, str(error)),)

    def describe(self, description: Description) -> None:
        """State device, place and operator; the procedure does not change."""
        self.journal.command(self.samples, DESCRIBE_COMMAND, json.dumps(description.stated()))

    def set_setup(self, setup: StreamSetup) -> None:
        """Read the stream with another setup from now on; the procedure restarts."""
        self.journal.new_setup(self.samples, setup)
        begun, readings = self._machine is not None, self._stream.reconfigure(setup)
        self._begin_again()
        text = "the stream is read with another setup: the procedure begins again"
        self._decided((Event(EventKind.WARNING, self._time, text),) if begun else ())
        self._resolved()
        if readings is not None:
            self.receive_readings(readings)

    def end(self) -> None:
        """The source has ended: complete the hold and the circle in progress."""
        rest = self._stream.intake.flush()
        if rest is not None:
            self.receive_readings(rest)
        if self._machine is not None:
            self._emit(self._machine.flush())
        self.finished = True
        self._view.changed()

    def close(self) -> None:
        """Close the session."""
        self.finished = True
        self.journal.close()
        self._view.changed()

    def idle(self, arrival: float, *, expected: bool = False) -> None:
        """No data until now; ``expected`` silence is not a problem."""
        self.journal.check()
        if expected:
            self._stream.link_health.heard(arrival)
        self._notify()
        if self._stream.link_health.silent(arrival):
            self._view.changed()

    def connected(self, source: str) -> None:
        """The port is open; ``source`` describes it."""
        self._stream.source = source
        self.link("")

    def link(self, problem: str, *, busy: bool = False) -> None:
        """Set the problem of the port; ``""`` if there is none; ``busy``: it ends by itself."""
        self._stream.link_health.link(problem, busy=busy)
        self._view.changed()

    def emit(self, kind: EventKind, text: str) -> None:
        """Emit an event from outside the procedure."""
        self._emit((Event(kind, self._time, text),))

    def note(self, text: str) -> None:
        """Emit a warning and add it to the warnings of the stream and of the result."""
        self._stream.note((text,))
        self.emit(EventKind.WARNING, text)

    def continue_in(self, journal: Journal) -> None:
        """Write to a journal from here on; what was replayed is on the disk and is announced."""
        self.journal = journal
        self._announcements.status(self.status)

    def _emit(self, events: Sequence[Event]) -> None:
        if events:
            self._decided(events)

    def _decided(self, events: Sequence[Event]) -> None:
        """Write what was decided, and announce it once it is on the disk."""
        quiet = bool(events) and all(event.kind in _QUIET_EVENTS for event in events)
        self.journal.decided(events, None if quiet else self.collected, str(self.step))
        self._announcements.decided(self.journal, events, self.status)
        self._view.changed()

    @property
    def step(self) -> StepKind:
        """Current step, without building the full status."""
        return StepKind.SOURCE if self._machine is None else self._machine.step

    def status(self) -> Status:
        """The procedure at this moment; before the first sample only its steps."""
        if self._machine is not None:
            return self._machine.status()
        procedure = self.settings.procedure
        return Status(steps=procedure.kinds, poses=len(procedure.step(StepKind.POSES).poses))

    @property
    def provisional_noise(self) -> Noise | None:
        """The noise of a rest shorter than requested, if the settle step had to use it."""
        return None if self._machine is None else self._machine.provisional_noise

    def collected(self) -> Collected:
        """The measurements."""
        return Collected((), ()) if self._machine is None else self._machine.collected()

    def snapshot(self) -> Snapshot:
        """A frozen snapshot; the same object again if nothing has changed."""
        announced = self._announcements
        if announced.confirm(self.journal):
            self._view.changed()
        return self._view.snapshot(
            self._stream_status,
            lambda: announced.status(self.status),
            (tuple(announced.events), announced.count),
            self.finished,
        )

    def busy(self, text: str) -> Snapshot:
        """A snapshot that shows only the work in progress."""
        return self._view.bare(StreamStatus(source=self.source, problem=text, busy=True))

    def _stream_status(self) -> StreamStatus:
        return self._stream.status(self._view.rate, self.samples, self.journal.problem)
