"""``imucal-wizard sessions``: the sessions that are kept."""

from collections.abc import Sequence
from pathlib import Path

from imucal_wizard.cli.arguments import (
    Parser,
    add_json,
    add_sessions,
    sessions_folder,
)
from imucal_wizard.cli.outcome import answer, spare_others
from imucal_wizard.core.output import note

USAGE = (
    ("sessions", "list the sessions: device, date, step, verdict"),
    ("sessions --repair FILE", "write what can be read of a damaged session to a new file"),
)


def parser() -> Parser:
    """The options of ``sessions``."""
    made = Parser(
        prog="imucal-wizard sessions",
        description="List the sessions of the wizard, newest first, with device, date, step, number"
        " of holds and the verdict of what was saved. To continue one, or to open its result again:"
        " imucal-wizard --resume SESSION",
    )
    add_sessions(made)
    made.add_argument(
        "--repair",
        type=Path,
        metavar="FILE",
        help="write what can be read of a damaged session to a new file beside it",
    )
    add_json(made)
    return made


def run(argv: Sequence[str]) -> int:
    """List the sessions, or repair one."""
    arguments = parser().parse_args(argv)
    spare_others(arguments)
    if arguments.repair is not None:
        return _repair(arguments.repair, arguments.json)
    from imucal_wizard.report.history_text import session_table, sessions_document
    from imucal_wizard.sessions.catalogue import Catalogue

    folder = sessions_folder(arguments)
    with Catalogue(folder) as catalogue:
        sessions, notes = catalogue.sessions(), catalogue.notes
    answer(
        arguments.json,
        sessions_document(sessions, folder, notes),
        session_table(sessions, folder),
    )
    for text in notes:
        note(f"note: {text}")
    return 0


def _repair(path: Path, place: str | None) -> int:
    """Repair a session; the status is 0 for a whole session, too."""
    from imucal_wizard.acquire.files.session_salvage import repair

    done = repair(path)
    new, lost = (str(done[0]), done[1]) if done else (None, "")
    text = f"{lost}\nwritten: {new}" if done else f"{path} is whole: nothing to repair"
    document = {"schema": "imucal-wizard/repair/1", "path": new, "says": lost}
    answer(place, document, text)
    return 0
