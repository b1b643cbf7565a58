"""Lines of separated numbers to one array: a fast way for clean text, a careful way for the rest.

The fast way is NumPy's reader, which accepts nothing but numbers in rows of one length. Whatever it
refuses is halved until the lines at fault stand alone; these go the careful way, where each line
that does not fit becomes a row of NaN (so that samples after it keep their place in time) and is
named by its number.
"""

import io
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from imucal_wizard.devices.formats.moment import seconds
from imucal_wizard.devices.formats.numbers import LARGEST
from imucal_wizard.errors import RecordingError
from imucal_wizard.readings import FloatArray
from imucal_wizard.recordings.layout import LONGEST, Layout, shown, split

TOLERATED = 0.3
"""A file in which more than this share of the lines does not fit is not what it was taken for."""

_MANY = 0.05
"""More than this share is no accident of a good link."""

_NOTHING = {"", "nan", "inf", "-inf", "+inf", "ovf", "null", "none", "n/a", "na"}
_ANYTHING = re.compile(r"^[^\S\n]*[^#\s]", re.MULTILINE)
"""A line with more than blanks or a comment."""
_PIECES = 16
_SMALL = 32_768
"""Characters below which a refused text is no longer cut into pieces."""


@dataclass(frozen=True, eq=False)
class Table:
    """The numbers of a file.

    Attributes:
        values: shape (n, columns); NaN where a field is empty, no number, or its line did not fit.
        warnings: what was left out, for the user.
    """

    values: FloatArray
    warnings: tuple[str, ...] = ()


Misfit = tuple[int, str]
"""Number and content of a line that does not fit."""


def read_table(text: str, layout: Layout, first_line: int) -> Table:
    """The wanted columns of a text as numbers, shape (n, len(layout.used)).

    Args:
        text: the lines after the header.
        layout: how they are written.
        first_line: number of the text's first line in its file, for messages.

    Raises:
        RecordingError: there are no data, or too many lines do not fit.
    """
    text, cut = _without_cut_line(text, layout)
    values, misfits = _read(text, layout, first_line)
    values[~(np.abs(values) < LARGEST)] = np.nan
    warnings = _judge(misfits, len(values)) + cut
    if np.isnan(values).all():
        raise RecordingError(
            "there is no line of data in it; record again and look at the file in an editor"
        )
    return Table(values, warnings)


def _read(text: str, layout: Layout, first_line: int) -> tuple[FloatArray, list[Misfit]]:
    values = None if layout.decimal_comma else _fast(text, layout)
    if values is not None:
        return values, []
    pieces = list(_pieces(text))
    if len(text) <= 2 * _SMALL or len(pieces) == 1:  # one piece: a line as long as all of them
        return _careful(text, layout, first_line)
    parts: list[FloatArray] = []
    misfits: list[Misfit] = []
    for piece in pieces:
        part, bad = _read(piece, layout, first_line)
        parts.append(part)
        misfits += bad
        first_line += piece.count("\n")
    return np.concatenate(parts), misfits


def _pieces(text: str) -> Iterator[str]:
    """The text in about equal pieces of whole lines."""
    start, size = 0, max(_SMALL, len(text) // _PIECES)
    while start < len(text):
        end = text.find("\n", start + size) + 1 or len(text)
        yield text[start:end]
        start = end


def _fast(text: str, layout: Layout) -> FloatArray | None:
    """The whole text by NumPy's reader, or None when anything in it is not plain numbers."""
    if not _ANYTHING.search(text):
        return np.zeros((0, len(layout.used)))
    some = len(layout.used) < layout.width
    picked = some and layout.separator is not None
    try:
        values = np.loadtxt(
            io.StringIO(text),
            delimiter=layout.separator,
            comments="#",
            ndmin=2,
            usecols=layout.used if picked else None,
        )
    except ValueError:
        return None
    if picked:
        return values if _even(text, layout, len(values)) else None
    return values[:, list(layout.used)] if values.shape[1] == layout.width else None


def _even(text: str, layout: Layout, rows: int) -> bool:
    """Whether the separators are as many as rows of full width have (columns were left unread)."""
    if layout.separator is None or "#" in text:
        return False
    return text.count(layout.separator) == rows * (layout.width - 1)


def _careful(text: str, layout: Layout, first_line: int) -> tuple[FloatArray, list[Misfit]]:
    """Line by line; a line that does not fit is a row of NaN and is named."""
    rows: list[list[float]] = []
    misfits: list[Misfit] = []
    for number, line in enumerate(text.split("\n"), first_line):
        content = line.partition("#")[0].strip("\r\0 ")
        if not content or content == layout.skip:
            continue
        row = _row(content, layout)
        if row is None:
            misfits.append((number, content))
        rows.append(row or [np.nan] * len(layout.used))
    return np.array(rows, float).reshape(-1, len(layout.used)), misfits


def _without_cut_line(text: str, layout: Layout) -> tuple[str, tuple[str, ...]]:
    """The text without a last line that may have lost its end, and a warning about it.

    Only a line without a line end can have: it is believed when it fits and its last number is
    printed as long as the one above it.
    """
    body, _, last = text.rpartition("\n")
    if not last.strip() or not body.strip():
        return text, ()
    above = split(body.rpartition("\n")[2], layout.separator)
    fields = split(last, layout.separator)
    if fields and len(fields) == len(above) and len(fields[-1]) >= len(above[-1]):
        return text, ()
    return body + "\n", (f"the last line may have been cut short: {shown(last)}; left out",)


def _row(content: str, layout: Layout) -> list[float] | None:
    """The wanted numbers of one line, or None when the line does not fit."""
    if len(content) > LONGEST:
        return None
    fields = split(content, layout.separator)
    if len(fields) == layout.width + 1 and not fields[-1]:
        fields.pop()
    if len(fields) != layout.width:
        return None
    try:
        return [_number(fields[place], layout) for place in layout.used]
    except ValueError:
        return None


def _number(field: str, layout: Layout) -> float:
    """One field; what says that there is no value is NaN, a time of day is its seconds.

    Raises:
        ValueError: it is no number.
    """
    field = field.strip("\"'")
    if field.lower() in _NOTHING:
        return np.nan
    if "_" in field:
        raise ValueError(field)
    if ":" in field:
        return seconds(field, layout.milliseconds)
    return float(field.replace(",", ".") if layout.decimal_comma else field)


def _judge(misfits: list[Misfit], rows: int) -> tuple[str, ...]:
    """One warning about the lines that did not fit.

    Raises:
        RecordingError: they are too many.
    """
    if not misfits:
        return ()
    number, content = misfits[0]
    count = "1 line does" if len(misfits) == 1 else f"{len(misfits)} of {rows} lines do"
    says = f"{count} not fit the columns, first line {number}: {shown(content)}"
    if len(misfits) > max(2, TOLERATED * rows) or len(misfits) == rows:
        raise RecordingError(
            f"{says}; give --columns with one name for each column of this file (- for one to leave"
            " out), or mend the file"
        )
    if len(misfits) > _MANY * rows:
        return (f"{says}; left out. Check the cable and the speed before the next recording",)
    return (f"{says}; left out",)
