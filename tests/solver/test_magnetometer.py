"""The magnetometer: N's figure 7 is found again, with the certainty that is claimed."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.errors import DataError, UsageError
from imucal_wizard.readings import FloatArray, Series
from imucal_wizard.solver.magnetometer.fit import fit_magnetometer, fit_methods
from imucal_wizard.solver.magnetometer.methods import METHODS
from imucal_wizard.solver.student import quantile
from tests.solver.field_truth import (
    CORRECTION,
    MAGNITUDE,
    OFFSET,
    TEN_BITS,
    all_over,
    recorded,
    six_circles,
    true_parameters,
    tumbling,
)

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


@pytest.mark.parametrize("step", [1.0, TEN_BITS])
def test_parameters_are_within_three_standard_errors_and_intervals_cover(step: float) -> None:
    """Forty recordings of N's six circles: all numbers hold, 95 % intervals within binomial 3.5 σ.

    The numbers of one run are correlated, so the spread is that of forty and not of four hundred.
    """
    inside: Counter[str] = Counter()
    runs, far = 40, 0
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        off, reach = deviations(recorded(six_circles(rng, 10.0), rng, step=step).series)
        far += sum(abs(value) > 3.0 for value in off.values())
        for name, value in off.items():
            inside[name] += abs(value) < reach
    assert far <= 0.01 * runs * len(inside)
    for count in inside.values():
        assert abs(count / runs - 0.95) < 3.5 * np.sqrt(0.95 * 0.05 / runs)


def test_many_samples_do_not_bring_out_a_bias() -> None:
    """50,000 samples: mean error over 20 runs is nothing against a single run's standard error."""
    total: FloatArray = np.zeros(10)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        off, _ = deviations(recorded(all_over(rng, 50_000), rng).series)
        total += list(off.values())
    assert np.abs(total / 20).max() < 3.5 / np.sqrt(20)


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


def test_without_a_field_the_determinant_is_one_and_the_matrix_symmetric() -> None:
    """N's gauge; S comes out in counts with a standard error."""
    rng = np.random.default_rng(2)
    fit = fit_magnetometer(recorded(six_circles(rng), rng).series).fit
    assert np.linalg.det(fit.matrix) == pytest.approx(1.0, rel=1e-12)
    assert (fit.matrix == fit.matrix.T).all()
    field = next(p for p in fit.parameters if p.name == "field")
    assert abs(field.value - TRUE["field"]) < 4.0 * (field.standard_error or 0.0)


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
    """Against refitting in full without each fold."""
    from imucal_wizard.ellipsoid.bins import bin_of
    from imucal_wizard.solver.magnetometer.methods import FOLDS

    rng = np.random.default_rng(4)
    made = recorded(tumbling(rng, 3000), rng)
    series = made.series
    whole = fit_magnetometer(series)
    corrected = (series.values - whole.fit.bias) @ whole.fit.matrix.T
    areas = bin_of(corrected.T / np.linalg.norm(corrected, axis=1))
    squares = []
    for fold in range(FOLDS.max() + 1):
        out = FOLDS[areas] == fold
        if not out.any():
            continue
        rest = Series(series.time[~out], series.values[~out], "count")
        fit = fit_magnetometer(rest)
        vectors = (series.values[out] - fit.fit.bias) @ fit.fit.matrix.T
        error = (np.linalg.norm(vectors, axis=1) - fit.magnitude) / fit.magnitude
        squares += [float(np.mean(error[areas[out] == a] ** 2)) for a in np.unique(areas[out])]
    assert whole.relative_error_held_out == pytest.approx(np.sqrt(np.mean(squares)), rel=0.02)
    assert whole.fit.rms_held_out == pytest.approx(
        (whole.relative_error_held_out or 0.0) * whole.magnitude
    )
    assert (whole.relative_error_held_out or 0.0) > whole.relative_error


