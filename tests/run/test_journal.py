"""A disk that is full for a while: nothing measured is lost as long as the program runs."""

from pathlib import Path

import pytest

from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.guide.kinds import EventKind
from imucal_wizard.run import journal
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.journal import WRITE_RETRY_SECONDS, Journal
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.session_replay import SessionReplay
from imucal_wizard.sessions import Session
from tests.acquire.streams import contract
from tests.run.performance import pieces, recorded, same, settings


class _Clock:
    """Seconds that pass when the test says so, and a little whenever somebody looks."""

    def __init__(self) -> None:
        self.now = 0.0
        self.look = 0.0

    def __call__(self) -> float:
        """The time."""
        self.now += self.look
        return self.now


class _Disk:
    """A session on a disk that can be filled and cleared."""

    def __init__(self, path: Path) -> None:
        self.clock = _Clock()
        about = {"asked": StreamSetup().to_json(), "settings": settings().to_json()}
        self.session = Session.create(path, about, clock=self.clock)
        self.journal = Journal(self.session, self.clock)

    def fill(self) -> None:
        """The file may not grow by a page."""
        self._limit(self._pages("page_count"))

    def leave(self, pages: int) -> None:
        """The file may grow by a few pages yet."""
        self._limit(self._pages("page_count") + pages)

    def clear(self) -> None:
        """There is room again."""
        self._limit(1 << 30)

    def _limit(self, pages: int) -> None:
        self.session._connection.execute(f"PRAGMA max_page_count = {pages}")

    def _pages(self, what: str) -> int:
        return int(self.session._connection.execute(f"PRAGMA {what}").fetchone()[0])


def _performed(disk: _Disk, full: range, step: ProcedureSettings) -> Engine:
    """A whole procedure during which the disk is full for some of the pieces."""
    engine = Engine(settings=step, journal=disk.journal)
    engine.command("start")
    for number, (arrival, data) in enumerate(pieces(recorded(), 2500)):
        if number == full.start:
            disk.fill()
        if number == full.stop:
            disk.clear()
        disk.clock.now += 0.3
        engine.receive(data, arrival)
    return engine


def test_what_came_while_the_disk_was_full_is_written_when_there_is_room(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    disk = _Disk(path)
    engine = _performed(disk, range(40, 90), settings())
    kinds = [event.kind for event in engine.snapshot().events]
    assert EventKind.WRITTEN_AGAIN in kinds
    assert engine.snapshot().stream.problem == ""
    engine.close()
    with Session.open(path) as session:
        assert b"".join(data for _, _, data in session.raw()) == recorded()
        past = SessionReplay(session)
        again = past.engine()
        past.replay(again)
        count = session._connection.execute("SELECT count(*) FROM hold").fetchone()[0]
    assert same(again.collected(), engine.collected())
    assert count == len(engine.collected().holds)


def test_a_full_disk_is_said_at_once_and_does_not_stop_the_measuring(tmp_path: Path) -> None:
    disk = _Disk(tmp_path / "a.imucal")
    engine = Engine(journal=disk.journal)
    disk.fill()
    data = contract(600)
    for start in range(0, len(data), 5000):
        engine.receive(data[start : start + 5000], start / 8000)
    stream = engine.snapshot().stream
    assert "the disk is full" in stream.problem
    assert "tried again every 5 s" in stream.problem
    assert stream.unwritten
    assert stream.samples == 600
    assert [event.kind for event in engine.snapshot().events].count(EventKind.WARNING) == 1


def test_writing_is_retried_now_and_then_even_without_new_data(tmp_path: Path) -> None:
    disk = _Disk(tmp_path / "a.imucal")
    engine = Engine(journal=disk.journal)
    disk.fill()
    engine.receive(contract(600), 0.0)
    disk.clear()
    disk.clock.now += 0.9 * WRITE_RETRY_SECONDS
    engine.idle(1.0)
    assert engine.snapshot().stream.unwritten
    disk.clock.now += 0.2 * WRITE_RETRY_SECONDS
    engine.idle(2.0)
    assert engine.snapshot().stream.unwritten == ""


def test_the_end_is_written_with_a_last_attempt_or_said_to_be_missing(tmp_path: Path) -> None:
    for full in (False, True):
        path = tmp_path / f"{full}.imucal"
        disk = _Disk(path)
        disk.fill()
        disk.journal.raw(0.0, bytes(100_000))
        assert disk.journal.problem
        if not full:
            disk.clear()
        disk.journal.close()
        assert bool(disk.journal.problem) == full
        with Session.open(path) as session:
            assert session.last_raw == (0 if full else 1)


def test_what_waits_in_memory_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journal, "MAX_PENDING_BYTES", 1 << 18)
    disk = _Disk(tmp_path / "a.imucal")
    disk.fill()
    for number in range(20):
        disk.clock.now += WRITE_RETRY_SECONDS
        disk.journal.raw(float(number), bytes(1 << 14))
    assert "no longer being saved" in disk.journal.problem
    disk.clear()
    disk.clock.now += WRITE_RETRY_SECONDS
    disk.journal.raw(20.0, b"late")
    assert "no longer being saved" in disk.journal.problem


@pytest.mark.parametrize("look", [0.0, 0.1, 0.6])
def test_a_disk_that_takes_a_part_gets_no_piece_twice(tmp_path: Path, look: float) -> None:
    """What was committed in the middle of an attempt is not written once more by the next."""
    path = tmp_path / "a.imucal"
    disk = _Disk(path)
    disk.fill()
    sent = [bytes([number]) * 3000 for number in range(60)]
    for number, data in enumerate(sent):
        disk.journal.raw(float(number), data)
    assert disk.journal.problem
    disk.clock.look = look
    for room in (4, 11, 9):
        disk.leave(room)
        disk.clock.now += WRITE_RETRY_SECONDS
        disk.journal.idle()
        assert disk.journal.problem
    disk.clear()
    disk.clock.now += WRITE_RETRY_SECONDS
    disk.journal.idle()
    assert disk.journal.problem == ""
    disk.journal.close()
    with Session.open(path) as session:
        assert [data for _, _, data in session.raw()] == sent
