"""Numbers separated by commas, semicolons, tabs, bars or blanks, with or without a header."""

import math
import re
from collections import Counter, deque
from collections.abc import Sequence
from contextlib import suppress

from imucal_wizard.acquire.decode import numbers
from imucal_wizard.acquire.decode.base import (
    Column,
    Format,
    MalformedLine,
    TextLine,
    axes,
    is_object,
)
from imucal_wizard.acquire.decode.lines import MAX_DECIMALS_ROWS, TextDecoder
from imucal_wizard.acquire.decode.vocabulary import header_columns, with_unit_line
from imucal_wizard.core.output import sanitise
from imucal_wizard.core.readings import FloatArray

MIN_LEARNED_LINES = 8
"""Numeric lines that determine the number of columns if no header does."""
MIN_COLUMNS = 3
"""Lines with fewer numbers cannot contain an accelerometer."""
_MAX_HEADER_MISFITS = 5
"""Consecutive lines of another width, before any sample, that disprove a header."""
_MAX_NAME_LENGTH = 40
"""Characters of a column name that are shown to the user."""
_BRACKETS = b"()[]{}"
_QUOTED = re.compile(rb'\s*"[^"]*"\s*([,;\t|])')
_COMMA_NUMBER = re.compile(rb"[-+]?\d+(?:,\d+)?(?:[eE][-+]?\d+)?")
_DECIMAL_COMMA = re.compile(rb"(?<=\d),(?=\d)")


class DelimitedDecoder(TextDecoder):
    """``csv``: one sample per line, fields by position.

    Args:
        columns: the columns in order, if known; otherwise a header names them now or later, or they
            have no channels.
        name: name of the format.
        header_units: units of the names in a header without units, by channel.
        whole: the bytes begin with a whole line.
    """

    def __init__(
        self,
        columns: tuple[Column, ...] = (),
        name: str = "csv",
        header_units: dict[str, str] | None = None,
        *,
        whole: bool = False,
    ) -> None:
        super().__init__(name, columns, whole=whole)
        self._fixed = bool(columns)
        self._units = header_units or {}
        self._separator = b""
        self._learning: deque[bytes] = deque(maxlen=MIN_LEARNED_LINES)
        self._misfits: deque[int] = deque(maxlen=_MAX_HEADER_MISFITS)
        self._again = False
        self._names: list[str] = []

    def _table(self, block: bytes) -> FloatArray | None:
        if not self._separator:
            return None
        values = numbers.number_table(block, self._separator, len(self.columns))
        if values is not None:
            self._misfits.clear()
        return values

    def _read(self, line: bytes, first: bool) -> None:
        if not first and self._separator == b"," and self._count >= MAX_DECIMALS_ROWS:
            plain = numbers.plain_numbers(line)
            if len(plain) == len(self.columns):
                self._misfits.clear()
                self._row(plain, [])
                return
        if line.lstrip().startswith(b"#"):
            self._comment(line)
            return
        if b"#" in line:
            line = line.partition(b"#")[0]
        fields = split_fields(line)
        if len(fields) == len(self.columns) - 1 and _ends_empty(line):
            fields.append(b"")
        values = [numbers.printed_number(field) for field in fields]
        if all(value is None or math.isnan(value) for value in values) and None in values:
            self._words(line, fields, first)
        elif first:
            return  # its beginning may be missing
        elif self.columns:
            self._sample(line, fields, values)
        elif are_numbers(fields, values):
            self._learn(line)

    def _sample(self, line: bytes, fields: list[bytes], values: list[float | None]) -> None:
        if len(fields) != len(self.columns) or self._text_where_needed(fields, values):
            self._spoilt(line)
            self._unfit(line, len(fields))
            return
        self._misfits.clear()
        if not self._separator:
            self._separator = _separator_of(line)
        counted = fields if self._count < MAX_DECIMALS_ROWS else []
        printed = [numbers.printed_decimals(field) for field in counted]
        self._row([math.nan if v is None else v for v in values], printed)

    def _text_where_needed(self, fields: list[bytes], values: list[float | None]) -> bool:
        """Whether a used column holds text; before the channels are known, any column is used."""
        if not any(c.channel for c in self.columns):
            return not are_numbers(fields, values)
        return any(v is None and c.channel for v, c in zip(values, self.columns, strict=True))

    def _comment(self, line: bytes) -> None:
        """A comment may contain the header."""
        names = header_columns(_field_texts(line.strip(b"# \t")))
        if names is not None and not self._count:
            self._header(names)

    def _words(self, line: bytes, fields: list[bytes], first: bool) -> None:
        """A line without numbers: a header, units, a banner, or garbage."""
        names = _field_texts(line)
        found = header_columns(names)
        if found is None and len(names) == len(self.columns) and not (self._count or self._fixed):
            self.columns = with_unit_line(self.columns, names) or self.columns
        if found is None:
            self._spoilt(line, sample=not _is_text(line))
            self._unknown_names(fields)
        elif not self._fixed and not (first and not _begins_with_known_name(found)):
            self._header(found)

    def _header(self, found: tuple[Column, ...]) -> None:
        if self._fixed:
            return
        found = tuple(
            c if c.unit else Column(c.channel, self._units.get(c.channel, ""), c.name)
            for c in found
        )
        if not self.columns or (
            len(found) == len(self.columns) and _named(found) > _named(self.columns)
        ):  # a damaged header names fewer columns than the known one
            self.columns = found
            self._read_again()

    def _unknown_names(self, fields: list[bytes]) -> None:
        """Keep unknown names of columns for the questions to the user."""
        names = [sanitise(field, _MAX_NAME_LENGTH) for field in fields]
        if len(names) >= MIN_COLUMNS and all(names) and not self._fixed:
            self._names = names

    def _learn(self, line: bytes) -> None:
        """Wait for enough numeric lines; their most common number of fields decides."""
        self._learning.append(line)
        if len(self._learning) < MIN_LEARNED_LINES:
            return
        counts = Counter(len(split_fields(line)) for line in self._learning)
        width = counts.most_common(1)[0][0]
        names = self._names if len(self._names) == width else []
        names = names or [f"column {i + 1}" for i in range(width)]
        self.columns = tuple(Column("", "", name) for name in names)
        self._read_again()

    def _read_again(self) -> None:
        """Read the waiting lines, now that the columns are known."""
        waiting = list(self._learning)
        self._learning.clear()
        self._again = True  # the learned columns survive the lines from which they were learned
        for line in waiting:
            self._read(line, False)
        self._again = False
        self._misfits.clear()

    def _unfit(self, line: bytes, count: int) -> None:
        """A header without its first name contradicts every line; it is then dropped."""
        if self._count:
            return
        self.first_malformed = self.first_malformed or MalformedLine(
            self._number, line, len(self.columns)
        )
        if self._fixed:
            return
        self._misfits.append(count)
        self._learning.append(line)
        full = len(self._misfits) == _MAX_HEADER_MISFITS and len(set(self._misfits)) == 1
        if full and not self._again:
            self.columns = ()
            self._disproved = True
            self._misfits.clear()


