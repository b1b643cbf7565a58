"""``imucal-wizard fit``: a recording in, a calibration out, without a screen."""

from collections.abc import Sequence

from imucal_wizard.cli.arguments import (
    STANDARD_OUT,
    Parser,
    add_limits,
    add_magnetometer,
    add_methods,
    add_rate_table,
    add_saving,
    date_of,
    fitting_parser,
    limits_of_use,
)
from imucal_wizard.cli.outcome import (
    calibrated,
    note_spans,
    save_or_print,
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
        "one session are given together: those that hold different sensors become one, "
        "and those that hold the same ones, like one for each position, follow one another.",
        "the data determine no calibration, or one that is worse than none, or --save left a "
        "sensor out",
    )
    add_methods(made)
    add_magnetometer(made)
    made.add_argument(
        "--no-verdict",
        action="store_true",
        help="only fit, without a verdict on what the model lacks",
    )
    add_rate_table(made)
    add_saving(made, "save the calibration to this file")
    made.add_argument(
        "--date", type=date_of, metavar="DATE", help="when it was measured, if not now: 2031-02-20"
    )
    add_limits(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Fit and report; 1 if a sensor's calibration is worse than none, or none is there to save."""
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
    tell = note if arguments.json == STANDARD_OUT else say
    if tell is say:
        from imucal_wizard.report.text import summary

        say(summary(fit.report, diagnosis, limits))
    else:
        for warning in fit.report.notes(judged=bool(says)):
            note(f"warning: {warning}")
    note_spans(diagnosis.values())
    if arguments.json:
        from imucal_wizard.report.document import fit_document

        write_json(fit_document(fit.report, fit.records(diagnosis, limits), says), arguments.json)
    if arguments.save:
        calibration = fit.judged(diagnosis, limits)
        return int(save_or_print(calibration, arguments, fit.report))
    unusable = any(one.unusable for one in fit.report.sensors.values())
    return 1 if unusable and not arguments.force else 0
