"""The engine: the same bytes and commands make the same state, and every trouble has words."""

import functools
import math
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.acquire.intake import LINK_BREAK
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.limits.stillness import ROTATION_OVERLAP_SECONDS
from imucal_wizard.core.poses import FACES
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.plan import standard
from imucal_wizard.measurement.segmentation import rotations_between
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.session_replay import begin_session
from imucal_wizard.sessions import KeptSession, Session
from tests.acquire.streams import HEADER, at_rest, contract, printed
from tests.run.performance import pieces, recorded, same, settings


def _performed(size: int, engine: Engine | None = None) -> Engine:
    engine = engine or Engine(settings=settings())
    engine.command("start")
    for arrival, data in pieces(recorded(), size):
        engine.receive(data, arrival)
    engine.end()
    return engine


@functools.cache
def _whole() -> Engine:
    return _performed(len(recorded()))


def test_the_whole_procedure_is_followed() -> None:
    engine = _whole()
    assert engine.status().step is StepKind.RESULT
    collected = engine.collected()
    assert {hold.pose for hold in collected.holds} >= set(FACES)
    assert len([one for one in collected.rotations if one.axis and not one.problem]) >= 6


def test_rotations_are_cut_as_they_are_from_a_file(tmp_path: Path) -> None:
    """From the same holds: a motion that was kept longer would add the noise of samples at rest."""
    path = tmp_path / "performed.csv"
    path.write_bytes(recorded())
    readings = read_files([path])
    assert readings.gyroscope is not None
    live = [one for one in _whole().collected().rotations if one.problem is None]
    holds = _whole().collected().holds
    cut = rotations_between(holds, readings.gyroscope, readings.accelerometer)
    of_file = {(one.before.start, one.after.start): one for one in cut}
    assert len(live) >= 6
    for one in live:
        other = of_file[one.before.start, one.after.start]
        # a hold ends with the last block that was kept of it, and a motion begins with a block
        assert abs(len(one.time) - len(other.time)) <= round(2.0 * ROTATION_OVERLAP_SECONDS * 50.0)
        assert one.time[-1] == pytest.approx(other.time[-1], abs=1e-6)


@pytest.mark.parametrize("size", [97, 4096])
def test_the_result_does_not_depend_on_how_the_bytes_were_cut(size: int) -> None:
    engine = _performed(size)
    assert same(engine.collected(), _whole().collected())
    events = engine.snapshot().events
    assert events == _whole().snapshot().events


def test_looking_and_writing_down_change_nothing(tmp_path: Path) -> None:
    engine = begin_session(tmp_path / "a.imucal", None, settings())
    engine.command("start")
    for arrival, data in pieces(recorded(), 2000):
        engine.receive(data, arrival)
        engine.snapshot()
        engine.collected()
    engine.end()
    engine.journal.close()
    assert same(engine.collected(), _whole().collected())


def test_what_the_reader_notices_while_measuring_is_said_at_once() -> None:
    engine = Engine()
    engine.command("start")
    lines = printed(at_rest(1000))
    half = len(lines) // 2
    engine.receive(HEADER + lines[:half], 1.0)
    assert _warnings(engine) == []
    engine.receive(lines[half:].replace(b",9.8", b",?.8"), 6.0)
    assert any("cannot be read" in warning for warning in _warnings(engine))


def _warnings(engine: Engine) -> list[str]:
    events = engine.snapshot().events
    return [event.text for event in events if event.kind is EventKind.WARNING]


def test_a_command_before_the_first_sample_waits_for_it() -> None:
    engine = Engine()
    engine.command("start")
    assert engine.status().step is StepKind.SOURCE
    engine.receive(contract(200), 0.0)
    assert engine.status().step is StepKind.SETTLE


def test_an_unknown_command_is_told_and_harms_nothing() -> None:
    engine = Engine()
    engine.receive(contract(200), 0.0)
    engine.command("fly")
    events = engine.snapshot().events
    assert events[-1].kind is EventKind.WARNING
    assert "fly" in events[-1].text


def test_a_snapshot_shows_the_newest_values_and_is_the_same_until_something_happens() -> None:
    engine = Engine(source="a device")
    engine.receive(contract(300), 0.0)
    first = engine.snapshot()
    assert first.stream.source == "a device"
    assert first.stream.samples == 300
    assert first.stream.rate == pytest.approx(100.0)
    assert first.stream.gravity == pytest.approx(9.8, abs=0.05)
    assert first.stream.temperature == 24.5
    assert first.stream.digits == 6
    assert first.traces.shape == (150, 6)
    assert first.attitude is not None
    assert engine.snapshot() is first
    engine.command("start")
    assert engine.snapshot().serial == first.serial + 1


def test_what_the_stream_does_not_say_is_asked_for_and_then_read_from_the_beginning() -> None:
    lines = contract(300).split(b"\r\n", 1)[1]
    engine = Engine()
    engine.receive(b"t[s],ax,ay,az,gx,gy,gz,temp[degC]\r\n" + lines, 0.0)
    stream = engine.snapshot().stream
    assert "gyroscope unit" in stream.needs
    assert stream.problem
    assert stream.line
    engine.set_setup(StreamSetup(gyroscope_unit="deg/s"))
    stream = engine.snapshot().stream
    assert (stream.needs, stream.problem, stream.samples) == ((), "", 300)


