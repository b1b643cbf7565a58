"""``imucal-wizard compare``: all methods on one recording, side by side, on one screen."""

from collections.abc import Sequence

from imucal_wizard.cli.arguments import Parser, add_field, fitting_parser
from imucal_wizard.cli.outcome import answer, calibrated, spare, spare_others
from imucal_wizard.core.output import note

USAGE = (("compare FILE...", "fit a recording by all methods, side by side"),)


def parser() -> Parser:
    """The options of ``compare``."""
    made = fitting_parser(
        "compare",
        "Fit a recording by every method (Q's, N's and our own) and show them side by side: "
        "fitted error, held-out error, differences.",
    )
    add_field(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Compare; the exit status is 1 when the data are insufficient."""
    arguments = parser().parse_args(argv)
    spare(arguments.files, arguments.json)
    spare_others(arguments)
    fit = calibrated(arguments, "compare")
    from imucal_wizard.estimate.comparison import method_rows
    from imucal_wizard.report.document import methods_document
    from imucal_wizard.report.tables import method_table

    report, recording = fit.report, fit.recording
    rows = method_rows(report, recording.gyroscope_unit, recording.field, arguments.field)
    answer(arguments.json, methods_document(report, rows), method_table(rows))
    for warning in report.notes(judged=False):
        note(f"warning: {warning}")
    return 0
