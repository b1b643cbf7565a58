"""What is told is on the disk, and the disk changes nothing but when it is told."""

import functools
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import settings as examples
from hypothesis import strategies as st

from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.errors import SessionError
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.run import journal
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.journal import Journal
from imucal_wizard.run.reader import Reader
from imucal_wizard.run.session_replay import SessionReplay
from imucal_wizard.run.snapshot import Snapshot
from imucal_wizard.sessions import KeptSession, Session
from imucal_wizard.simulate.imu import VirtualImu
from tests.run.performance import pieces, recorded, same, settings
from tests.waiting import wait_for

PIECE = 8000


class SlowSession(Session):
    """A session on a disk that needs some time for each commit."""

    delay: Callable[[], float] = staticmethod(lambda: 0.0)

    def commit(self) -> None:
        """Commit after the delay."""
        time.sleep(self.delay())
        super().commit()


def session(path: Path, delay: Callable[[], float] | None = None) -> SlowSession:
    """A new session, which replays with the settings of the performance."""
    about = {"asked": StreamSetup().to_json(), "settings": settings().to_json(), "created": 0.0}
    made = SlowSession.create(path, about)
    assert isinstance(made, SlowSession)
    if delay is not None:
        made.delay = delay
    return made


def perform(engine: Engine, look: Callable[[Snapshot], None]) -> None:
    """A procedure in which a hold is taken back; a screen looks after each piece."""
    engine.command("start")
    for number, (arrival, data) in enumerate(pieces(recorded(), PIECE)):
        if number == 20:
            engine.command("undo")
        engine.receive(data, arrival)
        look(engine.snapshot())
    engine.command("goto", "result")
    look(engine.snapshot())


@functools.cache
def undisturbed() -> Engine:
    """The same without a session."""
    engine = Engine(settings=settings())
    perform(engine, lambda _: None)
    return engine


def on_disk(path: Path) -> tuple[int, int, str]:
    """Number of events and commands in the file and the step, as another program reads them."""
    with closing(sqlite3.connect(path)) as connection:
        events, commands = (
            int(connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0])  # noqa: S608 - two names
            for table in ("event", "command")
        )
        row = connection.execute("SELECT value FROM meta WHERE key = 'step'").fetchone()
    return events, commands, "" if row is None else row[0].strip('"')


def replayed(path: Path) -> Collected:
    """The measurements of a session file, from its bytes and commands."""
    with KeptSession.look(path) as kept:
        past = SessionReplay(kept)
        engine = past.engine()
        past.replay(engine)
    return engine.collected()


@examples(max_examples=2, deadline=None)
@given(delays=st.lists(st.floats(0.0, 0.2), min_size=1, max_size=20), seed=st.integers(0, 99))
@pytest.mark.study
def test_a_slow_disk_changes_no_hold_and_nothing_is_told_before_its_commit(
    tmp_path_factory: pytest.TempPathFactory, delays: list[float], seed: int
) -> None:
    path = tmp_path_factory.mktemp("slow") / f"{seed}.imucal"
    left = iter(delays * 1000)
    engine = Engine(settings=settings(), journal=Journal(session(path, lambda: next(left))))

    def look(shown: Snapshot) -> None:
        events, _, _ = on_disk(path)
        assert shown.event_count <= events

    perform(engine, look)
    engine.close()
    events, commands, step = on_disk(path)
    assert (commands, step) == (3, "result")
    assert engine.snapshot().event_count == events == undisturbed().snapshot().event_count
    assert engine.snapshot().events == undisturbed().snapshot().events
    assert same(engine.collected(), undisturbed().collected())
    assert same(replayed(path), undisturbed().collected())


def test_the_screen_keeps_the_status_before_until_the_disk_has_the_hold(tmp_path: Path) -> None:
    """A disk that stands still holds back every decision, and nothing else."""
    moves = threading.Event()
    path = tmp_path / "a.imucal"
    writer = Journal(session(path, lambda: 0.0 if moves.wait() else 1.0))
    engine = Engine(settings=settings(), journal=writer)
    seen: list[Snapshot] = []
    perform(engine, seen.append)
    assert engine.step is StepKind.RESULT
    assert {one.status.step for one in seen} == {StepKind.SOURCE}
    assert {(one.event_count, one.status.holds) for one in seen} == {(0, 0)}
    assert seen[-1].stream.samples == engine.samples
    assert seen[-1].traces.shape == undisturbed().snapshot().traces.shape
    moves.set()
    wait_for(lambda: writer.written == writer.passed)
    assert engine.snapshot().status == undisturbed().snapshot().status
    engine.close()


