"""``imucal-wizard export``: write what another program reads, and prove it."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from imucal_wizard.cli.arguments import (
    STANDARD_OUT,
    Parser,
    add_effects,
    add_json,
    add_port,
    file_to_write,
    own_effects,
)
from imucal_wizard.cli.outcome import answer, spare, write_json
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.input import read_document
from imucal_wizard.core.output import say

if TYPE_CHECKING:
    from imucal_wizard.report.exports import Exported, ExportSettings, ExportTarget

USAGE = (("export CAL.json", "write a calibration for another program, and check the file"),)


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
        help="the parameters that the flight controller applied during the recording (a file like "
        "the one that is written): both corrections are combined",
    )
    made.add_argument(
        "--slot", type=int, default=0, choices=range(3), help="number of the IMU in the vehicle"
    )
    made.add_argument(
        "--counts-per-g",
        type=float,
        metavar="N",
        help="counts per g of INAV and Betaflight (default: 2048)",
    )
    made.add_argument(
        "--noise",
        type=Path,
        metavar="NOISE.json",
        help="the file that the command noise wrote, for Kalibr",
    )
    says = "write the calibration to the board on this port, and wait for its echo (adafruit)"
    add_port(made, says)
    add_effects(made)
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
    from imucal_wizard.report.exports import targets, targets_document

    lines = []
    for one in targets().values():
        lines += [f"{one.name:16} {one.title}"]
        lines += [f"{'':16}   cannot hold: {text}" for text in one.cannot_hold]
    answer(place, targets_document(), "\n".join(lines))
    return 0


def _export(arguments: Namespace) -> int:
    from imucal_wizard import api
    from imucal_wizard.report.exports import export_document, path_beside, target_named

    calibration, target = api.load(arguments.file), target_named(arguments.to)
    path = arguments.output or path_beside(arguments.file, target)
    if arguments.port and target.sent is None:
        raise UsageError(f"--port: {target.name} has no board that takes a calibration by its port")
    spare([one for one in (arguments.file, arguments.present, arguments.noise) if one], path)
    done = api.export(calibration, target.name, path, _settings(arguments))
    if arguments.json:
        write_json(export_document(done), arguments.json)
    sent = arguments.port and not done.worse
    if sent:
        _write_back(arguments, target, done)
    if arguments.json != STANDARD_OUT:
        say(target.title)
        for kind, text in done.lines():
            say(text if kind in ("file", "worse") else f"  {text}")
        if sent:
            say(f"written to the board on {arguments.port}: its echo says the same")
    return 1 if done.worse else 0


def _write_back(arguments: Namespace, target: "ExportTarget", done: "Exported") -> None:
    """Send the files to the board, until its echo confirms them.

    Raises:
        LinkError: the port cannot be opened, or the board does not confirm.
    """
    from imucal_wizard.acquire.transport import Transport
    from imucal_wizard.acquire.write_back import write_back

    assert target.sent is not None  # noqa: S101 (narrows the type)
    files = {
        place.name.removeprefix(done.path.stem) if place != done.path else "": place.read_bytes()
        for place in done.files
    }
    link = Transport(arguments.port, arguments.baud)
    link.open()
    try:
        write_back(link, target.sent(files), lambda lines: target.echoed(files, lines))
    finally:
        link.close()


def _settings(arguments: Namespace) -> "ExportSettings":
    """What the options say beside the calibration.

    Raises:
        InputError: a file cannot be read.
        UsageError: a number that no controller has.
    """
    from imucal_wizard.report.exports import ExportSettings
    from imucal_wizard.report.noise_report import noise_for_export, read_noise

    counts = arguments.counts_per_g
    if counts is not None and not 1.0 <= counts <= 1e6:
        raise UsageError(f"{counts:g} counts per g is no accelerometer; give a number like 2048")
    return ExportSettings(
        present=None if arguments.present is None else read_document(arguments.present),
        noise={} if arguments.noise is None else noise_for_export(read_noise(arguments.noise)),
        slot=arguments.slot,
        counts_per_g=counts,
        effects=tuple(own_effects(arguments.effects)),
    )
