"""Options and outputs that several commands share, and a parser that answers in one line."""

import argparse
import math
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from imucal_wizard.acquire.files import SUFFIX, RecordingOptions
from imucal_wizard.core.dates import iso_date, seconds_of
from imucal_wizard.core.description import Description, Location
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.input import is_file
from imucal_wizard.core.output import (
    cause_of,
    note,
    refuse_special,
)
from imucal_wizard.core.units import (
    COUNT,
    FIELD_ON_EARTH,
    FIELD_ON_EARTH_TEXT,
    GRAVITY_ON_EARTH,
    GRAVITY_ON_EARTH_TEXT,
    STANDARD_GRAVITY,
    UNIT_FACTORS,
)
from imucal_wizard.estimate.methods import DEFAULTS, MethodNames

_UNITS = (
    ("accel", "accelerometer", "accelerations"),
    ("gyro", "gyroscope", "angular rates"),
    ("mag", "magnetometer", "the field"),
)
"""Beginning of the option, the sensor whose unit it gives, and the quantity."""
if TYPE_CHECKING:  # numpy is imported after the options are checked
    from imucal_wizard.diagnose.grade import Limits
    from imucal_wizard.model.effect import Effect

STANDARD_OUT = "-"
HELP_COLUMNS = 78
"""Width of the help, the default of ``argparse`` where there is no terminal."""
GRADES = ("consumer", "industrial", "tactical")
MAX_BAUD = 20_000_000
"""Bits per second; no serial port is faster."""
MIN_SPEED, MAX_SPEED = 0.001, 1000.0
"""Speeds of the virtual IMU or of a recording, as a multiple of real time."""


class Parser(argparse.ArgumentParser):
    """An argument parser that reports an error in one line, with exit status 2.

    Its help has the width of a usual terminal: the import with which ``argparse`` finds the present
    width, which it does for every option, takes as long as reading 3 MB.
    """

    def __init__(
        self,
        prog: str,
        description: str,
        epilog: str | None = None,
        formatter: type[argparse.HelpFormatter] = argparse.HelpFormatter,
    ) -> None:
        made = partial(formatter, width=HELP_COLUMNS)
        super().__init__(prog=prog, description=description, epilog=epilog, formatter_class=made)

    def error(self, message: str) -> NoReturn:
        """Report what is wrong with the options and how to get help."""
        raise UsageError(f"{message}. See: {self.prog} --help")


def fitting_parser(
    command: str, description: str, one: str = "the data determine no calibration"
) -> Parser:
    """The parser of a command that fits a recording, with the options that all such commands take.

    Args:
        command: its name.
        description: what it does, in a sentence or two.
        one: when the exit status is 1.
    """
    epilog = (
        f"Exit status: 0 done, whatever the verdict; 1 {one}; 2 wrong usage or unreadable input."
    )
    made = Parser(prog=f"imucal-wizard {command}", description=description, epilog=epilog)
    made.add_argument("files", nargs="+", type=Path, metavar="FILE", help="recording or session")
    add_json(made)
    add_recording_options(made)
    add_all_samples(made)
    made.add_argument(
        "--without",
        action="append",
        default=[],
        type=_span,
        metavar="FROM:TO",
        help="leave out the samples of this span, like 12.5:18 (s, as the result gives times), "
        "such as a hold in which the device was touched; of a session, all others are used; may be "
        "given several times",
    )
    add_gravity(made)
    made.set_defaults(rates=(), turns=(), rate_unit=None)
    return made


def add_json(parser: argparse.ArgumentParser) -> None:
    """The option that writes the result for scripts."""
    parser.add_argument(
        "--json",
        type=document_place,
        metavar="FILE",
        help="write the result as JSON; - writes nothing but JSON to standard output",
    )


def add_effects(parser: "argparse._ActionsContainer") -> None:
    """The option for the user's own effects."""
    parser.add_argument(
        "--effects",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="a Python file with an effect of your own for the bench, whose code is run; may be "
        "given several times",
    )


def own_effects(paths: Sequence[Path]) -> "list[Effect]":
    """The effects in files of the user's own; each file whose code runs is named once.

    Raises:
        UsageError: a file is no effect, or others can write it.
    """
    if not paths:
        return []  # the catalogue loads numpy, which the first screen does not wait for
    from imucal_wizard.model.catalogue import load_effect

    return [load_effect(path, announce=note) for path in dict.fromkeys(paths)]


