"""The magnetometer: N's figure 7 is found again, with the certainty that is claimed."""

from collections import Counter
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from benchmarks.hold_sessions import DESIGNS
from benchmarks.magnetometer import turned
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.magnetometer.experiment import MagnetometerExperiment
from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
from imucal_wizard.estimate.magnetometer.pieces import FIELD_PIECE_SECONDS
from imucal_wizard.estimate.methods import MethodNames
from imucal_wizard.estimate.parameters import covariance_of
from tests.estimate.field_truth import (
    CORRECTION,
    MAGNITUDE,
    TEN_BITS,
    all_over,
    recorded,
    six_circles,
    true_parameters,
    tumbling,
)
from tests.estimate.truth import EIGHTEEN

METHODS = tuple(MethodNames("magnetometer"))

TRUE = true_parameters()


def deviations(series: Series, method: str = "orthogonal") -> tuple[dict[str, float], float]:
    """Error of each parameter in its standard errors, and the reach of a 95 % interval."""
    fit = fit_magnetometer(series, method=method).fit
    off = {p.name: (p.value - TRUE[p.name]) / (p.standard_error or 0.0) for p in fit.parameters}
    return off, quantile(0.95, min(fit.degrees_of_freedom, 500))


@pytest.mark.parametrize("method", METHODS)
def test_exact_readings_give_the_truth(method: str) -> None:
    """Without noise, evenly from all directions, to rounding; two-step to what its sphere errs."""
    rng = np.random.default_rng(0)
    directions = all_over(rng, 4000)
    even = np.concatenate([directions, -directions])
    fit = fit_magnetometer(recorded(even, rng, noise=0.0, step=0.0).series, method=method).fit
    loose = method == "two-step"
    for parameter in fit.parameters:
        scale = 1.0 if parameter.name.startswith("soft") else MAGNITUDE
        limit = 3e-3 if loose else 1e-6
        assert abs(parameter.value - TRUE[parameter.name]) < limit * scale


def test_the_error_before_is_that_of_the_readings_as_they_are() -> None:
    """In µT and of a field that nobody knows: hard iron makes the mean reading larger than it."""
    rng = np.random.default_rng(4)
    series = recorded(tumbling(rng, 6000), rng, noise=0.0, step=0.0).series
    offset = np.array([0.0, 0.0, MAGNITUDE])
    series = Series(series.time, 0.05 * (series.values + offset), "uT")
    sizes = np.linalg.norm(series.values, axis=1)
    assert fit_magnetometer(series).fit.rms_before == pytest.approx(sizes.std(), rel=0.05)


@pytest.mark.study
@pytest.mark.parametrize("step", [1.0, TEN_BITS])
def test_parameters_are_within_three_standard_errors_and_intervals_cover(step: float) -> None:
    """15 recordings of N's six circles: all numbers hold, 95 % intervals within binomial 3.5 σ.

    The numbers of one run are correlated, so the spread is that of 15 and not of 150.
    """
    inside: Counter[str] = Counter()
    runs, far = 15, 0
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        off, reach = deviations(recorded(six_circles(rng, 10.0), rng, step=step).series)
        far += sum(abs(value) > 3.0 for value in off.values())
        for name, value in off.items():
            inside[name] += abs(value) < reach
    # chance makes 0.5 % ± 0.65 % of ten numbers that are correlated within a run
    assert far <= 0.018 * runs * len(inside)
    for count in inside.values():
        assert abs(count / runs - 0.95) < 3.5 * np.sqrt(0.95 * 0.05 / runs)


@pytest.mark.study
def test_many_samples_do_not_bring_out_a_bias() -> None:
    """50,000 samples: mean error over 20 runs is nothing against a single run's standard error."""
    total: FloatArray = np.zeros(10)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        off, _ = deviations(recorded(all_over(rng, 50_000), rng).series)
        total += list(off.values())
    assert np.abs(total / 20).max() < 3.5 / np.sqrt(20)


def test_poses_repeated_at_the_same_place_repeat_what_rounding_does() -> None:
    """26 rests at ten bits, twice in the same orientations: standard errors as large as the errors.

    Visits that count as independent make the errors 1.4 times the standard errors and more; thirty
    recordings know the ratio of all ten parameters to about 6 %.
    """
    rng = np.random.default_rng(4321)
    poses = np.array([one for one in product((-1.0, 0.0, 1.0), repeat=3) if any(one)])
    off = []
    for _ in range(30):
        placed = poses / np.linalg.norm(poses, axis=1)[:, None]
        placed = placed + 0.1 * rng.standard_normal(placed.shape)
        placed /= np.linalg.norm(placed, axis=1)[:, None]
        zero = TEN_BITS * rng.uniform(size=3)
        held = np.repeat(np.concatenate([placed, placed]), 80, axis=0)
        extra = -zero @ CORRECTION.T
        series = recorded(held, rng, step=TEN_BITS, extra=extra).series
        found, _ = deviations(replace(series, values=series.values + zero))
        off.append(list(found.values()))
    assert 0.8 < np.sqrt(np.mean(np.square(off))) < 1.3


