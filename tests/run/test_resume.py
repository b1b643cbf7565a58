"""A session taken up again stands where it ended, to the last bit, and goes on from there."""

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as cases
from hypothesis import strategies as st

from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.errors import SessionError
from imucal_wizard.core.poses import CORNERS, FACES
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.measurement.requests import requests_to_text
from imucal_wizard.run import engine as run_engine
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.session_replay import (
    MIN_RESUME_PAUSE_SECONDS,
    SessionReplay,
    begin_session,
    resume_session,
)
from imucal_wizard.sessions import KeptSession, Session
from imucal_wizard.sessions import checkpoint as checkpoints
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


@pytest.mark.parametrize("jump", [-60.0, -1.7e9, 1.7e9, 1e15, float("inf"), float("nan")])
def test_a_clock_that_has_jumped_counts_as_a_short_pause(tmp_path: Path, jump: float) -> None:
    """A board without a battery is in 1970 until a network tells it the time."""
    live = begin_session(tmp_path / "a.imucal", None, settings())
    _receive(live, 0, 20)
    live.journal.close()
    resumed = resume_session(tmp_path / "a.imucal")
    last = resumed.session.last_arrival
    assert last is not None
    start = resumed.prepare(resumed.engine, now=lambda: resumed.created + jump)
    assert start == last + MIN_RESUME_PAUSE_SECONDS
    resumed.engine.journal.close()


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
    assert 10 < len(shares) < 40
    assert shares == sorted(shares)
    assert 0.9 < shares[-1] <= 1.0


def test_an_interrupted_replay_closes_the_session(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    live = begin_session(path, None, settings())
    for number in range(200):
        live.receive(b"1,2,3\n", 0.01 * number)
    live.journal.close()

    def progress(share: float) -> None:
        raise KeyError(share)

    resumed = resume_session(path)
    with pytest.raises(KeyError):
        resumed.prepare(resumed.engine, progress)
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


def test_commands_that_fall_on_other_samples_are_told_once(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    begin_session(path, None, settings()).journal.close()
    with Session.open(path) as session:
        for index in (5, 7, 9):
            session.write_command(index, "start")
    resumed = resume_session(path)
    resumed.prepare(resumed.engine)
    texts = [event.text for event in resumed.engine.snapshot().events]
    assert texts == [
        "the session gives other samples than when it was recorded: check the measurements"
    ]
    resumed.engine.journal.close()


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


def _lines(own_time: bool) -> bytes:
    """The recorded lines, with the device's own time or timed by their arrival."""
    if own_time:
        return recorded()
    lines = recorded().splitlines(keepends=True)
    return b"".join(line.partition(b",")[2] for line in lines if not line.startswith(b"#"))


@cases(max_examples=2, deadline=None)
@given(
    own_time=st.booleans(),
    size=st.integers(1500, 6000),
    every=st.floats(1.0, 30.0),
    cut=st.floats(0.2, 1.0),
    orders=st.dictionaries(
        st.integers(5, 60),
        st.sampled_from(["undo", "repeat", "loosen", "skip", "back"]),
        max_size=4,
    ),
)
def test_a_session_resumes_from_a_checkpoint_as_from_its_first_byte(
    tmp_path_factory: pytest.TempPathFactory,
    own_time: bool,
    size: int,
    every: float,
    cut: float,
    orders: dict[int, str],
) -> None:
    path = tmp_path_factory.mktemp("kept") / "a.imucal"
    parts = pieces(_lines(own_time), size)
    end = round(cut * len(parts))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(run_engine, "CHECKPOINT_SECONDS", every)
        patched.setattr(run_engine, "CHECKPOINT_BYTES", 1 << 30)
        live = begin_session(path, None, settings())
        live.command("start")
        for number, (arrival, data) in enumerate(parts[:end]):
            if number in orders:
                live.command(orders[number])
            live.receive(data, arrival)
        live.close()
    with KeptSession.look(path) as kept:
        past = SessionReplay(kept)
        checkpoint = kept.checkpoint()
        assert checkpoint is not None
        first, quick = past.engine(), past.engine()
        for step in past.steps():
            past.replay_step(first, step)
        replayed = list(past.steps(checkpoint))
        past.replay(quick)
    assert len(replayed) < len(parts)
    for engine in (live, first):
        assert same(quick.collected(), engine.collected())
        assert quick.status() == engine.status()
        assert (quick.samples, quick.step) == (engine.samples, engine.step)
    for arrival, data in parts[end:]:
        first.receive(data, arrival)
        quick.receive(data, arrival)
    assert same(quick.collected(), first.collected())
    assert quick.status() == first.status()
    shown, expected = quick.snapshot(), first.snapshot()
    assert (shown.events, shown.stream) == (expected.events, expected.stream)
    assert np.array_equal(shown.traces, expected.traces, equal_nan=True)


@pytest.fixture(scope="module")
def checkpointed(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, Engine]:
    """The file of a session with a checkpoint, and the engine as it was left."""
    path = tmp_path_factory.mktemp("checkpointed") / "a.imucal"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(run_engine, "CHECKPOINT_SECONDS", 5.0)
        live = begin_session(path, None, settings())
        live.command("start")
        _receive(live, 0, 60)
        live.close()
    return path.read_bytes(), live


@pytest.mark.parametrize("spoil", ["state", "seal", "place", "program", "key", "table"])
def test_a_checkpoint_that_is_not_this_programs_own_is_not_loaded(
    checkpointed: tuple[bytes, Engine], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spoil: str
) -> None:
    path, (file, live) = tmp_path / "a.imucal", checkpointed
    path.write_bytes(file)
    with KeptSession.look(path) as kept:
        assert kept.checkpoint() is not None
    changes = {
        "state": "UPDATE checkpoint SET state = CAST(substr(state, 2) AS BLOB)",
        "seal": "UPDATE checkpoint SET seal = zeroblob(32)",
        "place": "UPDATE checkpoint SET after_raw = after_raw - 1",
        "table": "UPDATE checkpoint SET state = 7, after_raw = 'x'",
    }
    if spoil in changes:
        with closing(sqlite3.connect(path)) as connection:
            connection.execute(changes[spoil])
            connection.commit()
    else:
        monkeypatch.setattr(checkpoints, f"_{spoil}", lambda: b"another")
    with KeptSession.look(path) as kept:
        assert kept.checkpoint() is None
    resumed = resume_session(path)
    resumed.prepare(resumed.engine)
    assert same(resumed.engine.collected(), live.collected())
    assert resumed.engine.status() == live.status()
    resumed.engine.close()


def test_damage_before_a_checkpoint_is_told_and_costs_no_measurement(
    checkpointed: tuple[bytes, Engine], tmp_path: Path
) -> None:
    path, (whole, live) = tmp_path / "a.imucal", checkpointed
    path.write_bytes(whole)
    with KeptSession.look(path) as kept:
        first = next(data for _, _, data in kept.raw())
    file = bytearray(whole)
    page = file.index(first[:64]) // 4096 * 4096
    file[page : page + 4096] = bytes(4096)
    path.write_bytes(file)
    resumed = resume_session(path)
    with pytest.raises(SessionError, match="is damaged"):
        resumed.prepare(resumed.engine)
    with KeptSession.look(path) as kept:
        past = SessionReplay(kept)
        engine = past.engine()
        past.replay(engine)
        assert "lost are" in kept.damage
    assert same(engine.collected(), live.collected())
