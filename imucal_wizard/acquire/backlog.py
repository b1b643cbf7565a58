"""The newest pieces of a stream that cannot be read yet, so that it is read from its beginning."""

from collections import deque
from collections.abc import Iterator

MAX_BACKLOG = 1 << 24
"""Bytes kept, 16 MiB: twenty minutes at 115200 baud. A stream of which nobody says for longer what
it is goes on to be written down; only the reading of it begins later."""


class Backlog:
    """Pieces of bytes with their arrival times, the oldest dropped when there are too many.

    Args:
        limit: how many bytes are kept; the newest piece always is.
    """

    def __init__(self, limit: int = MAX_BACKLOG) -> None:
        self._limit = limit
        self._pieces: deque[tuple[bytes, float]] = deque()
        self._size = 0

    def __iter__(self) -> Iterator[tuple[bytes, float]]:
        return iter(self._pieces)

    def add(self, data: bytes, arrival: float) -> None:
        """Keep one piece more."""
        self._pieces.append((data, arrival))
        self._size += len(data)
        while self._size > self._limit and len(self._pieces) > 1:
            self._size -= len(self._pieces.popleft()[0])

    def taken(self) -> list[tuple[bytes, float]]:
        """All pieces, oldest first; none is kept any more."""
        pieces = list(self._pieces)
        self._pieces.clear()
        self._size = 0
        return pieces
