"""Real recordings: known sensitivities, published residuals, mistakes that are really in them."""

import numpy as np
import pytest

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.readings import Readings
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.gyroscope_fit import gyroscope_minimum
from imucal_wizard.estimate.gyroscope_report import fit_gyroscope
from imucal_wizard.estimate.recording import FitOptions, fit_accelerometer, fit_readings
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.estimate.rotation_set import examined
from imucal_wizard.measurement.holds import Rotation
from imucal_wizard.model.rows.source import Parameters
from imucal_wizard.model.terms import Terms
from tests.shared_data import shared_data

MILLI_G = STANDARD_GRAVITY / 1000.0
CERTIFICATE = {"x": 415.0, "y": 413.0, "z": 415.0}
"""Counts per m/s² on the certificate of the Xsens unit, as far as it is rounded."""


@pytest.fixture(scope="module")
def xsens_readings() -> Readings:
    """The recording of imu_tk: raw counts around 32768, 512 s."""
    files = [shared_data(f"imu_tk_xsens/xsens_{name}.mat") for name in ("acc", "gyro")]
    return read_files(files, RecordingOptions(as_format="imu_tk"))


@pytest.fixture(scope="module")
def xsens(xsens_readings: Readings) -> FitReport:
    """Its fit."""
    return fit_readings(xsens_readings)


def _mikoff(name: str) -> FitReport:
    options = RecordingOptions(
        columns=("ax", "ay", "az", "gx", "gy", "gz"),
        rate=100.0,
        accelerometer_unit="m/s^2",
        gyroscope_unit="rad/s",
    )
    return fit_readings(read_files([shared_data(f"mikoff_mpu9150/{name}.log")], options))


def _values(fit: SensorFit) -> dict[str, float]:
    return {parameter.name: parameter.value for parameter in fit.parameters}


def test_the_holds_of_the_xsens_recording_are_found(xsens: FitReport) -> None:
    """About forty, in about fourteen directions; every motion between them can be used."""
    assert 36 <= len(xsens.holds) <= 42
    assert len(xsens.rotations) == len(xsens.holds) - 1
    assert all(rotation.problem is None for rotation in xsens.rotations)


def test_the_xsens_accelerometer_has_its_certificates_sensitivities(xsens: FitReport) -> None:
    """414.9, 412.5, 415.1 counts per m/s² within 0.15 %; all nine parameters carried."""
    fit = xsens.sensors["accelerometer"]
    values = _values(fit)
    for axis, known in zip("xyz", (414.9, 412.5, 415.1), strict=True):
        assert values[f"sensitivity_{axis}"] == pytest.approx(known, rel=0.0015)
        assert values[f"sensitivity_{axis}"] == pytest.approx(CERTIFICATE[axis], abs=0.6)
    assert all(parameter.carried for parameter in fit.parameters)
    assert fit.rms_fitted <= 0.12 * MILLI_G
    assert fit.rms_held_out is not None
    assert fit.rms_held_out <= 0.20 * MILLI_G


def test_the_xsens_repeats_agree_with_its_residual(xsens: FitReport) -> None:
    """Published for these data: residual 0.115 mg, pure error 0.120 mg with 24 dof."""
    fit = xsens.sensors["accelerometer"]
    assert fit.repeatability is not None
    assert fit.repeatability.rms == pytest.approx(0.12 * MILLI_G, rel=0.15)
    assert 20 <= fit.repeatability.freedom <= 28
    residual = fit.rms_fitted * np.sqrt(len(xsens.holds) / fit.degrees_of_freedom)
    assert residual == pytest.approx(0.115 * MILLI_G, rel=0.15)


def test_the_xsens_gyroscope_closes(xsens: FitReport) -> None:
    """Scales within 0.5 % of the known ones; what is left is an effect outside this model."""
    fit = xsens.sensors["gyroscope"]
    for axis, known in enumerate((2.093e-4, 2.099e-4, 2.095e-4)):
        assert fit.matrix[axis, axis] == pytest.approx(known, rel=0.005)
    assert np.degrees(fit.rms_fitted) <= 0.60
    assert np.degrees(fit.rms_held_out or np.inf) <= 0.70


@pytest.mark.parametrize("method", ["newton", "six-position"])
def test_other_methods_find_the_same_accelerometer(
    xsens: FitReport, xsens_readings: Readings, method: str
) -> None:
    """Newton to 0.02 %; six positions within the 6 % that faces tilted by up to 20° allow."""
    other = fit_readings(xsens_readings, FitOptions(method=method)).sensors["accelerometer"]
    fit = xsens.sensors["accelerometer"]
    assert other.method == method
    for one, two in zip(fit.parameters, other.parameters, strict=True):
        if one.name.startswith("sensitivity"):
            assert two.value == pytest.approx(one.value, rel=2e-4 if method == "newton" else 0.06)
    if method == "newton":
        assert other.iterations < 10
        # all holds weigh alike in Newton's: two that were moved pull it off
        assert fit.rms_held_out is not None
        assert fit.rms_held_out <= (other.rms_held_out or 0.0)


