"""A recording played at any speed gives what it gives in one piece."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.player import Player, ReadingsTape
from imucal_wizard.run.procedure_settings import ProcedureSettings
from tests.run.performance import recorded, same, settings
from tests.waiting import wait_for


def _readings(tmp_path: Path) -> Readings:
    path = tmp_path / "performed.csv"
    path.write_bytes(recorded())
    return read_files([path])


def _at_once(readings: Readings) -> Collected:
    engine = Engine(settings=settings())
    engine.command("start")
    engine.receive_readings(readings, readings.accelerometer.rate)
    engine.end()
    return engine.collected()


@pytest.mark.parametrize("speed", [60.0, 300.0, float("inf")])
def test_speed_changes_nothing_in_the_result(tmp_path: Path, speed: float) -> None:
    readings = _readings(tmp_path)
    player = Player(ReadingsTape(readings), Engine(settings=settings()), speed)
    player.start()
    player.command("start")
    wait_for(lambda: player.snapshot().finished)
    assert player.snapshot().status.step is StepKind.RESULT
    assert same(player.collected(), _at_once(readings))
    player.stop()


def test_however_long_the_preview_was_looked_at_it_starts_at_the_first_sample(
    tmp_path: Path,
) -> None:
    readings = _readings(tmp_path)
    player = Player(ReadingsTape(readings), Engine(settings=settings()), float("inf"))
    player.start()
    wait_for(lambda: player.snapshot().stream.samples == len(readings))
    assert player.snapshot().status.step is StepKind.SOURCE
    assert not player.finished
    player.command("start")
    wait_for(lambda: player.snapshot().finished)
    assert same(player.collected(), _at_once(readings))
    player.stop()


def _restless(readings: Readings) -> Readings:
    """The same without most of the rest at its beginning: no ten seconds, and a hold to lose."""
    begin = readings.accelerometer.time[0] + 16.0
    end = readings.accelerometer.time[-1] + 1.0
    assert readings.gyroscope is not None
    return Readings(
        readings.accelerometer.between(begin, end), readings.gyroscope.between(begin, end)
    )


def test_a_recording_without_a_rest_at_its_beginning_loses_no_hold(tmp_path: Path) -> None:
    """The noise is that of a shorter rest, and the holds in which it was sought are taken too."""
    whole = _readings(tmp_path)
    player = Player(
        ReadingsTape(_restless(whole)), Engine(settings=ProcedureSettings()), float("inf")
    )
    player.start()
    player.command("start")
    wait_for(lambda: player.snapshot().finished)
    assert any(
        "played again from its beginning" in text for text in player.snapshot().stream.warnings
    )
    starts = [hold.start for hold in player.collected().holds]
    expected = [hold.start for hold in _at_once(whole).holds if hold.start > 21.0]
    assert min(starts) < 17.0
    assert len([start for start in starts if start > 21.0]) == len(expected)
    player.stop()


def test_commands_are_obeyed_after_the_end(tmp_path: Path) -> None:
    player = Player(ReadingsTape(_readings(tmp_path)), Engine(settings=settings()), float("inf"))
    player.start()
    player.command("start")
    wait_for(lambda: player.snapshot().finished)
    assert player.snapshot().status.step is StepKind.RESULT
    player.command("validate")
    wait_for(lambda: player.snapshot().status.step is not StepKind.RESULT)
    assert player.snapshot().status.step is StepKind.VALIDATE
    player.stop()


def test_a_gyroscope_with_times_of_its_own_is_brought_to_the_accelerometers(
    tmp_path: Path,
) -> None:
    whole = _readings(tmp_path)
    gyroscope = whole.gyroscope
    assert gyroscope is not None
    fewer = Series(gyroscope.time[::2], gyroscope.values[::2], gyroscope.unit)
    engine = Engine(settings=settings())
    tape = ReadingsTape(Readings(whole.accelerometer, fewer))
    assert not tape.play(engine, np.inf)
    stream = engine.snapshot().stream
    assert stream.samples == len(whole)
    assert any("interpolated to the accelerometer's times" in text for text in stream.warnings)


def test_a_speed_of_zero_is_refused(tmp_path: Path) -> None:
    tape = ReadingsTape(_readings(tmp_path))
    with pytest.raises(UsageError, match="above 0"):
        Player(tape, Engine(), 0.0)


def test_a_single_sample_cannot_be_played() -> None:
    one = Series(np.zeros(1), np.zeros((1, 3)), "m/s^2")
    with pytest.raises(RecordingError, match="too few samples"):
        ReadingsTape(Readings(one))
