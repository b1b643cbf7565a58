"""A gyroscope on a rate table or turntable, by itself and together with gravity."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks.q_cases import BNO055, RATE, XSENS, Case, record
from benchmarks.rate_table import (
    RATES_DEG,
    fit_table,
    joined,
    mountings,
    study,
    table_recording,
)
from imucal_wizard.cli.main import main
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.profile_likelihood import unlikeliness
from imucal_wizard.diagnose.survey import add_by_itself, diagnose_benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate import rate_table
from imucal_wizard.estimate.fit import refined_minimum
from imucal_wizard.estimate.recording import FitOptions, fit_readings
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.estimate.table_steps import KnownRates
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.rows.known_rotation import KnownRotation
from imucal_wizard.model.rows.source import Parameters, unmeasured
from imucal_wizard.model.terms import Term, Terms
from imucal_wizard.report.calibration_file import read_calibration
from imucal_wizard.report.calibration_record import from_report
from imucal_wizard.report.differences import differences, named_parameters
from imucal_wizard.report.proof import Proof
from imucal_wizard.report.proof import own as corrections
from imucal_wizard.simulate.sensor import DEGREE, Triad

FAST = (60.0, 150.0)
NONE = Series(np.zeros(0), np.zeros((0, 3)), "m/s^2")


def within(fit: SensorFit, case: Case, errors: float = 4.5) -> None:
    """Every matrix entry and bias of the case, within so many of its standard errors."""
    assert fit.covariance is not None
    truth = np.linalg.inv(case.gyroscope.sensitivity).ravel()
    off = np.concatenate([fit.matrix.ravel() - truth, fit.bias - case.gyroscope.bias])
    sigma = np.sqrt(np.diag(fit.covariance))
    assert (np.abs(off) <= errors * sigma + 1e-12 * np.abs(truth).max()).all(), off / sigma


@pytest.mark.parametrize("case", [BNO055, XSENS], ids=["rad/s", "counts"])
def test_a_table_alone_gives_scales_angles_and_biases_in_the_own_frame(case: Case) -> None:
    """Nine mountings at two rates, both senses; the axis of none of them is told."""
    fit = fit_table(table_recording(case, 5, FAST, 4.0, white=True)[0], FAST)
    assert fit.frame == "own"
    assert not fit.not_determined
    assert np.allclose(np.tril(fit.matrix, -1), 0.0)
    within(fit, case)


def skewed(case: Case) -> Case:
    """The same device with scale errors of 30 % and axes that are 3° out of square."""
    skew = np.array([[1.3, 0.05, -0.03], [0.0, 0.75, 0.04], [0.0, 0.0, 1.1]])
    own = case.gyroscope
    triad = Triad(own.sensitivity @ skew, own.bias, own.unit, own.density, step=own.step)
    return replace(case, gyroscope=triad)


def test_scale_errors_of_thirty_per_cent_are_told_from_the_next_rate_of_the_list() -> None:
    """33⅓ and 45 rpm differ by 35 %; the assignment follows the calibration."""
    rates = (100.0, 135.0, 200.0)
    case = skewed(BNO055)
    within(fit_table(table_recording(case, 6, rates, 4.0, white=True)[0], rates), case)


@cache
def turned_by_hand() -> tuple[FitReport, Readings]:
    """A recording of rotations by hand and its fit."""
    hand = record(BNO055, 3, turns=3)
    return fit_readings(hand), hand


def test_together_with_gravity_the_matrix_is_in_the_accelerometers_frame(tmp_path: Path) -> None:
    """The hand's rotations tell how it lies, the table adds the scales: better than either.

    The two alone have different frames, but agree in the one that both know.
    """
    by_hand, hand = turned_by_hand()
    table, _ = table_recording(BNO055, 3, FAST, 4.0, white=True)
    alone = by_hand.sensors["gyroscope"]
    by_table = replace(by_hand, sensors={"gyroscope": fit_table(table, FAST)})
    paths = tmp_path / "hand.json", tmp_path / "table.json"
    for report, path in zip((by_hand, by_table), paths, strict=True):
        from_report(report, "a test", "2026-01-01T00:00:00+00:00").save(path)
    found, notes = differences([named_parameters(path) for path in paths])
    assert "compared in its own frame" in notes[-1]
    assert set(found["gyroscope"]) >= {"theta_yz", "theta_zy", "theta_zx", "sensitivity_z"}
    assert min(one.p or 1.0 for one in found["gyroscope"].values()) > 1e-3
    report = fit_readings(joined(hand, table), FitOptions(rates=tuple(DEGREE * r for r in FAST)))
    fit = report.sensors["gyroscope"]
    assert fit.frame == "accelerometer"
    assert fit.method == "vector + table"
    unused = [one for one in report.rotations if one.problem]
    assert len(unused) <= 9  # the mountings were changed while nothing was recorded
    within(fit, BNO055)
    assert fit.covariance is not None
    assert alone.covariance is not None
    better, before = (
        np.sqrt(np.diag(one)[[0, 4, 8]]) for one in (fit.covariance, alone.covariance)
    )
    assert (better < 0.5 * before).all()


def test_where_rotations_and_table_have_no_common_fit_the_table_is_used_and_it_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refused(*_: object) -> None:
        raise DataError("no minimum was found")

    monkeypatch.setattr(rate_table, "with_rate_table", refused)
    table, _ = table_recording(BNO055, 3, FAST, 4.0, white=True)
    readings = joined(record(BNO055, 3, turns=3), table)
    report = fit_readings(readings, FitOptions(rates=tuple(DEGREE * r for r in FAST)))
    assert report.sensors["gyroscope"].method == "rate table"
    assert "accelerometer" in report.sensors
    assert any("which is used alone: no minimum was found" in note for note in report.warnings)


@pytest.mark.parametrize(("about", "method"), [("x", "rate table"), ("z", "vector + table")])
def test_nothing_is_said_of_the_fit_that_the_table_replaces(about: str, method: str) -> None:
    """Rotations about one axis leave gains nominal; with the table all are fitted."""
    by_hand, hand = turned_by_hand()
    assert hand.gyroscope is not None
    time, kept = hand.gyroscope.time, np.ones(len(hand.gyroscope), bool)
    for one in by_hand.rotations:
        if one.axis is None or one.axis not in about:  # nothing was recorded while it turned
            kept &= (time <= one.time[0] + 0.3) | (time >= one.time[-1] - 0.3)
    left = Series(time[kept], hand.gyroscope.values[kept], hand.gyroscope.unit)
    table, _ = table_recording(BNO055, 3, FAST, 4.0, white=True)
    readings = joined(replace(hand, gyroscope=left), table)
    report = fit_readings(readings, FitOptions(rates=tuple(DEGREE * r for r in FAST)))
    fit = report.sensors["gyroscope"]
    assert (fit.method, fit.not_determined) == (method, ())
    assert not [text for text in report.warnings if "do not determine" in text]


def turntable(case: Case, angles_deg: tuple[float, ...], seed: int) -> Readings:
    """Turns by known angles between rests of three seconds, in all mountings."""
    rng, rates = np.random.default_rng(seed), []
    for axis in mountings(rng):
        rates.append(np.zeros((round(3.0 * RATE), 3)))
        for sense in (1.0, -1.0):
            for angle in angles_deg:
                time = np.arange(1, round(4.0 * RATE)) / RATE  # an angle about a fixed axis
                course = sense * angle * DEGREE / 4.0 * (1.0 - np.cos(np.pi * time / 2.0))
                rates += [course[:, None] * axis, np.zeros((round(3.0 * RATE), 3))]
        rates.append(np.full((3, 3), np.nan))  # the device is mounted anew
    whole = np.concatenate(rates)
    kept = np.isfinite(whole).all(axis=1)
    time = (np.arange(len(whole)) + np.cumsum(~kept) * 300.0) / RATE
    noise = case.gyroscope.density * np.sqrt(RATE / 2.0) * rng.standard_normal(whole.shape)
    reading = case.gyroscope.reading(whole, noise)[kept]
    return Readings(NONE, Series(time[kept], reading, case.gyroscope.unit))


@pytest.mark.parametrize("case", [skewed(BNO055), XSENS], ids=["rad/s", "counts"])
def test_known_angles_of_a_turntable_calibrate_as_known_rates_do(case: Case) -> None:
    """Quarter, half and whole turns; which is which follows from the readings."""
    options = FitOptions(turns=tuple(DEGREE * one for one in (90.0, 180.0, 360.0)))
    fit = fit_readings(turntable(case, (90.0, 180.0, 360.0), 8), options).sensors["gyroscope"]
    within(fit, case)
    assert fit.minimum is not None
    assert len(fit.minimum.rows[-1].residual) == 54


def test_few_mountings_leave_the_angles_nominal_and_say_so() -> None:
    """Three faces show three scales; rates that are not of the list are named."""
    readings, _ = table_recording(BNO055, 9, FAST, 4.0, white=True)
    assert readings.gyroscope is not None
    faces = readings.gyroscope.time < 3 * float(readings.gyroscope.time[-1] + 10.0) / 9.0
    series = Series(readings.gyroscope.time[faces], readings.gyroscope.values[faces], "rad/s")
    fit = fit_table(Readings(NONE, series), FAST)
    assert set(fit.not_determined) == {"theta_yz", "theta_zy", "theta_zx"}
    assert any("mountings do not determine theta_yz" in note for note in fit.warnings)
    with pytest.raises(DataError, match="at none of the listed rates: they read"):
        fit_table(Readings(NONE, series), (33.3, 45.0))
    with pytest.raises(DataError, match="hardly any rotation between them"):
        fit_readings(Readings(NONE, series), FitOptions(turns=(np.pi / 2,)))


def test_counts_of_a_table_that_never_turns_are_refused_in_words() -> None:
    time = np.arange(1000) / 100.0
    counts = np.round(np.random.default_rng(4).normal(20.0, 2.0, (1000, 3)))
    with pytest.raises(DataError, match="reads only one steady rate: let the table rest"):
        rate_table.find_table(Series(time, counts, "count"), KnownRates(rates=(np.radians(10.0),)))


@pytest.mark.parametrize(("density", "told"), [(0.01, True), (20.0, False)])
def test_the_earths_rate_in_the_biases_of_a_table_is_told_where_they_are_known_better(
    density: float, told: bool
) -> None:
    """A table with a vertical axis at 50° north: its rests read the part about the vertical."""
    own = BNO055.gyroscope
    triad = Triad(own.sensitivity, own.bias, own.unit, density * own.density)
    readings, _ = table_recording(replace(BNO055, gyroscope=triad), 5, FAST, 4.0, white=True)
    assert readings.gyroscope is not None
    force = readings.accelerometer.values
    up = force / np.linalg.norm(force, axis=1)[:, None]
    felt = 7.2921e-5 * np.sin(50.0 * DEGREE) * up @ own.sensitivity.T
    series = replace(readings.gyroscope, values=readings.gyroscope.values + felt)
    fit = fit_table(Readings(NONE, series), FAST)
    assert any("Earth's rate" in note for note in fit.warnings) == told
    if told:
        assert fit.covariance is not None
        off = np.abs(fit.bias - own.bias)
        assert (off > 3.0 * np.sqrt(np.diag(fit.covariance)[9:])).all()
        assert off.max() < 7.2921e-5


def test_files_that_hold_the_same_sensor_follow_one_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One file for each mounting, in °/s, with rates in rpm; no accelerometer."""
    readings, _ = table_recording(BNO055, 11, (60.0, 150.0), 4.0, white=True)
    assert readings.gyroscope is not None
    time, values = readings.gyroscope.time, readings.gyroscope.values / DEGREE
    ends = [0, *(np.flatnonzero(np.diff(time) > 1.0) + 1).tolist(), len(time)]
    files = []
    for number in range(len(ends) - 1):
        part = slice(ends[number], ends[number + 1])
        files.append(tmp_path / f"{number}.csv")
        columns = np.column_stack([time[part] - time[part][0], values[part]])
        header = "t[s],gx[deg/s],gy[deg/s],gz[deg/s]"
        np.savetxt(files[-1], columns, "%.6f", ",", header=header, comments="")
    place = tmp_path / "cal.json"
    status = main(
        ["fit", *map(str, files), "--rates", "0,10,25", "--rate-unit", "rpm", "--save", str(place)]
    )
    printed = capsys.readouterr().out
    assert status == 0, printed
    assert "36 steps of 60.0 °/s to 150 °/s in 9 mountings" in printed
    assert "in the gyroscope's own frame" in printed
    for target in ("numpy", "px4"):
        export = ["export", str(place), "--to", target, "-o", str(tmp_path / target), "--json", "-"]
        assert main(export) == 0
        proven = json.loads(capsys.readouterr().out)
        error = proven["sensors"]["gyroscope"]
        assert error["rms_calibration"] < 1e-3 < error["rms_before"]
        if target == "numpy":
            assert error["rms_exported"] == pytest.approx(error["rms_calibration"])
        else:  # fitted again without scales, which the table shows
            assert 0.9 * error["rms_before"] < error["rms_exported"] < error["rms_before"]
        assert any("in its own frame" in note for note in proven["notes"])
    reference = tmp_path / "table.toml"
    sensitivities = np.diag(BNO055.gyroscope.sensitivity)
    lines = [f"sensitivity_{a} = {k}" for a, k in zip("xyz", sensitivities, strict=True)]
    lines += [f'bias_{a} = {{ value = {b}, uncertainty = 0.01, k = 2, unit = "deg/s" }}'
              for a, b in zip("xyz", BNO055.gyroscope.bias / DEGREE, strict=True)]  # fmt: skip
    reference.write_text('name = "rate table"\n[gyroscope]\n' + "\n".join(lines))
    assert main(["diff", str(place), str(reference)]) == 0
    assert "sensitivity_z" in capsys.readouterr().out
    recheck = ["recheck", str(place), *map(str, files), "--sessions", str(tmp_path)]
    assert main([*recheck, "--rates", "0,10,25", "--rate-unit", "rpm"]) == 0
    assert capsys.readouterr().out.startswith("GO")
    assert main(recheck) == 2
    assert "record it on the table, and state the rates or angles (--rates)" in (
        capsys.readouterr().err
    )