def are_numbers(fields: list[bytes], values: list[float | None]) -> bool:
    """Whether a line without a known header consists of numbers, possibly with a date."""
    good = sum(value is not None for value in values)
    words = any(
        v is None and not numbers.without_letters(f) for f, v in zip(fields, values, strict=True)
    )
    return good >= max(MIN_COLUMNS, len(values) / 2) and not words


def _begins_with_known_name(columns: tuple[Column, ...]) -> bool:
    """Whether a header that may be cut off at the front begins with a known name."""
    return bool(columns[0].channel) or columns[0].name.lower().startswith(("rtc", "date"))


def _named(columns: tuple[Column, ...]) -> int:
    return sum(bool(c.channel) for c in columns)


def _is_text(line: bytes) -> bool:
    """Whether a line is printable ASCII, as text at the right speed is."""
    return all(32 <= byte < 127 or byte == 9 for byte in line)


def _separator_of(line: bytes) -> bytes:
    """The separator of a line: comma, semicolon, tab, bar, or blanks."""
    if b'"' in line and (quoted := _QUOTED.match(line)):
        return quoted[1]
    commas = line.count(b",")
    sign = max((b";", b"\t", b"|"), key=line.count)
    count = line.count(sign)
    if not commas:
        return sign if count else b" "
    decimal = b"." not in line and len(_DECIMAL_COMMA.findall(line)) == commas
    if count:
        return sign if decimal or count > commas else b","
    fields = line.split()
    blanks = decimal and len(fields) > 1 and all(map(_COMMA_NUMBER.fullmatch, fields))
    return b" " if blanks else b","


def _ends_empty(line: bytes) -> bool:
    """Whether a line ends with a separator, so that its last field may be empty."""
    sign = _separator_of(line)
    return sign != b" " and line.rstrip(b" \r").endswith(sign)


