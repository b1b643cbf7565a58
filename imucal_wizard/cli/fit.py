"""``imucal-wizard fit``: a recording in, a calibration out, without a screen."""

from collections.abc import Sequence

from imucal_wizard.cli.arguments import (
    STANDARD_OUT,
    Parser,
    add_limits,
    add_magnetometer,
    add_methods,
    add_saving,
    calibrated,
    fitting_parser,
    limits_of_use,
    save_usable,
    spare,
    spare_others,
    write_json,
)
from imucal_wizard.core.output import note, say

USAGE = (("fit FILE...", "fit a recording"),)


def parser() -> Parser:
    """The options of ``fit``."""
    made = fitting_parser(
        "fit",
        "Find the holds and rotations of a recording and fit the model. Files of "
        "one session that hold different sensors are given together.",
    )
    add_methods(made)
    add_magnetometer(made)
    made.add_argument(
        "--no-verdict",
        action="store_true",
        help="only fit: do not look for what the model lacks, and give no verdict",
    )
    add_saving(made, "save the calibration to this file")
    add_limits(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Fit and report; the exit status is 1 if the data or the calibration are not usable."""
    arguments = parser().parse_args(argv)
    limits = limits_of_use(arguments)
    spare(arguments.files, arguments.json, arguments.save)
    spare_others(arguments)
    methods = {
        "accelerometer": arguments.method,
        "gyroscope": arguments.gyro_method,
        "magnetometer": arguments.mag_method,
    }
    fit = calibrated(arguments, "fit", methods)
    diagnosis = {}
    if not arguments.no_verdict:
        from imucal_wizard.api import diagnose

        diagnosis = diagnose(fit)
    says = [f"{one.sensor}: {one.says}" for one in diagnosis.values()]
    saved = []
    if arguments.save:
        calibration = fit.judged(diagnosis, limits)
        saved = save_usable(calibration, arguments.save, arguments, force=arguments.force)
    if arguments.json:
        from imucal_wizard.report.document import fit_document

        write_json(fit_document(fit.report, fit.records(diagnosis, limits), says), arguments.json)
    tell = note if arguments.json == STANDARD_OUT else say
    if tell is say:
        from imucal_wizard.report.text import summary

        say(summary(fit.report, diagnosis, limits))
    else:
        for warning in fit.report.notes(judged=bool(says)):
            note(f"warning: {warning}")
    for text in saved:
        tell(text)
    unusable = any(one.unusable for one in fit.report.sensors.values())
    return 1 if unusable and not arguments.force else 0
