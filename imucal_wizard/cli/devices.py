"""``imucal-wizard devices``: the devices, each with its history."""

from collections.abc import Sequence

from imucal_wizard.cli.arguments import (
    Parser,
    add_json,
    add_sessions,
    sessions_folder,
)
from imucal_wizard.cli.outcome import answer, spare_others
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.output import note

USAGE = (
    ("devices", "list the devices"),
    ("devices NAME", "one device: as found, as left, drift, rechecks"),
)
PLOT_COLUMNS, PLOT_ROWS = 78, 20


def parser() -> Parser:
    """The options of ``devices``."""
    made = Parser(
        prog="imucal-wizard devices",
        description="List the devices; with a name or serial number the history of one: each "
        "calibration as found and as left, the drift of every parameter per month, rechecks and "
        "sessions.",
    )
    made.add_argument("name", nargs="?", metavar="NAME", help="name or serial number of a device")
    made.add_argument(
        "--view",
        metavar="PARAMETER",
        help="plot a parameter with its standard errors, like bias_x or gyroscope/bias_x",
    )
    made.add_argument(
        "--over",
        choices=("date", "temperature"),
        help="what to plot it over (default date)",
    )
    add_sessions(made)
    add_json(made)
    return made


def run(argv: Sequence[str]) -> int:
    """List the devices, or the history of one."""
    arguments = parser().parse_args(argv)
    if arguments.view and arguments.name is None:
        raise UsageError("--view plots a parameter of one device: devices NAME --view bias_x")
    if arguments.over and not arguments.view:
        raise UsageError("--over belongs to --view: devices NAME --view bias_x --over temperature")
    spare_others(arguments)
    from imucal_wizard.report import history_text as words
    from imucal_wizard.sessions.catalogue import Catalogue

    folder = sessions_folder(arguments)
    with Catalogue(folder) as catalogue:
        notes = catalogue.notes
        if arguments.name is None:
            devices = catalogue.devices()
            text, document = (
                words.device_table(devices, folder),
                words.devices_document(devices, notes),
            )
        else:
            history = catalogue.history(arguments.name)
            text, document = words.history_text(history), words.history_document(history, notes)
            if arguments.view:
                named = words.parameter_named(history, arguments.view)
                size = PLOT_COLUMNS, PLOT_ROWS
                text = "\n".join(
                    words.course_plot(history, *named, *size, arguments.over or "date")
                )
    answer(arguments.json, document, text)
    for one in notes:
        note(f"note: {one}")
    return 0