def test_the_rows_derivatives_are_those_of_the_rows() -> None:
    """By M, b and an effect, against differences; the effect is taken at the rates found."""
    rng = np.random.default_rng(4)
    where = Circumstances(
        force=rng.standard_normal((5, 3)),
        rate=rng.standard_normal((5, 3)),
        temperature=np.full(5, np.nan),
        time=np.arange(5.0),
        previous=np.zeros((5, 3)),
        vibration=np.zeros(5),
    )
    source = KnownRotation(
        reading=rng.standard_normal((5, 3)),
        seconds=rng.uniform(0.5, 2.0, 5),
        offsets=np.array([0, 1, 5]),
        angle=np.array([1.0, 2.0]),
        noise=np.ones(2),
        circumstances=where,
        labels=unmeasured(2),
    )
    terms = Terms("gyroscope", [Term(effect("g-sensitivity")), Term(effect("second-order"))])
    sizes = 0.01 * rng.standard_normal(len(terms))
    sizes[9:] *= 1e4  # ppm per °/s, of a rate of 60 °/s
    at = Parameters(np.eye(3) + 0.1 * rng.standard_normal((3, 3)), 0.1 * rng.standard_normal(3))

    def residual(entries: FloatArray, more: FloatArray) -> FloatArray:
        moved = Parameters(at.matrix, at.bias, sizes).moved(entries, more, np.zeros(0))
        return source.at(moved, terms).residual

    rows = source.at(Parameters(at.matrix, at.bias, sizes), terms)
    nothing, none = np.zeros(12), np.zeros(len(terms))
    by_entries = [residual(d, none) - residual(-d, none) for d in 1e-6 * np.eye(12)]
    by_sizes = [residual(nothing, d) - residual(nothing, -d) for d in 1e-6 * np.eye(len(terms))]
    for found, changes in (
        (rows.base_columns(), by_entries),
        (rows.term_columns(terms.terms), by_sizes),
    ):
        expected = np.array(changes).T / 2e-6
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7)