def test_uneven_density_is_weighed_out() -> None:
    """A stretch where the device lay still while its field was off does not pull the whole fit.

    The field of one face is 2 % too large (a table of steel). Held there ten times as long, the
    fit that counts samples follows it; the one that weighs directions does not.
    """
    rng = np.random.default_rng(5)
    directions = np.concatenate([all_over(rng, 4000), six_circles(rng, 250.0, faces=(0,))])
    near = directions[:, 2] < -0.85
    extra = np.where(near[:, None], 0.02 * MAGNITUDE * directions, 0.0)
    series = recorded(directions, rng, extra=extra).series
    error = {}
    for found in fit_methods(series, methods=("orthogonal", "numeric")):
        truth = MAGNITUDE * directions[:4000]
        corrected = (series.values[:4000] - found.fit.bias) @ found.fit.matrix.T
        size = np.linalg.norm(corrected, axis=1) / found.magnitude
        away = ~near[:4000]
        error[found.fit.method] = float(
            np.sqrt(np.mean((size - np.linalg.norm(truth, axis=1) / MAGNITUDE)[away] ** 2))
        )
    assert error["orthogonal"] < error["numeric"]


def test_a_passing_steel_object_is_left_out_with_its_time() -> None:
    """Ten µT for three seconds: found, named, left out, and the result is the undisturbed one."""
    rng = np.random.default_rng(6)
    directions = six_circles(rng)
    time = np.arange(len(directions)) / 80.0
    bump = 100.0 * np.exp(-(((time - 40.0) / 1.0) ** 2))
    extra = bump[:, None] * np.array([0.6, -0.6, 0.5])
    found = fit_magnetometer(recorded(directions, rng, extra=extra).series)
    assert len(found.left_out) >= 1
    assert any(run.start < 40.0 < run.end for run in found.left_out)
    assert all(run.start > 36.0 and run.end < 44.5 for run in found.left_out)
    assert any("disturbed from" in text for text in found.fit.warnings)
    for parameter in found.fit.parameters:
        off = abs(parameter.value - TRUE[parameter.name])
        assert off < 4.0 * (parameter.standard_error or 0.0)


def test_single_wild_samples_are_left_out() -> None:
    """Five per cent of the samples far off: counted, and without effect."""
    rng = np.random.default_rng(7)
    directions = six_circles(rng)
    extra = np.zeros((len(directions), 3))
    wild = rng.random(len(directions)) < 0.05
    extra[wild] = 500.0 * rng.standard_normal((int(wild.sum()), 3))
    found = fit_magnetometer(recorded(directions, rng, extra=extra).series)
    assert not found.kept[wild].mean() > 0.15
    assert found.kept[~wild].mean() > 0.99
    for parameter in found.fit.parameters:
        off = abs(parameter.value - TRUE[parameter.name])
        assert off < 4.0 * (parameter.standard_error or 0.0)


def test_a_field_that_swings_is_left_out_as_a_stretch() -> None:
    """A loudspeaker for five seconds: its mean is nothing, and half of it lies near the others."""
    rng = np.random.default_rng(37)
    directions = six_circles(rng)
    time = np.arange(len(directions)) / 80.0
    speaker = (time > 20.0) & (time < 25.0)
    extra = 80.0 * np.sin(1.7 * 80.0 * time)[:, None] * np.array([1.0, 0.3, 0.5])
    extra[~speaker] = 0.0
    found = fit_magnetometer(recorded(directions, rng, extra=extra).series)
    assert found.kept[speaker].mean() < 0.1
    assert found.kept[(time < 19.0) | (time > 26.0)].mean() > 0.99
    runs = [run for run in found.left_out if not run.single]
    assert all(run.start > 19.0 and run.end < 26.0 for run in runs)
    for parameter in found.fit.parameters:
        off = abs(parameter.value - TRUE[parameter.name])
        assert off < 4.0 * (parameter.standard_error or 0.0)


def test_a_long_rest_on_one_face_is_no_majority() -> None:
    """Four fifths of the samples on one circle, wild samples between: the rest still counts."""
    rng = np.random.default_rng(36)
    directions = np.concatenate([tumbling(rng, 2400), six_circles(rng, 120.0, faces=(0,))])
    extra = np.zeros((len(directions), 3))
    wild = rng.random(len(directions)) < 0.02
    extra[wild] = 300.0 * rng.standard_normal((int(wild.sum()), 3))
    found = fit_magnetometer(recorded(directions, rng, extra=extra).series)
    assert found.kept[~wild].mean() > 0.99
    for parameter in found.fit.parameters:
        off = abs(parameter.value - TRUE[parameter.name])
        assert off < 4.0 * (parameter.standard_error or 0.0)


