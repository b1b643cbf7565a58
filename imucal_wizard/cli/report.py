"""``imucal-wizard report``: the calibration report, one HTML file that prints on A4."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from imucal_wizard.cli.arguments import (
    Parser,
    add_effects,
    add_json,
    add_location,
    add_sessions,
    file_to_write,
    location_given,
    own_effects,
    sessions_folder,
)
from imucal_wizard.cli.outcome import answer, spare, spare_others
from imucal_wizard.core.dates import iso_now
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.output import begins_otherwise, note, write_atomically

if TYPE_CHECKING:
    from imucal_wizard.report.calibration_file import Calibration
    from imucal_wizard.sessions.history import DeviceHistory

USAGE = (("report CAL.json -o FILE.html", "a calibration report to print and file"),)


def parser() -> Parser:
    """The options of ``report``."""
    made = Parser(
        prog="imucal-wizard report",
        description="Write a calibration report: one self-contained HTML file that prints on A4. "
        "It uses the terms of ISO/IEC 17025 and claims no accreditation.",
    )
    made.add_argument("file", type=Path, metavar="CAL.json", help="a saved calibration")
    made.add_argument(
        "-o",
        "--output",
        type=file_to_write,
        metavar="REPORT.html",
        help="the file to write (default: beside the calibration)",
    )
    made.add_argument(
        "--noise",
        type=Path,
        metavar="NOISE.json",
        help="also show the noise that the command noise wrote to this file",
    )
    add_effects(made)
    add_location(made)
    add_sessions(made)
    add_json(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Write the report; the exit status is 0 whatever it says."""
    arguments = parser().parse_args(argv)
    place = arguments.output or arguments.file.with_suffix(".report.html")
    spare([one for one in (arguments.file, arguments.noise) if one], place, arguments.json)
    spare_others(arguments)
    where = location_given(arguments)
    from imucal_wizard.report.calibration_file import read_calibration
    from imucal_wizard.report.certificate import REPORT_MARK, certificate, report_document
    from imucal_wizard.report.noise_report import read_noise

    calibration = read_calibration(arguments.file)
    noise = None if arguments.noise is None else read_noise(arguments.noise)
    if begins_otherwise(place, REPORT_MARK):
        raise UsageError(f"{place} exists and is not a calibration report: give another name")
    text = certificate(
        calibration,
        arguments.file,
        issued=iso_now(),
        location=where,
        noise=noise,
        history=_history(calibration, sessions_folder(arguments)),
        effects=own_effects(arguments.effects),
    )
    write_atomically(place, text.encode())
    answer(
        arguments.json,
        report_document(calibration, place),
        f"written: {place}",
    )
    return 0


def _history(calibration: "Calibration", folder: Path) -> "DeviceHistory | None":
    """The history of the device in the user's folder; None without one."""
    if not (calibration.serial or calibration.device_name):
        return None
    from imucal_wizard.report.device_history import history_of
    from imucal_wizard.sessions.catalogue import Catalogue

    with Catalogue(folder) as catalogue:
        for text in catalogue.notes:
            note(f"note: {text}")
        return history_of(calibration, catalogue)