@pytest.fixture(scope="module")
def twice() -> Series:
    """Each mounting twice: the first and the second half of the recording show all axes."""
    first, _ = table_recording(BNO055, 5, FAST, 4.0, white=True)
    series = joined(first, first).gyroscope
    assert series is not None
    return series


@pytest.mark.parametrize(
    ("name", "size", "resting", "row", "part"),
    [
        ("bias-step", 0.25, True, 25, 0.7),
        ("bias-step", 0.25, False, 36, 0.4),
        ("scale-step", 1500.0, False, 50, 0.6),
    ],
)
def test_a_step_inside_a_rest_or_a_constant_rate_is_fitted_and_proven(
    twice: Series, tmp_path: Path, name: str, size: float, resting: bool, row: int, part: float
) -> None:
    """Its moment is found, data held out agree, and the file has the errors of the fit."""
    options = FitOptions(rates=tuple(DEGREE * rate for rate in FAST))
    data = rate_table.find_table(twice, KnownRates(options.rates))
    places = data.rests if resting else data.turned
    moment = places[row].start + part * (places[row].end - places[row].start)
    own, axis = BNO055.gyroscope, np.eye(3)[0]
    change = np.tile(size * DEGREE * axis, (len(twice), 1))
    if name == "scale-step":
        true = (twice.values - own.bias) @ np.linalg.inv(own.sensitivity).T
        change = 1e-6 * size * true * axis
    after = twice.time >= moment
    stepped = twice.values + after[:, None] * change @ own.sensitivity.T
    readings = Readings(NONE, replace(twice, values=stepped))
    benches = Benches(fit_readings(readings, options), readings)
    bench = benches.bench("gyroscope")
    assert bench is not None
    span = bench.rows.span
    inside = np.flatnonzero((span[:, 0] < moment) & (moment < span[:, 1]))
    assert len(inside)  # not between two rows, where any moment is as good
    (said,) = diagnose_benches(benches, {}, automatic=False)
    assert said.verdict is Verdict.MISSING
    assert bench.look().suspects[0].term == name
    bench.add(name)
    (term,), fit = bench.fit.terms, bench.fit
    assert fit.minimum is not None
    assert term.variant is not None
    begin, end = span[inside[0]] - twice.time[0]
    assert begin < term.variant < end
    known = Term(term.effect, moment - float(twice.time[0]))
    true_moment = refined_minimum(bench.measured, [known], fit.base)
    # settled to a third of its standard error at least
    assert unlikeliness(fit.minimum) < unlikeliness(true_moment) + 0.1
    assert fit.rms_held_out is not None
    # the rest in which the step lies is foreseen by the others, which do not know its moment
    assert fit.rms_held_out < 3.0 * (fit.floor or 0.0)
    path = tmp_path / "c.json"
    from_report(benches.fitted(), "a test", "2026-01-01T00:00:00+00:00").save(path)
    saved = read_calibration(path)
    errors = Proof(saved).errors(corrections(saved), frame=False)
    assert errors["gyroscope"] == pytest.approx(fit.rms_fitted, rel=1e-9)