def test_rounding_moves_the_mean_of_a_rest_and_not_that_of_a_turn() -> None:
    """Turns pass some five steps of 10 bits while one of their rows lasts, and some rows none.

    In rests rounding makes most of the error, 1.9 counts rms of each row.
    """
    rng = np.random.default_rng(25)
    data = fit_magnetometer(recorded(turned(rng, DESIGNS["18"]), rng, step=TEN_BITS).series).data
    by_rounding = np.sqrt((data.rounding**2).sum(axis=1))
    still = data.pieces.still(data.samples.magnetic)
    assert root_mean_square(by_rounding[still]) == pytest.approx(1.9, abs=0.4)
    # of a turn its slow ends have some; 1.7 if every row had as much as a rest
    assert root_mean_square(by_rounding[~still]) < 1.1


def test_a_short_arc_of_a_turn_is_no_pose_that_is_held() -> None:
    """Twenty seconds of turning, of which each fifth of a second is a row, and eighteen poses."""
    rng = np.random.default_rng(8)
    for directions, held in (
        (tumbling(rng, 1600), 0),
        (np.repeat(EIGHTEEN, 240, axis=0), 18),
    ):
        data = fit_magnetometer(recorded(directions, rng).series).data
        assert data.pieces.still(data.samples.magnetic).sum() == held


def test_a_pose_ends_where_the_turn_to_the_next_one_begins() -> None:
    """Turns of 2 s between poses of 3 s: a hand turns the device by 2° in 0.3 s at most."""
    rng = np.random.default_rng(17)
    data = fit_magnetometer(recorded(turned(rng, DESIGNS["18"]), rng).series).data
    held = data.pieces.span[data.pieces.still(data.samples.magnetic)]
    begin = 5.0 * np.arange(18)
    away = 0.3 + 0.5 * FIELD_PIECE_SECONDS
    assert held == pytest.approx(np.column_stack([begin, begin + 3.0]), abs=away)


def test_a_given_field_fixes_the_scale() -> None:
    """With 43.8 µT the matrix is µT per count and every corrected reading has that length."""
    rng = np.random.default_rng(1)
    series = recorded(six_circles(rng), rng).series
    found = fit_magnetometer(series, field=43.8)
    assert found.fit.unit == "uT"
    assert np.linalg.det(found.fit.matrix) ** (1 / 3) == pytest.approx(
        43.8 / TRUE["field"], rel=1e-3
    )
    corrected = (series.values - found.fit.bias) @ found.fit.matrix.T
    assert np.linalg.norm(corrected, axis=1).mean() == pytest.approx(43.8, rel=1e-3)
    assert "field" not in {p.name for p in found.fit.parameters}


@pytest.mark.parametrize("field", [None, MAGNITUDE])
def test_a_method_has_the_floor_of_its_rows_and_the_correlations_of_its_parameters(
    field: float | None,
) -> None:
    """Six circles: noise makes what the fit says it makes, and moves the parameters alike."""
    rng = np.random.default_rng(2)
    series = recorded(six_circles(rng, 3.0), rng).series
    own, printed = (
        fit_magnetometer(series, field, method).fit for method in ("orthogonal", "numeric")
    )
    assert own.floor is not None
    assert printed.floor == pytest.approx(own.floor, rel=0.02)
    assert printed.floor_fitted == pytest.approx(own.floor_fitted, rel=0.02)
    joint = covariance_of(printed)
    assert joint is not None
    errors = [one.standard_error or 0.0 for one in printed.parameters]
    np.testing.assert_allclose(np.sqrt(np.diag(joint)), errors, rtol=1e-9)
    assert (joint != np.diag(np.diag(joint))).any()


def test_without_a_field_the_determinant_is_one_and_the_matrix_symmetric() -> None:
    """N's gauge; S comes out in counts with a standard error."""
    rng = np.random.default_rng(2)
    fit = fit_magnetometer(recorded(six_circles(rng), rng).series).fit
    assert np.linalg.det(fit.matrix) == pytest.approx(1.0, rel=1e-12)
    assert (fit.matrix == fit.matrix.T).all()
    field = next(p for p in fit.parameters if p.name == "field")
    assert abs(field.value - TRUE["field"]) < 4.0 * (field.standard_error or 0.0)


