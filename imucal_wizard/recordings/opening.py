"""The beginning of a text file: comments, header, first line of data; from them the layout."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from imucal_wizard.devices.formats.base import Column
from imucal_wizard.devices.formats.moment import counts_milliseconds, is_moment
from imucal_wizard.errors import RecordingError
from imucal_wizard.recordings.layout import LONGEST, Layout, is_number, separator_of, shown, split
from imucal_wizard.recordings.naming import named, named_loosely, with_units
from imucal_wizard.recordings.options import RecordingOptions

_SEARCHED_LINES = 400
"""A header that the device prints every few seconds is looked for in so many lines."""
_LAYOUT_LINES = 20
"""Lines among which one shows whether numbers are written with a decimal comma."""

_LABEL = re.compile(r"[A-Za-z]\w*\s*[:=]")


@dataclass(frozen=True)
class Opening:
    """What the first lines of a file say.

    Attributes:
        columns: the wanted columns, in the order of ``layout.used``.
        layout: how the lines are written.
        start: where the data begin, in characters.
        first_line: number of the line there.
        warnings: what was noticed.
    """

    columns: tuple[Column, ...]
    layout: Layout
    start: int
    first_line: int
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Line:
    """One line of the file: where it starts, its number, what stands in it."""

    start: int
    number: int
    content: str

    @property
    def fields(self) -> list[str]:
        """The fields by the separator that this line itself shows."""
        return split(self.content, separator_of(self.content)[0])


class NoTableError(RecordingError):
    """There is no table of numbers with names; the reader of the file adds what to give.

    Attributes:
        line: the first line of data, where only the names are missing; else None.
    """

    def __init__(self, line: Line | None, words: str) -> None:
        super().__init__(words)
        self.line = line


def read_opening(text: str, options: RecordingOptions, file: str = "") -> Opening:
    """Find header and first line of data, and name the columns.

    Args:
        text: the whole text.
        options: what the user said of it.
        file: the file's name.

    Raises:
        NoTableError: there are no lines of numbers, or nothing says what the columns are.
        RecordingError: names and columns do not fit.
    """
    header, data, names = _search(text, file, wants_header=not options.columns)
    warnings: tuple[str, ...] = ()
    if options.columns:
        names = list(options.columns)
        if header is not None and _is_header(header.fields):
            warnings = (f"--columns was used instead of the header {shown(header.content)}",)
    whole = header is None or header.start < data.start
    separator, decimal_comma = _separators(text, data)
    fields = split(data.content, separator)
    columns = named(names, fields if whole else None, file)
    used = tuple(i for i, one in enumerate(columns) if one.channel)
    if not used:
        raise RecordingError("--columns leaves every column out; name at least ax,ay,az in it")
    skip = header.content.strip() if header is not None else ""
    ticks = _milliseconds(text[data.start :], separator, columns)
    layout = Layout(separator, len(columns), used, decimal_comma, skip, ticks)
    return Opening(tuple(columns[i] for i in used), layout, data.start, data.number, warnings)


def _separators(text: str, data: Line) -> tuple[str | None, bool]:
    """What stands between the fields, and whether a comma stands within the numbers."""
    own = separator_of(data.content)
    for place, line in enumerate(_lines(text[data.start : data.start + LONGEST])):
        if place == _LAYOUT_LINES:
            break
        other = separator_of(line.content)
        if other[1] and (other[0] == own[0] or own[0] == ","):
            return other
    return own


def _milliseconds(text: str, separator: str | None, columns: list[Column]) -> bool:
    """Whether the times of day in the first lines count milliseconds behind the point."""
    place = next((i for i, one in enumerate(columns) if one.channel == "t"), None)
    if place is None:
        return False
    lines = (split(line.content, separator) for line in _lines(text))
    return counts_milliseconds(fields[place] for fields in lines if place < len(fields))


def _search(text: str, file: str, wants_header: bool) -> tuple[Line | None, Line, list[str]]:
    """The header, the first line of data, and the names.

    A log may begin in the middle of the stream, so the header may come after the first data.

    Raises:
        NoTableError: there are no data, or no names.
    """
    header: Line | None = None
    data: Line | None = None
    words: Line | None = None
    below: list[str] = []
    for line in _lines(text):
        if header is None and _is_header(line.fields, file):
            header = line
        elif data is None and _is_data(line.fields):
            data = line
        elif data is None:
            words = line
            below = below or (line.fields if header is not None else [])
        if data is not None and (header is not None or not wants_header):
            break
    if data is None:
        says = "there is no line of data in it: no line of plain numbers; record again"
        raise NoTableError(None, says)
    if header is not None or not wants_header:
        return header or words, data, with_units(header.fields, below) if header else []
    if names := _comment_header(text, data):
        return None, data, names
    says = f"no name in {shown(words.content)} is known" if words else "it has no header"
    raise NoTableError(data, says)


def _lines(text: str) -> Iterator[Line]:
    """The first lines that are neither empty nor comments."""
    start = 0
    for number in range(1, _SEARCHED_LINES + 1):
        end = text.find("\n", start)
        content = text[start : end if end >= 0 else len(text)]
        if content.strip() and not content.lstrip().startswith("#") and len(content) <= LONGEST:
            yield Line(start, number, content)
        if end < 0:
            return
        start = end + 1


def _is_header(fields: list[str], file: str = "") -> bool:
    """Whether a line names columns: it has no number in it, and two of its names are known."""
    if any(field and is_number(field) for field in fields):
        return False
    known = {one.channel for one in named_loosely(fields, file)} - {""}
    return len(known) >= 2


def _is_data(fields: list[str]) -> bool:
    """Whether a line can be a sample: numbers without labels, and a few words beside them."""
    if any(_LABEL.search(field) and not is_moment(field) for field in fields):
        return False
    numbers = sum(is_number(field) or is_moment(field) for field in fields)
    return numbers >= 2 and any(map(str.strip, fields)) and numbers >= len(fields) / 2


def _comment_header(text: str, data: Line) -> list[str]:
    """The names in the last comment above the data that is a header, else none."""
    comments = [line.strip("# \t") for line in text[: data.start].split("\n") if "#" in line]
    for comment in reversed(comments):
        names = split(comment, separator_of(comment)[0])
        if len(names) == len(data.fields) and _is_header(names):
            return names
    return []