@pytest.mark.study
def test_intervals_hold_the_truth_and_the_scatter_is_near_the_bound() -> None:
    """Fresh mountings, white noise, rounding; ``python -m benchmarks.rate_table`` has more."""
    found = study(BNO055, 8, 7300, white=True)
    inside = int(found.inside.sum())
    assert inside >= 62  # of 72 at 95 %: 68.4 ± 1.8
    assert 0.75 < np.sqrt((found.over_bound**2).mean()) < 1.35
    assert found.over_bound.max() < 1.8


def test_a_step_that_disagrees_is_called_a_step_of_the_table() -> None:
    """0.1 rad/s on one axis while the table turns at its seventh rate."""
    readings, _ = table_recording(BNO055, 31, white=True)
    series, rates = readings.gyroscope, tuple(DEGREE * one for one in RATES_DEG)
    assert series is not None
    report = fit_readings(Readings(NONE, series), FitOptions(rates=rates))
    bench = Benches(report).bench("gyroscope")
    assert bench is not None
    (begin, end), *_ = (
        bench.rows.span[row]
        for row in range(len(bench.rows.kind))
        if bench.rows.place(row).startswith("step 7 ")
    )
    during = (series.time > begin) & (series.time < end)
    spoilt = replace(series, values=series.values + 0.1 * during[:, None] * np.eye(3)[1])
    wrong = Readings(NONE, spoilt)
    made = Benches(fit_readings(wrong, FitOptions(rates=rates)), wrong)
    (said,) = diagnose_benches(made, {}, automatic=False)
    assert said.verdict is Verdict.DISTURBED
    assert said.says.startswith("Step 7 of the table explains the misfit")