def test_a_field_that_drifts_weighs_the_rows_and_is_no_noise_of_the_samples() -> None:
    """By a tenth of a per cent in a random walk: the floor stays, the interval held out widens.

    By 8 % here: no more of what is left is taken as slow than measured noise does not explain.
    """
    rng = np.random.default_rng(11)
    directions = six_circles(rng, 10.0)
    walk = np.cumsum(rng.standard_normal(len(directions))) / np.sqrt(len(directions))
    drift = 3.0 * directions * (walk - walk.mean())[:, None]
    still, moved = (
        fit_magnetometer(recorded(directions, np.random.default_rng(12), extra=extra).series).fit
        for extra in (0.0, drift)
    )
    (low, high), (narrow, wide) = (
        still.held_out_interval or (0, 0),
        moved.held_out_interval or (0, 0),
    )
    assert wide / narrow > 1.05 * high / low
    assert moved.floor == pytest.approx(still.floor, rel=0.05)
    assert np.linalg.det(moved.matrix) == pytest.approx(1.0, abs=1e-8)


def test_the_report_says_whether_slow_noise_was_measured() -> None:
    """One circle after the other takes most of a drift for soft iron; circles again show it."""
    rng = np.random.default_rng(13)
    once, again = six_circles(rng, 5.0), six_circles(rng, 5.0)
    fit = fit_magnetometer(recorded(once, rng).series).fit
    assert fit.slow_noise_measured is False
    assert "same directions again" in fit.slow_noise_note
    assert "a drift of the field were not measured" in fit.slow_noise_note
    assert fit_magnetometer(
        recorded(np.concatenate([once, again]), rng).series
    ).fit.slow_noise_measured


def test_turns_between_poses_do_not_repeat_a_pose() -> None:
    """They pass directions that were held before, a tenth as long; poses held again repeat them."""
    for design, expected in (("18", False), ("26 + 12", True)):
        rng = np.random.default_rng(23)
        series = recorded(turned(rng, DESIGNS[design]), rng).series
        assert fit_magnetometer(series).fit.slow_noise_measured is expected


def test_corrected_readings_point_where_the_field_points() -> None:
    """Up to the rotation that no magnitude shows: here none, since figure 7 is symmetric."""
    rng = np.random.default_rng(3)
    made = recorded(tumbling(rng, 4000), rng)
    fit = fit_magnetometer(made.series).fit
    corrected = (made.series.values - fit.bias) @ fit.matrix.T
    cosines = (corrected * made.field).sum(axis=1) / (
        np.linalg.norm(corrected, axis=1) * np.linalg.norm(made.field, axis=1)
    )
    assert np.degrees(np.arccos(np.clip(cosines, -1, 1))).mean() < 1.0


def test_the_error_held_out_is_that_of_a_fit_without_those_directions() -> None:
    """Against fitting the groups anew without those of each direction."""
    rng = np.random.default_rng(4)
    whole = fit_magnetometer(recorded(tumbling(rng, 3000), rng).series)
    rows, data = whole.fit.rows, whole.data
    assert rows is not None
    out = np.empty(len(data))
    for group in np.unique(rows.group):
        kept = rows.group != group
        noise = np.where(kept, data.noise, 1e6 * data.field**2)
        rest = fit(MagnetometerExperiment(replace(data, noise=noise)))
        assert rest.rows is not None
        out[~kept] = rest.rows.residual[~kept]
    assert whole.fit.held_out is not None
    assert np.sqrt(np.mean(out**2)) == pytest.approx(whole.fit.rms_held_out, rel=0.05)
    assert whole.fit.rms_held_out == pytest.approx(
        (whole.relative_error_held_out or 0.0) * whole.magnitude
    )
    assert (whole.relative_error_held_out or 0.0) > whole.relative_error


def test_uneven_density_is_weighed_out() -> None:
    """A long stretch in one direction while its field was off does not pull the whole fit.

    The field of one face is 2 % too large (a table of steel). Turned there for five times as long,
    the fit that counts samples follows it more than the fit of rows by direction and time.
    """
    rng = np.random.default_rng(5)
    directions = np.concatenate([tumbling(rng, 4000), six_circles(rng, 250.0, faces=(0,))])
    near = directions[:, 2] < -0.85
    extra = np.where(near[:, None], 0.02 * MAGNITUDE * directions, 0.0)
    series = recorded(directions, rng, extra=extra).series
    error = {}
    for found in (fit_magnetometer(series, method=name) for name in ("orthogonal", "numeric")):
        truth = MAGNITUDE * directions[:4000]
        corrected = (series.values[:4000] - found.fit.bias) @ found.fit.matrix.T
        size = np.linalg.norm(corrected, axis=1) / found.magnitude
        away = ~near[:4000]
        error[found.fit.method] = float(
            np.sqrt(np.mean((size - np.linalg.norm(truth, axis=1) / MAGNITUDE)[away] ** 2))
        )
    assert error["orthogonal"] < error["numeric"]


