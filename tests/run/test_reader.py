"""The reader's thread on a real pseudo-terminal: reads, loses, finds again, stops at once."""

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from imucal_wizard.acquire.transport import Transport
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.reader import Pump, Reader
from imucal_wizard.run.session_replay import begin_session, resume_session
from imucal_wizard.sessions import Session
from imucal_wizard.simulate.imu import VirtualImu
from tests.acquire.ports import Pty, link
from tests.acquire.streams import contract
from tests.run.performance import same, settings
from tests.waiting import AT_ONCE, wait_for

Run = Callable[[Reader], Reader]


@pytest.fixture
def run() -> Iterator[Run]:
    """Starts readers, and stops them whatever happens."""
    running: list[Reader] = []

    def start(reader: Reader) -> Reader:
        running.append(reader)
        reader.start()
        return reader

    yield start
    for reader in running:
        reader.stop()


def _kinds(reader: Reader) -> list[EventKind]:
    return [event.kind for event in reader.snapshot().events]


def _print(device: Pty, count: int, first: int = 0) -> None:
    """Print the header and so many lines, in pieces that a terminal takes."""
    header, *rows = contract(first + count).splitlines(keepends=True)
    data = header + b"".join(rows[first:])
    for start in range(0, len(data), 2000):
        device.send(data[start : start + 2000])


def test_the_virtual_imu_is_read_written_down_and_taken_up_again(tmp_path: Path, run: Run) -> None:
    path = tmp_path / "a.imucal"
    imu = VirtualImu(speed=100.0, seed=3, following=True)
    reader = run(Reader(imu, begin_session(path, None, settings())))
    reader.command("start")
    wait_for(lambda: reader.snapshot().status.step is StepKind.RESULT)
    reader.stop()
    wait_for(lambda: reader.finished)
    stream = reader.snapshot().stream
    assert (stream.lost, stream.malformed) == (0, 0)
    assert stream.rate == pytest.approx(100.0)
    measured = reader.collected()
    assert len([one for one in measured.rotations if one.axis and not one.problem]) >= 6
    resumed = resume_session(path)
    resumed.prepare(resumed.engine)
    assert same(resumed.engine.collected(), measured)
    resumed.engine.journal.close()


def test_it_stops_at_once_and_closes_the_session(tmp_path: Path, pty: Pty, run: Run) -> None:
    path = tmp_path / "a.imucal"
    reader = run(Reader(Pump(Transport(pty.path)), begin_session(path)))
    wait_for(lambda: reader.snapshot().stream.connected)
    _print(pty, 50)
    before = time.monotonic()
    reader.stop()
    assert time.monotonic() - before < AT_ONCE
    assert not any(thread.name == "Reader" for thread in threading.enumerate())
    Session.open(path).close()


def _begun(name: Path, pty: Pty, run: Run) -> Reader:
    """The wizard's reader of a device of this name, connected, with the first step begun."""
    engine = Engine(settings=settings())
    engine.command("start")
    reader = run(Reader(Pump(Transport(link(name, pty.path))), engine))
    wait_for(lambda: reader.snapshot().stream.connected)
    return reader


def test_a_device_that_goes_away_in_a_hold_loses_nothing_and_is_found_again(
    tmp_path: Path, pty: Pty, run: Run
) -> None:
    name = tmp_path / "device"
    reader = _begun(name, pty, run)
    _print(pty, 1200)
    wait_for(lambda: reader.snapshot().stream.samples == 1200)
    assert reader.snapshot().status.step is StepKind.UP_DOWN
    before = reader.collected()
    assert len(before.holds) == 1
    name.unlink()  # as the system does; another terminal may get the number of this one
    pty.unplug()
    wait_for(lambda: EventKind.LINK_LOST in _kinds(reader))
    stream = reader.snapshot().stream
    assert not stream.connected
    assert stream.problem
    assert len(reader.collected().holds) == 1
    back = Pty()
    link(name, back.path)
    wait_for(lambda: EventKind.LINK_BACK in _kinds(reader))
    _print(back, 300, first=2000)
    wait_for(lambda: reader.snapshot().stream.samples >= 1499)
    stream = reader.snapshot().stream
    assert (stream.connected, stream.problem) == (True, "")
    assert reader.snapshot().status.step is StepKind.UP_DOWN
    assert reader.collected().holds[0].start == before.holds[0].start
    back.unplug()


