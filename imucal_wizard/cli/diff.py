"""``imucal-wizard diff``: calibrations against each other, and against a reference."""

from collections.abc import Sequence
from pathlib import Path

from imucal_wizard.cli.arguments import Parser, add_json
from imucal_wizard.cli.outcome import answer, spare, spare_others
from imucal_wizard.core.errors import UsageError

USAGE = (("diff CAL.json CAL.json...", "what has changed, and whether chance explains it"),)


def parser() -> Parser:
    """The options of ``diff``."""
    made = Parser(
        prog="imucal-wizard diff",
        description="Compare calibrations of one device with each other or with a reference (a "
        "certificate or rate table: TOML or JSON with a table of parameters per sensor). For two "
        "files it prints the difference of each parameter with its standard error and the "
        "probability of such a difference by chance; for three or more, the scatter beside the "
        "one that the standard errors predict.",
    )
    made.add_argument(
        "files", nargs="+", type=Path, metavar="FILE", help="a saved calibration or a reference"
    )
    add_json(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Compare; the exit status is 0 whatever differs."""
    arguments = parser().parse_args(argv)
    if len(arguments.files) < 2:
        raise UsageError("give two files or more: diff CAL.json CAL.json")
    spare(arguments.files, arguments.json)
    spare_others(arguments)
    from imucal_wizard.report.differences import (
        difference_document,
        difference_table,
        differences,
        named_parameters,
    )

    files = [named_parameters(path) for path in arguments.files]
    found, notes = differences(files)
    answer(
        arguments.json,
        difference_document(files, found, notes),
        difference_table(files, found, notes),
    )
    return 0
