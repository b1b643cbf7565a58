"""From bytes to Readings: format, columns, units, clock."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.acquire.assemble import Assembler
from imucal_wizard.acquire.column_guess import UnitGuess
from imucal_wizard.acquire.decode import decoder_for, formats, is_binary
from imucal_wizard.acquire.decode.base import Column, Decoder, MalformedLine
from imucal_wizard.acquire.detect import GarbageDetector
from imucal_wizard.acquire.health import MAX_ARRIVAL_GAP_SECONDS, StreamHealth
from imucal_wizard.acquire.search import Backlog, ResolvedStream, StreamSearch
from imucal_wizard.acquire.setup import AUTO, StreamSetup
from imucal_wizard.acquire.stream_corrections import StreamCorrections
from imucal_wizard.core.output import sanitise
from imucal_wizard.core.readings import FloatArray, Readings, join_readings
from imucal_wizard.core.records import dataclass

LINK_BREAK = b""
"""An empty piece of bytes, which no protocol can send: the link was interrupted here."""

_SHOWN_BYTES = 24
"""Newest bytes of a binary stream that the preview shows, as hexadecimal numbers."""
_MAX_UNREAD_LINES = 50
"""Consecutive unreadable lines after which the stream is reported as unreadable."""


@dataclass(frozen=True)
class Preview:
    """The newest line as received, and the numbers read from it.

    Attributes:
        line: printable text; the newest bytes in hexadecimal if the stream is binary.
        values: one number per column, as printed; empty before the first row.
    """

    line: str = ""
    values: tuple[float, ...] = ()


class Intake:
    """Converts bytes to Readings.

    Until format, columns, units and rate are known the bytes are kept; then all Readings from the
    first byte on are returned. The same chunks with the same arrivals give bit-identical Readings;
    if the stream carries its own time, neither the arrivals nor the cuts matter.

    Args:
        setup: known properties of the stream.
        compare_arrivals: warn if the device's time and the host's disagree; False if the arrivals
            are not those of the device (a recording played at another speed).
        recording: whether the bytes are a whole recording: the first line is whole, there are no
            arrivals, the device's own origin of time is kept, and sensors may be missing.
        check_values: whether the samples are checked as they come; False if the whole recording is
            checked later.
    """

    def __init__(
        self,
        setup: StreamSetup | None = None,
        *,
        compare_arrivals: bool = True,
        recording: bool = False,
        check_values: bool = True,
    ) -> None:
        self._asked = setup or StreamSetup()
        self._compare_arrivals = compare_arrivals and not recording
        self._recording = recording
        self._check_values = check_values and not recording
        self._search = StreamSearch(self._asked, recording=recording)
        self._held = Backlog()
        self._found: ResolvedStream | None = None
        self._decoder: Decoder | None = None
        self._assembler: Assembler | None = None
        self._health: StreamHealth | None = None
        self._corrections = None if recording else StreamCorrections()
        self._garbage = GarbageDetector()
        self._unread = 0
        self._malformed = 0
        self._decimals: tuple[int, ...] = ()
        self._rate = 0.0
        self._line = b""
        self._latest: FloatArray = np.zeros((0, 0))

    @property
    def ready(self) -> bool:
        """Whether format, columns, units and rate are known, so that Readings are returned."""
        return self._rate > 0

    @property
    def longest_pause(self) -> float:
        """Seconds between pieces that may be fed as one; 0 if each one's arrival matters."""
        has_time = self._assembler is not None and self._assembler.device is not None
        return MAX_ARRIVAL_GAP_SECONDS if has_time else 0.0

    @property
    def needs(self) -> tuple[str, ...]:
        """The unknown properties: ``columns``, ``accelerometer unit``, ``gyroscope unit``."""
        return () if self._found else self._search.needs

    @property
    def problem(self) -> str:
        """The reason why nothing can be read and what to do, or ``""``."""
        if self._found is None:
            return self._search.problem
        if self._garbage.problem:
            return self._garbage.problem
        if self._assembler is not None and self._assembler.missing.problem:
            return self._assembler.missing.problem
        if self._corrections is not None and self._corrections.problem:
            return self._corrections.problem
        if self._unread < _MAX_UNREAD_LINES:
            return ""
        return (
            f"The last {self._unread} lines could not be read: the device's output has changed. "
            f"Restart it, or choose the source again."
        )

    @property
    def format(self) -> str:
        """Name of the format; ``""`` while it is not known."""
        return self._found.format if self._found else self._search.format

    @property
    def _binary(self) -> bool:
        return is_binary(self.format)

    @property
    def first_malformed(self) -> MalformedLine | None:
        """The first malformed line."""
        return self._decoder.first_malformed if self._decoder else self._search.first_malformed

    @property
    def named(self) -> bool:
        """Whether the stream itself names its columns."""
        return self._search.named

    @property
    def rows(self) -> int:
        """Number of rows read, with or without a number in each needed column."""
        return self._assembler.samples + self._assembler.missing.count if self._assembler else 0

    @property
    def without_number(self) -> str:
        """Number of rows without a number and the columns, in words; ``""`` if there are none."""
        if self._assembler is None or not self._assembler.missing.count:
            return ""
        missing = self._assembler.missing
        return f"{missing.count} of {self.rows} rows have no number {missing.lacking}"

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns as far as they are known, with a proposal if they must be asked for."""
        return self._found.columns if self._found else self._search.columns

    @property
    def guesses(self) -> Mapping[str, UnitGuess]:
        """The units that were guessed from the first readings, by sensor."""
        return self._found.guesses if self._found else {}

    @property
    def setup(self) -> StreamSetup:
        """The setup as far as it is known; an Intake made with it reads the same bytes alike."""
        return replace(self._asked, format=self.format or AUTO, columns=self.columns)

    @property
    def rate(self) -> float:
        """Samples per second, as estimated with the first Readings; 0 before."""
        return self._rate

    @property
    def measured_rate(self) -> float:
        """Current estimate of the samples per second; 0 while unknown."""
        period = self._assembler.period if self._assembler else 0.0
        repeated = self._corrections.repeated if self._corrections else 1.0
        return 1.0 / (repeated * period) if period else 0.0

    @property
    def signs(self) -> Mapping[str, int]:
        """Bits of the counts that were written as unsigned numbers and have a sign, by sensor."""
        return self._corrections.signs if self._corrections else {}

    @property
    def signed_since(self) -> float:
        """Time of the sample that showed the newest of these signs, s."""
        return self._corrections.signed_since if self._corrections else 0.0

    @property
    def samples(self) -> int:
        """Number of samples returned."""
        left_out = self._corrections.dropped if self._corrections else 0
        return self._assembler.samples - left_out if self._assembler else 0

    @property
    def lost(self) -> int:
        """Number of lost samples by the device's time or counter, or by the host's clock."""
        return self._assembler.lost if self._assembler else 0

    @property
    def dropped(self) -> int:
        """Number of lost samples without those lost while the device was away."""
        return self._assembler.dropped if self._assembler else 0

    @property
    def malformed(self) -> int:
        """Number of lines or frames dropped."""
        return self._malformed + (self._assembler.misplaced if self._assembler else 0)

    @property
    def digits(self) -> int | None:
        """Printed decimals of the accelerometer columns; None if the stream is not text."""
        printed = self._decimals or self._search.decimals
        places = [i for i, c in enumerate(self.columns) if c.channel in ("ax", "ay", "az")]
        there = [printed[i] for i in places if i < len(printed)]
        return max(there) if there and max(there) >= 0 else None

    @property
    def preview(self) -> Preview:
        """The newest line and its values."""
        if self._binary:
            line = self._line[-_SHOWN_BYTES:].hex(" ")
        else:
            lines = [line for line in self._line.splitlines() if line.strip()]
            line = sanitise(lines[-1]) if lines else ""
        latest = self._latest if self._found else self._search.latest
        row = tuple(float(v) for v in latest[-1]) if len(latest) else ()
        return Preview(line, row)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings, each once, newest last."""
        known = formats().get(self.format)
        note = known.note if known else ""
        seen = self._health.notes if self._health else ()
        corrected = self._corrections.notes if self._corrections else ()
        times = self._assembler.time_notes if self._assembler else ()
        own = (note,) if note else ()
        return (*self._search.notes, *own, *times, *corrected, *seen)

    def feed(self, data: bytes, arrival: float, since: float | None = None) -> Readings | None:
        """Add received bytes.

        Args:
            data: bytes, divided anywhere; ``LINK_BREAK`` after an interruption of the link.
            arrival: arrival of the last one, s, on a monotonic clock.
            since: arrival of the first one if they came in several pieces without a pause.

        Returns:
            The samples that these bytes complete; None if there are none yet.
        """
        if not data:
            self._broken(arrival)
            return None
        if b"\n" in data or self._binary:
            self._line = data
        if self._decoder is not None and self._assembler is not None:
            return self._run(self._decoder, self._assembler, data, arrival, since)
        self._held.add(data, arrival)
        for piece in data.splitlines(keepends=True):
            found = self._search.feed(piece, arrival)
            if found is not None:
                return self._start(found)
        return None

    def _broken(self, arrival: float) -> None:
        """The link was interrupted: join nothing across the interruption."""
        if self._decoder is not None:
            self._decoder.broken()
        else:
            self._held.add(LINK_BREAK, arrival)
            self._search.broken()

    def feed_all(self, pieces: Sequence[tuple[bytes, float]]) -> Readings | None:
        """Add several pieces, each with its arrival: the same samples as one by one, but faster."""
        if self.longest_pause and pieces:
            datas, arrivals = zip(*pieces, strict=True)
            pauses = np.diff(np.array(arrivals), prepend=arrivals[0])
            if all(datas) and pauses.max() <= MAX_ARRIVAL_GAP_SECONDS:
                return self.feed(b"".join(datas), arrivals[-1], arrivals[0])
        parts: list[Readings | None] = []
        run: list[bytes] = []
        first = last = 0.0
        for data, arrival in pieces:
            if run and (not data or arrival - last > MAX_ARRIVAL_GAP_SECONDS):
                parts.append(self.feed(b"".join(run), last, first))
                run = []
            if not data or self._assembler is None or self._assembler.device is None:
                parts.append(self.feed(data, arrival))
                continue
            first = first if run else arrival
            run.append(data)
            last = arrival
        if run:
            parts.append(self.feed(b"".join(run), last, first))
        return _joined(parts)

    def flush(self) -> Readings | None:
        """The samples that still wait for their time, at the end of the stream."""
        found = self._search.finish() if self._assembler is None else None
        parts = [None if found is None else self._start(found)]
        if self._assembler is not None:
            parts.append(self._corrected(self._assembler, self._assembler.flush()))
        if self._corrections is not None:
            parts.append(self._corrections.flush())
        readings = _joined(parts)
        self._know_rate(readings)
        return readings

    def reconfigured(self, setup: StreamSetup) -> "tuple[Intake, Readings | None]":
        """An Intake with another setup, fed with the bytes that this one still keeps.

        Once Readings have been returned, no bytes are kept: the new one continues with the next
        bytes.
        """
        other = Intake(
            setup,
            compare_arrivals=self._compare_arrivals,
            recording=self._recording,
            check_values=self._check_values,
        )
        return other, _joined(other.feed(*chunk) for chunk in self._held)

    def _start(self, found: ResolvedStream) -> Readings | None:
        """Decode from the first byte, now that everything is known."""
        self._found = found
        decoder = self._decoder = decoder_for(found.format, found.columns, whole=self._recording)
        assembler = self._assembler = Assembler(
            found.columns, found.first, self._asked.rate, recording=self._recording
        )
        self._health = StreamHealth(
            assembler,
            self._compare_arrivals,
            values=self._check_values,
            losses=not self._recording,
        )
        return _joined(self._run(decoder, assembler, *chunk) for chunk in self._held.taken())

    def _run(
        self,
        decoder: Decoder,
        assembler: Assembler,
        data: bytes,
        arrival: float,
        since: float | None = None,
    ) -> Readings | None:
        if not data:
            decoder.broken()
            return None
        rows = decoder.feed(data)
        self._malformed += rows.malformed
        self._decimals = rows.decimals or self._decimals
        if len(rows.values):
            self._latest = rows.values
            self._unread = 0
            self._garbage = GarbageDetector() if self._garbage.problem else self._garbage
        else:
            self._unread += rows.malformed
            if not self._binary:
                self._garbage.feed(data)
        readings = self._corrected(assembler, assembler.feed(rows, arrival))
        self._know_rate(readings)
        if self._health is not None:
            if readings is not None:
                self._health.feed(readings, arrival, arrival if since is None else since)
            self._health.count(self.malformed, self._decimals)
        return readings

    def _know_rate(self, readings: Readings | None) -> None:
        """Keep the rate with which the first Readings are returned."""
        if not self._rate and readings is not None:
            self._rate = self.measured_rate

    def _corrected(self, assembler: Assembler, readings: Readings | None) -> Readings | None:
        """What is known of these samples, and of those that waited."""
        if readings is None or self._corrections is None:
            return readings
        known = self._corrections.feed(readings, assembler.period)
        if self._corrections.signs and self._health is not None:
            self._health.signs_known()
        return known


def _joined(parts: Iterable[Readings | None]) -> Readings | None:
    there = [part for part in parts if part is not None]
    return join_readings(there) if len(there) > 1 else next(iter(there), None)
