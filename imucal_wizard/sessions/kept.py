"""A session file as it was written down, only to be read."""

import sqlite3
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import Any, Self

from imucal_wizard.recordings import session_file
from imucal_wizard.recordings.session_file import Command, explaining


class KeptSession:
    """What came and what was ordered. Used by one thread at a time.

    Every method raises ``SessionError`` when the file can no longer be read.

    Attributes:
        path: the file.
        last_raw: number of the newest piece of bytes; 0 before the first.
        last_arrival: arrival of the newest piece, s; None before the first.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self.last_raw = 0
        self.last_arrival: float | None = None
        self._connection = connection

    @classmethod
    def look(cls, path: Path) -> "KeptSession":
        """An existing file, also one that is being written.

        Raises:
            SessionError: it cannot be read.
        """
        session = KeptSession(path, session_file.connect(path))
        with session._explaining(), ExitStack() as on_failure:
            on_failure.callback(session._connection.close)
            session._connection.execute("PRAGMA query_only = 1")
            session._seek()
            on_failure.pop_all()
        return session

    def _seek(self) -> None:
        last = self._connection.execute("SELECT max(id), max(arrival) FROM raw").fetchone()
        self.last_raw, self.last_arrival = last[0] or 0, last[1]

    def _explaining(self) -> AbstractContextManager[None]:
        return explaining(self.path)

    def meta(self) -> dict[str, Any]:
        """All settings."""
        with self._explaining():
            return session_file.meta(self._connection)

    def raw(self) -> Iterator[tuple[int, float, bytes]]:
        """Number, arrival and bytes of each piece, in order."""
        with self._explaining():
            yield from session_file.raw(self._connection)

    def commands(self) -> list[Command]:
        """All commands, in order."""
        with self._explaining():
            return list(session_file.commands(self._connection))

    def close(self) -> None:
        """Let go of the file."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
