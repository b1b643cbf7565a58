"""The accelerometer with effects against what is known exactly."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.accelerometer import AccelerometerExperiment, accelerometer_experiment
from imucal_wizard.estimate.fit import fit, minimum
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import Effect
from imucal_wizard.model.rows.table import ResidualTable
from imucal_wizard.model.terms import Term, Terms
from tests.estimate.extended.holds import BIAS, MATRIX, G, Session, circumstances, holds, session
from tests.estimate.extended.sizes import drawn

EFFECTS = effects_for("accelerometer")
MILLI_G = G / 1000.0


def data_of(made: Session, *args: object, **kwargs: object) -> AccelerometerExperiment:
    """The rows of holds, with the vibration that they had."""
    found = holds(made, *args, **kwargs)  # type: ignore[arg-type] # passed on
    data = accelerometer_experiment(found, G, "m/s^2")
    data.circumstances = replace(data.circumstances, vibration=made.vibration)
    data.source = replace(data.source, circumstances=data.circumstances)
    data.sources = (data.source,)
    return data


@pytest.mark.parametrize("one", EFFECTS, ids=lambda one: one.name)
def test_every_effect_is_found_exactly_where_there_is_no_noise(one: Effect) -> None:
    """Combinations that the holds determine come out as put in; nothing is left of the error."""
    made = session()
    variant = one.variants(circumstances(made))[0]
    term = Term(one, variant)
    sizes = drawn(Terms("accelerometer", (term,)))
    found = fit(data_of(made, (term,), sizes), (term,))
    typical = np.array([p.typical for p in one.parameters("accelerometer")])
    assert found.size_covariance is not None
    variances, combinations = np.linalg.eigh(found.size_covariance / np.outer(typical, typical))
    errors = np.sqrt(np.maximum(variances, 0.0))
    missed = combinations.T @ ((found.sizes[0] - sizes) / typical)
    determined = errors < 1e-2
    # the pose before is known to the error of the base fit, some thousandths of a radian
    exact = 1e-2 if one.name == "hysteresis" else 1e-4
    assert (np.abs(missed) <= exact + 5.0 * errors)[determined].all()
    assert found.rms_fitted < (1e-6 if one.name == "hysteresis" else 1e-7) * G * 10.0
    # along gravity y·z on x, x·z on y and x·y on z are one; so are x·y² on x and y·x² on y, and
    # the two other pairs, while x²y on x, x·y² on y and x·y·z on z add up to a cross-axis
    # sensitivity, and so do two other triples
    alike = {"cross-product": 2, "cubic-cross": 6}.get(one.name, 0)
    assert determined.sum() >= len(sizes) - alike


@pytest.mark.parametrize("one", EFFECTS, ids=lambda one: one.name)
def test_the_linear_form_follows_the_residual(one: Effect) -> None:
    """``design_columns`` are the derivatives of the nonlinear residual of a fit with effects."""
    made = session(4)
    inside = Term(effect("second-order"))
    noisy = {"noise": 0.3 * MILLI_G, "rng": np.random.default_rng(5)}
    data = data_of(made, (inside,), np.array([3.0, -2.0, 1.0]), **noisy)
    fitted = fit(data, (inside,))
    variant = one.variants(data.circumstances)[0]
    lift = _table(fitted).design_columns([Term(one, variant)])
    assert lift.shape == (len(made.up), len(one.parameters("accelerometer")))
    for k in range(lift.shape[1]):
        step = 1e-3 * one.parameters("accelerometer")[k].typical
        unit = step * np.eye(lift.shape[1])[k]
        ahead, behind = (
            _residual(fitted, data, (*fitted.terms, Term(one, variant)), (*fitted.sizes, s * unit))
            for s in (1.0, -1.0)
        )
        slope = (ahead - behind) / (2.0 * step)
        np.testing.assert_allclose(lift[:, k], slope, rtol=1e-5, atol=1e-6 * np.abs(lift).max())


def _residual(
    fitted: SensorFit,
    data: AccelerometerExperiment,
    terms: tuple[Term, ...],
    sizes: tuple[FloatArray, ...],
) -> FloatArray:
    """The error of each hold through the public correction."""
    readings = np.array([hold.accelerometer for hold in data.holds])
    moved = replace(fitted, terms=terms, sizes=sizes)
    force = moved.correct(readings, data.circumstances)
    return np.asarray(np.linalg.norm(force, axis=1) - data.gravity)


def test_the_residual_turns_with_every_base_parameter_as_its_column_says() -> None:
    """Biases and M's entries: central differences of the corrected magnitude."""
    made = session(4)
    inside = Term(effect("second-order"))
    data = data_of(made, (inside,), np.array([3.0, -2.0, 1.0]))
    fitted = fit(data, (inside,))
    table, span = _table(fitted), float(np.ptp(data.source.reading)) / 2.0
    for k, name in enumerate(table.names[:9]):
        ends = []
        for sign in (1.0, -1.0):
            matrix, bias = fitted.matrix.copy(), fitted.bias.copy()
            if name.startswith("bias"):
                step = 1e-5 * span
                bias["xyz".index(name[-1])] += sign * step
            else:
                place = "xyz".index(name[0]), "xyz".index(name[1])
                step = 1e-5 * G / span
                matrix[place] += sign * step
            moved = replace(fitted, matrix=matrix, bias=bias)
            ends.append(_residual(moved, data, fitted.terms, fitted.sizes))
        slope = (ends[0] - ends[1]) / (2.0 * step)
        atol = 1e-6 * np.abs(slope).max()
        np.testing.assert_allclose(table.columns[:, k], slope, rtol=1e-5, atol=atol)


