"""What all readings of a file show, but its first rows do not."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.even_times import evenly_arrived, without_jitter
from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.limits.data_quality import RESTART_GAP_SECONDS
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.measurement.unsigned_counts import as_signed
from tests.acquire.files.lines import samples, write


def _counts(rng: np.random.Generator) -> FloatArray:
    """Counts of an accelerometer, 16,384 per g, and of a gyroscope, in two positions."""
    up = np.repeat([[0.0, 300.0, 16384.0], [-16384.0, -40.0, 10.0]], 200, axis=0)
    return np.round(np.hstack([up, np.zeros((400, 3))]) + rng.normal(0.0, 40.0, (400, 6)))


@pytest.mark.parametrize("bits", [16, 32])
def test_negative_counts_that_were_written_as_unsigned_ones_are_read(
    tmp_path: Path, bits: int
) -> None:
    values = _counts(np.random.default_rng(3))
    path = write(tmp_path / "a.csv", np.mod(values, 2**bits), "ax,ay,az,gx,gy,gz")
    readings = read_files([path], RecordingOptions(rate=100.0))
    assert readings.gyroscope is not None
    np.testing.assert_array_equal(readings.accelerometer.values, values[:, :3])
    np.testing.assert_array_equal(readings.gyroscope.values, values[:, 3:])
    assert any("read as negative" in text for text in readings.warnings)
    assert any("nominally 16384 per g" in text for text in readings.warnings)


def test_counts_around_the_middle_of_their_range_keep_their_offset() -> None:
    rng = np.random.default_rng(5)
    values = np.round(32768.0 + rng.normal((0.0, 300.0, 4000.0), 40.0, (400, 3)))
    assert as_signed(values) is None
    assert as_signed(values - 32768.0) is None
    assert as_signed(values / 3.0) is None


def test_one_wrong_reading_does_not_make_counts_with_an_offset_signed() -> None:
    values = np.round(np.random.default_rng(4).normal([33000.0, 36000.0, 42000.0], 20.0, (500, 3)))
    values[200, 0] = 12.0  # of 33012, the first digits were lost
    assert as_signed(values) is None


def _arrived(even: FloatArray) -> FloatArray:
    """Times of arrival over a bus that is asked every 5.12 ms."""
    return np.ceil(even / 0.00512) * 0.00512 + 0.2


def test_times_of_arrival_are_replaced_by_the_even_ones_they_jitter_about(tmp_path: Path) -> None:
    even = np.delete(np.arange(3000) / 100.0, slice(1500, 1540))
    values = samples(len(even))
    values[:, 0] = _arrived(even)
    readings = read_files([write(tmp_path / "a.csv", values)])
    own = readings.accelerometer.time
    assert np.ptp(own - even) < 4e-4
    assert np.abs(own - values[:, 0]).max() < 0.00512
    assert any("jitter about even ones" in text for text in readings.warnings)
    assert any("40 samples are missing in 1 gap" in text for text in readings.warnings)


def test_lost_samples_do_not_shift_the_even_times_of_the_others(tmp_path: Path) -> None:
    """With a jitter by ±0.15 intervals, the step over a lost sample may be 1.7 intervals."""
    rng = np.random.default_rng(8)
    even = np.arange(6000)[rng.random(6000) > 0.05] / 100.0
    values = samples(len(even))
    values[:, 0] = even + rng.uniform(0.0, 0.003, len(even))
    own = read_files([write(tmp_path / "a.csv", values)]).accelerometer.time
    assert np.ptp(own - even) < 5e-4


def test_a_sample_that_is_very_late_keeps_its_place_among_the_even_times() -> None:
    """It took the time of the next one, and one rotation closed worse by 17°."""
    rng = np.random.default_rng(8)
    even = np.arange(2000) / 100.0
    late = np.abs(rng.normal(0.0, 0.0015, 2000))
    late[700] = 0.0072
    found = without_jitter(even + late)
    assert found is not None
    np.testing.assert_allclose(np.diff(found), 0.01, atol=1e-4)


@pytest.mark.parametrize("missing", [0.0, 0.02])
def test_the_long_tail_of_times_of_arrival_does_not_shorten_the_interval(missing: float) -> None:
    """Latency of an exponential distribution, which no sample overtakes: one in fifty is late."""
    rng = np.random.default_rng(10)
    even = np.arange(6000)[rng.random(6000) >= missing] / 100.0
    found = without_jitter(np.maximum.accumulate(even + rng.exponential(0.0025, len(even))))
    assert found is not None
    # two hundred neighbours know the mean of 2.5 ms to 0.2 ms; those twice as late are few
    assert np.sqrt(np.mean((found - even - np.mean(found - even)) ** 2)) < 7e-4


@pytest.mark.parametrize("late", [0.003, 0.006, 0.015])
def test_samples_that_arrive_with_any_delay_get_even_times(late: float) -> None:
    """Their phases say nothing, but none is missing: the order alone says when each was measured.

    The mean delay of a hundred samples in a row is known to a tenth of its scatter.
    """
    rng = np.random.default_rng(25_973)
    even = np.arange(6000) / 100.0
    time = np.maximum.accumulate(even + rng.exponential(late, len(even)))
    found = evenly_arrived(time)
    assert found is not None
    off = found - even
    assert np.sqrt(np.mean((off - off.mean()) ** 2)) < 0.15 * late + 2e-4


def test_missing_samples_and_own_times_are_no_even_arrivals() -> None:
    rng = np.random.default_rng(25_974)
    even = np.arange(6000)[rng.random(6000) >= 0.002] / 100.0
    late = rng.exponential(0.006, len(even))
    assert evenly_arrived(np.maximum.accumulate(even + late)) is None
    assert evenly_arrived(np.cumsum(rng.uniform(0.003, 0.017, 6000))) is None
    assert evenly_arrived(even) is None


def test_the_jitter_of_many_samples_does_not_bend_even_times() -> None:
    """Over a hundred neighbours the mean of a jitter of 1.2 ms still wanders by 0.1 ms."""
    even = np.arange(12000) / 100.0
    found = without_jitter(even + np.random.default_rng(9).uniform(0.0, 0.004, len(even)))
    assert found is not None
    np.testing.assert_allclose(found - found.mean(), even - even.mean(), atol=1.5e-4)


def test_even_times_follow_a_clock_that_drifts() -> None:
    """By 3 ms in a minute, back and forth, far more than the jitter of as many samples."""
    even = np.arange(12000) / 100.0
    even += 0.003 * np.sin(2.0 * np.pi * even / 60.0)
    found = without_jitter(even + np.random.default_rng(9).uniform(0.0, 0.004, len(even)))
    assert found is not None
    off = (found - even)[100:-100]
    np.testing.assert_allclose(off - off.mean(), 0.0, atol=4e-4)


def test_a_restart_stays_a_restart_where_the_times_jitter(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    values = samples(1200)
    values[:, 0] = np.concatenate([np.arange(600), np.arange(600)]) / 100.0
    values[:, 0] += rng.uniform(0.0, 0.003, 1200)
    readings = read_files([write(tmp_path / "a.csv", values)])
    assert np.diff(readings.accelerometer.time).max() == pytest.approx(
        RESTART_GAP_SECONDS, abs=1e-9
    )
    assert any("jitter about even ones" in text for text in readings.warnings)
    assert not any("missing" in text for text in readings.warnings)


def test_readings_that_a_faster_loop_repeats_count_once(tmp_path: Path) -> None:
    once = samples(300, rate=50.0)
    values = np.repeat(once, 4, axis=0)
    values[:, 0] = np.arange(len(values)) / 200.0
    readings = read_files([write(tmp_path / "a.csv", values)])
    assert readings.gyroscope is not None
    assert readings.gyroscope.time is readings.accelerometer.time
    np.testing.assert_allclose(readings.accelerometer.time, once[:, 0], atol=1e-9)
    np.testing.assert_allclose(readings.gyroscope.values, once[:, 4:7], atol=1e-6)
    (told,) = readings.warnings
    assert "accelerometer and the gyroscope is repeated 4 times" in told


def test_steps_that_vary_by_themselves_stay_as_they_are() -> None:
    """A loop that takes its time: each sample is measured when it is."""
    for half in (0.001, 0.002, 0.005):
        time = np.cumsum(np.random.default_rng(2).uniform(0.01 - half, 0.01 + half, 3000))
        assert without_jitter(time) is None
    assert without_jitter(np.arange(3000) / 100.0) is None


def test_samples_that_read_zero_on_all_axes_are_no_readings(tmp_path: Path) -> None:
    """Two seconds at the end were filled up with zeros, which looks like a rest."""
    values = samples()
    values[200:, 1:7] = 0.0
    filled = read_files([write(tmp_path / "a.csv", values)])
    assert filled.gyroscope is not None
    assert len(filled) == len(filled.gyroscope) == 200
    assert filled.gyroscope.time is filled.accelerometer.time
    assert any("200 samples of the accelerometer read exactly zero" in w for w in filled.warnings)


def test_zeros_between_the_readings_of_a_slower_magnetometer_are_no_readings(
    tmp_path: Path,
) -> None:
    """Nine lines of ten have no new field, and the logger writes zeros."""
    rng = np.random.default_rng(7)
    field = rng.normal((20.0, -10.0, -40.0), 0.3, (400, 3))
    field[np.arange(400) % 10 != 0] = 0.0
    values = np.hstack([samples()[:, :4], field])
    path = write(tmp_path / "a.csv", values, "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],mx,my,mz")
    readings = read_files([path])
    assert readings.magnetometer is not None
    assert readings.magnetometer.unit == "uT"
    assert readings.magnetometer.rate == pytest.approx(10.0)
    assert len(readings) == 400
    assert any("360 samples of the magnetometer read exactly zero" in w for w in readings.warnings)


def test_zeros_of_a_device_that_removes_gravity_are_what_it_sends(tmp_path: Path) -> None:
    values = samples()
    values[20:, 1:4] = 0.0
    values[:20, 1:4] = 0.01
    with pytest.raises(RecordingError, match="removed gravity"):
        read_files([write(tmp_path / "a.csv", values)])


def test_spans_that_are_stated_are_left_out(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples())
    readings = read_files([path], RecordingOptions(without=((0.995, 1.505), (3.0, 9.0))))
    assert readings.gyroscope is not None
    assert readings.temperature is not None
    assert len(readings) == len(readings.gyroscope) == len(readings.temperature) == 249
    assert readings.gyroscope.time is readings.accelerometer.time
    assert np.diff(readings.accelerometer.time).max() == pytest.approx(0.52)
    assert "the samples from 3 to 9 s are left out, as stated" in readings.warnings
    with pytest.raises(UsageError, match="no samples from 8 to 9 s"):
        read_files([path], RecordingOptions(without=((8.0, 9.0),)))


def test_no_span_leaves_nothing(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples())
    with pytest.raises(UsageError, match="from 0 to 100 s only"):
        read_files([path], RecordingOptions(without=((0.0, 100.0),)))


def test_spans_of_a_magnetometer_alone_are_left_out_too(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples()[:, :4], "t[s],mx[uT],my[uT],mz[uT]")
    options = RecordingOptions(without=((0.995, 1.505),))
    field = read_files([path], options, field_alone=True).magnetometer
    assert field is not None
    assert len(field) == 349
