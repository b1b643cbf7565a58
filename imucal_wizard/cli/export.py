"""``imucal-wizard export``: write what another program reads, and prove it."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from imucal_wizard.cli.arguments import (
    STANDARD_OUT,
    Parser,
    add_json,
    file_to_write,
    spare,
    write_json,
)
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.output import say
from imucal_wizard.core.quantities import quantity

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
    made.add_argument("--list", action="store_true", help="list the targets and what they lose")
    add_json(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Export, or list the targets."""
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
        write_json({"targets": listed}, place)
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
    spare([arguments.file], path)
    done = api.export(calibration, target.name, path)
    if arguments.json:
        found = {name: getattr(done, name) for name in done.__dataclass_fields__}
        write_json({"schema": "imucal-wizard/export/1", **found, "path": str(path)}, arguments.json)
    if arguments.json == STANDARD_OUT:
        return 0
    say(f"{target.title}\n  {done.formula}")
    for text in done.cannot_hold:
        say(f"  cannot hold: {text}")
    if done.rms_exported is None:
        say("  not proven: this calibration file has no holds to apply the export to")
    else:
        errors = (done.rms_before, done.rms_calibration, done.rms_exported)
        before, full, exported = (quantity(error, done.unit) for error in errors)
        say(f"  error over the holds: before {before}, calibration {full}, exported {exported}")
    say(f"written: {path}")
    return 0