def test_another_setup_in_the_middle_begins_the_procedure_again() -> None:
    engine = Engine()
    engine.command("start")
    engine.receive(contract(300), 0.0)
    serial = engine.snapshot().serial
    engine.set_setup(StreamSetup(accelerometer_unit="g"))
    assert engine.status().step is StepKind.SOURCE
    assert engine.snapshot().serial > serial
    assert "begins again" in engine.snapshot().events[-1].text


def test_silence_is_named_with_its_length_and_ends_with_the_next_data() -> None:
    engine = Engine()
    engine.receive(contract(200), 0.0)
    engine.idle(2.9)
    assert engine.snapshot().stream.problem == ""
    engine.idle(3.0)
    assert "no data for 3 s" in engine.snapshot().stream.problem
    engine.idle(4.2)
    assert "no data for 4 s" in engine.snapshot().stream.problem
    assert "baud rate" not in engine.snapshot().stream.problem  # what was read had the right one
    engine.receive(b"9.9,", 4.3)
    assert engine.snapshot().stream.problem == ""


def test_samples_of_the_time_in_which_a_device_was_away_do_not_count_as_lost() -> None:
    engine = Engine()
    lines = contract(900).splitlines(keepends=True)
    engine.receive(b"".join(lines[:300]), 0.0)
    engine.receive(LINK_BREAK, 8.0)
    engine.receive(b"".join(lines[800:]), 9.0)
    assert engine.snapshot().stream.lost == 0
    engine.receive(printed(at_rest(920)[905:]), 9.2)
    assert engine.snapshot().stream.lost == 5


def test_a_port_of_which_nothing_was_read_may_have_the_wrong_speed() -> None:
    engine = Engine()
    engine.idle(0.0)
    engine.idle(3.0)
    assert "is the baud rate right?" in engine.snapshot().stream.problem


def test_a_stream_that_stops_while_measuring_is_heard_and_so_is_its_return() -> None:
    """Nobody looks at the screen; in the source step somebody does."""
    for order, expected in (("start", [EventKind.STALLED, EventKind.FLOWING]), ("", [])):
        engine = Engine()
        if order:
            engine.command(order)
        engine.receive(contract(200), 0.0)
        for moment in (2.0, 3.1, 4.2, 9.0):
            engine.idle(moment)
        engine.receive(contract(201)[-90:], 9.5)
        engine.idle(9.6)
        kinds = [event.kind for event in engine.snapshot().events]
        assert [
            kind for kind in kinds if kind in (EventKind.STALLED, EventKind.FLOWING)
        ] == expected


def test_a_device_that_is_known_to_wait_is_not_called_silent() -> None:
    engine = Engine()
    engine.command("start")
    engine.receive(contract(200), 0.0)
    for moment in range(2, 60, 2):
        engine.idle(float(moment), expected=True)
    engine.idle(60.5)
    assert engine.snapshot().stream.problem == ""
    assert EventKind.STALLED not in [event.kind for event in engine.snapshot().events]


def test_bytes_of_a_wrong_speed_are_named() -> None:
    engine = Engine()
    garbage = bytes((17 * i * i + 128 * (i % 3)) % 256 for i in range(6000))
    engine.receive(garbage, 0.0)
    assert "speed" in engine.snapshot().stream.problem


def test_steps_holds_and_events_are_in_the_session(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    engine = _performed(5000, begin_session(path, None, settings(), source="x"))
    engine.journal.close()
    with Session.open(path) as session:
        about = session.meta()
        count = session._connection.execute("SELECT count(*) FROM hold").fetchone()[0]
        kinds = {row[0] for row in session._connection.execute("SELECT kind FROM event")}
    assert (about["step"], about["setup"]["format"]) == ("result", "csv")
    assert count == len(engine.collected().holds)
    assert {"hold-taken", "rotation-taken", "step-done"} <= kinds
    with KeptSession.look(path) as kept:
        assert b"".join(data for *_, data in kept.raw()) == recorded()


@pytest.mark.parametrize(("unit", "limit"), [("rad/s", 500.0), ("count", None)])
def test_a_range_in_degrees_per_second_says_nothing_of_counts(
    unit: str, limit: float | None
) -> None:
    engine = Engine(settings=ProcedureSettings(gyroscope_range=math.radians(500.0)))
    time = np.arange(100) / 100.0
    force, still = np.tile([0.0, 0.0, 9.8], (100, 1)), np.zeros((100, 3))
    engine.receive_readings(Readings(Series(time, force, "m/s^2"), Series(time, still, unit)))
    engine.command("goto", "rotations")
    rotation = engine.status().rotation
    assert rotation is not None
    assert rotation.range_limit == (None if limit is None else pytest.approx(limit))


def test_settings_survive_the_session() -> None:
    own = ProcedureSettings(standard(3, count_faces=True), 9.81744, 4.36)
    assert ProcedureSettings.from_json(own.to_json()) == own
