"""Sessions begun and taken up again: bytes and commands make the same state to the last bit."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from imucal_wizard.devices.setup import StreamSetup
from imucal_wizard.errors import SessionError
from imucal_wizard.live.engine import Engine
from imucal_wizard.live.journal import Journal
from imucal_wizard.live.past import Past
from imucal_wizard.live.settings import Settings
from imucal_wizard.sessions import Session

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
        past: what it has seen.
        session: the file, open for writing.
        created: when it was begun, seconds since 1970.
    """

    engine: Engine
    past: Past
    session: Session
    created: float

    @property
    def about(self) -> dict[str, Any]:
        """All settings of the session."""
        return self.past.about

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
            self.past.replay(engine, told)
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
        past = Past(session)
        return Resumed(past.engine(), past, session, _created(past))
    except SessionError:
        session.close()
        raise


def _created(past: Past) -> float:
    try:
        return float(past.about["created"])
    except (KeyError, TypeError, ValueError) as error:
        raise SessionError(
            f"{past.session.path} lacks its settings ({error}); begin a new session"
        ) from error
