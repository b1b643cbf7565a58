"""``imucal-wizard fit``: a recording in, a calibration out, without a screen."""

from collections.abc import Sequence
from datetime import datetime

from imucal_wizard.commands.arguments import (
    Parser,
    add_magnetometer,
    add_methods,
    fitting_parser,
    recording_options,
    write_json,
)
from imucal_wizard.commands.places import STANDARD_OUT, file_to_write, spare
from imucal_wizard.output import note, say


def parser() -> Parser:
    """The options of ``fit``."""
    made = fitting_parser(
        "fit",
        "Find the holds and rotations of a recording, fit the model, show what is left. Files of "
        "one session that hold different sensors are given together.",
    )
    add_methods(made)
    add_magnetometer(made)
    made.add_argument(
        "--save", type=file_to_write, metavar="FILE", help="save the calibration to this file"
    )
    return made


def run(argv: Sequence[str]) -> int:
    """Fit and report; the exit status is 1 when the data do not carry it."""
    arguments = parser().parse_args(argv)
    spare(arguments.files, arguments.json, arguments.save)
    from imucal_wizard.commands.material import Material, fitted
    from imucal_wizard.document import failure_document, fit_document
    from imucal_wizard.fitting import FitOptions

    material = Material(
        arguments.files, recording_options(arguments), all_samples=arguments.all_samples
    )
    options = FitOptions(
        material.gravity(arguments.gravity),
        arguments.method,
        arguments.gyro_method,
        arguments.mag_method,
        arguments.field,
    )
    report = fitted(material, options, arguments.json, failure_document)
    if arguments.save:
        from imucal_wizard.calibration import from_report, save

        source = ", ".join(path.name for path in arguments.files)
        now = datetime.now().astimezone().isoformat(timespec="seconds")
        save(from_report(report, source, now), arguments.save)
    if arguments.json:
        write_json(fit_document(report), arguments.json)
    tell = note if arguments.json == STANDARD_OUT else say
    if tell is say:
        from imucal_wizard.summary import summary

        say(summary(report))
    else:
        for warning in report.warnings:
            note(f"warning: {warning}")
    if arguments.save:
        tell(f"saved: {arguments.save}")
    return 0