def _table(found: SensorFit) -> ResidualTable:
    assert found.rows is not None
    return found.rows


def test_correcting_gives_back_the_true_force() -> None:
    """``correct`` undoes the forward model, effects that depend on the force itself included."""
    made = session(6)
    terms = (Term(effect("second-order")), Term(effect("bias-temperature")))
    sizes = np.array([4.0, -3.0, 2.0, 0.5, -0.4, 0.3])
    data = data_of(made, terms, sizes)
    found = fit(data, terms)
    readings = np.array([hold.accelerometer for hold in data.holds])
    np.testing.assert_allclose(
        found.correct(readings, circumstances(made)), G * made.up, atol=1e-5 * MILLI_G * 100.0
    )
    np.testing.assert_allclose(found.matrix, MATRIX, atol=1e-7)
    np.testing.assert_allclose(found.bias, BIAS, atol=1e-6)


def test_the_ladder_climbs_from_nothing() -> None:
    """Each further base term lowers the error; what is not fitted stays at its nominal value."""
    made = session(7)
    data = data_of(made, noise=0.1 * MILLI_G, rng=np.random.default_rng(8))
    ladder = [(), ("bias",), ("bias", "scale"), ("bias", "scale", "non-orthogonality")]
    fits = [fit(data, (), base) for base in ladder]
    errors = [one.rms_fitted for one in fits]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] == pytest.approx(fits[-1].rms_before, rel=1e-9)
    assert errors[-1] < 0.2 * MILLI_G
    np.testing.assert_array_equal(fits[1].matrix, np.eye(3))
    assert [p.carried for p in fits[1].parameters] == [True] * 3 + [False] * 6
    np.testing.assert_array_equal(np.triu(fits[2].matrix, 1), 0.0)


def test_leaving_a_direction_out_is_a_refit_without_it() -> None:
    """The held-out errors agree with fits of their own to the other directions."""
    made = session(9, repeats=6)
    term = Term(effect("second-order"))
    noisy = {"noise": 0.3 * MILLI_G, "rng": np.random.default_rng(10)}
    data = data_of(made, (term,), np.array([4.0, 0.0, 0.0]), **noisy)
    found = fit(data, (term,))
    labels, table = data.source.labels.group, _table(found)
    assert found.held_out is not None
    for label in (0, 5, 11):
        kept = labels != label
        # rows of enormous variance have no say
        own = minimum(data, (term,), variance=np.where(kept, table.variance, 1e12))
        errors = own.rows[0].residual
        # but for the width of the prior, which the others choose anew
        np.testing.assert_allclose(errors[~kept], found.held_out[~kept], rtol=1e-2)


def test_a_drift_is_predicted_from_the_earlier_part_only_when_it_is_in_the_model() -> None:
    """Early → late: the error of the later holds falls to the noise with the drift and not else."""
    made = session(11, repeats=20)
    term = Term(effect("bias-drift"))
    noisy = {"noise": 0.1 * MILLI_G, "rng": np.random.default_rng(12)}
    data = data_of(made, (term,), np.array([0.8, -0.6, 0.7]), **noisy)
    without, with_it = fit(data), fit(data, (term,))
    assert without.rms_late is not None
    assert with_it.rms_late is not None
    assert without.rms_late > 10.0 * with_it.rms_late
    assert with_it.rms_late < 0.3 * MILLI_G


def test_the_standard_errors_of_sizes_are_honest() -> None:
    """In 80 recordings the scaled error of each size has about the spread of Student's t."""
    made = session(13)
    term, sizes = Term(effect("second-order")), np.array([2.0, -1.0, 0.5])
    rng = np.random.default_rng(14)
    scaled = []
    for _ in range(80):
        noisy = data_of(made, (term,), sizes, noise=0.3 * MILLI_G, rng=rng)
        found = fit(noisy, (term,))
        scaled.append((found.sizes[0] - sizes) / found.size_errors[0])
    inside = np.mean(np.abs(scaled) < 2.06)  # 95 % of t with 25 degrees of freedom
    assert 0.91 < inside < 0.99