def test_a_device_that_goes_away_while_it_settles_is_told_that_this_begins_again(
    tmp_path: Path, pty: Pty, run: Run
) -> None:
    """Settling is one rest; the part before the gap is not kept."""
    name = tmp_path / "device"
    reader = _begun(name, pty, run)
    _print(pty, 500)
    wait_for(lambda: reader.snapshot().status.progress[0] > 3.0)
    name.unlink()
    pty.unplug()
    wait_for(lambda: EventKind.LINK_LOST in _kinds(reader))
    assert "all measurements" not in reader.snapshot().stream.problem
    assert "an unfinished one begins again" in reader.snapshot().stream.problem
    assert reader.snapshot().status.progress[0] == 0.0
    back = Pty()
    link(name, back.path)
    wait_for(lambda: EventKind.LINK_BACK in _kinds(reader))
    _print(back, 300, first=2000)
    wait_for(lambda: reader.snapshot().stream.samples >= 799)
    wait_for(lambda: reader.snapshot().status.progress[0] > 2.0)
    assert reader.snapshot().status.progress[0] <= 3.0
    back.unplug()


def test_a_port_that_is_not_there_yet_is_waited_for(tmp_path: Path, pty: Pty, run: Run) -> None:
    name = tmp_path / "device"
    reader = run(Reader(Pump(Transport(str(name))), Engine()))
    wait_for(lambda: str(name) in reader.snapshot().stream.problem)
    assert not reader.snapshot().stream.connected
    link(name, pty.path)
    wait_for(lambda: reader.snapshot().stream.connected)
    assert reader.snapshot().stream.problem == ""


def test_what_was_measured_before_is_there_before_the_port_is_read(
    tmp_path: Path, pty: Pty, run: Run
) -> None:
    path = tmp_path / "a.imucal"
    engine = begin_session(path, None, settings())
    engine.command("start")
    engine.receive(contract(1200), 0.0)
    engine.journal.close()
    resumed = resume_session(path)
    reader = run(Reader(Pump(Transport(pty.path)), resumed.engine, prepare=resumed.prepare))
    wait_for(lambda: reader.snapshot().stream.connected)
    assert reader.snapshot().status.step is StepKind.UP_DOWN
    _print(pty, 300, first=2000)
    wait_for(lambda: reader.snapshot().stream.samples >= 1499)
    reader.stop()
    with Session.open(path) as session:
        arrivals = [arrival for _, arrival, _ in session.raw()]
    assert arrivals == sorted(arrivals)


def test_the_share_that_is_read_again_is_shown_and_a_stop_ends_it(pty: Pty, run: Run) -> None:
    def prepare(_: Engine, progress: Callable[[float], None]) -> float:
        while True:  # until what it tells ends it
            progress(0.374)

    reader = run(Reader(Pump(Transport(pty.path)), Engine(), prepare=prepare))
    wait_for(lambda: "37% done" in reader.snapshot().stream.problem)
    assert reader.snapshot().status.step is StepKind.SOURCE
    before = time.monotonic()
    reader.stop()
    assert time.monotonic() - before < AT_ONCE
    wait_for(lambda: not any(thread.name == "Reader" for thread in threading.enumerate()))


def test_nothing_is_drawn_for_a_screen_that_does_not_look(pty: Pty, run: Run) -> None:
    reader = run(Reader(Pump(Transport(pty.path)), Engine()))
    wait_for(lambda: reader.snapshot().stream.connected)
    wait_for(lambda: not reader._asked.is_set())
    serial = reader._published.serial
    for first in range(0, 500, 100):
        _print(pty, 100, first)
        reader.collected()
    assert reader._published.serial == serial
    wait_for(lambda: reader.snapshot().stream.samples >= 490)
