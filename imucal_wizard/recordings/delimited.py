"""Text with one sample per line: CSV, semicolons, tabs or spaces, with a header or without."""

import shlex
from contextlib import suppress
from pathlib import Path

import numpy as np

from imucal_wizard.devices.guess import channels as guess_columns
from imucal_wizard.errors import RecordingError
from imucal_wizard.readings import FloatArray
from imucal_wizard.recordings import guess
from imucal_wizard.recordings.columns import Samples, to_samples
from imucal_wizard.recordings.decoded import UnknownColumnsError
from imucal_wizard.recordings.layout import Layout, separator_of
from imucal_wizard.recordings.log import format_of, one_object_per_line, read_log, without_stamps
from imucal_wizard.recordings.opening import Line, NoTableError, read_opening
from imucal_wizard.recordings.options import RecordingOptions
from imucal_wizard.recordings.table import read_table
from imucal_wizard.recordings.text import decode, read_bytes

_USUAL_COLUMNS = {
    3: "ax,ay,az",
    4: "t,ax,ay,az",
    6: "ax,ay,az,gx,gy,gz",
    7: "t,ax,ay,az,gx,gy,gz",
    8: "t,ax,ay,az,gx,gy,gz,temp",
    9: "ax,ay,az,gx,gy,gz,mx,my,mz",
    10: "t,ax,ay,az,gx,gy,gz,mx,my,mz",
}
_OF_PAIRS = "; a pair of files of imu_tk, lines t x y z, is read with --as imu_tk"
_WIDEST = 40
_LOOKED_AT = 20_000
"""Characters from which the columns of a file without a header are guessed for the example."""


def read_text(path: Path, options: RecordingOptions) -> Samples:
    """The samples in a text file: a table, or a log of what a device printed.

    Raises:
        RecordingError: it cannot be read, or something about it is not known.
    """
    text, stamped = without_stamps(one_object_per_line(decode(read_bytes(path))))
    if options.as_format not in (None, "csv"):
        samples = read_log(text, options.as_format, options)
    else:
        samples = _table_or_log(path, text, options)
    return Samples(samples.series, stamped + samples.warnings)


def _table_or_log(path: Path, text: str, options: RecordingOptions) -> Samples:
    try:
        opening = read_opening(text, options, path.name)
    except NoTableError as error:
        if name := format_of(text):
            with suppress(UnknownColumnsError):
                return read_log(text, name, options)
        if error.line is None:
            raise
        raise RecordingError(f"{error}; {_command(path, text, error.line)}") from None
    table = read_table(text[opening.start :], opening.layout, opening.first_line)
    samples = to_samples(table.values, opening.columns, options)
    return Samples(samples.series, opening.warnings + table.warnings + samples.warnings)


def _command(path: Path, text: str, line: Line) -> str:
    """The command that would read a file without a header, as far as the file tells it."""
    width = len(line.fields)
    if width < len("xyz"):
        return "its lines have fewer numbers than a sensor has axes; is it a recording of an IMU?"
    if width > _WIDEST:
        return f"say what its {width} columns are with --columns (- for one to leave out)"
    values = _first_rows(text, line)
    names = _likely_names(values, width)
    options = f"--columns {','.join(names)}"
    if "t" not in names:
        options += " --rate 100"
    options += f" --accel-unit {_likely_unit(values, names)}"
    if "gx" in names:
        options += " --gyro-unit rad/s"
    return (
        f"say what its {width} columns are, with the true names, units and rate; for example:"
        f" imucal-wizard fit {shlex.quote(str(path))} {options}"
        f"{_OF_PAIRS if width == len('txyz') else ''}"
    )


def _first_rows(text: str, line: Line) -> FloatArray | None:
    """All columns of the first lines of data, or None where they are not all numbers."""
    separator, comma = separator_of(line.content)
    width = len(line.fields)
    layout = Layout(separator, width, tuple(range(width)), comma)
    end = text.find("\n", line.start + _LOOKED_AT)
    try:
        values = read_table(text[line.start : end], layout, line.number).values
    except RecordingError:
        return None
    return values[np.isfinite(values).all(axis=1)]


def _likely_names(values: FloatArray | None, width: int) -> list[str]:
    """Where gravity is plain, the names it speaks for; else those in the usual order."""
    if values is not None and len(values) > width:
        found, sure = guess_columns(values)
        if sure:
            return [name or "-" for name in found]
    usual = _USUAL_COLUMNS.get(width)
    return usual.split(",") if usual else ["ax", "ay", "az", *["-"] * (width - 3)]


def _likely_unit(values: FloatArray | None, names: list[str]) -> str:
    """The acceleration unit that the example would have."""
    if values is None or not len(values):
        return "m/s^2"
    try:
        return guess.acceleration_unit(values[:, [names.index(a) for a in ("ax", "ay", "az")]])[0]
    except RecordingError:
        return "m/s^2"
