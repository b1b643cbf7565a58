"""The magnetometer on the bench: named, added, the error falls; and what is not the sensor's."""

from dataclasses import replace

import numpy as np
import pytest

import benchmarks.hidden_field.recording
from benchmarks.hidden_field.recording import CONSUMER, Colour, record
from benchmarks.hidden_field.sessions import REPEATED, STANDARD, Plan, session_of
from benchmarks.hidden_field.strangers import Waves
from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.core.notices import Notice, NoticeKind
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.grade import Grade, graded
from imucal_wizard.diagnose.next_poses import next_requests
from imucal_wizard.diagnose.recheck import RecheckVerdict, judge_field
from imucal_wizard.diagnose.survey import add_by_itself, diagnose_benches, diagnosis_of
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.diagnose.verdict_text import (
    spans_to_leave_out,
    verdict_text,
)
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
from imucal_wizard.estimate.magnetometer.surroundings import by_current
from imucal_wizard.estimate.magnetometer.surroundings import recorded as recorded_beside
from imucal_wizard.estimate.recording import FitOptions, fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.estimate.second_stage.field_changes import only_headings_differ
from imucal_wizard.model.formula import FormulaEffect
from imucal_wizard.simulate.magnetometer import TrueField
from tests.calibrate.collecting import offline
from tests.diagnose.recordings import tumbled

pytestmark = pytest.mark.usefixtures("rough_sizes_throughout")


def recorded(*hidden: str) -> tuple[FitReport, Readings]:
    """A recording of a tumbled device, and its fit."""
    made = tumbled(*hidden)
    assert made.readings is not None
    return made.report, made.readings


def field_bench(benches: Benches, *, anew: bool = True) -> Bench:
    """The bench of the magnetometer; a fresh one unless that of these benches is wanted."""
    bench = (Benches(benches.report, benches.readings) if anew else benches).bench("magnetometer")
    assert bench is not None
    return bench


