"""What the calibration file keeps of the measurement: it proves the calibration without samples."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.api import load
from imucal_wizard.core.attitude import Attitudes, rotation_samples
from imucal_wizard.core.quaternions import matrices, quaternions
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.calibration_record import from_report
from imucal_wizard.report.measured import increments_of
from imucal_wizard.report.proof import Proof, own
from imucal_wizard.simulate.recording import simulate_recording
from tests.diagnose.recordings import fitted, tumbled
from tests.report.devices import calibration

PROMISED = np.radians(1e-3)
"""To which the increments of a rotation give its attitude."""


def saved(benches: Benches, folder: Path) -> Calibration:
    """The calibration of benches, read back."""
    return load(from_report(benches.fitted(), "a test", "2026-01-01").save(folder / "c.json"))


def angle(a: FloatArray, b: FloatArray) -> float:
    """Between two rotations, rad."""
    return float(np.linalg.norm(a - b) / np.sqrt(2.0))


def test_increments_give_the_attitude_of_the_samples_for_any_calibration() -> None:
    """Also for a bias and a matrix that are not those they were cut for."""
    report, _ = fitted(rotations=6)
    fit = report.sensors["gyroscope"]
    other = fit.matrix @ (np.eye(3) + 0.03 * np.arange(-4, 5).reshape(3, 3) / 4.0)
    for one in report.rotations:
        kept = increments_of(one, 0, 1, fit.matrix, fit.bias)
        samples = rotation_samples([one.time], [one.rate])
        for matrix, bias in ((fit.matrix, fit.bias), (other, fit.bias + 0.02)):
            steps = quaternions(samples.rotation_vectors((one.rate - bias) @ matrix.T))
            whole = matrices(Attitudes(steps, samples.step_offsets).whole)[:, :, 0]
            found = kept.attitudes((kept.readings() - bias) @ matrix.T)[-1]
            assert angle(found, whole) < PROMISED
        assert len(kept.edges) < 0.5 * len(one.time)


def test_increments_leave_the_error_of_the_samples() -> None:
    """The errors that an export states are then those of the fit."""
    report, _ = fitted(rotations=6)
    stated = report.sensors["gyroscope"].rms_fitted
    made = from_report(report, "a test", "2026-01-01")
    assert Proof(made).errors(own(made), frame=False)["gyroscope"] == pytest.approx(
        stated, rel=5e-4
    )


@pytest.mark.parametrize("degrees", [0.0, 180.0])
def test_few_samples_of_no_turn_or_half_a_turn_are_kept_in_an_interval(degrees: float) -> None:
    """The sine of either angle is zero, which is no sign that nothing is missing."""
    report, _ = fitted(rotations=1)
    time = np.arange(21) / 20.0
    rate = np.tile([0.0, 0.0, np.radians(degrees)], (21, 1))
    kept = replace(report.rotations[0], time=time, rate=rate, accelerometer=None)
    found = increments_of(kept, 0, 1, np.eye(3), np.zeros(3))
    assert [found.edges[0], found.edges[-1]] == [0.0, 1.0]
    turned = found.attitudes(found.readings())[-1]
    assert np.degrees(np.arccos(0.5 * (np.trace(turned) - 1.0))) == pytest.approx(degrees, abs=1e-4)


def test_the_error_of_a_rotation_is_an_angle_also_if_it_is_large() -> None:
    """Without any rate gravity is not carried at all."""
    made = calibration(turns=3)
    errors = Proof(made).residuals({"gyroscope": lambda one: 0.0 * one.reading}, frame=False)
    up = made["accelerometer"].apply(made.means())
    up /= np.linalg.norm(up, axis=1)[:, None]
    angles = np.arccos((up[1:] * up[:-1]).sum(axis=1))
    assert angles.max() > 0.5
    np.testing.assert_allclose(errors["gyroscope"], angles, rtol=1e-9)


def test_the_file_alone_gives_the_errors_that_the_fit_told(tmp_path: Path) -> None:
    benches = Benches(*fitted("second-order:5:x", rotations=6))
    benches.accelerometer.add("second-order")
    made = saved(benches, tmp_path)
    sensor, gyroscope, g = made["accelerometer"], made["gyroscope"], made.gravity.value
    force = sensor.apply(made.means(), made.circumstances())
    errors = np.linalg.norm(force, axis=1) - g
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(sensor.rms_fitted, rel=1e-9)
    up = force / np.linalg.norm(force, axis=1)[:, None]
    closing = [
        np.linalg.norm(
            one.attitudes(gyroscope.apply(one.readings()))[-1].T @ up[one.before] - up[one.after]
        )
        for one in made.rotation_increments
    ]
    assert len(closing) == made.rotations
    assert np.sqrt(np.mean(np.square(closing))) == pytest.approx(gyroscope.rms_fitted, rel=0.01)


@pytest.mark.parametrize(
    ("hidden", "seed"), [("bias-drift:5:y", 104), ("bias-temperature:0.5:z", 207)]
)
def test_the_file_keeps_how_the_device_seems_to_turn_in_its_holds(
    tmp_path: Path, hidden: str, seed: int
) -> None:
    """A bias that wanders by degrees per second looks like a slow turn in some holds."""
    path = tmp_path / "recording.csv"
    simulate_recording(path, hidden=[f"gyroscope/{hidden}"], poses="6", seed=seed, rate=25.0)
    report = fit_readings(read_files([path]))
    made = load(from_report(report, "a test", "2026-01-01").save(tmp_path / "c.json", force=True))
    holds = made.hold_means
    # a rotation reaches 0.05 s into a hold in which the device rests
    assert any(one.edges[0] < holds[one.before].end - 0.3 for one in made.rotation_increments)
    proof, stated = Proof(made), made["gyroscope"].rms_fitted
    assert proof.errors(own(made), frame=False)["gyroscope"] == pytest.approx(stated, rel=1e-3)
    # a program with another body frame leaves the same error
    frame = np.array([[0.0, -1.0, 0.0], [0.6, 0.0, 0.8], [-0.8, 0.0, 0.6]])
    other = {
        # a default binds the correction of this turn
        name: lambda samples, correct=correct: correct(samples) @ frame.T
        for name, correct in own(made).items()
    }
    assert proof.errors(other, frame=True)["gyroscope"] == pytest.approx(stated, rel=1e-3)


def test_holds_keep_what_effects_of_time_and_history_need(tmp_path: Path) -> None:
    benches = Benches(*fitted("bias-drift:1:x"))
    benches.accelerometer.add("bias-drift")
    benches.accelerometer.add("hysteresis")
    made = saved(benches, tmp_path)
    sensor = made["accelerometer"]
    errors = np.linalg.norm(sensor.apply(made.means(), made.circumstances()), axis=1)
    rms = np.sqrt(np.mean((errors - made.gravity.value) ** 2))
    assert rms == pytest.approx(sensor.rms_fitted, rel=1e-6)
    first, second = made.hold_means[:2]
    assert first.previous is None
    assert second.previous is not None
    assert np.linalg.norm(second.previous) == pytest.approx(1.0)
    assert first.gyroscope_covariance is not None


def test_the_magnetometers_means_have_the_size_of_the_field(tmp_path: Path) -> None:
    made = saved(tumbled(), tmp_path)
    sensor = made["magnetometer"]
    field = sensor.apply(np.array([one.reading for one in made.field_means]))
    size = np.linalg.norm(field, axis=1) + [one.shortened for one in made.field_means]
    assert np.std(size) < 0.01 * np.mean(size)
    # one statistic under one name, also of a drift that counts from the first sample
    error = Proof(made).errors(own(made), frame=False)["magnetometer"]
    assert error == pytest.approx(sensor.rms_fitted, rel=0.01)
    benches = tumbled("magnetometer/bias-drift:0.3:x")
    bench = benches.bench("magnetometer")
    assert bench is not None
    bench.add("bias-drift")
    made = saved(benches, tmp_path)
    error = Proof(made).errors(own(made), frame=False)["magnetometer"]
    assert error == pytest.approx(made["magnetometer"].rms_fitted, rel=0.03)
    assert any(hold.magnetometer is not None for hold in made.hold_means)


def test_the_covariance_of_the_parameters_has_their_standard_errors(tmp_path: Path) -> None:
    benches = Benches(*fitted("second-order:5:x", rotations=6))
    benches.accelerometer.add("second-order")
    made = saved(benches, tmp_path)
    for sensor in made.sensors.values():
        assert sensor.parameter_covariance is not None
        covariance = np.array(sensor.parameter_covariance)
        errors = [one.standard_error or 0.0 for one in sensor.parameters.values()]
        np.testing.assert_allclose(np.sqrt(np.diag(covariance)), errors, rtol=1e-9)
        assert np.linalg.eigvalsh(covariance)[0] > -1e-12 * np.trace(covariance)
    names = list(made["accelerometer"].parameters)
    i, j = names.index("bias_x"), names.index("second-order_x")
    covariance = np.array(made["accelerometer"].parameter_covariance)
    # six tenths of a parabola on one axis pass for its bias
    assert covariance[i, j] / np.sqrt(covariance[i, i] * covariance[j, j]) < -0.5


def test_a_file_of_an_earlier_version_has_no_measurements_and_still_reads() -> None:
    old = load(Path(__file__).parents[1] / "golden" / "data" / "calibration.json")
    assert old.rotation_increments == []
    assert old.field_means == []
    assert old["accelerometer"].parameter_covariance is None