def add_recording_options(parser: argparse.ArgumentParser) -> None:
    """Options that describe files which do not describe themselves."""
    group = parser.add_argument_group("description of the files, where they lack it")
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
        help="names of the columns in their order, like t,ax,ay,az,gx,gy,gz; - skips one",
    )
    group.add_argument(
        "--rate", type=positive, metavar="HZ", help="samples per second, if there is no time column"
    )
    for name, sensor, of in _UNITS:
        known = ", ".join([*UNIT_FACTORS[sensor], COUNT])
        group.add_argument(f"--{name}-unit", metavar="UNIT", help=f"unit of {of}: {known}")


def add_port(parser: "argparse._ActionsContainer", help_text: str) -> None:
    """The options for a device at a port.

    Args:
        parser: gets the options.
        help_text: what the port is for.
    """
    parser.add_argument("--port", metavar="PORT_OR_URL", help=help_text)
    parser.add_argument(
        "--baud",
        type=_baud,
        default=115200,
        metavar="N",
        help="speed of the port (default %(default)s)",
    )


def _baud(text: str) -> int:
    """The type of an option for the speed of a port, bits per second."""
    if not text.isdecimal() or not 0 < int(text) <= MAX_BAUD:
        raise argparse.ArgumentTypeError(f"{text!r} is no speed; give bits per second, like 115200")
    return int(text)


def add_speed(parser: "argparse._ActionsContainer", of: str) -> None:
    """The option for the speed of what runs in the program.

    Args:
        parser: gets the option.
        of: what it is the speed of.
    """
    parser.add_argument(
        "--speed",
        type=_between(MIN_SPEED, MAX_SPEED, f"a speed from {MIN_SPEED:g} to {MAX_SPEED:g}"),
        default=1.0,
        metavar="X",
        help=f"speed of {of}, as a multiple of real time (default 1)",
    )


def add_gravity(parser: argparse.ArgumentParser) -> None:
    """The option for local gravity, which sets the accelerometer's scale."""
    parser.add_argument(
        "--gravity",
        type=_between(*GRAVITY_ON_EARTH, GRAVITY_ON_EARTH_TEXT),
        metavar="M/S2",
        help=f"local gravity, m/s² (default {STANDARD_GRAVITY}, or that of the session; "
        "9.780 at the equator, 9.832 at the poles)",
    )
    add_location(parser)


def add_location(parser: "argparse._ActionsContainer") -> None:
    """The options for the place from which local gravity follows."""
    parser.add_argument(
        "--latitude",
        type=_between(-90.0, 90.0, "a latitude; it lies between -90 and 90 degrees"),
        metavar="DEG",
        help="latitude in degrees, from which gravity follows (GRS 1980)",
    )
    parser.add_argument(
        "--height",
        type=_between(-500.0, 9000.0, "a height on Earth in metres"),
        metavar="M",
        help="height above the sea, m; with --latitude (default 0)",
    )


def gravity_given(arguments: argparse.Namespace) -> float | None:
    """Local gravity by the options, m/s²; None if no option gives it.

    Raises:
        UsageError: it is given twice, or a height without a latitude.
    """
    given: float | None = getattr(arguments, "gravity", None)
    place = location_given(arguments)
    if place is None:
        return given
    if given is not None:
        raise UsageError("--gravity and --latitude both give the local gravity: give one of them")
    return place.gravity


def location_given(arguments: argparse.Namespace) -> Location | None:
    """The place by the options; None if no option gives it.

    Raises:
        UsageError: a height without a latitude.
    """
    if arguments.latitude is not None:
        return Location(arguments.latitude, arguments.height or 0.0)
    if arguments.height is not None:
        raise UsageError("--height needs --latitude: gravity follows from both")
    return None


def add_methods(parser: argparse.ArgumentParser) -> None:
    """Options for the methods of accelerometer and gyroscope."""
    _add_method(parser, "--method", "accelerometer")
    _add_method(parser, "--gyro-method", "gyroscope")


def add_magnetometer(parser: argparse.ArgumentParser) -> None:
    """Options for the method and scale of the magnetometer."""
    _add_method(parser, "--mag-method", "magnetometer")
    add_field(parser)


def _add_method(parser: argparse.ArgumentParser, option: str, sensor: str) -> None:
    parser.add_argument(
        option,
        choices=MethodNames(sensor),
        metavar="NAME",
        default=DEFAULTS[sensor],
        help=f"the {sensor}'s method: %(choices)s (default %(default)s)",
    )


def add_field(parser: argparse.ArgumentParser) -> None:
    """The option for the magnitude of the local field, which sets the magnetometer's scale."""
    parser.add_argument(
        "--field",
        type=_between(*FIELD_ON_EARTH, FIELD_ON_EARTH_TEXT),
        metavar="UT",
        help="magnitude of the local magnetic field, µT; without it the magnetometer's matrix has "
        "determinant 1",
    )


