"""``imucal-wizard export``: write what another program reads, and prove it."""

import json
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from statistics import mean
from typing import TYPE_CHECKING

from imucal_wizard.cli.arguments import (
    STANDARD_OUT,
    Parser,
    add_json,
    file_to_write,
    spare,
    write_json,
)
from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.output import say
from imucal_wizard.core.quantities import quantity

if TYPE_CHECKING:
    from imucal_wizard.report.exports import ExportSettings

USAGE = (("export CAL.json", "write it for another program, and prove the file"),)


def parser() -> Parser:
    """The options of ``export``."""
    made = Parser(
        prog="imucal-wizard export",
        description="Write a saved calibration for another program. The written file is read back "
        "and applied to the holds in the calibration, in that program's own formula.",
    )
    made.add_argument("file", nargs="?", type=Path, metavar="CAL.json", help="a saved calibration")
    made.add_argument("--to", metavar="TARGET", help="the program to write for; see --list")
    made.add_argument(
        "-o",
        "--output",
        type=file_to_write,
        metavar="PATH",
        help="the file to write (default: named after the calibration and the target)",
    )
    made.add_argument(
        "--present",
        type=Path,
        metavar="FILE",
        help="the parameters that the flight controller applied while it was recorded (a file like "
        "the one that is written): both corrections become one",
    )
    made.add_argument(
        "--slot", type=int, default=0, choices=range(3), help="number of the IMU in the vehicle"
    )
    made.add_argument(
        "--counts-per-g", type=float, metavar="N", help="of INAV and Betaflight (default: 2048)"
    )
    made.add_argument(
        "--noise", type=Path, metavar="NOISE.json", help="Allan deviation, for Kalibr"
    )
    made.add_argument("--list", action="store_true", help="list the targets and what they lose")
    add_json(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Export, or list the targets; the status is 1 if a file corrects worse than none."""
    arguments = parser().parse_args(argv)
    if arguments.list:
        return _list(arguments.json)
    if arguments.file is None or arguments.to is None:
        raise UsageError("give a calibration and a target: export CAL.json --to TARGET")
    return _export(arguments)


def _list(place: str | None) -> int:
    from imucal_wizard.report.exports import targets

    known = targets().values()
    if place:
        listed = [
            {"name": one.name, "title": one.title, "cannot_hold": one.cannot_hold} for one in known
        ]
        write_json({"schema": "imucal-wizard/export-list/1", "targets": listed}, place)
    if place != STANDARD_OUT:
        for one in known:
            say(f"{one.name:16} {one.title}")
            for text in one.cannot_hold:
                say(f"{'':16}   cannot hold: {text}")
    return 0


def _export(arguments: Namespace) -> int:
    from imucal_wizard import api
    from imucal_wizard.report.exports import path_beside, target_named

    calibration, target = api.load(arguments.file), target_named(arguments.to)
    path = arguments.output or path_beside(arguments.file, target)
    spare([one for one in (arguments.file, arguments.present, arguments.noise) if one], path)
    done = api.export(calibration, target.name, path, _settings(arguments))
    if arguments.json:
        found = {name: getattr(done, name) for name in done.__dataclass_fields__}
        sensors = {
            name: {key: getattr(one, key) for key in one.__dataclass_fields__}
            for name, one in done.sensors.items()
        }
        places = {"path": str(path), "files": [str(one) for one in done.files]}
        document = {"schema": "imucal-wizard/export/1", **found, **places, "sensors": sensors}
        write_json(document, arguments.json)
    worse = [name for name, one in done.sensors.items() if one.worse_than_none]
    if arguments.json == STANDARD_OUT:
        return 1 if worse else 0
    say(f"{target.title}\n  {done.formula}\n  {done.direction}")
    for text in done.cannot_hold:
        say(f"  cannot hold: {text}")
    for text in done.notes:
        say(f"  note: {text}")
    if not done.sensors:
        say("  not proven: this calibration file has no holds to apply the export to")
    for name, one in done.sensors.items():
        before = "" if one.rms_before is None else f"before {quantity(one.rms_before, one.unit)}, "
        full, exported = (quantity(e, one.unit) for e in (one.rms_calibration, one.rms_exported))
        say(f"  error of the {name}: {before}calibration {full}, exported {exported}")
    for place in done.files:
        say(f"written: {place}")
    for name in worse:
        say(f"▲ what this file holds of the {name} is worse than no calibration: do not use it")
    return 1 if worse else 0


def _settings(arguments: Namespace) -> "ExportSettings":
    """What the options say beside the calibration.

    Raises:
        InputError: a file cannot be read.
        UsageError: a number that no controller has.
    """
    from imucal_wizard.report.exports import ExportSettings

    counts = arguments.counts_per_g
    if counts is not None and not 1.0 <= counts <= 1e6:
        raise UsageError(f"{counts:g} counts per g is no accelerometer; give a number like 2048")
    return ExportSettings(
        present=None if arguments.present is None else _bytes_of(arguments.present),
        noise={} if arguments.noise is None else _noise_of(arguments.noise),
        slot=arguments.slot,
        counts_per_g=counts,
    )


def _noise_of(path: Path) -> dict[str, dict[str, float]]:
    """Mean over the axes of the figures of an Allan deviation, by sensor."""
    try:
        sensors = json.loads(_bytes_of(path))["sensors"]
        return {
            sensor: {
                key: mean([float(axis[key]) for axis in one["axes"].values()])
                for key in ("white", "random_walk")
                if all(axis.get(key) for axis in one["axes"].values())
            }
            for sensor, one in sensors.items()
        }
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        raise RecordingError(f"{path} is no document of an Allan deviation") from error


def _bytes_of(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror or error}") from error
