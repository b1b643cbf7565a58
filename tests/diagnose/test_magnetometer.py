"""The magnetometer on the bench: named, added, the error falls; and what is not the sensor's."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.next_poses import next_requests
from imucal_wizard.diagnose.survey import add_by_itself, diagnose_benches, diagnosis_of
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.magnetometer.experiment import MagnetometerExperiment
from imucal_wizard.estimate.magnetometer.report import with_field
from imucal_wizard.estimate.recording import FitOptions, fit_readings
from imucal_wizard.simulate.magnetometer import TrueField
from tests.diagnose.recordings import tumbled


def field_bench(benches: Benches) -> Bench:
    """A fresh bench of the magnetometer, as the accelerometer's passed model leaves it."""
    bench = Benches(benches.report, benches.readings).magnetometer
    assert bench is not None
    return bench


def test_the_angle_between_the_chips_is_named_and_found_from_the_dip() -> None:
    """Of a virtual board nothing else is missing; the angles agree with the truth."""
    bench = field_bench(tumbled())
    assert bench.look().opinion.families == ("misalignment",)
    bench.add("misalignment")
    truth = np.degrees(TrueField.drawn(3).misalignment)
    size, error = bench.fit.sizes[0], bench.fit.size_errors[0]
    # the definition is that of small angles: half the product of two of them is beyond it
    np.testing.assert_allclose(size, truth, atol=float(4.0 * error.max()) + 0.1)
    assert bench.confirmed()
    assert bench.look().opinion.verdict is Verdict.COMPLETE


def test_what_the_fit_has_aligned_is_in_the_model_from_the_start_and_can_be_taken_out() -> None:
    """To nobody who has the second stage's result is the misalignment said to be missing."""
    made = tumbled()
    assert made.readings is not None
    report = fit_readings(made.readings)
    assert report.second_stage is not None
    benches = Benches(report, made.readings)
    bench = benches.magnetometer
    assert bench is not None
    assert [rung.added for rung in bench.ladder] == [None, "misalignment"]
    assert bench.look().opinion.verdict is Verdict.COMPLETE
    bench.remove("misalignment")
    assert bench.look().opinion.families == ("misalignment",)
    again = Benches(report, made.readings, before=benches).magnetometer
    assert again is not None
    assert [rung.model for rung in again.ladder] == [rung.model for rung in bench.ladder]
    climbed = Benches(report, made.readings, {"magnetometer": ("bias",)}).magnetometer
    assert climbed is not None
    assert climbed.fit.model == ("bias",)


def test_while_the_accelerometer_is_worked_on_the_magnetometers_other_effects_are_kept() -> None:
    """Without the dip only the misalignment has to go, and it comes back with the dip."""
    made = tumbled("magnetometer/current:0.3:x")
    assert made.readings is not None
    benches = Benches(fit_readings(made.readings), made.readings)
    bench = benches.magnetometer
    assert bench is not None
    bench.add("current")
    benches.accelerometer.remove("non-orthogonality")
    assert not benches.passed
    bench = benches.magnetometer
    assert bench is not None
    assert bench.fit.model == ("bias", "soft-iron", "current")
    benches.accelerometer.undo()
    bench = benches.magnetometer
    assert bench is not None
    assert set(bench.fit.model) == {"bias", "soft-iron", "current", "misalignment"}


@pytest.mark.parametrize(
    ("hidden", "axis", "size"),
    [("current:0.3:x", 0, 0.3), ("bias-drift:0.6:y", 1, 0.6)],
)
def test_a_hidden_effect_is_added_with_its_size_and_the_error_falls_to_the_noise(
    hidden: str, axis: int, size: float
) -> None:
    bench = field_bench(tumbled(f"magnetometer/{hidden}"))
    said = add_by_itself(bench)
    term = hidden.partition(":")[0]
    assert term in bench.fit.model
    assert said.opinion.verdict in (Verdict.MISSING, Verdict.AMBIGUOUS)
    place = [one.name for one in bench.fit.terms].index(term)
    found, error = bench.fit.sizes[place][axis], bench.fit.size_errors[place][axis]
    assert abs(found - size) < 4.0 * error
    first, last = bench.ladder[0], bench.ladder[-1]
    assert last.rms_held_out is not None
    assert first.rms_held_out is not None
    assert last.rms_held_out < 1.5 * last.floor < 0.2 * first.rms_held_out


def test_a_field_of_the_room_is_not_attributed_to_the_sensor() -> None:
    benches = tumbled("magnetometer/field-gradient:12:x")
    bench = field_bench(benches)
    bench.add("misalignment")
    assert bench.look().opinion.verdict is Verdict.UNEXPLAINED
    said = diagnosis_of(benches, bench)
    assert all("one metre away" in pose.why for pose in said.next_poses)
    assert len(said.next_poses) == 6


def test_without_soft_iron_hard_iron_and_one_scale_remain_and_it_is_to_be_put_back() -> None:
    benches = tumbled()
    base = {"magnetometer": ("bias",)}
    found = diagnose_benches(Benches(benches.report, benches.readings, base), {}, automatic=False)
    said = {one.sensor: one for one in found}["magnetometer"]
    assert said.verdict is Verdict.UNEXPLAINED
    assert said.bench is not None
    assert said.bench.fit.model == ("bias",)
    matrix = said.bench.fit.matrix
    np.testing.assert_allclose(matrix, matrix[0, 0] * np.eye(3), atol=1e-12)
    without = said.bench.fit.rms_held_out
    said.bench.add("soft-iron")
    assert said.bench.fit.rms_held_out is not None
    assert without is not None
    assert said.bench.fit.rms_held_out < 0.5 * without


