"""A session taken up again stands where it ended, to the last bit, and goes on from there."""

from pathlib import Path

import pytest

from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.errors import SessionError
from imucal_wizard.core.poses import CORNERS, FACES
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.measurement.requests import requests_to_text
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.session_replay import begin_session, resume_session
from imucal_wizard.sessions import Session
from tests.guide.device import pose_asked
from tests.run.performance import pieces, recorded, same, settings


def _receive(engine: Engine, first: int, past: int) -> None:
    for arrival, data in pieces(recorded(), 3000)[first:past]:
        engine.receive(data, arrival)


@pytest.mark.parametrize("share", [0.15, 0.6, 0.97])
def test_a_session_cut_off_anywhere_goes_on_as_if_nothing_had_happened(
    tmp_path: Path, share: float
) -> None:
    count = len(pieces(recorded(), 3000))
    cut = round(share * count)
    path = tmp_path / "a.imucal"
    live = begin_session(path, None, settings())
    live.command("start")
    _receive(live, 0, cut)
    live.journal.close()
    resumed = resume_session(path)
    engine = resumed.engine
    resumed.prepare(engine)
    assert engine.status().step is live.status().step
    assert same(engine.collected(), live.collected())
    _receive(live, cut, count)
    _receive(engine, cut, count)
    engine.journal.close()
    assert same(engine.collected(), live.collected())
    assert engine.status() == live.status()
    again = resume_session(path)
    again.prepare(again.engine)
    assert same(again.engine.collected(), live.collected())
    again.engine.journal.close()


@pytest.mark.parametrize("timed", [True, False])
def test_many_small_pieces_are_read_again_in_few_steps_and_give_the_same(
    tmp_path: Path, timed: bool
) -> None:
    """A device that prints line by line leaves one piece per line, with or without its own time."""
    path, lines = tmp_path / "a.imucal", recorded().splitlines(keepends=True)
    if not timed:
        lines = [line.partition(b",")[2] for line in lines if not line.startswith(b"#")]
    live = begin_session(path, None, settings())
    live.command("start")
    for number, line in enumerate(lines[:2500]):
        if number in (1501, 1733):
            live.command("undo")
        live.receive(line, 0.01 * number)
    live.journal.close()
    resumed, shares = resume_session(path), list[float]()
    resumed.prepare(resumed.engine, shares.append)
    resumed.engine.journal.close()
    assert same(resumed.engine.collected(), live.collected())
    assert resumed.engine.status() == live.status()
    assert resumed.engine.snapshot().events == live.snapshot().events
    assert 50 < len(shares) < 200
    assert shares == sorted(shares)
    assert 0.9 < shares[-1] <= 1.0


def test_an_interrupted_replay_closes_the_session(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    live = begin_session(path, None, settings())
    for number in range(200):
        live.receive(b"1,2,3\n", 0.01 * number)
    live.journal.close()

    def told(share: float) -> None:
        raise KeyError(share)

    resumed = resume_session(path)
    with pytest.raises(KeyError):
        resumed.prepare(resumed.engine, told)
    Session.open(path).close()


def test_commands_take_effect_at_the_same_sample_again(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    live = begin_session(path, None, settings())
    live.command("start")
    for number, (arrival, data) in enumerate(pieces(recorded(), 3000)):
        if number == 50:
            live.set_setup(StreamSetup(gyroscope_unit="rad/s"))
            live.command("start")
            live.command("skip")
        if number in (150, 151):
            live.command("undo")
        live.receive(data, arrival)
    live.journal.close()
    resumed = resume_session(path)
    resumed.prepare(resumed.engine)
    resumed.engine.journal.close()
    assert same(resumed.engine.collected(), live.collected())
    assert resumed.engine.status() == live.status()
    assert resumed.engine.snapshot().events == live.snapshot().events


@pytest.mark.parametrize(("now", "goes_on_at"), [(1500.0, 500.0), (900.0, 21.0)])
def test_the_session_clock_goes_on_after_the_pause_and_never_back(
    tmp_path: Path, now: float, goes_on_at: float
) -> None:
    path = tmp_path / "a.imucal"
    engine = begin_session(path, about={"created": 1000.0})
    engine.receive(b"x", 20.0)
    engine.journal.close()
    resumed = resume_session(path)
    assert resumed.prepare(resumed.engine, now=lambda: now) == goes_on_at
    resumed.engine.journal.close()


def test_nothing_measured_yet_is_taken_up_at_the_source(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    begin_session(path, None, settings(), about={"port": "/dev/ttyX"}).journal.close()
    resumed = resume_session(path)
    resumed.prepare(resumed.engine)
    assert resumed.about["port"] == "/dev/ttyX"
    assert resumed.engine.status().step is StepKind.SOURCE
    resumed.engine.journal.close()


def test_a_session_without_its_settings_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    Session.create(path, {}).close()
    with pytest.raises(SessionError, match="lacks its settings"):
        resume_session(path)


def test_what_the_bench_has_asked_for_is_asked_for_again(tmp_path: Path) -> None:
    """Left in the middle of it, the session goes on with the same poses, some of them taken."""
    parts = pieces(recorded(), 3000)
    path, middle = tmp_path / "a.imucal", len(parts) // 2
    live = begin_session(path, None, settings())
    live.command("start")
    _receive(live, 0, middle // 2)
    live.command("goto", "result")
    live.command(
        "measure", requests_to_text([pose_asked(name, "to know") for name in (*FACES, *CORNERS)])
    )
    _receive(live, middle // 2, middle)
    live.journal.close()
    status = live.status()
    assert status.step is StepKind.MORE
    assert status.done
    assert status.missing
    resumed = resume_session(path)
    engine = resumed.engine
    resumed.prepare(engine)
    assert engine.status() == status
    assert same(engine.collected(), live.collected())
    engine.journal.close()