def split_fields(line: bytes) -> list[bytes]:
    """The fields of a line without enclosing brackets and one trailing separator."""
    sign = _separator_of(line)
    if b'"' in line:
        if sign != b" " and line.count(b'"') % 2 == 0 and line.isascii():
            import csv  # few lines have quotation marks

            with suppress(csv.Error):
                rows = csv.reader(
                    [line.decode("ascii")], delimiter=sign.decode(), skipinitialspace=True
                )
                return _without_last(next(rows, []))
        line = line.replace(b'"', b"")
    line = line.strip(b" \t" if b"," in line or b";" in line else b" ")
    if line[:1] in (b"(", b"[", b"{"):
        line = line.translate(None, _BRACKETS).strip(b" ")
    fields = line.split() if sign == b" " else line.split(sign)
    if sign != b" " and len(fields) > 1 and not fields[-1].strip():
        fields.pop()
    return fields


def _without_last(fields: list[str]) -> list[bytes]:
    if len(fields) > 1 and not fields[-1].strip():
        fields.pop()
    return [field.strip().encode() for field in fields]


def _field_texts(line: bytes) -> list[str]:
    """The fields of a line as text, for names of columns."""
    return [field.decode("utf-8", errors="replace") for field in split_fields(line)]


class _HeaderDetector:
    """Recognises a header that names an accelerometer, a gyroscope or a magnetometer.

    Args:
        sign: a name that the header must contain, or ``""``.
    """

    def __init__(self, sign: str = "") -> None:
        self._sign = sign

    def feed(self, _data: bytes, lines: Sequence[TextLine]) -> bool:
        """Whether such a header has arrived."""
        return any(self._is_header(line) for line in lines)

    def _is_header(self, line: TextLine) -> bool:
        names = _field_texts(line.raw.strip(b"# \t"))
        columns = header_columns(names)
        if columns is None or (line.first and not _begins_with_known_name(columns)):
            return False
        return not self._sign or self._sign in (name.strip() for name in names)


class _NumbersDetector(_HeaderDetector):
    """Recognises a header, or lines of numbers most of which have the same width.

    Args:
        columns: the columns, if known; unused ones may contain text.
    """

    _WINDOW, _AGREE = 8, 6

    def __init__(self, columns: tuple[Column, ...]) -> None:
        super().__init__()
        self._columns = columns
        self._widths: deque[int] = deque(maxlen=self._WINDOW)

    def feed(self, data: bytes, lines: Sequence[TextLine]) -> bool:
        """Whether the format is certain."""
        if super().feed(data, lines):
            return True
        for line in lines:
            if not line.first:
                self._widths.append(self._width(line.raw))
        width = self._widths[-1] if self._widths else 0
        return width > 0 and self._widths.count(width) >= self._AGREE

    def _width(self, line: bytes) -> int:
        if is_object(line):
            return 0
        fields = split_fields(line)
        values = [numbers.printed_number(field) for field in fields]
        if len(fields) == len(self._columns):
            both = zip(values, self._columns, strict=True)
            return len(fields) if all(v is not None or not c.channel for v, c in both) else 0
        return len(fields) if are_numbers(fields, values) else 0


_RAZOR_M0 = (
    Column("t", "ms", "time"), *axes("a", "g"), *axes("g", "deg/s"), *axes("m", "uT")
)  # fmt: skip
_ARTEMIS_UNITS = {
    channel.channel: channel.unit
    for letter, unit in (("a", "mg"), ("g", "deg/s"), ("m", "uT"))
    for channel in axes(letter, unit)
}

FORMATS = (
    Format(
        "openlog-artemis",
        "SparkFun OpenLog Artemis",
        lambda columns, whole: DelimitedDecoder(
            columns, "openlog-artemis", _ARTEMIS_UNITS, whole=whole
        ),
        lambda _columns: _HeaderDetector("imu_degC"),
    ),
    Format(
        "csv",
        "numbers separated by commas, semicolons, tabs or blanks, with or without a header",
        lambda columns, whole: DelimitedDecoder(columns, whole=whole),
        _NumbersDetector,
        rank=3,
    ),
    Format(
        "razor-m0",
        "SparkFun 9DoF Razor IMU M0 (scaled)",
        lambda columns, whole: DelimitedDecoder(columns or _RAZOR_M0, "razor-m0", whole=whole),
        None,
        rank=3,
    ),
)