def test_a_current_that_was_not_recorded_is_not_looked_for() -> None:
    bench = field_bench(tumbled())
    current = next(one for one in bench.catalogue if one.name == "current")
    assert "current[A] or throttle[%]" in (bench.lacking(current) or "")
    with pytest.raises(DataError, match="current cannot be added"):
        bench.add("current")


def test_a_current_that_was_recorded_for_half_of_the_time_is_not_made_up_for_the_rest() -> None:
    made = tumbled("magnetometer/current:0.3:x")
    assert made.readings is not None
    assert made.readings.current is not None
    series = made.readings.current
    half = series.between(series.time[0], float(np.median(series.time)))
    bench = field_bench(Benches(made.report, replace(made.readings, current=half)))
    current = next(one for one in bench.catalogue if one.name == "current")
    assert "record it from the beginning to the end" in (bench.lacking(current) or "")
    assert "current" not in [suspect.term for suspect in bench.look().suspects]


def test_a_throttle_is_fitted_per_per_cent() -> None:
    """The unit of the size is that of what was recorded."""
    benches = tumbled("magnetometer/current:0.3:x")
    readings = benches.readings
    assert readings is not None
    assert readings.current is not None
    throttle = replace(readings.current, values=100.0 * readings.current.values / 12.0, unit="%")
    bench = field_bench(Benches(benches.report, replace(readings, current=throttle)))
    bench.add("misalignment")
    bench.add("current")
    parameter = next(p for p in bench.fit.parameters if p.name == "current_x")
    assert parameter.unit == "µT/%"
    assert parameter.value == pytest.approx(0.036, rel=0.05)


def test_a_device_that_only_tumbles_has_a_bench_for_its_magnetometer_alone() -> None:
    """Without still poses there is no accelerometer, and no dip."""
    benches = tumbled()
    readings = benches.readings
    assert readings is not None
    own = {"magnetometer": benches.report.sensors["magnetometer"]}
    report = replace(benches.report, sensors=own, holds=(), rates={"magnetometer": 80.0})
    alone = Benches(report, readings)
    assert alone.sensors == ("magnetometer",)
    first, second = diagnose_benches(alone, {}, automatic=True)
    assert (first.sensor, first.verdict) == ("accelerometer", Verdict.INSUFFICIENT)
    assert (second.sensor, second.verdict) == ("magnetometer", Verdict.COMPLETE)


def test_while_the_accelerometer_is_not_complete_the_dip_is_not_looked_at() -> None:
    """A tilted reference would be blamed on the magnetometer's mounting."""
    benches = tumbled("second-order:12:x")
    assert not benches.passed
    bench = benches.magnetometer
    assert bench is not None
    assert isinstance(bench.measured, MagnetometerExperiment)
    assert len(bench.measured.data.dips) == 0
    misaligned = next(one for one in bench.catalogue if one.name == "misalignment")
    assert "accelerometer's model complete" in (bench.lacking(misaligned) or "")
    benches.accelerometer.add("second-order")
    assert benches.passed
    again = benches.magnetometer
    assert again is not None
    assert isinstance(again.measured, MagnetometerExperiment)
    assert len(again.measured.data.dips) >= 18


@pytest.mark.parametrize(
    ("explanations", "says", "warm"),
    [
        ((("bias-drift",), ("bias-temperature",)), "tells a drift from warmth", True),
        ((("bias-drift",), ("current",)), "half of it with the motors on", False),
    ],
)
def test_what_would_decide_changes_the_one_cause_and_not_the_other(
    explanations: tuple[tuple[str, ...], ...], says: str, warm: bool
) -> None:
    bench = field_bench(tumbled())
    findings = bench.look()
    undecided = replace(
        findings, opinion=replace(findings.opinion, explanations=explanations, families=())
    )
    poses, _ = next_requests(bench, undecided, Verdict.AMBIGUOUS)
    assert len(poses) == 6
    assert all(says in pose.why and pose.warm is warm for pose in poses)


def test_for_counts_in_an_unknown_field_the_basis_of_the_sizes_is_stated() -> None:
    """The same readings as counts: the same effect, told with the field that is assumed."""
    benches = tumbled("magnetometer/current:0.3:x")
    readings = benches.readings
    assert readings is not None
    assert readings.magnetometer is not None
    series = readings.magnetometer
    counts = replace(series, values=np.round(10.0 * series.values), unit="count")
    plain = replace(benches.report, magnetic=None)
    report = with_field(plain, counts, FitOptions())
    made = Benches(report, replace(readings, magnetometer=counts))
    bench = made.magnetometer
    assert bench is not None
    bench.add("misalignment")
    bench.add("current")
    told = diagnosis_of(made, bench).says
    assert "all sizes rest on a usual 50 µT" in told
    field = float(np.linalg.norm(TrueField.drawn(3).world))
    size = next(p.value for p in bench.fit.parameters if p.name == "current_x")
    assert size == pytest.approx(0.3 * 50.0 / field, rel=0.05)
    known = with_field(plain, counts, FitOptions(field=field))
    bench = Benches(known, replace(readings, magnetometer=counts)).magnetometer
    assert bench is not None
    assert "all sizes rest" not in diagnosis_of(made, bench).says
