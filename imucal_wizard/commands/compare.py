"""``imucal-wizard compare``: all methods on one recording, side by side, on one screen."""

from collections.abc import Sequence

from imucal_wizard.commands.arguments import (
    Parser,
    add_field,
    fitting_parser,
    recording_options,
    write_json,
)
from imucal_wizard.commands.places import STANDARD_OUT, spare
from imucal_wizard.output import note, say


def parser() -> Parser:
    """The options of ``compare``."""
    made = fitting_parser(
        "compare",
        "Fit a recording by every method there is (Q's, N's and our own) and show them side by "
        "side: error fitted, error held out, what differs.",
    )
    add_field(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Compare; the exit status is 1 when the data carry nothing."""
    arguments = parser().parse_args(argv)
    spare(arguments.files, arguments.json)
    from imucal_wizard.commands.material import Material, fitted
    from imucal_wizard.fitting import FitOptions
    from imucal_wizard.fitting.methods import method_rows
    from imucal_wizard.method_table import failure_document, method_table, methods_document

    material = Material(
        arguments.files, recording_options(arguments), all_samples=arguments.all_samples
    )
    options = FitOptions(material.gravity(arguments.gravity), field=arguments.field)
    report = fitted(material, options, arguments.json, failure_document)
    rows = method_rows(report, material.gyroscope_unit, material.field, arguments.field)
    if arguments.json:
        write_json(methods_document(report, rows), arguments.json)
    if arguments.json != STANDARD_OUT:
        say(method_table(rows))
    for warning in report.warnings:
        note(f"warning: {warning}")
    return 0
