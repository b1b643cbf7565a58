"""The beginning of a text file: comments, header, first line of data; from them the layout."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from imucal_wizard.devices.formats.base import Column
from imucal_wizard.errors import RecordingError
from imucal_wizard.recordings.header import column
from imucal_wizard.recordings.layout import Layout, is_number, separator_of, shown, split
from imucal_wizard.recordings.naming import named
from imucal_wizard.recordings.options import RecordingOptions

_SEARCHED_LINES = 400
"""A header that the device prints every few seconds is looked for in so many lines."""

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


class NamelessError(RecordingError):
    """Nothing says what the columns are; the reader of the file adds what to give.

    Attributes:
        line: the first line of data.
    """

    def __init__(self, line: Line, words: str) -> None:
        super().__init__(words)
        self.line = line


def read_opening(text: str, options: RecordingOptions) -> Opening:
    """Find header and first line of data, and name the columns.

    Raises:
        RecordingError: there are no lines of numbers, or nothing says what the columns are.
    """
    header, data, names = _search(text, wants_header=not options.columns)
    warnings: tuple[str, ...] = ()
    if options.columns:
        names = list(options.columns)
        if header is not None and any(column(name).channel for name in header.fields):
            warnings = (f"--columns was used instead of the header {shown(header.content)}",)
    columns = named(names, data.fields if header is None or header.start < data.start else None)
    used = tuple(i for i, one in enumerate(columns) if one.channel)
    separator, decimal_comma = separator_of(data.content)
    skip = header.content.strip() if header is not None else ""
    layout = Layout(separator, len(columns), used, decimal_comma, skip)
    return Opening(tuple(columns[i] for i in used), layout, data.start, data.number, warnings)


def _search(text: str, wants_header: bool) -> tuple[Line | None, Line, list[str]]:
    """The header, the first line of data, and the names.

    A log may begin in the middle of the stream, so the header may come after the first data.

    Raises:
        RecordingError: there are no data.
        NamelessError: there are data, but no names.
    """
    header: Line | None = None
    data: Line | None = None
    words: Line | None = None
    for line in _lines(text):
        if header is None and _is_header(line.fields):
            header = line
        elif data is None and _is_data(line.fields):
            data = line
        elif data is None:
            words = line
        if data is not None and (header is not None or not wants_header):
            break
    if data is None:
        raise RecordingError(
            "there is no line of data in it: no line of plain numbers; record again"
        )
    if header is not None or not wants_header:
        return header or words, data, header.fields if header else []
    if names := _comment_header(text, data):
        return None, data, names
    says = f"no name in {shown(words.content)} is known" if words else "it has no header"
    raise NamelessError(data, says)


def _lines(text: str) -> Iterator[Line]:
    """The first lines that are neither empty nor comments."""
    start = 0
    for number in range(1, _SEARCHED_LINES + 1):
        end = text.find("\n", start)
        content = text[start : end if end >= 0 else len(text)]
        if content.strip() and not content.lstrip().startswith("#"):
            yield Line(start, number, content)
        if end < 0:
            return
        start = end + 1


def _is_header(fields: list[str]) -> bool:
    """Whether a line names columns: it has no number in it, and two of its names are known."""
    known = {column(field).channel for field in fields} - {""}
    return len(known) >= 2 and not any(field and is_number(field) for field in fields)


def _is_data(fields: list[str]) -> bool:
    """Whether a line can be a sample: numbers without labels, and a few words beside them."""
    if any(_LABEL.search(field) for field in fields):
        return False
    numbers = sum(is_number(field) for field in fields)
    return numbers >= 2 and any(map(str.strip, fields)) and numbers >= len(fields) / 2


def _comment_header(text: str, data: Line) -> list[str]:
    """The names in the comment above the data when it is a header, else none."""
    comments = [line.strip("# \t") for line in text[: data.start].split("\n") if "#" in line]
    if not comments:
        return []
    names = split(comments[-1], separator_of(comments[-1])[0])
    is_header = len(names) == len(data.fields) and all(column(name).channel for name in names)
    return names if is_header else []