@pytest.mark.parametrize(("plan", "seed"), [(STANDARD, 24101), (REPEATED, 24103)])
def test_steps_of_five_times_the_noise_are_no_misfit(
    plan: Plan, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What rounding does to a rest counts beside turns in one mean with it, and for the dip."""
    monkeypatch.setattr(benchmarks.hidden_field.recording, "FIELD_STEP", 2.0)
    measured = record(session_of(plan, seed), CONSUMER, (), np.random.default_rng(seed))
    findings = Bench("magnetometer", measured).look()
    assert findings.opinion.verdict is Verdict.COMPLETE


def test_the_angle_between_the_chips_is_in_the_model_and_no_suspect() -> None:
    """The second stage finds it from the dip; the magnitude of the field does not depend on it."""
    bench = field_bench(tumbled())
    assert bench.fit.model == ("bias", "soft-iron", "misalignment")
    named = {one.name: one for one in bench.fit.parameters}
    truth = TrueField.drawn(3).misalignment
    for axis, angle in zip("xyz", truth, strict=True):
        found = named[f"misalignment_{axis}"]
        assert found.standard_error is not None
        assert abs(found.value - angle) < 4.0 * found.standard_error
    assert "misalignment" not in [one.term for one in bench.look().suspects]
    assert bench.look().opinion.verdict is Verdict.COMPLETE
    with pytest.raises(UsageError, match="is in the model already"):
        bench.add("misalignment")
    with pytest.raises(UsageError, match="cannot be taken out"):
        bench.remove("misalignment")


@pytest.mark.parametrize("plan", [STANDARD, REPEATED])
def test_repeated_directions_tell_slow_noise_from_what_the_model_lacks(plan: Plan) -> None:
    """Flicker noise of 0.01 µT scatters every visit; a smooth error only between directions."""
    for extra, expected in ((None, Verdict.COMPLETE), (Waves(0.2), Verdict.UNEXPLAINED)):
        rng = np.random.default_rng([950, 0])
        data = record(session_of(plan, 950), Colour(floor=0.01), (), rng, extra=extra)
        found = Bench("magnetometer", data, first=fit(data)).look()
        assert found.opinion.verdict is expected
    repeated = found.fit.repeatability
    assert repeated is not None
    assert repeated.freedom > 10


def test_while_the_accelerometer_is_worked_on_the_magnetometers_effects_are_kept() -> None:
    """Its dip is measured anew; it does not wait, as that agrees with it."""
    benches = Benches(*recorded("magnetometer/current:0.3:x"))
    bench = field_bench(benches, anew=False)
    assert not bench.look().rejected_by_reference
    bench.add("current")
    benches.accelerometer.remove("non-orthogonality")
    assert not benches.passed
    assert not benches.waits("magnetometer")
    again = field_bench(benches, anew=False)
    assert again is not bench
    assert again.fit.model == bench.fit.model


def test_a_magnetometer_waits_where_only_its_dip_is_against_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the accelerometer lacks turns up; what magnitudes show is the magnetometer's own."""
    report, readings = recorded()
    fitted = report.sensors["accelerometer"]
    assert fitted.reference is not None
    rng = np.random.default_rng(1)
    up = fitted.reference.up + 0.1 * rng.standard_normal(fitted.reference.up.shape)
    up /= np.linalg.norm(up, axis=1)[:, None]
    tilted = replace(fitted, reference=replace(fitted.reference, up=up))
    sensors = {**report.sensors, "accelerometer": tilted}
    monkeypatch.setattr(Benches, "passed", property(lambda _: False))
    said = {}
    for turned in (report, replace(report, sensors=sensors)):
        benches = Benches(turned, readings)
        said[turned is report] = diagnosis_of(benches, field_bench(benches, anew=False))
    assert said[True].verdict is Verdict.COMPLETE
    assert said[False].verdict is Verdict.WAITING
    assert "accelerometer's model is not complete" in said[False].says


def test_a_field_that_turned_makes_the_magnetometer_doubtful() -> None:
    """Its own model shows nothing of it, for magnitude and dip stay the same."""
    report, readings = recorded()
    text = "the field turned about the vertical between holds 9 and 10 by 30.0°"
    notice = Notice(text, NoticeKind.FIELD_TURNED, "magnetometer")
    told = replace(report, warnings=(*report.warnings, notice))
    benches = Benches(told, readings)
    said = diagnosis_of(benches, field_bench(benches, anew=False))
    assert said.verdict is Verdict.COMPLETE
    assert "The field turned about the vertical between holds 9 and 10" in said.says
    grade = graded(told, {"magnetometer": said})["magnetometer"]
    assert (grade.grade, grade.why[:16]) == (Grade.DOUBTFUL, "the field turned")


def test_a_rotation_that_gravity_closes_is_not_said_to_have_moved_the_device() -> None:
    """About the vertical nothing tells a field that turns from a gyroscope that reads wrongly."""
    table = offline(2).sensors["gyroscope"].rows
    assert table is not None
    heading = int(np.flatnonzero(table.kind == "heading")[3])
    item = int(table.item[heading])
    both = np.flatnonzero((table.kind == "rotation") & (table.item == item))
    assert len(both) == 2
    residual = table.residual.copy()
    residual[heading] = 0.2
    assert only_headings_differ(replace(table, residual=residual), (item,))
    residual[both[0]] = 0.2
    assert not only_headings_differ(replace(table, residual=residual), (item,))


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
    assert last.floor is not None
    assert last.rms_held_out < 1.5 * last.floor < 0.2 * first.rms_held_out


def test_a_drift_too_large_for_one_step_of_the_fit_does_not_count_as_noise() -> None:
    """Else the sizes told would be several times those of the same session without it."""
    told = []
    for hidden in ((), ("magnetometer/bias-drift:1.5:y",)):
        found = field_bench(tumbled(*hidden)).look()
        (drift,) = (one for one in found.suspects if one.term == "bias-drift")
        told.append(drift.detectable)
    # draws of the noise change a size by 2 to 5 %, another estimate of its scale by as much
    np.testing.assert_allclose(told[1], told[0], rtol=0.2)


def test_a_field_of_the_room_is_not_attributed_to_the_sensor() -> None:
    benches = tumbled("magnetometer/field-gradient:12:x")
    bench = field_bench(benches)
    assert bench.look().opinion.verdict is Verdict.NOT_REPEATABLE
    said = diagnosis_of(benches, bench)
    assert "The field differs from place to place" in verdict_text(said)
    assert all("one metre away" in pose.why for pose in said.next_poses)
    assert len(said.next_poses) == 6


def test_a_pose_whose_dip_is_off_is_not_left_out_with_the_span_of_another_reading() -> None:
    benches = tumbled()
    bench = benches.bench("magnetometer")
    assert bench is not None
    found, dips = bench.look(), bench.rows.item[bench.rows.kind == "dip"]
    assert len(dips)
    for number in dips.tolist():
        accused = replace(found.opinion, verdict=Verdict.DISTURBED, holds=(number,))
        said = diagnosis_of(benches, bench, replace(found, opinion=accused))
        assert said.disturbed_holds
        assert spans_to_leave_out(said) == []
        assert "Measure it again" in said.says


def test_without_soft_iron_hard_iron_and_one_scale_remain_and_it_is_to_be_put_back() -> None:
    benches = tumbled()
    base = {"magnetometer": ("bias",)}
    found = diagnose_benches(Benches(benches.report, benches.readings, base), {}, automatic=False)
    said = {one.sensor: one for one in found}["magnetometer"]
    assert said.verdict is Verdict.UNEXPLAINED
    assert said.bench is not None
    assert said.bench.fit.model == ("bias", "misalignment")
    matrix = said.bench.fit.matrix
    scale = float(np.cbrt(np.linalg.det(matrix)))
    np.testing.assert_allclose(matrix @ matrix.T, scale**2 * np.eye(3), atol=1e-12)
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


def test_a_strong_current_that_is_switched_disturbs_no_pose() -> None:
    """Of 2 µT/A it moves the field far above the noise in the middle of a pose."""
    said = diagnose_benches(tumbled("magnetometer/current:2:x", seed=0), {}, automatic=True)
    field = next(one for one in said if one.sensor == "magnetometer")
    assert field.bench is not None
    assert [term.name for term in field.bench.fit.terms] == ["current"]
    assert field.verdict is not Verdict.DISTURBED
    left, noise = field.bench.fit.rms_held_out, field.bench.fit.floor
    assert left is not None
    assert noise is not None
    assert noise < 0.06
    assert left < 1.5 * noise


@pytest.mark.parametrize("rate", [1.0, 5.0])
def test_a_current_that_does_nothing_changes_no_noise(rate: float) -> None:
    """Recorded more slowly than the field, it is a ramp where the device turns, too."""
    plain = tumbled()
    assert plain.readings is not None
    assert plain.readings.magnetometer is not None
    series = plain.readings.magnetometer
    rng = np.random.default_rng(11)
    time = np.arange(series.time[0], series.time[-1] + 1.0 / rate, 1.0 / rate)
    steps = np.repeat(rng.uniform(0.0, 12.0, len(time)), round(7.0 * rate))[: len(time), None]
    drawn = replace(plain.readings, current=Series(time, steps, "A"))
    slope = by_current(series.values, recorded_beside(series.time, drawn)[:, 1])
    np.testing.assert_array_equal(slope, 0.0)
    without = fit_magnetometer(series).fit
    with_it = fit_magnetometer(series, readings=drawn).fit
    assert with_it.floor is not None
    assert without.floor is not None
    assert with_it.floor < 1.1 * without.floor


def test_a_throttle_is_fitted_per_per_cent() -> None:
    """The unit of the size is that of what was recorded."""
    benches = tumbled("magnetometer/current:0.3:x")
    readings = benches.readings
    assert readings is not None
    assert readings.current is not None
    throttle = replace(readings.current, values=100.0 * readings.current.values / 12.0, unit="%")
    bench = field_bench(Benches(benches.report, replace(readings, current=throttle)))
    bench.add("current")
    parameter = next(p for p in bench.fit.parameters if p.name == "current_x")
    assert parameter.unit == "µT/%"
    assert parameter.value == pytest.approx(0.036, rel=0.05)


def test_a_device_that_only_tumbles_has_a_bench_for_its_magnetometer_alone() -> None:
    """Without still poses there is no accelerometer, and the sensor keeps its own frame."""
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


@pytest.mark.parametrize(
    ("explanations", "says", "warm"),
    [
        ((("bias-drift",), ("bias-temperature",)), "to separate a drift from temperature", True),
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


def test_for_counts_in_an_unknown_field_the_sizes_are_in_counts() -> None:
    """The same readings as counts: the same effect; which sizes are usual rests on 50 µT."""
    _, readings = recorded("magnetometer/current:0.3:x")
    assert readings.magnetometer is not None
    series = readings.magnetometer
    counts = replace(
        readings, magnetometer=replace(series, values=np.round(10.0 * series.values), unit="count")
    )
    made = Benches(fit_readings(counts), counts)
    bench = field_bench(made, anew=False)
    bench.offer(FormulaEffect("k*I", "magnetometer"))
    built, typed = (
        next(one.trial for one in bench.look().suspects if one.term == name)
        for name in ("current", "formula")
    )
    assert built is not None
    assert typed is not None
    assert typed.candidates[0].unit == "count"
    assert typed.size == pytest.approx(built.size, rel=0.01)
    bench.add("current")
    said = diagnosis_of(made, bench)
    assert "which of them are usual rests on a field of 50 µT" in said.says
    limit = graded(made.report, {"magnetometer": said})["magnetometer"].limit
    counted = next(p for p in bench.fit.parameters if p.name == "field").value
    assert limit == pytest.approx(0.5 * counted / 50.0, rel=0.01)
    even = judge_field(counted * np.eye(3)[[0, 1, 2, 0, 1, 2]], None, limit or 0.0, 1.0, "count")
    assert "limit 4.8" in even.says
    assert even.says.endswith("count")
    found = next(p for p in bench.fit.parameters if p.name == "current_x")
    assert found.unit == "count/A"
    assert found.value == pytest.approx(3.0, rel=0.05)
    field = float(np.linalg.norm(TrueField.drawn(3).world))
    known = Benches(fit_readings(counts, FitOptions(field=field)), counts)
    bench = field_bench(known, anew=False)
    bench.add("current")
    assert "which of them are usual rests" not in diagnosis_of(known, bench).says
    found = next(p for p in bench.fit.parameters if p.name == "current_x")
    assert found.unit == "µT/A"
    assert found.value == pytest.approx(0.3, rel=0.05)


def test_the_scatter_of_a_field_over_six_holds_is_that_of_a_sample() -> None:
    """Two lengths, each three times: the variance of a sample is 6/5 of the mean square."""
    lengths = np.array([47.0, 49.0, 47.0, 49.0, 47.0, 49.0])
    found = judge_field(lengths[:, None] * np.eye(3)[[0, 1, 2, 0, 1, 2]], None, 0.1, 0.0, "uT")
    assert found.error == pytest.approx(np.sqrt(6.0 / 5.0))


def test_a_magnitude_that_varies_is_no_go_however_few_axes_saw_the_field() -> None:
    """A bias that has moved by twice the field leaves one axis on one side of it.

    One that has moved by four times the field leaves the other axes less of it than shows them.
    """
    field = 50.0 * np.concatenate([np.eye(3), -np.eye(3)])
    for by in (100.0, 200.0):
        moved = judge_field(field + np.array([0.0, by, 0.0]), None, 0.5, 0.1, "uT")
        assert moved.verdict is RecheckVerdict.NO_GO
        assert moved.error is not None
        assert moved.error > 0.5
    few = judge_field(field[[0, 0, 1, 1]], None, 0.5, 0.1, "uT")
    assert few.verdict is RecheckVerdict.INSUFFICIENT
    assert few.error is None