def test_undisturbed_samples_are_all_kept() -> None:
    """No false alarm in a clean recording, by circles or by tumbling."""
    rng = np.random.default_rng(8)
    for directions in (six_circles(rng), tumbling(rng, 4000)):
        found = fit_magnetometer(recorded(directions, rng).series)
        assert found.kept.all()
        assert found.fit.warnings == ()


def test_three_circles_do_not_carry_the_off_diagonals() -> None:
    """Those are left at zero, said to be, and have no standard error."""
    rng = np.random.default_rng(9)
    fit = fit_magnetometer(recorded(six_circles(rng, faces=(0, 2, 4)), rng).series).fit
    assert fit.model == ("bias", "scale")
    dropped = {p.name: p for p in fit.parameters if not p.carried}
    assert set(dropped) == {"soft_iron_xy", "soft_iron_xz", "soft_iron_yz"}
    assert all(p.value == 0.0 and p.standard_error is None for p in dropped.values())
    assert any("do not carry" in text for text in fit.warnings)


@pytest.mark.parametrize("faces", [(0, 2, 4), (0, 3), (1, 2), (0, 4)])
def test_what_is_left_at_zero_counts_in_the_errors_of_the_rest(faces: tuple[int, ...]) -> None:
    """N's sensor has soft iron of the usual size: all that is fitted beside it holds."""
    rng = np.random.default_rng(10)
    fit = fit_magnetometer(recorded(six_circles(rng, faces=faces), rng).series).fit
    fitted = [p for p in fit.parameters if p.carried]
    off = [(p.value - TRUE[p.name]) / (p.standard_error or 0.0) for p in fitted]
    assert len(off) == 7
    assert np.abs(off).max() < 3.0


def _saturated(axis: int, rng: np.random.Generator) -> FloatArray:
    values = recorded(six_circles(rng), rng).series.values.copy()
    values[:, axis] = np.minimum(values[:, axis], np.round(OFFSET[axis] + 0.8 * MAGNITUDE))
    return values


def _bad(name: str) -> Series:
    rng = np.random.default_rng(10)
    still = np.tile([0.3, 0.4, 0.866], (3000, 1))
    if name == "dead axis":
        values = recorded(six_circles(rng), rng).series.values.copy()
        values[:, 1] = 17.0
    elif name == "absent":
        values = np.tile([-1.0, -1.0, -1.0], (3000, 1))
    elif name == "saturated":
        values = _saturated(2, rng)
    elif name == "too large":
        return recorded(six_circles(rng), rng, scale=0.3, unit="uT", step=0.0).series
    elif name == "too small":
        return recorded(six_circles(rng), rng, scale=0.02, unit="uT", step=0.0).series
    elif name == "alternating current":
        values = recorded(six_circles(rng), rng).series.values
        values = values + 400.0 * rng.standard_normal(values.shape)
    elif name.endswith("with wild samples"):
        values = _bad(name.removesuffix(" with wild samples")).values
        wild = rng.random(len(values)) < 0.02
        values = values + wild[:, None] * 1500.0 * rng.standard_normal(values.shape)
    else:
        directions = {
            "still": still,
            "few": still[:20],
            "circle": six_circles(rng, faces=(0,), wobble=1.0),
            "half circle": six_circles(rng, faces=(0,), share=0.5),
            "wide half circle": six_circles(rng, faces=(0,), share=0.5, wobble=12.0),
        }[name]
        return recorded(directions, rng).series
    return Series(np.arange(len(values)) / 80.0, values, "count")


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("circle", "one plane"),
        ("half circle", "one plane"),
        ("wide half circle", "of 100 directions"),
        ("still", "does not turn"),
        ("circle with wild samples", "one plane"),
        ("half circle with wild samples", "one plane"),
        ("still with wild samples", "does not turn"),
        ("few", "too few"),
        ("absent", "not there, or asleep"),
        ("dead axis", "axis y"),
        ("saturated", "axis z of the magnetometer is saturated"),
        ("too large", "not the Earth's"),
        ("too small", "not the Earth's"),
        ("alternating current", "does not turn|not one constant field"),
    ],
)
@pytest.mark.parametrize("method", ["orthogonal", "two-step"])
def test_what_carries_no_calibration_is_refused_in_words(name: str, says: str, method: str) -> None:
    """Whatever the method, no result that looks like one."""
    with pytest.raises(DataError, match=says):
        fit_magnetometer(_bad(name), method=method)