def test_three_circles_do_not_determine_the_off_diagonals() -> None:
    """Those are left at zero, said to be, and have no standard error."""
    rng = np.random.default_rng(9)
    fit = fit_magnetometer(recorded(six_circles(rng, faces=(0, 2, 4)), rng).series).fit
    assert fit.model == ("bias", "scale")
    dropped = {p.name: p for p in fit.parameters if not p.carried}
    assert set(dropped) == {"soft_iron_xy", "soft_iron_xz", "soft_iron_yz"}
    assert all(p.value == 0.0 and p.standard_error is None for p in dropped.values())
    assert any("do not determine" in text for text in fit.warnings)


@pytest.mark.parametrize("method", ["orthogonal", "algebraic", "two-step", "numeric"])
def test_directions_within_sixty_degrees_give_the_hard_iron_only_by_every_method(
    method: str,
) -> None:
    rng = np.random.default_rng(9)
    directions = tumbling(rng, 20_000)
    found = fit_magnetometer(recorded(directions[directions[:, 2] > 0.5], rng).series, None, method)
    assert any("the soft iron is left out" in text for text in found.fit.warnings)
    assert found.fit.matrix == pytest.approx(np.eye(3), abs=1e-5)


@pytest.mark.parametrize("faces", [(0, 2, 4), (0, 3), (1, 2), (0, 4)])
def test_what_is_left_at_zero_counts_in_the_errors_of_the_rest(faces: tuple[int, ...]) -> None:
    """N's sensor has soft iron of the usual size: all that is fitted beside it holds."""
    rng = np.random.default_rng(10)
    fit = fit_magnetometer(recorded(six_circles(rng, faces=faces), rng).series).fit
    fitted = [p for p in fit.parameters if p.carried]
    off = [(p.value - TRUE[p.name]) / (p.standard_error or 0.0) for p in fitted]
    assert len(off) == 7
    assert np.abs(off).max() < 3.0


@pytest.mark.study
@pytest.mark.parametrize("motion", ["circles", "tumbling"])
def test_the_errors_of_every_method_are_as_stated(motion: str) -> None:
    """In eight sessions the algebraic and the numeric fit are off by one standard error, rms.

    Two-step errs by its first step too; its errors may be too large, and are not too small.
    """
    off: dict[str, list[list[float]]] = {name: [] for name in METHODS}
    for seed in range(8):
        rng = np.random.default_rng(seed)
        turned = six_circles(rng, 8.0) if motion == "circles" else tumbling(rng, 3000)
        series = recorded(turned, rng).series
        for found in (fit_magnetometer(series, method=name) for name in METHODS):
            away = [
                (p.value - TRUE[p.name]) / (p.standard_error or 0) for p in found.fit.parameters
            ]
            off[found.fit.method].append(away)
    rms = {name: float(np.sqrt(np.mean(np.square(values)))) for name, values in off.items()}
    for name in ("orthogonal", "algebraic", "numeric"):
        assert 0.75 < rms[name] < 1.35, name
    assert rms["two-step"] < 1.35


def test_an_unknown_method_is_a_mistake_of_the_user() -> None:
    """The message names those there are."""
    rng = np.random.default_rng(13)
    with pytest.raises(UsageError, match="two-step"):
        fit_magnetometer(recorded(all_over(rng, 500), rng).series, method="magic")


@pytest.mark.parametrize(
    ("name", "says"), [("everywhere", False), ("one half", True), ("two ends", False)]
)
def test_an_empty_side_is_said(name: str, says: bool) -> None:
    """Half a sphere carries all nine parameters, but the other half is extrapolated."""
    rng = np.random.default_rng(20)
    directions = all_over(rng, 12000)
    height = directions[:, 2]
    seen = {"everywhere": height > -2.0, "one half": height > -0.1, "two ends": abs(height) > 0.5}
    found = fit_magnetometer(recorded(directions[seen[name]], rng).series)
    assert found.fit.model == ("bias", "soft-iron")
    warnings = [text for text in found.fit.warnings if "one side is empty, that of −z:" in text]
    assert bool(warnings) == says
    if warnings:
        assert warnings[0].startswith(
            f"{int((found.filled > 0).sum())} of 100 directions are covered"
        )
