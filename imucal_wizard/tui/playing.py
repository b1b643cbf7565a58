"""Players of what was recorded: a recording with the wizard of today, a session as it was."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from imucal_wizard.live.engine import Engine
from imucal_wizard.live.past import Past
from imucal_wizard.live.player import Player
from imucal_wizard.live.session_tape import SessionTape
from imucal_wizard.live.settings import Settings
from imucal_wizard.live.tape import ReadingsTape
from imucal_wizard.readings import Readings
from imucal_wizard.recordings import read
from imucal_wizard.recordings.options import RecordingOptions
from imucal_wizard.recordings.session import taken_back, with_options
from imucal_wizard.sessions import KeptSession


def recording_player(
    paths: Sequence[Path], known: RecordingOptions, speed: float, settings: Settings
) -> tuple[Player, Readings]:
    """A player of the samples in files, and the samples.

    Args:
        paths: the files of one recording.
        known: what they do not say themselves.
        speed: seconds of the recording per second.
        settings: how the procedure is carried out; nobody is led through a recording.

    Raises:
        RecordingError: a file cannot be read.
    """
    readings = read(list(paths), known)
    told = (text for path in paths for text in taken_back(path))
    readings = replace(readings, warnings=(*told, *readings.warnings))
    procedure = replace(settings.procedure, led=False)
    source = " + ".join(path.name for path in paths)
    engine = Engine(None, replace(settings, procedure=procedure), source=source)
    return Player(ReadingsTape(readings), engine, speed), readings


def session_player(path: Path, known: RecordingOptions, speed: float) -> tuple[Player, float]:
    """A player of a session with the operator's commands, and the gravity it was carried out with.

    Raises:
        SessionError: it cannot be read.
    """
    session = KeptSession.look(path)
    with ExitStack() as on_failure:
        on_failure.callback(session.close)
        past = Past(session, lambda setup: with_options(setup, known))
        player = Player(SessionTape(past), past.engine(), speed)
        on_failure.pop_all()
    return player, past.settings.gravity