@pytest.mark.parametrize("axes", [(2,), (0, 1, 2)])
@pytest.mark.parametrize("share", [0.8, 0.5, 0.2, 0.0])
@pytest.mark.parametrize("step", [1.0, 8.0])
def test_a_range_however_small_is_seen_as_saturated(
    axes: tuple[int, ...], share: float, step: float
) -> None:
    """On one axis or on all, with noise of several steps and of half of one."""
    rng = np.random.default_rng(38)
    series = recorded(six_circles(rng), rng, step=step).series
    values = series.values.copy()
    for axis in axes:
        end = np.round((OFFSET[axis] + share * MAGNITUDE) / step) * step
        values[:, axis] = np.minimum(values[:, axis], end)
    with pytest.raises(DataError, match=f"axis [{''.join('xyz'[k] for k in axes)}] .*saturated"):
        fit_magnetometer(replace(series, values=values))


@pytest.mark.parametrize("rate", [8.0, 25.0, 80.0])
@pytest.mark.parametrize("step", [0.5, 8.0, 16.0])
def test_rests_at_the_end_of_an_axis_are_no_saturation(rate: float, step: float) -> None:
    """Half a minute on each face, straight up and down, at any rate, in fine steps and coarse."""
    rng = np.random.default_rng(39)
    turned = six_circles(rng, wobble=2.0)[:: round(80.0 / rate)]
    rests = np.repeat(np.concatenate([np.eye(3), -np.eye(3)]), round(30.0 * rate), axis=0)
    found = fit_magnetometer(recorded(np.concatenate([turned, rests]), rng, step=step).series)
    assert found.fit.model == ("bias", "soft-iron")


@pytest.mark.parametrize("step", [0.01, 0.1, 0.6])
def test_rests_in_coarse_steps_are_no_disturbance(step: float) -> None:
    """Without noise rounding shifts the mean of a rest as a whole; that is no other field."""
    rng = np.random.default_rng(40)
    parts = []
    for circle in np.split(six_circles(rng, wobble=2.0), 6):
        parts += [circle, np.repeat(circle[-1:], 800, axis=0)]
    series = recorded(np.concatenate(parts), rng, noise=0.0, step=10.0 * step).series
    assert fit_magnetometer(series).kept.mean() > 0.98


def test_quantised_circles_are_not_taken_for_saturation() -> None:
    """At ten bits the axis that points down reads one value in a whole circle."""
    rng = np.random.default_rng(11)
    made = recorded(six_circles(rng, wobble=1.0), rng, step=TEN_BITS, noise=1.0)
    assert fit_magnetometer(made.series).fit.model == ("bias", "soft-iron")


def test_all_methods_are_judged_on_the_same_undisturbed_samples() -> None:
    """N's methods use everything, as printed; what they then err is measured where all is well."""
    rng = np.random.default_rng(12)
    directions = six_circles(rng)
    extra = np.zeros((len(directions), 3))
    extra[2000:2600] = (150.0, 80.0, -60.0)
    fits = fit_methods(recorded(directions, rng, extra=extra).series)
    assert [found.fit.method for found in fits] == list(METHODS)
    assert len({int(found.kept.sum()) for found in fits}) == 1
    held_out = {found.fit.method: found.fit.rms_held_out or 0.0 for found in fits}
    assert held_out["orthogonal"] == min(held_out.values())
    assert held_out["numeric"] > 1.5 * held_out["orthogonal"]
    assert np.abs(fits[0].fit.matrix - CORRECTION).max() < 0.01


@pytest.mark.parametrize("motion", ["circles", "tumbling"])
def test_the_errors_of_every_method_are_what_they_say(motion: str) -> None:
    """In twelve sessions the algebraic and the numeric fit are off by one standard error, rms.

    Two-step errs by its first step too; its errors may be too large, and are not too small.
    """
    off: dict[str, list[list[float]]] = {name: [] for name in METHODS}
    for seed in range(12):
        rng = np.random.default_rng(seed)
        turned = six_circles(rng, 8.0) if motion == "circles" else tumbling(rng, 3000)
        for found in fit_methods(recorded(turned, rng).series):
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
    told = [text for text in found.fit.warnings if "one side is empty" in text]
    assert bool(told) == says
    if told:
        assert told[0].startswith(f"{int((found.filled > 0).sum())} of 100 directions are covered")