TABLE_UNITS = {"deg/s": math.pi / 180.0, "rpm": 2.0 * math.pi / 60.0}
"""Units of the rates of a table, rad/s each."""


def add_rate_table(parser: argparse.ArgumentParser) -> None:
    """Options for a recording on a rate table or turntable."""
    group = parser.add_argument_group(
        "a rate table or turntable (files with the same sensors then follow one another)"
    )
    group.add_argument(
        "--rates",
        type=_numbers,
        default=(),
        metavar="LIST",
        help="constant rates of the table, like 0,33.333,45; both senses, any mounting",
    )
    group.add_argument(
        "--rate-unit", choices=tuple(TABLE_UNITS), help="unit of --rates (default deg/s)"
    )
    group.add_argument(
        "--turns",
        type=_numbers,
        default=(),
        metavar="LIST",
        help="angles in degrees by which the table turned between rests, like 90,180,360",
    )


def table_options(arguments: argparse.Namespace) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """What a table did, by the options of ``add_rate_table``: rates, rad/s, and turns, rad.

    Raises:
        UsageError: a unit of rates without rates.
    """
    if arguments.rate_unit and not arguments.rates:
        raise UsageError("--rate-unit belongs to --rates")
    unit = TABLE_UNITS[arguments.rate_unit or "deg/s"]
    return (
        tuple(unit * abs(rate) for rate in arguments.rates),
        tuple(math.radians(abs(angle)) for angle in arguments.turns),
    )


def _numbers(text: str) -> tuple[float, ...]:
    """The type of an option for numbers with commas between them."""
    found = tuple(_number(part) for part in text.split(","))
    if not any(found) or not all(math.isfinite(value) for value in found):
        raise argparse.ArgumentTypeError(f"{text!r} names no number other than zero")
    return found


def add_all_samples(parser: argparse.ArgumentParser) -> None:
    """The option that treats a session as a plain recording."""
    parser.add_argument(
        "--all-samples",
        action="store_true",
        help="use all samples of a session, also those that were taken back in the wizard",
    )


def recording_options(arguments: argparse.Namespace) -> RecordingOptions:
    """The shared options in the form that the readers of files take."""
    columns = tuple(name.strip() for name in (arguments.columns or "").split(",") if name.strip())
    return RecordingOptions(
        columns=columns,
        rate=arguments.rate,
        accelerometer_unit=arguments.accel_unit,
        gyroscope_unit=arguments.gyro_unit,
        magnetometer_unit=arguments.mag_unit,
        as_format=arguments.as_format,
        without=tuple(getattr(arguments, "without", ())),
    )


def add_saving(parser: "argparse._ActionsContainer", help_text: str) -> None:
    """The options for the file of a calibration."""
    parser.add_argument("--save", type=file_to_write, metavar="FILE", help=help_text)
    parser.add_argument(
        "--force",
        action="store_true",
        help="also save sensors whose calibration is worse than none, and overwrite any other file",
    )
    for name, text in SAVED_ABOUT.items():
        parser.add_argument(f"--{name}", metavar="TEXT", help=f"{text}, for the saved file")
    add_sessions(parser)


def add_sessions(parser: "argparse._ActionsContainer") -> None:
    """The option for the folder of sessions and of the history of devices."""
    parser.add_argument(
        "--sessions",
        type=_folder,
        metavar="DIR",
        help="folder of the sessions and of the history of devices (default: this program's place "
        "in your data folder)",
    )


def _folder(text: str) -> Path:
    """The type of an option for a folder, which need not exist."""
    path = Path(text)
    try:
        if path.exists() and not path.is_dir():
            raise argparse.ArgumentTypeError(f"{text} is a file; give a folder")
    except OSError as error:  # a name too long
        raise argparse.ArgumentTypeError(f"{text}: {cause_of(error)}; give another name") from error
    return path


def sessions_folder(arguments: argparse.Namespace) -> Path:
    """The folder of the sessions: the given one, or the user's."""
    from imucal_wizard.sessions import default_directory

    given: Path | None = arguments.sessions
    return given or default_directory()


def kept_session(name: Path | None, arguments: argparse.Namespace) -> Path | None:
    """A session by its path, or by the name that ``sessions`` lists."""
    if name is None or is_file(name) or name.name != str(name):
        return name
    folder = sessions_folder(arguments)
    beside = (folder / name, folder / f"{name}{SUFFIX}")
    return next((path for path in beside if is_file(path)), name)


