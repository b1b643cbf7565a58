"""Options and outputs that several commands share, and a parser that answers in one line."""

import argparse
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.core.output import (
    begins_otherwise,
    encode_json,
    note,
    refuse_special,
    write_atomically,
)
from imucal_wizard.core.units import (
    COUNT,
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
    from imucal_wizard.api import Fit, Recording
    from imucal_wizard.diagnose.grade import Limits
    from imucal_wizard.report.calibration_file import Calibration

STANDARD_OUT = "-"
HELP_COLUMNS = 78
"""Width of the help, the default of ``argparse`` where there is no terminal."""
GRADES = ("consumer", "industrial", "tactical")


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


def fitting_parser(command: str, description: str) -> Parser:
    """The parser of a command that fits a recording, with the options that all such commands take.

    Args:
        command: its name.
        description: what it does, in a sentence or two.
    """
    made = Parser(prog=f"imucal-wizard {command}", description=description)
    made.add_argument("files", nargs="+", type=Path, metavar="FILE", help="recording or session")
    add_json(made)
    add_recording_options(made)
    add_all_samples(made)
    add_gravity(made)
    return made


def add_json(parser: argparse.ArgumentParser) -> None:
    """The option that writes the result for scripts."""
    parser.add_argument(
        "--json",
        type=document_place,
        metavar="FILE",
        help="write the result as JSON; - for standard output, and nothing else there",
    )


def add_effects(parser: "argparse._ActionsContainer") -> None:
    """The option for the user's own effects."""
    parser.add_argument(
        "--effects",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="a Python file with an effect of your own for the bench; may be given several times",
    )


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


def add_gravity(parser: argparse.ArgumentParser) -> None:
    """The option for local gravity, which sets the accelerometer's scale."""
    parser.add_argument(
        "--gravity",
        type=_between(*GRAVITY_ON_EARTH, GRAVITY_ON_EARTH_TEXT),
        metavar="M/S2",
        help=f"local gravity, m/s² (default {STANDARD_GRAVITY}, or that of the session; "
        "9.780 at the equator, 9.832 at the poles)",
    )


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
        type=_between(20.0, 70.0, "the Earth's field; it lies between 22 and 67 µT"),
        metavar="UT",
        help="magnitude of the local magnetic field, µT; without it the magnetometer's matrix has "
        "determinant 1",
    )


def add_all_samples(parser: argparse.ArgumentParser) -> None:
    """The option that treats a session as a plain recording."""
    parser.add_argument(
        "--all-samples",
        action="store_true",
        help="of a session: use everything received, also what was taken back in the wizard",
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
    )


def recording_of(arguments: argparse.Namespace) -> "Recording":
    """The recording or session that a command was given.

    Raises:
        InputError: a file cannot be read.
    """
    from imucal_wizard.api import Recording

    options = recording_options(arguments)
    return Recording(arguments.files, options, all_samples=arguments.all_samples)


def calibrated(
    arguments: argparse.Namespace, command: str, methods: Mapping[str, str] | None = None
) -> "Fit":
    """The fit of a command; if the data are insufficient, its JSON document gives the reason.

    Args:
        arguments: with the options of ``fitting_parser`` and ``add_field``.
        command: whose document it is.
        methods: by sensor.

    Raises:
        DataError: the data do not determine a calibration.
    """
    from imucal_wizard.api import calibrate

    recording = recording_of(arguments)
    try:
        return calibrate(
            recording, gravity=arguments.gravity, field=arguments.field, methods=methods
        )
    except DataError as error:
        if arguments.json:
            from imucal_wizard.report.document import failure_document

            write_json(failure_document(command, str(error), recording.warnings), arguments.json)
        for warning in recording.warnings:
            note(f"warning: {warning}")
        raise


def add_saving(parser: "argparse._ActionsContainer", help_text: str) -> None:
    """The options for the file of a calibration."""
    parser.add_argument("--save", type=file_to_write, metavar="FILE", help=help_text)
    parser.add_argument(
        "--force",
        action="store_true",
        help="also save sensors whose calibration is worse than none, and over any other file",
    )
    for name, text in SAVED_ABOUT.items():
        parser.add_argument(f"--{name}", metavar="TEXT", help=f"{text}, for the saved file")


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
    "device": "name of the device",
    "serial": "its serial number",
    "operator": "who measured",
    "note": "a note",
}


def save_usable(
    calibration: "Calibration", place: Path, about: argparse.Namespace, *, force: bool
) -> list[str]:
    """Save the usable sensors; all of them with ``force``.

    Args:
        calibration: the result.
        place: the file.
        about: what the user says of device and measurement.
        force: whether the user wants what is worse than none.

    Returns:
        What was saved and what was left out, in lines.
    """
    left_out = [] if force else list(calibration.unusable)
    if left_out and len(left_out) == len(calibration.sensors):
        return ["not saved: no sensor has a usable calibration (--force saves it all the same)"]
    from imucal_wizard.report.calibration_file import described

    said = {name: getattr(about, name) for name in SAVED_ABOUT}
    described(calibration, **said).save(place, force=force)
    without = f" without the {' and the '.join(left_out)} (--force saves all)" if left_out else ""
    return [f"saved: {place}{without}"]


def write_json(document: object, place: str) -> None:
    """Write one JSON document to a file, or to standard output for ``-``.

    Raises:
        UsageError: the file cannot be written.
    """
    data = encode_json(document)
    if place == STANDARD_OUT:
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
        return
    write_atomically(Path(place), data)


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


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None


def file_to_write(text: str) -> Path:
    """The type of an option for a file that can be written; its folder must exist."""
    path = Path(text)
    try:
        refuse_special(path)
    except UsageError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    if not path.parent.is_dir():
        raise argparse.ArgumentTypeError(f"there is no folder {path.parent}; make it first")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise argparse.ArgumentTypeError(f"{text} cannot be written; choose another place")
    return path


def spare(files: Sequence[Path], *places: str | Path | None) -> None:
    """Refuse to write over an input file: a measurement cannot be repeated.

    Raises:
        UsageError: a place is one of the files.
    """
    for place in places:
        if place is not None and any(_same(Path(place), file) for file in files):
            raise UsageError(f"{place} is an input file: give another name to write to")


def spare_others(arguments: argparse.Namespace) -> None:
    """Refuse to write over a file of another kind, unless ``--force`` is given.

    Raises:
        UsageError: the place of ``--json`` is no JSON, or that of ``--save`` no calibration.
    """
    document, place = getattr(arguments, "json", None), getattr(arguments, "save", None)
    if getattr(arguments, "force", False):
        return
    if document not in (None, STANDARD_OUT) and begins_otherwise(Path(document), b"{"):
        raise UsageError(f"{document} is there already and no JSON: give another name")
    if place is not None and begins_otherwise(place, b'"imucal-wizard/calibration/'):
        raise UsageError(
            f"{place} is there already and no calibration: give another name, or --force"
        )


def _same(place: Path, file: Path) -> bool:
    try:
        return place.samefile(file)
    except OSError:  # one of them does not exist
        return False


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
