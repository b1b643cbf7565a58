"""The options that several commands share, and a parser that answers in one line."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from imucal_wizard.commands.places import STANDARD_OUT, document_place
from imucal_wizard.errors import UsageError
from imucal_wizard.recordings.options import RecordingOptions
from imucal_wizard.units import COUNT, FACTORS, STANDARD_GRAVITY

_UNITS = (
    ("accel", "accelerometer", "accelerations"),
    ("gyro", "gyroscope", "turn rates"),
    ("mag", "magnetometer", "the field"),
)
"""Beginning of an option, the sensor whose unit it says, and what that measures."""


class Parser(argparse.ArgumentParser):
    """Argparse whose complaint is one clear line and exit status 2."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong with the options, and where help is."""
        raise UsageError(f"{message}. See: {self.prog} --help")


def fitting_parser(command: str, description: str) -> Parser:
    """The parser of a command that fits what was recorded, with the options that all of these take.

    Args:
        command: its name.
        description: what it does, in a sentence or two.
    """
    made = Parser(prog=f"imucal-wizard {command}", description=description)
    made.add_argument("files", nargs="+", type=Path, metavar="FILE", help="recording or session")
    made.add_argument(
        "--json",
        type=document_place,
        metavar="FILE",
        help="write the result as JSON; - for standard output, and nothing else there",
    )
    add_recording_options(made)
    add_all_samples(made)
    add_gravity(made)
    return made


def add_effects(parser: "argparse._ActionsContainer") -> None:
    """Effects of the user's own, for the bench."""
    parser.add_argument(
        "--effects",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="a Python file with an effect of your own for the bench; may be given several times",
    )


def add_recording_options(parser: argparse.ArgumentParser) -> None:
    """What may be said of files that do not say it themselves."""
    group = parser.add_argument_group("what the files do not say")
    group.add_argument(
        "--as",
        dest="as_format",
        metavar="FORMAT",
        help="how the lines are written: imu_tk for pairs of `t x y z` files, or the name of a "
        "device's format",
    )
    group.add_argument(
        "--columns",
        metavar="NAMES",
        help="what the columns are, in their order, like t,ax,ay,az,gx,gy,gz; - leaves one out",
    )
    group.add_argument(
        "--rate", type=positive, metavar="HZ", help="samples per second, where no column is a time"
    )
    for name, sensor, of in _UNITS:
        known = ", ".join([*FACTORS[sensor], COUNT])
        group.add_argument(f"--{name}-unit", metavar="UNIT", help=f"unit of {of}: {known}")


def add_gravity(parser: argparse.ArgumentParser) -> None:
    """The local gravity, on which the accelerometer's scale rests."""
    parser.add_argument(
        "--gravity",
        type=_between(9.7, 9.9, "a gravity on Earth; it lies between 9.76 and 9.84 m/s²"),
        metavar="M/S2",
        help=f"local gravity, m/s² (default {STANDARD_GRAVITY}, or what a session was begun with; "
        "9.780 at the equator, 9.832 at the poles)",
    )


def add_methods(parser: argparse.ArgumentParser) -> None:
    """Which of the solver's methods give the result."""
    parser.add_argument(
        "--method",
        choices=("least_squares", "newton", "six-position", "algebraic", "two-step", "numeric"),
        default="least_squares",
        help="the accelerometer's method (default least_squares)",
    )
    parser.add_argument(
        "--gyro-method",
        choices=("vector", "static", "dynamic", "offset"),
        default="vector",
        help="the gyroscope's method (default vector)",
    )


def add_magnetometer(parser: argparse.ArgumentParser) -> None:
    """Method and scale of the magnetometer."""
    parser.add_argument(
        "--mag-method",
        choices=("orthogonal", "algebraic", "two-step", "numeric"),
        default="orthogonal",
        help="the magnetometer's method (default orthogonal)",
    )
    add_field(parser)


def add_field(parser: argparse.ArgumentParser) -> None:
    """The size of the local magnetic field, on which the magnetometer's scale rests."""
    parser.add_argument(
        "--field",
        type=_between(20.0, 70.0, "the Earth's field; it lies between 22 and 67 µT"),
        metavar="UT",
        help="magnitude of the local magnetic field, µT; without it the magnetometer's matrix has "
        "determinant 1",
    )


def add_all_samples(parser: argparse.ArgumentParser) -> None:
    """The option that makes a recording of a session."""
    parser.add_argument(
        "--all-samples",
        action="store_true",
        help="of a session: count everything received, also what was taken back in the wizard",
    )


def recording_options(arguments: argparse.Namespace) -> RecordingOptions:
    """The shared options as the readers of files take them."""
    columns = tuple(name.strip() for name in (arguments.columns or "").split(",") if name.strip())
    return RecordingOptions(
        columns=columns,
        rate=arguments.rate,
        accelerometer_unit=arguments.accel_unit,
        gyroscope_unit=arguments.gyro_unit,
        magnetometer_unit=arguments.mag_unit,
        as_format=arguments.as_format,
    )


def write_json(document: object, place: str) -> None:
    """Write one JSON document to a file, or to standard output for ``-``.

    Raises:
        UsageError: the file cannot be written.
    """
    from imucal_wizard.calibration import encode

    data = encode(document)
    if place == STANDARD_OUT:
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
        return
    try:
        Path(place).write_bytes(data)
    except OSError as error:
        raise UsageError(f"{place} cannot be written: {error.strerror or error}") from error


def positive(text: str) -> float:
    """A number above zero, as an option's type."""
    value = _number(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number above zero")
    return value


def _between(low: float, high: float, says: str) -> Callable[[str], float]:
    """A number in a range, as an option's type; ``says`` is what another one is not."""

    def number(text: str) -> float:
        value = _number(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text!r} is not {says}")
        return value

    return number


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
