"""Answers to exercises opened with other words, changed, or looked for in the files."""

import json
import secrets
import tempfile
from pathlib import Path

from benchmarks.attacks import Outcome
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.sessions import KeptSession
from imucal_wizard.teach.exercise import make_exercise, reveal
from imucal_wizard.teach.exercise_session import draw_exercise_session
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.services import WizardServices
from imucal_wizard.tui.sources import SourceChoice, SourceKind

NUMBER = 11
ATTACK = "answers opened with wrong keys, changed, or found in clear"

FULL_TRIES, FEW_TRIES = 300, 10
KEY = "gimbal-lock"


def run(full: bool) -> Outcome:
    """Attack the files of an exercise, and the session of a live one."""
    outcome = Outcome()
    tries = FULL_TRIES if full else FEW_TRIES
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = make_exercise(folder / "a.csv", key=KEY, poses="6", rate=25.0)
        truth, sealed = reveal(made.answer, KEY), json.loads(made.answer.read_text())
        inside = made.answer.read_text() + made.recording.read_text()[:500]
        outcome.count("the answer stands in the files" if truth.term in inside else "")
        for number in range(tries):
            outcome.count(_opens(made.answer, secrets.token_hex(1 + number % 4)))
            place = ("salt", "nonce", "sealed")[number % 3]
            data = bytearray.fromhex(sealed[place])
            data[secrets.randbelow(len(data))] ^= 1 << secrets.randbelow(8)
            changed = folder / "changed.mystery"
            changed.write_text(json.dumps({**sealed, place: data.hex()}))
            outcome.count(_opens(changed, KEY))
        for number in range(tries // 10):
            outcome.count(_stands_in_session(folder / str(number), secrets.randbits(62)))
    return outcome


def _opens(answer: Path, key: str) -> str:
    try:
        return f"{key} opened {answer.name}: {reveal(answer, key).term}"
    except ImucalError:
        return ""


def _stands_in_session(folder: Path, number: int) -> str:
    """What the settings of a live exercise tell of its answer."""
    services = WizardServices(WizardOptions(sessions=folder, mystery=number, key=KEY, speed=50.0))
    source = services.open_source(SourceChoice(SourceKind.VIRTUAL, title="virtual IMU"))
    source.start()
    source.stop()
    if services.sources.session is None:
        return "no session was written"
    with KeptSession.look(services.sources.session) as session:
        stored = json.dumps(session.meta())
    terms = (str(number), hex(number), draw_exercise_session(number).truth.term)
    return next((f"the session holds {one}" for one in terms if one in stored), "")
