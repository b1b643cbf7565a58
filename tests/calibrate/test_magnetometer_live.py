"""The magnetometer that the wizard has collected: fitted as that of a recording is."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.estimate.fit import ARRIVED
from imucal_wizard.estimate.recording import FitOptions, fit_collected, fit_readings
from imucal_wizard.estimate.result import FitReport
from tests.calibrate.collecting import UNITS, collected, offline, recording, with_field


@cache
def live() -> FitReport:
    """The fit of what the wizard would have collected of it."""
    return fit_collected(with_field(), UNITS, 100.0)


def vector(report: FitReport, sensor: str) -> FloatArray:
    """Matrix and bias in one row."""
    fit = report.sensors[sensor]
    return np.concatenate([fit.matrix.ravel(), fit.bias])


def test_the_same_samples_give_the_same_magnetometer() -> None:
    """Live and from a recording: calibration, alignment and dip agree to rounding."""
    one, other = offline(0), live()
    assert one.magnetic is not None
    assert other.magnetic is not None
    np.testing.assert_array_equal(other.magnetic.fit.matrix, one.magnetic.fit.matrix)
    np.testing.assert_array_equal(other.magnetic.kept, one.magnetic.kept)
    assert vector(other, "magnetometer") == pytest.approx(vector(one, "magnetometer"), abs=1e-9)
    assert other.second_stage is not None
    assert one.second_stage is not None
    assert other.second_stage.alignment.dip == pytest.approx(one.second_stage.alignment.dip)
    assert other.second_stage.clock is not None
    assert one.second_stage.clock is not None
    # the wizard's turns about the vertical are in the gyroscope's first fit as well
    clocks = other.second_stage.clock.seconds, one.second_stage.clock.seconds
    assert abs(clocks[0] - clocks[1]) < 0.1 * one.second_stage.clock.standard_error
    assert other.rates["magnetometer"] == one.rates["magnetometer"]


def test_the_gyroscope_gains_from_the_field_live_too() -> None:
    """All turns of the wizard count, those about the vertical as well, and give the same gains."""
    fit = live().sensors["gyroscope"]
    assert fit.method == "vector + field"
    assert fit.covariance is not None
    sigma = np.sqrt(np.diag(fit.covariance))
    # the fits begin elsewhere, and end where a step no longer matters
    off = np.abs(vector(live(), "gyroscope") - vector(offline(0), "gyroscope"))
    assert (off < ARRIVED * sigma).all()


def test_only_the_samples_of_its_step_are_fitted() -> None:
    """What was measured beside a computer, before the step, bends nothing."""
    readings = recording(0)
    series = readings.magnetometer
    assert series is not None
    middle = 0.5 * float(series.time[-1])
    spoilt = series.values.copy()
    early = series.time < middle
    spoilt[early] *= 1.3
    part = collected(readings, offline(0).holds, replace(series, values=spoilt))
    report = fit_collected(replace(part, field_spans=((middle, np.inf),)), UNITS, 100.0)
    later = Series(series.time[~early], series.values[~early], series.unit)
    alone = fit_readings(replace(readings, magnetometer=later)).magnetic
    assert report.magnetic is not None
    assert alone is not None
    np.testing.assert_array_equal(report.magnetic.fit.matrix, alone.fit.matrix)
    np.testing.assert_array_equal(report.magnetic.fit.bias, alone.fit.bias)


def test_a_disturbance_outside_its_step_is_left_out_of_the_second_stage() -> None:
    """Steel beside one still position: its samples are not kept, the alignment stays the same."""
    readings = recording(0)
    series = readings.magnetometer
    assert series is not None
    holds = offline(0).holds
    at = (series.time >= holds[3].start) & (series.time < holds[3].end)
    spoilt = series.values + np.where(at[:, None], [8.0, -5.0, 3.0], 0.0)
    middle = 0.5 * float(series.time[-1])
    part = collected(readings, holds, replace(series, values=spoilt))
    part = replace(part, field_spans=((middle, np.inf),))
    report = fit_collected(part, UNITS, 100.0)
    assert report.magnetic is not None
    assert not report.magnetic.undisturbed[at].any()
    assert report.second_stage is not None
    assert len(report.second_stage.alignment.used) == len(holds) - 1


def test_a_step_left_out_leaves_the_other_sensors_as_they_are() -> None:
    """No result that looks like one, and the reason."""
    report = fit_collected(replace(with_field(), field_spans=()), UNITS, 100.0)
    assert set(report.sensors) == {"accelerometer", "gyroscope"}
    assert report.magnetic is None
    assert report.second_stage is None
    assert "the magnetometer is not calibrated: its step was left out" in report.warnings


def test_a_magnetometer_alone_is_calibrated_when_no_pose_was_taken() -> None:
    """Everything skipped but its own step."""
    nothing = replace(with_field(), holds=(), rotations=())
    report = fit_collected(nothing, UNITS, 100.0)
    assert set(report.sensors) == {"magnetometer"}
    assert any("accelerometer is not calibrated" in text for text in report.warnings)
    with pytest.raises(DataError, match="its step was left out"):
        fit_collected(replace(nothing, field_spans=()), UNITS, 100.0)


def test_the_local_field_and_the_method_are_the_users_choice() -> None:
    """As for a recording: µT of the length given, by the method named."""
    options = FitOptions(magnetometer_method="algebraic", field=48.5)
    fit = fit_collected(with_field(), UNITS, 100.0, options).sensors["magnetometer"]
    assert fit.method == "algebraic"
    series = recording(0).magnetometer
    assert series is not None
    length = np.linalg.norm((series.values - fit.bias) @ fit.matrix.T, axis=1)
    assert length.mean() == pytest.approx(48.5, rel=1e-3)
