"""Numbers between commas, semicolons, tabs or blanks, with or without a header."""

import math
from collections import Counter, deque

from imucal_wizard.devices.formats import numbers
from imucal_wizard.devices.formats.base import Column
from imucal_wizard.devices.formats.names import header
from imucal_wizard.devices.formats.text import DECIMALS_FROM, TextDecoder
from imucal_wizard.devices.plain import plain
from imucal_wizard.readings import FloatArray

LEARN_FROM = 8
"""Numeric lines from which the number of columns is learned where no header gives it."""
MIN_COLUMNS = 3
"""Fewer numbers on a line are no accelerometer."""
_GIVE_UP_HEADER = 5
_LONGEST_NAME = 40
_BRACKETS = b"()[]{}"


class DelimitedDecoder(TextDecoder):
    """``csv``: one sample per line, fields by their place.

    Args:
        columns: the columns by their place, where they are known; else a header tells them, now
            or later, or they stay without channels.
        name: name of the format.
        header_units: units that a header's bare names stand for, by channel.
    """

    def __init__(
        self,
        columns: tuple[Column, ...] = (),
        name: str = "csv",
        header_units: dict[str, str] | None = None,
    ) -> None:
        super().__init__(name, columns)
        self._fixed = bool(columns)
        self._units = header_units or {}
        self._separator = b""
        self._learning: deque[bytes] = deque(maxlen=LEARN_FROM)
        self._misfits: deque[int] = deque(maxlen=_GIVE_UP_HEADER)
        self._again = False
        self._names: list[str] = []

    def _fast(self, lines: list[bytes]) -> FloatArray | None:
        if self._count < DECIMALS_FROM or self._first or not self._separator or self._skip:
            return None
        values = numbers.batch(lines, self._separator, len(self._columns))
        if values is not None:
            self._misfits.clear()
        return values

    def _read(self, line: bytes, first: bool) -> None:
        if line.lstrip().startswith(b"#"):
            return
        fields = split(line)
        if len(fields) == len(self._columns) - 1 and _ends_empty(line):
            fields.append(b"")
        values = [numbers.number(field) for field in fields]
        if all(value is None or math.isnan(value) for value in values) and None in values:
            self._words(line, fields, first)
        elif first:
            return  # its beginning is missing and nobody can see it
        elif self._columns:
            self._sample(line, fields, values)
        elif are_numbers(fields, values):
            self._learn(line)

    def _sample(self, line: bytes, fields: list[bytes], values: list[float | None]) -> None:
        if len(fields) != len(self._columns) or self._text_where_needed(fields, values):
            self._spoilt()
            self._unfit(line, len(fields))
            return
        self._misfits.clear()
        if not self._separator:
            self._separator = separator_of(line)
        printed = [numbers.decimals(field) for field in fields]
        self._row([math.nan if v is None else v for v in values], printed)

    def _text_where_needed(self, fields: list[bytes], values: list[float | None]) -> bool:
        """Text may stand in a column that nobody needs, once it is known which these are."""
        if not any(c.channel for c in self._columns):
            return not are_numbers(fields, values)
        return any(v is None and c.channel for v, c in zip(values, self._columns, strict=True))

    def _words(self, line: bytes, fields: list[bytes], first: bool) -> None:
        """A line without numbers: a header, a banner that nobody needs, or garbage."""
        found = header([field.decode("utf-8", errors="replace") for field in fields])
        if found is None and not is_text(line):
            self._spoilt()
        if found is None:
            self._unknown_names(fields)
        if found is None or self._fixed or (first and not whole(found)):
            return
        found = tuple(self._with_unit(c) for c in found)
        if not self._columns or (
            len(found) == len(self._columns) and _named(found) > _named(self._columns)
        ):  # a spoilt header names fewer columns than the one that is known
            self._columns = found
            self._read_again()

    def _unknown_names(self, fields: list[bytes]) -> None:
        """Names that mean nothing here: nobody may guess what they stand for."""
        names = [plain(field, _LONGEST_NAME) for field in fields]
        if len(names) >= MIN_COLUMNS and all(names) and not self._fixed:
            self._names = names

    def _with_unit(self, c: Column) -> Column:
        return c if c.unit else Column(c.channel, self._units.get(c.channel, ""), c.name)

    def _learn(self, line: bytes) -> None:
        """Wait for enough numeric lines, then let the commonest number of fields decide."""
        self._learning.append(line)
        if len(self._learning) < LEARN_FROM:
            return
        counts = Counter(len(split(line)) for line in self._learning)
        width = counts.most_common(1)[0][0]
        names = self._names if len(self._names) == width else []
        names = names or [f"column {i + 1}" for i in range(width)]
        self._columns = tuple(Column("", "", name) for name in names)
        self._read_again()

    def _read_again(self) -> None:
        """The lines that waited, now that the columns are known."""
        waiting = list(self._learning)
        self._learning.clear()
        self._again = True  # what is known now is not given up for the lines it was learned from
        for line in waiting:
            self._read(line, False)
        self._again = False
        self._misfits.clear()

    def _unfit(self, line: bytes, count: int) -> None:
        """A header that lost its first name disagrees with every line: then it is forgotten."""
        if self._fixed or self._count:
            return
        self._misfits.append(count)
        self._learning.append(line)
        full = len(self._misfits) == _GIVE_UP_HEADER and len(set(self._misfits)) == 1
        if full and not self._again:
            self._columns = ()
            self._misfits.clear()


def are_numbers(fields: list[bytes], values: list[float | None]) -> bool:
    """Whether a line without a known header is a line of numbers, a date perhaps among them."""
    good = sum(value is not None for value in values)
    words = any(v is None and not numbers.wordless(f) for f, v in zip(fields, values, strict=True))
    return good >= max(MIN_COLUMNS, len(values) / 2) and not words


def whole(columns: tuple[Column, ...]) -> bool:
    """Whether a header that may be cut off in front begins with a name that is known."""
    return bool(columns[0].channel) or columns[0].name.lower().startswith(("rtc", "date"))


def _named(columns: tuple[Column, ...]) -> int:
    return sum(bool(c.channel) for c in columns)


def is_text(line: bytes) -> bool:
    """Whether a line is printable, as text at the right speed is."""
    return all(32 <= byte < 127 or byte == 9 for byte in line)


def separator_of(line: bytes) -> bytes:
    """What stands between the fields of this line: comma, semicolon, tab, bar, or blanks."""
    if _decimal_commas(line):
        return b";"
    return next((sign for sign in (b",", b";", b"\t", b"|") if sign in line), b" ")


def _decimal_commas(line: bytes) -> bool:
    """Whether numbers with commas stand between semicolons."""
    return line.count(b";") > 1 and b"," in line and b"." not in line


def _ends_empty(line: bytes) -> bool:
    """Whether a line ends with a separator: its last field may be an empty one."""
    sign = separator_of(line)
    return sign != b" " and line.rstrip(b" \r").endswith(sign)


def split(line: bytes) -> list[bytes]:
    """The fields of a line; brackets around it and one separator at its end do not count."""
    if b'"' in line:
        line = line.replace(b'"', b"")
    line = line.strip(b" \t" if b"," in line or b";" in line else b" ")
    if line[:1] in (b"(", b"[", b"{"):
        line = line.translate(None, _BRACKETS).strip(b" ")
    sign = separator_of(line)
    if sign == b" ":
        return line.split()
    if sign == b";":
        line = line.replace(b",", b".")
    fields = line.split(sign)
    if len(fields) > 1 and not fields[-1].strip():
        fields.pop()
    return fields
