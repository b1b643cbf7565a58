"""Sessions: starting, resuming and replaying. The same bytes and commands give the same state."""

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import msgspec

from imucal_wizard.acquire.files.session_file import DESCRIBE_COMMAND
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.dates import SECONDS_PER_YEAR
from imucal_wizard.core.errors import SessionError, UsageError
from imucal_wizard.core.records import dataclass
from imucal_wizard.guide.kinds import EventKind
from imucal_wizard.guide.steps.recheck import Planner
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.journal import SETUP_COMMAND, Journal
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.sessions import Checkpoint, Command, KeptSession, Session

RawPieces = tuple[tuple[bytes, float], ...]
"""Pieces of bytes with their arrival times, s."""
REPLAY_PIECE_SECONDS = 2.0
"""Seconds of arrivals that are fed to the engine at once, because each piece has a cost."""


def _as_it_is(setup: StreamSetup) -> StreamSetup:
    return setup


class SessionReplay:
    """The data and commands of a session; replaying them brings an engine to the same state.

    Args:
        session: the session.
        known: adds the user's present statements to every setup of the stream.

    Attributes:
        session: the same.
        about: all its settings.
        settings: settings of the procedure.

    Raises:
        SessionError: the settings are missing, or belong to another version.
    """

    def __init__(
        self, session: KeptSession, known: Callable[[StreamSetup], StreamSetup] = _as_it_is
    ) -> None:
        self.session = session
        self._known = known
        self._share = 0.0
        self._damage_noted = self._difference_noted = False
        self.about: dict[str, Any] = session.meta()
        try:
            self._setup = StreamSetup.from_json(self.about["asked"])
            self.settings = ProcedureSettings.from_json(self.about["settings"])
        except (KeyError, AttributeError, TypeError, ValueError, UsageError) as error:
            raise SessionError(
                f"{session.path} lacks its settings ({error}); begin a new session"
            ) from error

    def engine(self, planner: Planner | None = None) -> Engine:
        """An engine in the state in which the session began.

        Args:
            planner: chooses the poses of a recheck.
        """
        source = str(self.about.get("source", ""))
        return Engine(self._known(self._setup), self.settings, source=source, planner=planner)

    def steps(self, after: Checkpoint | None = None) -> Iterator[RawPieces | Command]:
        """The pieces of data, joined, and the commands between them.

        Args:
            after: begin after this checkpoint.
        """
        commands = deque(self.session.commands()[0 if after is None else after.commands :])
        pieces: list[tuple[bytes, float]] = []
        for number, arrival, data in self.session.raw(0 if after is None else after.after_raw):
            due = bool(commands) and commands[0].after_raw < number
            if pieces and (due or arrival - pieces[0][1] > REPLAY_PIECE_SECONDS):
                yield tuple(pieces)
                pieces = []
            while commands and commands[0].after_raw < number:
                yield commands.popleft()
            pieces.append((data, arrival))
            self._share = number / self.session.last_raw
        if pieces:
            yield tuple(pieces)
        yield from commands

    def _read_as_it_was(self) -> bool:
        """Whether the user states nothing that the session was not read with."""
        setups = [
            _setup_of(one.argument) for one in self.session.commands() if one.name == SETUP_COMMAND
        ]
        return all(self._known(one) == one for one in (self._setup, *setups))

    def replay_step(self, engine: Engine, step: RawPieces | Command) -> None:
        """Replay one piece of data or one command."""
        if self.session.damage and not self._damage_noted:
            self._damage_noted = True
            engine.note(self.session.damage)
        if isinstance(step, tuple):
            engine.receive_all(step)
            return
        # another version, other statements of the user, or lost pieces
        if step.sample_index != engine.samples and not self._difference_noted:
            self._difference_noted = True
            engine.emit(
                EventKind.WARNING,
                "the session gives other samples than when it was recorded: check the measurements",
            )
        if step.name == DESCRIBE_COMMAND:
            return
        if step.name == SETUP_COMMAND:
            engine.set_setup(self._known(_setup_of(step.argument)))
        else:
            engine.command(step.name, step.argument)

    def replay(self, engine: Engine, progress: Callable[[float], None] | None = None) -> None:
        """Bring an engine to the end of the session, from the newest valid checkpoint if possible.

        Args:
            engine: an engine made by ``engine``.
            progress: called repeatedly with the share done.
        """
        checkpoint = self.session.checkpoint() if self._read_as_it_was() else None
        if checkpoint is not None:
            engine.restore(checkpoint.state)
        for step in self.steps(checkpoint):
            self.replay_step(engine, step)
            if progress is not None:
                progress(self._share)


