"""A device over its calibrations: as found, and the drift of its parameters."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from scipy import stats

from imucal_wizard.core.dates import SECONDS_PER_DAY, SECONDS_PER_MONTH
from imucal_wizard.core.description import Description
from imucal_wizard.report.calibration_file import Calibration, read_calibration
from imucal_wizard.report.calibration_record import described
from imucal_wizard.report.device_history import save_in_history
from imucal_wizard.report.history_text import as_found_note
from imucal_wizard.sessions.catalogue import Catalogue
from imucal_wizard.sessions.drift import drift
from imucal_wizard.sessions.history import PastParameter
from tests.report.devices import BIAS, calibration


def course(
    days: list[float], values: list[float], errors: list[float]
) -> list[tuple[float, PastParameter, float | None]]:
    """What the history says of one parameter."""
    return [
        (day * SECONDS_PER_DAY, PastParameter(value, error, "m/s^2", determined=True), 25.0)
        for day, value, error in zip(days, values, errors, strict=True)
    ]


def test_the_drift_is_the_weighted_line_of_the_textbook() -> None:
    """Where the values scatter as their errors say, nothing else enters: scipy's line."""
    days, errors = [0.0, 31.0, 60.0, 95.0], [0.01, 0.02, 0.01, 0.03]
    values = [0.100, 0.112, 0.113, 0.131]
    found = drift(course(days, values, errors))
    months = np.array(days) * SECONDS_PER_DAY / SECONDS_PER_MONTH
    line, covariance = np.polyfit(months, values, 1, w=1.0 / np.array(errors), cov="unscaled")
    assert found.per_month == pytest.approx(line[0])
    assert found.standard_error == pytest.approx(np.sqrt(covariance[0, 0]))
    assert found.spread == 0.0


def test_two_dates_tell_no_spread_and_one_no_drift() -> None:
    two = drift(course([0.0, 30.4375], [0.1, 0.3], [0.03, 0.04]))
    assert two.per_month == pytest.approx(0.2)
    assert two.standard_error == pytest.approx(0.05)
    assert (two.spread, two.p) == (None, None)
    assert drift(course([0.0, 0.2], [0.1, 0.3], [0.03, 0.04])).per_month is None
    assert drift(course([0.0], [0.1], [0.03])).dates == 1


def test_the_error_of_the_drift_covers_the_truth_as_often_as_it_says() -> None:
    """Six dates, errors that differ, and a turn-on spread that no calibration can see."""
    random, inside, trials = np.random.default_rng(8), 0, 300
    for _ in range(trials):
        days = np.sort(random.uniform(0.0, 400.0, 6))
        errors = random.uniform(0.2, 2.0, 6)
        slope = random.normal()
        months = days * SECONDS_PER_DAY / SECONDS_PER_MONTH
        values = slope * months + random.normal(0.0, 1.5, 6) + random.normal(0.0, errors)
        found = drift(course(days.tolist(), values.tolist(), errors.tolist()))
        assert found.per_month is not None
        assert found.standard_error is not None
        reach = stats.t.ppf(0.975, 4) * found.standard_error
        inside += abs(found.per_month - slope) < reach
    assert stats.binom.ppf(0.001, trials, 0.95) <= inside


def shifted(days: int, by: float) -> Calibration:
    """The device on another day, when its bias has moved along x."""
    made = described(
        calibration(turns=12, felt=False), Description("arm"), measured=f"2031-03-{days:02d}"
    )
    sensor = made["accelerometer"]
    away = np.array([by, 0.0, 0.0])
    holds = [
        msgspec.structs.replace(one, accelerometer=(np.array(one.accelerometer) + away).tolist())
        for one in made.hold_means
    ]
    moved = msgspec.structs.replace(sensor, bias=(np.array(sensor.bias) + away).tolist())
    sensors = {**made.sensors, "accelerometer": moved}
    return msgspec.structs.replace(made, hold_means=holds, sensors=sensors)


def test_as_found_is_the_error_that_the_calibration_before_makes_today(tmp_path: Path) -> None:
    """A bias that has moved by 0.1 m/s² along x: the error of |M (y − b)| in every hold."""
    folder, first, second = tmp_path / "s", tmp_path / "1.json", tmp_path / "2.json"
    assert save_in_history(shifted(1, 0.0), first, folder)[1:] == ["kept in the history of arm"]
    save_in_history(shifted(20, 0.1), second, folder)
    made = shifted(20, 0.1)
    readings = np.array([one.accelerometer for one in made.hold_means])
    old = calibration(turns=12, felt=False)["accelerometer"]
    sizes = np.linalg.norm((readings - BIAS) @ np.array(old.matrix).T, axis=1)
    expected = float(np.sqrt(np.mean((sizes - 9.80665) ** 2)))
    found = read_calibration(second)["accelerometer"].as_found
    assert found is not None
    assert found.error == pytest.approx(expected, rel=1e-9)
    assert (found.by, found.created) == ("2031-03-01_000000.calibration.json", "2031-03-01")
    assert read_calibration(first)["accelerometer"].as_found is None
    # saved once more: the same measurement has the same calibration before it
    save_in_history(shifted(20, 0.1), second, folder)
    again = read_calibration(second)["accelerometer"].as_found
    assert again == found
    with Catalogue(folder) as catalogue:
        one, two = catalogue.history("arm").calibrations
        assert one.sensors["accelerometer"].as_found_by == ""
        assert two.sensors["accelerometer"].as_found == found.error


def test_readings_in_other_units_are_not_compared(tmp_path: Path) -> None:
    """Counts of another range, or of another device that has the same name."""
    save_in_history(shifted(1, 0.0), tmp_path / "1.json", tmp_path / "s")
    made = shifted(9, 0.0)
    sensor = msgspec.structs.replace(made["accelerometer"], bias_unit="count")
    made = msgspec.structs.replace(made, sensors={"accelerometer": sensor})
    save_in_history(made, tmp_path / "2.json", tmp_path / "s")
    assert read_calibration(tmp_path / "2.json")["accelerometer"].as_found is None


def test_what_the_first_errors_as_found_refer_to_is_said_once(tmp_path: Path) -> None:
    """Readings of the accelerometer in m/s² and those of the gyroscope in rad/s: one conversion."""
    save_in_history(shifted(1, 0.0), tmp_path / "1.json", tmp_path / "s")
    with Catalogue(tmp_path / "s") as catalogue:
        history = catalogue.history("arm")
    units = {one.bias_unit for one in history.calibrations[0].sensors.values()}
    assert {"m/s^2", "rad/s"} <= units
    note = as_found_note(history)
    assert note.count("nominal conversion") == 1
    assert " or " not in note


def test_a_calibration_without_a_device_belongs_to_no_history(tmp_path: Path) -> None:
    made = described(calibration(turns=2), Description())
    assert save_in_history(made, tmp_path / "1.json", tmp_path / "s")[1:] == []
    assert not (tmp_path / "s").exists()
    readings = np.array([one.accelerometer for one in made.hold_means])
    assert made.device is not None
    assert made.device.ranges["accelerometer"] == (
        f"{readings.min():.3f} to {readings.max():.1f} m/s²".replace("-", "−")
    )
