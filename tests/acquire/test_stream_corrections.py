"""What is no measurement, or reads wrong, is corrected in a stream as in a file."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.core.readings import FloatArray, Readings, join_readings
from imucal_wizard.measurement.data_quality import missing_samples
from tests.acquire.files.lines import HEADER, samples, write

COUNTS = "t[s],ax[count],ay[count],az[count],gx[count],gy[count],gz[count],temp[degC]"
FIELD = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],mx[uT],my[uT],mz[uT]"


def repeated(times: int, equal: bool = False) -> FloatArray:
    """Each measurement printed several times; some of them are equal by chance."""
    once = samples(500, 50.0)
    if equal:
        once[100:500:40, 1:7] = once[99:499:40, 1:7]
    values = np.repeat(once, times, axis=0)
    values[:, 0] = np.arange(len(values)) / (50.0 * times)
    return values


def silent() -> FloatArray:
    """A sensor that does not answer at first, now and then, and at last for 30 samples."""
    rng = np.random.default_rng(11)
    values = samples(600)
    values[rng.random(600) < 0.1, 1:7] = 0.0
    values[:20, 1:7] = 0.0
    values[400:430, 1:7] = 0.0
    return values


def silent_field() -> FloatArray:
    """Nine lines of ten have no new field, the first as well, and are filled up with zeros."""
    rng = np.random.default_rng(11)
    field = rng.normal((20.0, -10.0, -40.0), 0.3, (600, 3))
    field[np.arange(600) % 10 != 7] = 0.0
    return np.hstack([samples(600)[:, :4], field])


def unsigned() -> FloatArray:
    """Counts of 16 bits without sign; the x axis passes through zero after four seconds."""
    rng = np.random.default_rng(11)
    values = samples(600)
    values[:, 1:4] = np.repeat([[0.0, -900.0, 16384.0], [-16384.0, -40.0, 10.0]], 300, axis=0)
    values[:300, 1] -= 500.0
    values[400:, 1] *= -1.0
    values[:, 1:7] = np.mod(
        np.round(values[:, 1:7] + rng.normal([-3.0] * 3 + [300.0] * 3, 20.0, (600, 6))), 2.0**16
    )
    return values


def jittering() -> FloatArray:
    """Times of arrival, late by up to 0.6 intervals; some samples are lost."""
    rng = np.random.default_rng(11)
    values = samples(2000)[rng.random(2000) > 0.002]
    values[:, 0] += rng.uniform(0.0, 0.006, len(values))
    return values


def stream(path: Path, size: int) -> tuple[Intake, Readings]:
    """A text as a device sends it, in pieces of so many bytes."""
    data, intake = path.read_bytes(), Intake(compare_arrivals=False)
    parts = [intake.feed(data[at : at + size], at / 9000.0) for at in range(0, len(data), size)]
    found = [part for part in (*parts, intake.flush()) if part is not None]
    return intake, join_readings(found)


CASES = {
    "repeated": (repeated(2), HEADER, "is repeated 2 times"),
    "repeated, some equal": (repeated(4, equal=True), HEADER, "is repeated 4 times"),
    "silent": (silent(), HEADER, "of the accelerometer"),
    "silent field": (silent_field(), FIELD, "of the magnetometer"),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("size", [97, 5000])
def test_the_same_measurements_are_left_of_a_stream_and_of_a_file(
    tmp_path: Path, name: str, size: int
) -> None:
    values, header, words = CASES[name]
    path = write(tmp_path / "a.csv", values, header)
    file = read_files([path])
    intake, live = stream(path, size)
    assert any(words in text for text in file.warnings)
    assert any(words in text for text in intake.warnings)
    assert intake.samples == len(live) == len(file)
    for sensor in ("accelerometer", "gyroscope", "magnetometer"):
        own, other = getattr(live, sensor), getattr(file, sensor)
        if other is None:
            assert own is None
            continue
        np.testing.assert_array_equal(own.values, other.values)
        np.testing.assert_allclose(own.time - own.time[0], other.time - other.time[0], atol=1e-6)


def test_the_rate_of_a_stream_is_that_of_its_measurements(tmp_path: Path) -> None:
    intake, _ = stream(write(tmp_path / "a.csv", repeated(4)), 97)
    assert intake.rate == pytest.approx(50.0)
    assert intake.measured_rate == pytest.approx(50.0)


@pytest.mark.parametrize("size", [97, 5000])
def test_signs_are_restored_from_the_sample_on_that_shows_them(tmp_path: Path, size: int) -> None:
    path = write(tmp_path / "a.csv", unsigned(), COUNTS)
    file = read_files([path])
    intake, live = stream(path, size)
    assert intake.signs == {"accelerometer": 16, "gyroscope": 16}
    assert intake.signed_since == pytest.approx(3.03)
    there = live.accelerometer.time >= intake.signed_since
    np.testing.assert_array_equal(
        live.accelerometer.values[there], file.accelerometer.values[there]
    )
    assert any("of the accelerometer were written as unsigned" in w for w in intake.warnings)


def test_counts_that_may_be_negative_ones_are_pointed_out_before_one_shows_it(
    tmp_path: Path,
) -> None:
    intake, _ = stream(write(tmp_path / "a.csv", unsigned()[:290], COUNTS), 97)
    assert not intake.signs.get("accelerometer")
    hint = "turn the device over once before the start"
    assert any(hint in text for text in intake.warnings)
    shown, _ = stream(write(tmp_path / "b.csv", unsigned(), COUNTS), 97)
    assert not any(hint in text for text in shown.warnings)


@pytest.mark.parametrize("size", [97, 5000])
def test_times_that_jitter_are_made_even(tmp_path: Path, size: int) -> None:
    values = jittering()
    path = write(tmp_path / "a.csv", values)
    intake, live = stream(path, size)
    even = read_files([path]).accelerometer.time
    assert any("jitter about even ones" in text for text in intake.warnings)
    off = live.accelerometer.time - (even - even[0])
    assert len(live) == len(values)
    assert off.std() < 0.2 * 0.006 / np.sqrt(12.0)  # the loop leaves a tenth of the jitter
    assert 0 < intake.lost < 10
    assert intake.measured_rate == pytest.approx(100.0, rel=1e-3)


def test_times_that_wander_by_themselves_stay_in_a_stream(tmp_path: Path) -> None:
    values = samples(1000)
    values[:, 0] = np.cumsum(np.random.default_rng(2).uniform(0.005, 0.015, 1000))
    intake, live = stream(write(tmp_path / "a.csv", values), 97)
    own = live.accelerometer.time
    np.testing.assert_allclose(own - own[0], values[:, 0] - values[0, 0], atol=2e-6)
    assert not any("even ones" in text for text in intake.warnings)


@pytest.mark.parametrize("missing", [0.0, 0.01])
def test_times_of_arrival_about_no_even_ones_are_named(tmp_path: Path, missing: float) -> None:
    """Late by up to two intervals; a whole file shows the even times if no sample is missing."""
    rng = np.random.default_rng(2)
    values = samples(3000)[rng.random(3000) >= missing]
    values[:, 0] = np.maximum.accumulate(values[:, 0] + rng.exponential(0.008, len(values)))
    path = write(tmp_path / "a.csv", values)
    intake, _ = stream(path, 97)
    words = "jitter as if they were taken on arrival"
    of_file = words if missing else "jitter about even ones"
    assert any(of_file in text for text in read_files([path]).warnings)
    assert any(words in text for text in intake.warnings)


@pytest.mark.parametrize("answers", [0, 200])
def test_a_sensor_that_does_not_answer_any_more_is_named(tmp_path: Path, answers: int) -> None:
    values = samples(300)
    values[answers:, 1:7] = 0.0
    intake = Intake(compare_arrivals=False)
    live = intake.feed(write(tmp_path / "a.csv", values).read_bytes(), 3.0)
    assert (0 if live is None else len(live)) == answers
    assert intake.problem.startswith("The accelerometer reads exactly zero on all axes")


def test_coarse_readings_of_a_resting_device_are_no_repeats(tmp_path: Path) -> None:
    """A fast device at rest, of which one reading in forty differs from the one before."""
    rng = np.random.default_rng(3)
    values = samples(4000, 1000.0)
    values[:, 1:7] = 0.01 * np.cumsum(rng.random((4000, 1)) < 0.025, axis=0) % 0.02
    values[:, 3] += 9.8
    intake, live = stream(write(tmp_path / "a.csv", values), 97)
    assert len(live) == 4000
    assert not any("is repeated" in text for text in intake.warnings)


def test_times_go_on_after_a_sensor_that_hung(tmp_path: Path) -> None:
    """Its last reading is repeated for long, by a clock that is a little faster than at first."""
    once = samples(900, 100.0 / 3.0)
    values = np.repeat(once, 3, axis=0)
    values[900:1800, 1:7] = values[899, 1:7]
    steps = np.where(np.arange(2700) < 200, 0.01, 0.00997)
    values[:, 0] = np.cumsum(steps)
    intake, live = stream(write(tmp_path / "a.csv", values), 97)
    assert any("is repeated 3 times" in text for text in intake.warnings)
    assert len(live) == 900
    steps = np.diff(live.accelerometer.time)
    np.testing.assert_allclose(steps[100:], 3 * 0.00997, atol=0.0001)


@pytest.mark.parametrize("size", [60, 5000])
def test_the_field_is_kept_while_the_accelerometer_is_silent(tmp_path: Path, size: int) -> None:
    values = np.hstack([samples(600)[:, :4], np.full((600, 3), 30.0)])
    values[30::50, 1:4] = 0.0
    _, live = stream(write(tmp_path / "a.csv", values, FIELD), size)
    assert live.magnetometer is not None
    assert (len(live), len(live.magnetometer)) == (588, 600)


def test_a_slow_stream_does_not_wait_until_its_times_are_known_to_jitter(tmp_path: Path) -> None:
    """300 samples take half a minute at 10 Hz, in which the wizard would show no sample."""
    values = samples(100, 10.0)
    values[:, 0] += np.random.default_rng(2).uniform(0.0, 0.02, 100)
    path, intake = write(tmp_path / "a.csv", values), Intake(compare_arrivals=False)
    intake.feed(path.read_bytes(), 10.0)
    assert intake.samples == 100


def test_a_restart_stays_a_restart_in_a_stream_whose_times_jitter(tmp_path: Path) -> None:
    """What is missing at a restart is not known, and is not counted."""
    values = samples(1200)
    values[600:, 0] = values[:600, 0]
    values[:, 0] += np.random.default_rng(8).uniform(0.0, 0.003, 1200)
    intake, live = stream(write(tmp_path / "a.csv", values), 97)
    assert any("jitter about even ones" in text for text in intake.warnings)
    assert any("it has restarted" in text for text in intake.warnings)
    assert intake.lost == 0
    assert missing_samples(live.accelerometer.time) == ""