@pytest.mark.study
def test_an_effect_of_the_rate_is_found_by_itself_and_of_its_size() -> None:
    """2e-5 per °/s on one axis, which is 0.45 °/s at the fastest rate of the table."""
    readings, _ = table_recording(BNO055, 31, white=True)
    assert readings.gyroscope is not None
    own, inverse = BNO055.gyroscope, np.linalg.inv(BNO055.gyroscope.sensitivity)
    rate = (readings.gyroscope.values - own.bias) @ inverse.T
    felt = np.zeros_like(rate)
    felt[:, 1] = 2e-5 / DEGREE * rate[:, 1] ** 2
    series = replace(
        readings.gyroscope, values=readings.gyroscope.values + felt @ own.sensitivity.T
    )
    rates = tuple(DEGREE * one for one in RATES_DEG)
    report = fit_readings(Readings(NONE, series), FitOptions(rates=rates))
    bench = Benches(report, Readings(NONE, series)).bench("gyroscope")
    assert bench is not None
    add_by_itself(bench)
    assert bench.fit.model[3:] == ("second-order",)
    size, error = bench.fit.sizes[0], bench.fit.size_errors[0]
    assert (np.abs(size - [0.0, 20.0, 0.0]) < 4.0 * error).all()
    assert error.max() < 0.3
