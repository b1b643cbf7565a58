"""A session as it was written down: what came and what was ordered, in its order."""

from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import msgspec

from imucal_wizard.devices.setup import StreamSetup
from imucal_wizard.errors import SessionError, UsageError
from imucal_wizard.live.engine import Engine
from imucal_wizard.live.journal import SETUP
from imucal_wizard.live.settings import Settings
from imucal_wizard.procedure.state import EventKind
from imucal_wizard.sessions import Command, KeptSession

Pieces = tuple[tuple[bytes, float], ...]
"""Bytes with their arrivals, s."""
GATHER = 0.25
"""Seconds of arrivals that go through the engine at once: it costs by the piece."""


def _as_it_is(setup: StreamSetup) -> StreamSetup:
    return setup


class Past:
    """What a session has seen; an engine that sees it again comes to the same state.

    Args:
        session: where it was written down.
        known: adds to every setup of the stream what the user says of it now.

    Attributes:
        session: the same.
        about: all its settings.
        settings: how the procedure was carried out.

    Raises:
        SessionError: the settings are not there, or those of another version.
    """

    def __init__(
        self, session: KeptSession, known: Callable[[StreamSetup], StreamSetup] = _as_it_is
    ) -> None:
        self.session = session
        self._known = known
        self._share = 0.0
        self.about: dict[str, Any] = session.meta()
        try:
            self._setup = StreamSetup.from_json(self.about["asked"])
            self.settings = Settings.from_json(self.about["settings"])
        except (KeyError, AttributeError, TypeError, ValueError, UsageError) as error:
            raise SessionError(
                f"{session.path} lacks its settings ({error}); begin a new session"
            ) from error

    def engine(self) -> Engine:
        """An engine in the state in which the session began."""
        source = str(self.about.get("source", ""))
        return Engine(self._known(self._setup), self.settings, source=source)

    def steps(self) -> Iterator[Pieces | Command]:
        """What came, some of it at once, and the commands where they were given."""
        commands = deque(self.session.commands())
        pieces: list[tuple[bytes, float]] = []
        for number, arrival, data in self.session.raw():
            due = bool(commands) and commands[0].after_raw < number
            if pieces and (due or arrival - pieces[0][1] > GATHER):
                yield tuple(pieces)
                pieces = []
            while commands and commands[0].after_raw < number:
                yield commands.popleft()
            pieces.append((data, arrival))
            self._share = number / self.session.last_raw
        if pieces:
            yield tuple(pieces)
        yield from commands

    def happen(self, engine: Engine, what: Pieces | Command) -> None:
        """One of the steps, once more."""
        if isinstance(what, tuple):
            engine.receive_all(what)
            return
        if what.sample_index != engine.samples:
            engine.tell(
                EventKind.WARNING,
                "this version of the program reads the session differently: look at what is kept",
            )
        if what.name == SETUP:
            engine.set_setup(self._known(_setup_of(what.argument)))
        else:
            engine.command(what.name, what.argument)

    def replay(self, engine: Engine, told: Callable[[float], None] | None = None) -> None:
        """Everything once more.

        Args:
            engine: as ``engine`` makes it.
            told: told now and then which share is done.
        """
        for what in self.steps():
            self.happen(engine, what)
            if told is not None:
                told(self._share)


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