def test_leaving_out_each_xsens_rotation_is_a_complete_refit(xsens: FitReport) -> None:
    """The one-step shortcut against refits without the rotation.

    The refit's holds and accelerometer are the same, so the difference is the shortcut's alone;
    with an effect outside the model in the data it may reach 5 % of the rms.
    """
    fit = xsens.sensors["gyroscope"]
    assert fit.held_out is not None
    accelerometer = fit_accelerometer(xsens.holds, STANDARD_GRAVITY, "count")
    rotations = examined(xsens.rotations)
    experiment = gyroscope_minimum(xsens.holds, rotations, accelerometer, "count").experiment
    for index in range(0, len(xsens.rotations), 4):
        rest = [rotation for i, rotation in enumerate(xsens.rotations) if i != index]
        refit = fit_gyroscope(xsens.holds, rest, accelerometer, "count").fit
        assert refit is not None
        rows = experiment.closure.at(Parameters(refit.matrix, refit.bias), Terms("gyroscope", ()))
        error = float(np.linalg.norm(rows.residual.reshape(-1, 2)[index]))
        assert fit.held_out[index] == pytest.approx(error, abs=0.05 * fit.rms_fitted)


@pytest.mark.parametrize("name", ["imu0", "imu1"])
def test_both_mpu9150_logs_are_calibrated(name: str) -> None:
    """Held out 0.6 mg and 0.15°, from six columns without times, header or units."""
    report = _mikoff(name)
    assert 18 <= len(report.holds) <= 24
    accelerometer, gyroscope = report.sensors["accelerometer"], report.sensors["gyroscope"]
    assert (accelerometer.rms_held_out or np.inf) <= 0.6 * MILLI_G
    assert np.degrees(gyroscope.rms_held_out or np.inf) <= 0.15
    assert (accelerometer.rms_before or 0.0) > 10.0 * MILLI_G
    assert all(p.carried for p in (*accelerometer.parameters, *gyroscope.parameters))


def test_a_sampling_rate_twice_too_high_is_told() -> None:
    """The file claims 204.8 Hz and has 102.4: every angle comes out at half its size."""
    options = RecordingOptions(rate=204.8, accelerometer_unit="m/s^2", gyroscope_unit="deg/s")
    path = shared_data("imucal_example/example_ferraris_session.csv")
    report = fit_readings(read_files([path], options))
    assert np.diag(report.sensors["gyroscope"].matrix) == pytest.approx([2.0, 2.0, 2.0], rel=0.04)
    assert any("about 100 Hz instead of 204.8 Hz" in warning for warning in report.warnings)


def test_at_the_true_rate_nothing_is_wrong_with_it() -> None:
    """The scales are those of a gyroscope, and no warning speaks of rate or unit."""
    options = RecordingOptions(rate=102.4, accelerometer_unit="m/s^2", gyroscope_unit="deg/s")
    path = shared_data("imucal_example/example_ferraris_session.csv")
    report = fit_readings(read_files([path], options))
    assert np.diag(report.sensors["gyroscope"].matrix) == pytest.approx([1.0, 1.0, 1.0], rel=0.04)
    assert not any("rate" in warning for warning in report.warnings)


def test_six_faces_in_counts_give_bias_and_scale() -> None:
    """2048 counts per g; the full turns are about the vertical, where gravity sees nothing."""
    options = RecordingOptions(rate=102.4, accelerometer_unit="count", gyroscope_unit="count")
    path = shared_data("imucal_example/annotated_session.csv")
    report = fit_readings(read_files([path], options))
    values = _values(report.sensors["accelerometer"])
    for axis in "xyz":
        per_g = values[f"sensitivity_{axis}"] * STANDARD_GRAVITY
        assert per_g == pytest.approx(2048.0, rel=0.035)
    left = {p.name for p in report.sensors["accelerometer"].parameters if not p.carried}
    assert left == {"theta_yz", "theta_zy", "theta_zx"}
    assert "gyroscope" not in report.sensors
    assert any("gyroscope is not calibrated" in warning for warning in report.warnings)


def test_residuals_belong_to_the_rotations_without_a_problem(xsens: FitReport) -> None:
    """One residual and one held-out error for each, in order; one angle for every rotation."""
    usable: list[Rotation] = [r for r in xsens.rotations if r.problem is None]
    fit = xsens.sensors["gyroscope"]
    assert fit.held_out is not None
    assert len(fit.residuals) == len(fit.held_out) == len(usable)
    assert len(xsens.angles) == len(xsens.rotations)
