"""Clocks that wrap, jump, restart, stumble or are missing."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.errors import RecordingError
from imucal_wizard.readings import FloatArray
from imucal_wizard.recordings import RecordingOptions, read
from imucal_wizard.recordings.timeline import from_column, from_counter, guess_unit
from tests.recordings.lines import samples, write


def _ticks(count: int = 1000, step: float = 10_000.0) -> FloatArray:
    return np.arange(count, dtype=np.float64) * step


@pytest.mark.parametrize(("unit", "step"), [("us", 10_000.0), ("ms", 10.0)])
def test_a_clock_of_32_bits_that_wraps_is_put_together(unit: str, step: float) -> None:
    ticks = (_ticks(step=step) + 2.0**32 - 400 * step) % 2.0**32
    line = from_column(ticks, unit, None)
    np.testing.assert_allclose(np.diff(line.time), 0.01, rtol=1e-6)
    assert line.warnings == ("the device's clock began again at zero once; put together",)


@pytest.mark.parametrize("full", [2.0**32 / 1e6, 86_400.0])
def test_seconds_of_a_clock_that_was_full_or_passed_midnight_are_put_together(full: float) -> None:
    line = from_column((_ticks(step=0.01) + full - 4.0) % full, "s", None)
    np.testing.assert_allclose(np.diff(line.time), 0.01, rtol=1e-6)
    assert line.warnings == ("the time began again at zero once; put together",)


def test_milliseconds_without_leading_zeros_are_not_taken_for_decimals(tmp_path: Path) -> None:
    values = samples()[:, 1:4]
    stamps = [f"2025-6-28 7:50:{i // 100}.{i % 100 * 10}" for i in range(len(values))]
    rows = [f"0x50\t{s}\t" + "\t".join(map(str, v)) for s, v in zip(stamps, values, strict=True)]
    path = tmp_path / "wit.txt"
    path.write_text("\n".join(["address\ttime\tax(m/s²)\tay(m/s²)\taz(m/s²)", *rows, ""]))
    readings = read([path])
    np.testing.assert_allclose(np.diff(readings.accelerometer.time), 0.01, atol=1e-4)


def test_a_counter_of_16_bits_that_wraps_keeps_the_samples_that_are_missing() -> None:
    numbers = np.delete((np.arange(1000.0) + 65_000) % 65_536, 200)
    line = from_counter(numbers, 100.0)
    assert line.time[-1] == pytest.approx(9.99)
    assert any("about 1 samples are missing in 1 gap," in text for text in line.warnings)


def test_single_wrong_times_are_left_out() -> None:
    time = np.arange(100) / 100.0
    time[40], time[70] = 99.0, 0.0
    line = from_column(time, "s", None)
    assert len(line.time) == 98
    assert np.all(np.diff(line.time) > 0)
    assert 40 not in line.rows
    assert any("2 samples whose time jumps" in text for text in line.warnings)


def test_what_follows_a_restart_of_the_clock_is_set_after_a_gap() -> None:
    time = np.concatenate([np.arange(500), np.arange(500)]) / 100.0
    line = from_column(time, "s", None)
    assert len(line.time) == 1000
    assert np.all(np.diff(line.time) > 0)
    assert np.diff(line.time).max() == pytest.approx(1.0)
    assert any("goes back once, first after 4.99" in text for text in line.warnings)
    assert not any("missing" in text for text in line.warnings)


def test_missing_samples_are_counted() -> None:
    time = np.delete(np.arange(1000) / 100.0, slice(300, 350))
    line = from_column(time, "s", None)
    assert any("about 50 samples are missing in 1 gap," in text for text in line.warnings)


def test_times_of_a_coarse_clock_are_spread_evenly() -> None:
    ticks = np.floor(np.arange(1666) / 1.666)
    line = from_column(ticks, "ms", None)
    steps = np.diff(line.time)
    assert np.all(steps > 0)
    assert steps.mean() == pytest.approx(1 / 1666, rel=1e-3)
    assert any("coarse clock" in text for text in line.warnings)


def test_times_of_arrival_are_told_from_loss() -> None:
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.choice([0.002, 0.03], 1000, p=[0.7, 0.3]))
    line = from_column(time, "s", None)
    assert any("jitter" in text for text in line.warnings)
    assert not any("missing" in text for text in line.warnings)


@pytest.mark.parametrize(
    ("step", "unit"),
    [(0.01, "s"), (10.0, "ms"), (1.0, "ms"), (0.6, "ms"), (10_000.0, "us"), (1e6, "ns")],
)
def test_the_unit_of_a_time_column_is_the_one_with_a_plausible_rate(step: float, unit: str) -> None:
    found, says = guess_unit(_ticks(step=step), None)
    assert found == unit
    assert f"taken as {unit}" in says[0]


def test_a_time_column_without_a_plausible_unit_is_asked_for() -> None:
    with pytest.raises(RecordingError, match=r"t\[ms\]"):
        guess_unit(np.zeros(10), None)


def test_a_rate_that_contradicts_the_times_is_not_used(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples())
    readings = read([path], RecordingOptions(rate=50.0))
    assert readings.accelerometer.rate == pytest.approx(100.0)
    assert any("--rate 50 was not used" in text for text in readings.warnings)


def test_a_time_of_day_is_the_time_where_there_is_no_better_one(tmp_path: Path) -> None:
    """As OpenLog Artemis prints it: date, time of day in hundredths, mg, deg/s, a last comma."""
    rows = [
        f"01/07/2000,16:{18 + n // 6000:02d}:{n % 6000 / 100:05.2f},{x:.2f},{y:.2f},{z + 1000:.2f},"
        for n, (x, y, z) in enumerate(np.random.default_rng(3).normal(0, 2, (400, 3)))
    ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["rtcDate,rtcTime,aX,aY,aZ,", *rows, ""]))
    readings = read([path])
    assert readings.accelerometer.rate == pytest.approx(100.0)
    assert readings.accelerometer.time[0] == pytest.approx(16 * 3600 + 18 * 60)
    assert np.median(readings.accelerometer.values[:, 2]) == pytest.approx(9.81, abs=0.01)


def test_samples_without_a_time_are_left_out(tmp_path: Path) -> None:
    values = samples()
    values[10, 0] = np.nan
    assert len(read([write(tmp_path / "a.csv", values)])) == 399


@pytest.mark.parametrize(
    ("time", "says"),
    [
        (np.zeros(200), "stands still at 0"),
        (np.arange(200)[::-1] / 100.0, "goes back in 100% of its steps"),
        (np.random.default_rng(1).permutation(200) / 100.0, "goes back in"),
    ],
)
def test_a_column_that_is_no_time_is_refused_or_replaced_by_the_rate(
    time: FloatArray, says: str
) -> None:
    with pytest.raises(RecordingError, match=says):
        from_column(time, "s", None)
    line = from_column(time, "s", 100.0)
    np.testing.assert_allclose(np.diff(line.time), 0.01)
    assert says in line.warnings[0]


def test_a_clock_that_was_set_has_not_lost_a_thousand_million_samples() -> None:
    time = np.arange(200) / 100.0
    time[100:] += 1e7
    (warning,) = from_column(time, "s", None).warnings
    assert "jumps by 1e+07 s after 0.99 s" in warning


@pytest.mark.parametrize(("unit", "step"), [("us", 0.01), ("s", 100.0)])
def test_a_unit_of_time_that_cannot_be_is_refused(unit: str, step: float) -> None:
    with pytest.raises(RecordingError, match=f"the times in {unit} would mean"):
        from_column(_ticks(step=step), unit, None)


def test_many_samples_that_are_missing_are_no_jitter() -> None:
    time = np.delete(np.arange(2000) / 100.0, np.random.default_rng(0).integers(0, 2000, 300))
    line = from_column(time, "s", None)
    assert any("samples are missing in" in text for text in line.warnings)
    assert not any("jitter" in text for text in line.warnings)
