"""Determines the format, columns and units of a stream, line by line."""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import field

import numpy as np

from imucal_wizard.acquire.column_guess import UnitGuess
from imucal_wizard.acquire.decode import decoder_for
from imucal_wizard.acquire.decode.base import Column, Decoder, MalformedLine
from imucal_wizard.acquire.detect import MIN_UNKNOWN_LINES, Detector
from imucal_wizard.acquire.resolve import FIRST_ROWS, first_rows, resolve_columns
from imucal_wizard.acquire.setup import AUTO, StreamSetup
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass

_MAX_PROBE_ROWS = 16384
"""Rows kept while questions about the stream are open."""
MAX_BACKLOG = 1 << 24
"""Bytes kept, 16 MiB: twenty minutes at 115200 baud. If the format is still unknown then, the
stream is recorded all the same, but reading begins later."""


class Backlog:
    """Pieces of bytes with their arrival times; the oldest are dropped beyond a limit.

    Args:
        limit: number of bytes kept; the newest piece is always kept.
    """

    def __init__(self, limit: int = MAX_BACKLOG) -> None:
        self._limit = limit
        self._pieces: deque[tuple[bytes, float]] = deque()
        self._size = 0

    def __iter__(self) -> Iterator[tuple[bytes, float]]:
        return iter(self._pieces)

    def add(self, data: bytes, arrival: float) -> None:
        """Add a piece."""
        self._pieces.append((data, arrival))
        self._size += len(data)
        while self._size > self._limit and len(self._pieces) > 1:
            self._size -= len(self._pieces.popleft()[0])

    def taken(self) -> list[tuple[bytes, float]]:
        """Remove and return all pieces, oldest first."""
        pieces = list(self._pieces)
        self._pieces.clear()
        self._size = 0
        return pieces


@dataclass(frozen=True, eq=False)
class ResolvedStream:
    """The properties of a stream that are needed to make Readings.

    Attributes:
        format: name of the format.
        columns: every column, with its unit.
        first: first rows of the stream, which give the device's period.
        guesses: units by sensor, as in ``ResolvedColumns``.
    """

    format: str
    columns: tuple[Column, ...]
    first: FloatArray
    guesses: Mapping[str, UnitGuess] = field(default_factory=dict)


class StreamSearch:
    """Examines the beginning of a stream until everything is known.

    It is fed one line at a time, so that the result does not depend on how the bytes were divided.
    The rows read here are dropped: the stream is decoded from its start once it is known.

    Args:
        setup: known properties of the stream.
        recording: whether the bytes are a whole recording and not the middle of a stream.
    """

    def __init__(self, setup: StreamSetup, *, recording: bool = False) -> None:
        self._setup = setup
        self._recording = recording
        self._detector = Detector(setup.columns, whole=recording)
        self._decoder: Decoder | None = None
        if setup.format != AUTO:
            self._decoder = decoder_for(setup.format, setup.columns, whole=recording)
        self._undecoded = Backlog()
        self._values: list[FloatArray] = []
        self._arrivals: list[float] = []
        self._columns: tuple[Column, ...] = ()
        self._next = FIRST_ROWS
        self._lines = 0
        self.needs: tuple[str, ...] = ()
        self.notes: tuple[str, ...] = ()
        self.decimals: tuple[int, ...] = ()
        self.latest: FloatArray = np.zeros((0, 0))

    @property
    def format(self) -> str:
        """Name of the format; ``""`` while it is not known."""
        return self._decoder.name if self._decoder else ""

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns as far as they are known or guessed."""
        return self._columns or (self._decoder.columns if self._decoder else ())

    @property
    def first_malformed(self) -> MalformedLine | None:
        """The first malformed line."""
        return self._decoder.first_malformed if self._decoder else None

    @property
    def named(self) -> bool:
        """Whether the stream itself names its columns."""
        return self._decoder is not None and any(c.channel for c in self._decoder.columns)

    @property
    def problem(self) -> str:
        """The reason why nothing can be read, or ``""``."""
        if self._decoder is None:
            return self._detector.problem
        if self._arrivals or self._lines < MIN_UNKNOWN_LINES:
            return ""
        return self._unfit(self._decoder)

    def _unfit(self, decoder: Decoder) -> str:
        """Message if no line is a row."""
        fields = f" with {len(self._setup.columns)} columns" if self._setup.columns else ""
        return (
            f"{self._lines} lines have arrived and none is {decoder.name}{fields}. Check the "
            f"newest line and correct the format or the columns."
        )

    def feed(self, piece: bytes, arrival: float) -> ResolvedStream | None:
        """Add a line.

        Args:
            piece: a line, or a part of one.
            arrival: arrival, s.

        Returns:
            The stream's properties once all are known; None before.
        """
        self._lines += piece.endswith((b"\n", b"\r"))
        if self._decoder is not None:
            return self._decode(self._decoder, piece, arrival)
        self._undecoded.add(piece, arrival)
        name = self._detector.feed(piece)
        if not name:
            return None
        self._decoder = decoder_for(name, self._setup.columns, whole=self._recording)
        answers = [self._decode(self._decoder, *chunk) for chunk in self._undecoded.taken()]
        return next((found for found in answers if found is not None), None)

    def broken(self) -> None:
        """The link was interrupted."""
        if self._decoder is not None:
            self._decoder.broken()

    def finish(self) -> ResolvedStream | None:
        """The stream's properties, now that it has ended; None if they remain unknown."""
        if self._decoder is None or not self._values:
            return None
        return self._resolve(self._decoder, full=True)

    def _decode(self, decoder: Decoder, piece: bytes, arrival: float) -> ResolvedStream | None:
        before = decoder.columns
        rows = decoder.feed(piece)
        self.decimals = rows.decimals or self.decimals
        if len(rows.values):
            self.latest = rows.values
            if len(self._arrivals) < _MAX_PROBE_ROWS:
                self._values.append(rows.values)
                self._arrivals += [arrival] * len(rows.values)
        count = len(self._arrivals)
        due = len(rows.values) > 0 and count >= self._next
        if due:  # ever less often, so that it stays cheap while the user is being asked
            later = max(count + FIRST_ROWS, count * 5 // 4)
            self._next = min(later, _MAX_PROBE_ROWS) if count < _MAX_PROBE_ROWS else later
        changed = decoder.columns != before and count >= FIRST_ROWS
        return self._resolve(decoder) if due or changed else None

    def _resolve(self, decoder: Decoder, *, full: bool = False) -> ResolvedStream | None:
        values = np.concatenate(self._values)
        arrivals = None if self._recording else np.array(self._arrivals)
        found = resolve_columns(self._setup, decoder.columns, values, arrivals)
        self._columns, self.needs, self.notes = found.columns, found.needs, found.notes
        if found.needs:
            return None
        full = full or len(self._arrivals) >= _MAX_PROBE_ROWS
        first = first_rows(found.columns, values, full=full)
        if first is None:
            return None
        return ResolvedStream(decoder.name, found.columns, first, found.guesses)