def add_limits(parser: "argparse._ActionsContainer") -> None:
    """The option for the limits of use, for which the grade of a sensor is given."""
    parser.add_argument(
        "--limits",
        type=Path,
        metavar="FILE",
        help='the limits of use in TOML: grade = "industrial", or accelerometer = "2 mg"',
    )


def limits_of_use(arguments: argparse.Namespace) -> "Limits | None":
    """The limits of use that the user gives; None for the usual ones.

    Raises:
        InputError: the file cannot be read, or does not hold limits.
    """
    if arguments.limits is None:
        return None
    from imucal_wizard.diagnose.grade import read_limits

    return read_limits(arguments.limits)


SAVED_ABOUT = {
    "device": "name of the device, whose history keeps the calibration",
    "serial": "serial number of the device",
    "chip": "kind of chip",
    "place": "name of the place",
    "operator": "who measured",
    "note": "a note",
}


def said_about(arguments: argparse.Namespace) -> Description:
    """What the options say of device and measurement."""
    return Description.read({name: getattr(arguments, name) for name in SAVED_ABOUT})


def date_of(text: str) -> str:
    """The type of an option for a date, ISO 8601; with the local time where it has no offset."""
    seconds = seconds_of(text)
    date = None if seconds is None else iso_date(seconds)
    if date is None:
        raise argparse.ArgumentTypeError(f"{text!r} is no date like 2031-02-20 or 2031-02-20T14:05")
    return date


def positive(text: str) -> float:
    """The type of an option for a number above zero."""
    value = _number(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number above zero")
    return value


def _between(low: float, high: float, says: str) -> Callable[[str], float]:
    """The type of an option for a number in a range; ``says`` describes such a number."""

    def number(text: str) -> float:
        value = _number(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text!r} is not {says}")
        return value

    return number


def _span(text: str) -> tuple[float, float]:
    """The type of an option for a span of time, s."""
    try:
        start, end = map(float, text.split(":"))
    except ValueError:
        start = end = 0.0
    if not start < end:
        raise argparse.ArgumentTypeError(f"{text!r} is no span; give its ends, like 12.5:18")
    return start, end


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None


def file_to_write(text: str) -> Path:
    """The type of an option for a file that can be written; its folder must exist."""
    path = Path(text)
    if text == STANDARD_OUT:
        raise argparse.ArgumentTypeError("this goes to a file: give its name")
    try:
        refuse_special(path)
        if not path.parent.is_dir():
            raise argparse.ArgumentTypeError(f"there is no folder {path.parent}; make it first")
        if not os.access(path if path.exists() else path.parent, os.W_OK):
            raise argparse.ArgumentTypeError(f"{text} cannot be written; choose another place")
    except UsageError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    except OSError as error:  # a name too long
        raise argparse.ArgumentTypeError(f"{text}: {cause_of(error)}; give another name") from error
    return path


def document_place(text: str) -> str:
    """The type of an option for a JSON file, or ``-`` for standard output."""
    return text if text == STANDARD_OUT else str(file_to_write(text))


def add_sensor(group: "argparse._ActionsContainer") -> None:
    """Options for the virtual sensor and the effects in it."""
    group.add_argument(
        "--hidden",
        action="append",
        default=[],
        metavar="TERM:SIZE:AXIS",
        help="hide an effect in the sensor, like second-order:5:y; may be given several times",
    )
    group.add_argument("--seed", type=int, metavar="N", help="seed of sensor and hand (default 0)")


def add_exercise(group: "argparse._ArgumentGroup", mystery: str) -> None:
    """Options for an exercise with a randomly hidden effect.

    Args:
        group: where the options are listed.
        mystery: help text of ``--mystery``.
    """
    group.add_argument("--mystery", action="store_true", help=mystery)
    group.add_argument(
        "--grade",
        choices=GRADES,
        default=GRADES[0],
        help=f"grade of the sensor; better ones hide smaller effects (default {GRADES[0]})",
    )
    group.add_argument("--key", metavar="WORD", help="the class's key to the answer")


def check_exercise(arguments: argparse.Namespace, also: str = "") -> None:
    """Refuse options of an exercise that contradict one another.

    Args:
        arguments: as they were given.
        also: another option that a key belongs to, or "".

    Raises:
        UsageError: an effect of the user's own beside one by chance, or a key for nothing.
    """
    if arguments.mystery and arguments.hidden:
        raise UsageError("--mystery hides a random effect, --hidden one that you choose: give one")
    if arguments.key is None:
        return
    if not arguments.mystery:
        raise UsageError(f"--key belongs to --mystery{f' or {also}' if also else ''}")
    if not arguments.key.strip():
        raise UsageError("the key is empty; give a word with --key")
