"""``imucal-wizard compare``: all methods on one recording, side by side, on one screen."""

from collections.abc import Sequence
from pathlib import Path

from imucal_wizard.commands.arguments import (
    Parser,
    add_field,
    add_gravity,
    add_recording_options,
    recording_options,
    write_json,
)
from imucal_wizard.output import note, say


def parser() -> Parser:
    """The options of ``compare``."""
    made = Parser(
        prog="imucal-wizard compare",
        description="Fit a recording by every method there is (Q's, N's and our own) and show them "
        "side by side: error fitted, error held out, what differs.",
    )
    made.add_argument("files", nargs="+", type=Path, metavar="FILE", help="recording or session")
    add_recording_options(made)
    add_gravity(made)
    add_field(made)
    made.add_argument("--json", metavar="FILE", help="write the table as JSON; - for standard out")
    return made


def run(argv: Sequence[str]) -> int:
    """Compare; the exit status is 1 when the data carry nothing."""
    arguments = parser().parse_args(argv)
    from imucal_wizard.fitting import FitOptions
    from imucal_wizard.fitting.methods import compare_methods
    from imucal_wizard.recordings import read

    readings = read(arguments.files, recording_options(arguments), field_alone=True)
    options = FitOptions(arguments.gravity, field=arguments.field)
    report, rows = compare_methods(readings, options)
    if arguments.json:
        from imucal_wizard.method_table import methods_document

        write_json(methods_document(report, rows), arguments.json)
    if arguments.json != "-":
        from imucal_wizard.method_table import method_table

        say(method_table(rows))
    for warning in report.warnings:
        note(f"warning: {warning}")
    return 0