def _setup_of(text: str) -> StreamSetup:
    """The setup stored with a command.

    Raises:
        SessionError: it is not a setup.
    """
    try:
        return StreamSetup.from_json(msgspec.json.decode(text))
    except (msgspec.MsgspecError, AttributeError, UsageError) as error:
        raise SessionError(
            f"the stored setup of the stream is damaged ({error}); begin a new session"
        ) from error


MIN_RESUME_PAUSE_SECONDS = 1.0
"""Shortest time between two runs of one session, s."""
MAX_RESUME_PAUSE_SECONDS = 10.0 * SECONDS_PER_YEAR
"""Longest time between them, s; a longer one is a clock that was not set in one of them."""


def begin_session(
    path: Path,
    setup: StreamSetup | None = None,
    settings: ProcedureSettings | None = None,
    *,
    source: str = "",
    about: dict[str, Any] | None = None,
    planner: Planner | None = None,
) -> Engine:
    """An engine that writes a new session.

    Args:
        path: the file to write.
        setup: known properties of the stream.
        settings: settings of the procedure.
        source: description of the source.
        about: data that the caller needs to open the same source again (port, speed …).
        planner: chooses the poses of a recheck.

    Raises:
        SessionError: the file cannot be written.
    """
    setup, settings = setup or StreamSetup(), settings or ProcedureSettings()
    known = {"asked": setup.to_json(), "setup": setup.to_json(), "settings": settings.to_json()}
    session = Session.create(path, {"source": source, "step": "source", **known, **(about or {})})
    return Engine(setup, settings, source=source, journal=Journal(session), planner=planner)


@dataclass(frozen=True)
class ResumedSession:
    """A resumed session.

    Attributes:
        engine: in its initial state; ``prepare`` brings it to the end of the session.
        replay: its data and commands.
        session: the file, open for writing.
        created: start of the session, seconds since 1970.
    """

    engine: Engine
    replay: SessionReplay
    session: Session
    created: float

    @property
    def about(self) -> dict[str, Any]:
        """All settings of the session."""
        return self.replay.about

    def prepare(
        self,
        engine: Engine,
        progress: Callable[[float], None] | None = None,
        now: Callable[[], float] = time.time,
    ) -> float:
        """Replay everything through the engine, and let it continue writing.

        Args:
            engine: ``self.engine``.
            progress: called repeatedly with the share done; an exception that it raises stops the
                work and closes the session.
            now: seconds since 1970.

        Returns:
            The time of the session's own clock at which it continues, s.
        """
        with ExitStack() as on_failure:
            on_failure.callback(self.session.close)
            self.replay.replay(engine, progress)
            on_failure.pop_all()
        engine.continue_in(Journal(self.session))
        last = self.session.last_arrival
        passed, before = now() - self.created, 0.0 if last is None else last
        if not 0.0 <= passed <= before + MAX_RESUME_PAUSE_SECONDS:
            passed = 0.0  # the clock has jumped
        return passed if last is None else max(before + MIN_RESUME_PAUSE_SECONDS, passed)


def resume_session(
    path: Path, planner_of: Callable[[Mapping[str, Any]], Planner | None] = lambda _about: None
) -> ResumedSession:
    """Open a session to continue it.

    Args:
        path: the session.
        planner_of: makes what chooses the poses of a recheck from the settings of the session.

    Raises:
        SessionError: it cannot be read, or its settings are those of another version.
    """
    session = Session.open(path)
    with ExitStack() as on_failure:
        on_failure.callback(session.close)
        replay = SessionReplay(session)
        engine = replay.engine(planner_of(replay.about))
        resumed = ResumedSession(engine, replay, session, _created(replay))
        on_failure.pop_all()
    return resumed


def _created(replay: SessionReplay) -> float:
    try:
        return float(replay.about["created"])
    except (KeyError, TypeError, ValueError) as error:
        raise SessionError(
            f"{replay.session.path} lacks its settings ({error}); begin a new session"
        ) from error
