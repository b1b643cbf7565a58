"""A session watched again: it goes as it went, the operator's commands included."""

from pathlib import Path

import pytest

from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.player import MAX_PAUSE_SECONDS, Player, SessionTape
from imucal_wizard.run.session_replay import SessionReplay
from imucal_wizard.sessions import KeptSession, Session
from tests.cli.kept_sessions import Orders, sat
from tests.run.performance import same
from tests.waiting import wait_for


def played(path: Path, speed: float = float("inf")) -> Player:
    """Played to its end, started as the source's screen does it."""
    past = SessionReplay(KeptSession.look(path))
    player = Player(SessionTape(past), past.engine(), speed)
    player.start()
    wait_for(lambda: player.snapshot().stream.samples > 0)
    player.command("start")
    wait_for(lambda: player.snapshot().finished)
    return player


@pytest.mark.parametrize(
    "orders",
    [{}, {0.4: ("undo",)}, {0.5: ("repeat",)}, {0.55: ("goto result", "validate")}],
    ids=["plain", "undo", "repeat", "validate"],
)
def test_it_ends_as_it_was_left(tmp_path: Path, orders: Orders) -> None:
    path = tmp_path / "a.imucal"
    live = sat(path, orders)
    player = played(path)
    assert player.snapshot().status.step is live.status().step
    assert same(player.collected(), live.collected())
    player.stop()


def test_speed_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    live = sat(path, {0.2: ("undo",)}, share=0.3)
    player = played(path, 40.0)
    assert same(player.collected(), live.collected())
    player.stop()


def test_the_preview_ends_where_the_session_was_started(tmp_path: Path) -> None:
    """However long one looks at it, nothing of what was measured is played away."""
    path = tmp_path / "a.imucal"
    live = sat(path, {0.05: ("start",)}, share=0.4, start=False)
    past = SessionReplay(KeptSession.look(path))
    tape, engine = SessionTape(past), past.engine()
    assert tape.play(engine, float("inf"))
    assert engine.status().step is StepKind.SOURCE
    before = engine.samples
    assert 0 < before < 0.2 * live.samples
    assert tape.begin(engine) is not None
    assert engine.samples == before
    assert engine.status().step is StepKind.SETTLE
    assert not tape.play(engine, float("inf"))
    assert same(engine.collected(), live.collected())
    tape.close()


def test_a_session_that_was_never_started_is_played_as_a_recording(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    sat(path, start=False)
    player = played(path)
    assert player.snapshot().status.step is StepKind.RESULT
    assert len(player.collected().holds) >= 18
    player.stop()


def test_replay_skips_the_pause_between_two_runs(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    live = sat(path, share=0.1)
    with Session.open(path) as session:
        session.write_pieces([((session.last_arrival or 0.0) + 36_000.0, b"")])
    past = SessionReplay(KeptSession.look(path))
    tape, engine = SessionTape(past), past.engine()
    seconds = live.snapshot().status.elapsed + MAX_PAUSE_SECONDS + 5.0
    tape.begin(engine)
    assert not tape.play(engine, seconds)
    tape.close()


def test_what_the_operator_does_meanwhile_is_obeyed(tmp_path: Path) -> None:
    """It can be left for the result before its end."""
    path = tmp_path / "a.imucal"
    sat(path, share=0.4)
    past = SessionReplay(KeptSession.look(path))
    engine: Engine = past.engine()
    player = Player(SessionTape(past), engine, 40.0)
    player.start()
    wait_for(lambda: player.snapshot().stream.samples > 0)
    player.command("start")
    wait_for(lambda: player.snapshot().status.step is StepKind.POSES)
    player.command("goto", "result")
    wait_for(lambda: player.snapshot().status.step is not StepKind.POSES)
    assert player.snapshot().status.step is StepKind.RESULT
    player.stop()
