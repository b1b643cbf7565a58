"""Sessions begun and taken up again: bytes and commands make the same state to the last bit."""

import time
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from imucal_wizard.devices.setup import StreamSetup
from imucal_wizard.errors import SessionError, UsageError
from imucal_wizard.live.engine import Engine
from imucal_wizard.live.journal import SETUP, Journal
from imucal_wizard.live.settings import Settings
from imucal_wizard.procedure.state import EventKind
from imucal_wizard.sessions import Command, Session

GATHER = 0.25
"""Seconds of arrivals that go through the engine at once: it costs by the piece."""
_PAUSE = 1.0
"""The shortest time that lies between two runs of one session, s."""


def begin(
    path: Path,
    setup: StreamSetup | None = None,
    settings: Settings | None = None,
    *,
    source: str = "",
    about: dict[str, Any] | None = None,
) -> Engine:
    """An engine that writes a new session.

    Args:
        path: the file to write.
        setup: what is known of the stream.
        settings: how the procedure is carried out.
        source: what is read, in words.
        about: what the caller needs to open the same source again (port, speed …).

    Raises:
        SessionError: the file cannot be written.
    """
    setup, settings = setup or StreamSetup(), settings or Settings()
    known = {"asked": setup.to_json(), "setup": setup.to_json(), "settings": settings.to_json()}
    session = Session.create(path, {"source": source, "step": "source", **known, **(about or {})})
    return Engine(setup, settings, source=source, journal=Journal(session))


@dataclass(frozen=True)
class Resumed:
    """A session taken up again.

    Attributes:
        engine: in its first state; ``prepare`` brings it to where the session ended.
        about: all settings of the session.
        session: the file, open for writing.
        created: when it was begun, seconds since 1970.
    """

    engine: Engine
    about: dict[str, Any]
    session: Session
    created: float

    def prepare(
        self,
        engine: Engine,
        told: Callable[[float], None] | None = None,
        now: Callable[[], float] = time.time,
    ) -> float:
        """Run everything through the engine again, and let it go on writing.

        Args:
            engine: ``self.engine``.
            told: told now and then which share is done; what it raises ends the work, and the
                session is closed.
            now: seconds since 1970.

        Returns:
            The time on the session's own clock, s, at which it goes on.
        """
        with ExitStack() as on_failure:
            on_failure.callback(self.session.close)
            replay(self.session, engine, told)
            on_failure.pop_all()
        engine.journal = Journal(self.session)
        last = self.session.last_arrival
        passed = now() - self.created
        return passed if last is None else max(last + _PAUSE, passed)


def resume(path: Path) -> Resumed:
    """Open a session to go on with it.

    Raises:
        SessionError: it cannot be read, or its settings are those of another version.
    """
    session = Session.open(path)
    try:
        about = session.meta()
        setup = StreamSetup.from_json(about["asked"])
        settings = Settings.from_json(about["settings"])
        created = float(about["created"])
    except (KeyError, AttributeError, TypeError, ValueError, UsageError) as error:
        session.close()
        raise SessionError(f"{path} lacks its settings ({error}); begin a new session") from error
    engine = Engine(setup, settings, source=str(about.get("source", "")))
    return Resumed(engine, about, session, created)


def replay(session: Session, engine: Engine, told: Callable[[float], None] | None = None) -> None:
    """Everything that was written down, through an engine, in its order."""
    commands = deque(session.commands())
    pieces: list[tuple[bytes, float]] = []
    for number, arrival, data in session.raw():
        due = bool(commands) and commands[0].after_raw < number
        if pieces and (due or arrival - pieces[0][1] > GATHER):
            engine.receive_all(pieces)
            pieces = []
            if told is not None:
                told(number / session.last_raw)
        while commands and commands[0].after_raw < number:
            _obey(engine, commands.popleft())
        pieces.append((data, arrival))
    if pieces:
        engine.receive_all(pieces)
    for command in commands:
        _obey(engine, command)


def _obey(engine: Engine, command: Command) -> None:
    if command.sample_index != engine.samples:
        engine.tell(
            EventKind.WARNING,
            "this version of the program reads the session differently: look at what is kept",
        )
    if command.name == SETUP:
        engine.set_setup(_setup_of(command.argument))
    else:
        engine.command(command.name, command.argument)


def _setup_of(text: str) -> StreamSetup:
    """The setup that was written down with a command.

    Raises:
        SessionError: it is none.
    """
    try:
        return StreamSetup.from_json(msgspec.json.decode(text))
    except (msgspec.MsgspecError, AttributeError, UsageError) as error:
        raise SessionError(
            f"how the stream was read cannot be told ({error}); begin a new session"
        ) from error