def test_the_prior_keeps_an_undetermined_combination_from_spoiling_new_poses() -> None:
    """Cross products on six faces and twelve edges: nothing there shows x·y·z, corners do."""
    rng = np.random.default_rng(15)
    flat = Term(_flat(effect("cross-product")))  # all but least squares
    careful = Term(effect("cross-product"))
    made, corners = session(16, directions=18, repeats=0), session(17, repeats=0)
    errors: dict[str, list[float]] = {"map": [], "least squares": []}
    for seed in range(6):
        sizes = drawn(Terms("accelerometer", (careful,)), seed)
        data = data_of(made, (careful,), sizes, noise=0.3 * MILLI_G, rng=rng)
        new = data_of(corners, (careful,), sizes)
        for name, term in (("map", careful), ("least squares", flat)):
            found = fit(data, (term,))
            residual = _residual(found, new, found.terms, found.sizes)
            errors[name].append(float(np.sqrt(np.mean(residual**2))))
    careful_rms, flat_rms = (np.sqrt(np.mean(np.square(errors[name]))) for name in errors)
    assert careful_rms < 1.5 * MILLI_G
    assert flat_rms > 2.0 * careful_rms


def _flat(one: Effect) -> Effect:
    """The same effect of which hardly anything is known beforehand."""
    kind = type(one)

    class Flat(kind):  # type: ignore[misc, valid-type] # a subclass of whatever effect it is
        def parameters(self, sensor: str):  # type: ignore[no-untyped-def] # as the parent's
            return tuple(replace(p, typical=10.0 * p.typical) for p in super().parameters(sensor))

    made: Effect = Flat()
    return made


def test_an_effect_far_larger_than_its_prior_is_not_taken_for_scatter() -> None:
    """Thirty typical sizes on one axis come out within their standard error."""
    made = session(18)
    term = Term(effect("second-order"))
    noisy = {"noise": 0.05 * MILLI_G, "rng": np.random.default_rng(19)}
    data = data_of(made, (term,), np.array([0.0, 60.0, 0.0]), **noisy)
    found = fit(data, (term,))
    assert np.abs((found.sizes[0] - [0.0, 60.0, 0.0]) / found.size_errors[0]).max() < 4.0
    assert found.size_errors[0].max() < 0.1


def test_a_rest_cut_in_two_has_one_pose_before() -> None:
    """The second half of a disturbed rest remembers the pose before the first half."""
    made = session(20, repeats=0)
    cut = replace(
        made,
        up=np.insert(made.up, 5, made.up[5], axis=0),
        temperature=np.insert(made.temperature, 5, 25.0),
        vibration=np.insert(made.vibration, 5, 0.02),
    )
    before = accelerometer_experiment(holds(cut), G, "m/s^2").circumstances.previous
    assert np.isnan(before[0]).all()
    np.testing.assert_array_equal(before[6], before[5])
    np.testing.assert_allclose(before[5], G * made.up[4], atol=1e-4)


def test_an_effect_of_another_sensor_is_refused() -> None:
    """An accelerometer has no g-sensitivity."""
    data = data_of(session())
    with pytest.raises(UsageError, match="g-sensitivity is no effect of the accelerometer"):
        fit(data, (Term(effect("g-sensitivity")),))
    with pytest.raises(UsageError, match="'sacle' is not in the base"):
        fit(data, (), ("sacle",))


def test_the_first_hold_does_not_judge_an_effect_of_the_pose_before() -> None:
    """Nobody knows the pose before it: what that pose makes of it is noise, and sizes are right."""
    made, term = session(6), Term(effect("hysteresis"))
    sizes, noise = np.array([0.0, 0.8, 0.0]), 0.03 * MILLI_G
    for seed in range(4):
        first, *others = holds(made, (term,), sizes, noise, np.random.default_rng(seed))
        # the device came from a pose with an end of the y axis up
        felt = (-1.0) ** seed * MILLI_G * np.linalg.inv(MATRIX) @ sizes
        first = replace(first, accelerometer=first.accelerometer + felt)
        found = fit(accelerometer_experiment([first, *others], G, "m/s^2"), (term,))
        assert np.abs((found.sizes[0] - sizes) / found.size_errors[0]).max() < 4.0
        table = _table(found)
        assert np.abs(table.residual / np.sqrt(table.variance)).max() < 4.0