def test_a_resumed_session_shows_where_it_was_left_while_the_disk_stands_still(
    tmp_path: Path,
) -> None:
    moves = threading.Event()
    engine, sent = Engine(settings=settings()), pieces(recorded(), PIECE)
    engine.command("start")
    for arrival, data in sent[: len(sent) // 2]:
        engine.receive(data, arrival)
    before = engine.status()
    engine.continue_in(
        Journal(session(tmp_path / "a.imucal", lambda: 0.0 if moves.wait() else 1.0))
    )
    for arrival, data in sent[len(sent) // 2 :]:
        engine.receive(data, arrival)
    assert engine.status().holds > before.holds > 0
    assert engine.snapshot().status.holds == before.holds
    moves.set()
    wait_for(lambda: engine.snapshot().status.holds > before.holds)
    engine.close()


def test_the_operator_is_told_what_the_screen_waits_for(tmp_path: Path) -> None:
    moves, now = threading.Event(), [0.0]
    slow = session(tmp_path / "a.imucal", lambda: 0.0 if moves.wait() else 1.0)
    engine = Engine(journal=Journal(slow, lambda: now[0]))
    engine.receive(b"1,2,3\n", 0.0)
    assert engine.snapshot().stream.problem == ""
    now[0] = 3.0
    engine.idle(0.1)
    engine.receive(b"1,2,3\n", 0.2)
    assert "the session is waiting for the disk for 3 s" in engine.snapshot().stream.problem
    moves.set()
    engine.close()
    assert engine.snapshot().stream.unwritten == ""


def test_a_full_disk_ends_the_run_and_all_of_it_is_written_to_another_place(
    tmp_path: Path,
) -> None:
    path, other = tmp_path / "a.imucal", tmp_path / "elsewhere" / "b.imucal"
    kept = session(path)
    pages = kept._connection.execute("PRAGMA page_count").fetchone()[0]
    kept._connection.execute(f"PRAGMA max_page_count = {pages + 30}")
    engine = Engine(settings=settings(), journal=Journal(kept))
    reader = Reader(VirtualImu(speed=30.0, seed=3, following=True), engine)
    reader.start()
    reader.command("start")
    wait_for(lambda: reader.finished)
    shown = reader.snapshot()
    assert "the disk is full" in shown.stream.problem
    assert "no longer being saved" in shown.stream.unwritten
    assert shown.event_count <= on_disk(path)[0]
    assert not shown.stream.connected
    reader.rescue(other)
    assert same(replayed(other), reader.collected())
    with KeptSession.look(other) as whole, KeptSession.look(path) as part:
        assert len(list(whole.raw())) > len(list(part.raw())) > 0


def test_a_disk_that_cannot_keep_up_has_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journal, "MAX_WAITING_BYTES", 1 << 16)
    moves = threading.Event()
    writer = Journal(session(tmp_path / "a.imucal", lambda: 0.0 if moves.wait() else 1.0))
    for number in range(17):
        writer.raw(float(number), bytes(1 << 12))
    with pytest.raises(SessionError, match="too slow"):
        writer.raw(17.0, b"late")
    writer.close()
    assert "too slow" in writer.problem
    moves.set()


LEFT = """
import sys, threading, time
from pathlib import Path
from imucal_wizard.run.session_replay import begin_session
from imucal_wizard.sessions import Session
commit = Session.commit
engine = begin_session(Path(sys.argv[1]))
Session.commit = lambda self: (time.sleep(0.5), commit(self))
engine.command("start")
engine.receive(b"the last bytes", 1.0)
if sys.argv[2] == "closing":
    threading.Thread(target=engine.close, daemon=True).start()
"""


@pytest.mark.parametrize("ends", ["closing", "without closing"])
def test_a_program_that_ends_waits_for_the_last_commit(tmp_path: Path, ends: str) -> None:
    path = tmp_path / "a.imucal"
    subprocess.run([sys.executable, "-c", LEFT, str(path), ends], check=True)
    with Session.open(path) as kept:
        assert [data for _, _, data in kept.raw()] == [b"the last bytes"]
        assert [command.name for command in kept.commands()] == ["start"]


def test_received_bytes_are_on_the_disk_without_a_decision(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    writer = Journal(session(path))
    writer.raw(0.0, b"first")
    wait_for(lambda: writer.written == writer.passed == 1)
    with KeptSession.look(path) as kept:
        assert [data for _, _, data in kept.raw()] == [b"first"]
    writer.close()


def test_a_session_that_nobody_closes_is_closed_at_the_end_of_the_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As one is whose program is left while its source is being opened."""
    at_the_end: list[Callable[[], None]] = []
    monkeypatch.setattr("atexit.register", at_the_end.append)
    path = tmp_path / "a.imucal"
    kept = Journal(Session.create(path, {"asked": {}, "setup": {}, "settings": {}}))
    assert len(list(tmp_path.iterdir())) > 1  # the log, which SQLite removes when it closes a file
    for close in at_the_end:
        close()
    assert list(tmp_path.iterdir()) == [path]
    assert kept.written == 0


def test_open_sessions_can_be_closed_without_the_exit_functions(tmp_path: Path) -> None:
    """As a signal does that ends the process while its source is being opened."""
    path = tmp_path / "a.imucal"
    kept = Journal(Session.create(path, {"asked": {}, "setup": {}, "settings": {}}))
    assert len(list(tmp_path.iterdir())) > 1
    journal.close_journals()
    assert list(tmp_path.iterdir()) == [path]
    kept.close()  # as a source does that is released later
    journal.close_journals()
