"""Text with one sample per line: CSV, semicolons, tabs or spaces, with a header or without."""

import shlex
from pathlib import Path

from imucal_wizard.errors import RecordingError
from imucal_wizard.recordings import guess
from imucal_wizard.recordings.columns import Samples, to_samples
from imucal_wizard.recordings.layout import Layout, separator_of
from imucal_wizard.recordings.opening import Line, NamelessError, read_opening
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


def read_delimited(path: Path, options: RecordingOptions) -> Samples:
    """The samples in a text file with one sample per line.

    Raises:
        RecordingError: it cannot be read, or something about it is not known.
    """
    text = decode(read_bytes(path))
    try:
        opening = read_opening(text, options, path.name)
    except NamelessError as error:
        raise RecordingError(f"{error}; {_command(path, text, error.line)}") from None
    table = read_table(text[opening.start :], opening.layout, opening.first_line)
    samples = to_samples(table.values, opening.columns, options)
    return Samples(samples.series, opening.warnings + table.warnings + samples.warnings)


def _command(path: Path, text: str, line: Line) -> str:
    """The command that would read a file without a header, as far as the file tells it."""
    width = len(line.fields)
    if width < len("xyz"):
        return "its lines have fewer numbers than a sensor has axes; is it a recording of an IMU?"
    columns = _USUAL_COLUMNS.get(width, ",".join(["ax", "ay", "az", *["-"] * (width - 3)]))
    options = f"--columns {columns}"
    if "t" not in columns.split(","):
        options += " --rate 100"
    options += f" --accel-unit {_likely_unit(text, line, columns.split(','))}"
    if "gx" in columns:
        options += " --gyro-unit rad/s"
    return (
        f"say what its {width} columns are, with the true names, units and rate; for example:"
        f" imucal-wizard fit {shlex.quote(str(path))} {options}"
    )


def _likely_unit(text: str, line: Line, names: list[str]) -> str:
    """The acceleration unit that the example would have."""
    first = names.index("ax")
    separator, comma = separator_of(line.content)
    layout = Layout(separator, len(line.fields), (first, first + 1, first + 2), comma)
    try:
        table = read_table(text[line.start :], layout, line.number)
        return guess.acceleration_unit(table.values)[0]
    except RecordingError:
        return "m/s^2"
