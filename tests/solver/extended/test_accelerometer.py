"""The accelerometer with effects against what is known exactly."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.effects.catalogue import effect, effects_for
from imucal_wizard.effects.effect import Effect
from imucal_wizard.errors import UsageError
from imucal_wizard.readings import BoolArray, FloatArray
from imucal_wizard.solver.accelerometer import fit_accelerometer
from imucal_wizard.solver.extended.accelerometer import fit_accelerometer_with
from imucal_wizard.solver.extended.hold_data import BASE, HoldData, hold_data
from imucal_wizard.solver.extended.hold_fit import fit_holds
from imucal_wizard.solver.extended.result import Extended, correct
from imucal_wizard.solver.extended.terms import Term, Terms
from tests.solver.extended.holds import BIAS, MATRIX, G, Session, circumstances, holds, session
from tests.solver.extended.sizes import drawn

EFFECTS = effects_for("accelerometer")
MILLI_G = G / 1000.0


def data_of(made: Session, *args: object, **kwargs: object) -> HoldData:
    """The data of holds, with the vibration that they had."""
    data = hold_data(holds(made, *args, **kwargs), G, "m/s^2")  # type: ignore[arg-type] # passed on
    return replace(data, circumstances=replace(data.circumstances, vibration=made.vibration))


@pytest.mark.parametrize("one", EFFECTS, ids=lambda one: one.name)
def test_every_effect_is_found_exactly_where_there_is_no_noise(one: Effect) -> None:
    """What the holds determine comes out as put in, and nothing is left of the error."""
    made = session()
    variant = one.variants(circumstances(made))[0]
    term = Term(one, variant)
    sizes = drawn(Terms("accelerometer", (term,)))
    found = fit_accelerometer_with(data_of(made, (term,), sizes), (term,))
    typical = np.array([p.typical for p in one.parameters("accelerometer")])
    told = found.errors[0] < 1e-2 * typical
    # the pose before is known to the error of the base fit, some thousandths of a radian
    exact = 1e-2 if one.name == "hysteresis" else 1e-4
    allowed = exact * typical + 5.0 * found.errors[0]
    assert (np.abs(found.sizes[0] - sizes)[told] <= allowed[told]).all()
    assert found.rms_fitted < (1e-6 if one.name == "hysteresis" else 1e-7) * G * 10.0
    assert told.sum() >= (2 if one.name == "cross-product" else 3)


def test_without_effects_it_is_the_base_fit() -> None:
    """The plain fit and the one with effects are one estimate, with one set of standard errors."""
    made = session(2)
    found = holds(made, noise=0.3 * MILLI_G, rng=np.random.default_rng(3))
    plain = fit_accelerometer(found, G, "m/s^2").fit
    extended = fit_accelerometer_with(hold_data(found, G, "m/s^2")).fit
    np.testing.assert_allclose(extended.matrix, plain.matrix, atol=2e-7)
    np.testing.assert_allclose(extended.bias, plain.bias, atol=2e-6)
    assert extended.rms_held_out == pytest.approx(plain.rms_held_out, rel=1e-3)
    for mine, theirs in zip(extended.parameters, plain.parameters, strict=True):
        assert mine.standard_error == pytest.approx(theirs.standard_error, rel=1e-2)


@pytest.mark.parametrize("one", EFFECTS, ids=lambda one: one.name)
def test_the_linear_form_follows_the_residual(one: Effect) -> None:
    """``base`` and ``lift`` are the derivatives of the nonlinear residual of a fit with effects."""
    made = session(4)
    inside = Term(effect("second-order"))
    noisy = {"noise": 0.3 * MILLI_G, "rng": np.random.default_rng(5)}
    data = data_of(made, (inside,), np.array([3.0, -2.0, 1.0]), **noisy)
    fitted = fit_accelerometer_with(data, (inside,))
    variant = one.variants(data.circumstances)[0]
    lift = fitted.linear.lift(one, variant)
    assert lift.shape == (len(made.up), len(one.parameters("accelerometer")))
    for k in range(lift.shape[1]):
        step = 1e-3 * one.parameters("accelerometer")[k].typical
        unit = step * np.eye(lift.shape[1])[k]
        ahead, behind = (
            _residual(fitted, data, (*fitted.terms, Term(one, variant)), (*fitted.sizes, s * unit))
            for s in (1.0, -1.0)
        )
        slope = (ahead - behind) / (2.0 * step) / fitted.linear.sigma
        np.testing.assert_allclose(lift[:, k], slope, rtol=1e-5, atol=1e-6 * np.abs(lift).max())


def _residual(
    fitted: Extended, data: HoldData, terms: tuple[Term, ...], sizes: tuple[FloatArray, ...]
) -> FloatArray:
    """The error of each hold through the public correction."""
    readings = np.array([hold.accelerometer for hold in data.holds])
    force = correct(fitted.fit, terms, sizes, readings, data.circumstances)
    return np.asarray(np.linalg.norm(force, axis=1) - data.gravity)


def test_the_residual_turns_with_every_base_parameter_as_its_column_says() -> None:
    """Biases and M's entries: central differences of the corrected magnitude."""
    made = session(4)
    inside = Term(effect("second-order"))
    data = data_of(made, (inside,), np.array([3.0, -2.0, 1.0]))
    fitted = fit_accelerometer_with(data, (inside,))
    problem = data.task.problem
    for k, name in enumerate(fitted.linear.names[:9]):
        ends = []
        for sign in (1.0, -1.0):
            matrix, bias = fitted.fit.matrix.copy(), fitted.fit.bias.copy()
            if name.startswith("bias"):
                bias["xyz".index(name[-1])] += sign * 1e-5 * problem.span
            else:
                place = "xyz".index(name[0]), "xyz".index(name[1])
                matrix[place] += sign * 1e-5 * G / problem.span
            moved = replace(fitted, fit=replace(fitted.fit, matrix=matrix, bias=bias))
            ends.append(_residual(moved, data, fitted.terms, fitted.sizes))
        slope = (ends[0] - ends[1]) / 2e-5 / fitted.linear.sigma
        atol = 1e-6 * np.abs(slope).max()
        np.testing.assert_allclose(fitted.linear.base[:, k], slope, rtol=1e-5, atol=atol)


def test_correcting_gives_back_the_true_force() -> None:
    """``correct`` undoes the forward model, effects that depend on the force itself included."""
    made = session(6)
    terms = (Term(effect("second-order")), Term(effect("bias-temperature")))
    sizes = np.array([4.0, -3.0, 2.0, 0.5, -0.4, 0.3])
    data = data_of(made, terms, sizes)
    found = fit_accelerometer_with(data, terms)
    readings = np.array([hold.accelerometer for hold in data.holds])
    np.testing.assert_allclose(
        found.correct(readings, circumstances(made)), G * made.up, atol=1e-5 * MILLI_G * 100.0
    )
    np.testing.assert_allclose(found.fit.matrix, MATRIX, atol=1e-7)
    np.testing.assert_allclose(found.fit.bias, BIAS, atol=1e-6)


def test_the_ladder_climbs_from_nothing() -> None:
    """Each further base term lowers the error; what is not fitted stays at its nominal value."""
    made = session(7)
    data = data_of(made, noise=0.1 * MILLI_G, rng=np.random.default_rng(8))
    ladder = [(), ("bias",), ("bias", "scale"), ("bias", "scale", "non-orthogonality")]
    fits = [fit_accelerometer_with(data, (), base) for base in ladder]
    errors = [one.rms_fitted for one in fits]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] == pytest.approx(fits[-1].fit.rms_before, rel=1e-9)
    assert errors[-1] < 0.2 * MILLI_G
    np.testing.assert_array_equal(fits[1].fit.matrix, np.eye(3))
    assert [p.carried for p in fits[1].fit.parameters] == [True] * 3 + [False] * 6
    np.testing.assert_array_equal(np.triu(fits[2].fit.matrix, 1), 0.0)


def test_leaving_a_direction_out_is_a_refit_without_it() -> None:
    """The held-out errors agree with fits of their own to the other directions."""
    made = session(9, repeats=6)
    term = Term(effect("second-order"))
    noisy = {"noise": 0.3 * MILLI_G, "rng": np.random.default_rng(10)}
    data = data_of(made, (term,), np.array([4.0, 0.0, 0.0]), **noisy)
    found = fit_accelerometer_with(data, (term,))
    labels = data.task.labels
    assert found.fit.held_out is not None
    for label in (0, 5, 11):
        kept = labels != label
        part = _selected(data, kept)
        part = replace(part, scatter=float(np.sqrt((found.linear.sigma**2 - data.noise)[0])))
        own = fit_accelerometer_with(part, (term,))
        errors = _residual(own, data, own.terms, own.sizes)
        np.testing.assert_allclose(errors[~kept], found.fit.held_out[~kept], atol=2e-3 * MILLI_G)


def _selected(data: HoldData, rows: BoolArray) -> HoldData:
    """The same problem with some of the holds, in the same units and with the same weights."""
    task = data.task
    problem = replace(task.problem, points=task.problem.points[rows])
    labels = np.unique(task.labels[rows], return_inverse=True)[1]
    return replace(
        data,
        holds=tuple(hold for hold, kept in zip(data.holds, rows, strict=True) if kept),
        task=replace(task, problem=problem, labels=labels, weights=task.weights[rows]),
        noise=data.noise[rows],
        circumstances=data.circumstances.select(rows),
    )


def test_a_drift_is_predicted_from_the_earlier_part_only_when_it_is_in_the_model() -> None:
    """Early → late: the error of the later holds falls to the noise with the drift and not else."""
    made = session(11, repeats=20)
    term = Term(effect("bias-drift"))
    noisy = {"noise": 0.1 * MILLI_G, "rng": np.random.default_rng(12)}
    data = data_of(made, (term,), np.array([0.8, -0.6, 0.7]), **noisy)
    without, with_it = fit_accelerometer_with(data), fit_accelerometer_with(data, (term,))
    assert without.rms_late is not None
    assert with_it.rms_late is not None
    assert without.rms_late > 10.0 * with_it.rms_late
    assert with_it.rms_late < 0.3 * MILLI_G


def test_the_standard_errors_of_sizes_are_honest() -> None:
    """In 120 recordings the scaled error of each size has about the spread of Student's t."""
    made = session(13)
    term, sizes = Term(effect("second-order")), np.array([2.0, -1.0, 0.5])
    rng = np.random.default_rng(14)
    scaled = []
    for _ in range(120):
        noisy = data_of(made, (term,), sizes, noise=0.3 * MILLI_G, rng=rng)
        fit = fit_holds(noisy, (term,), BASE)
        assert fit.covariance is not None
        errors = np.sqrt(np.diag(fit.covariance)[-3:])
        scaled.append((fit.point.sizes[0] - sizes) / errors)
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
            found = fit_accelerometer_with(replace(data, scatter=0.3 * MILLI_G), (term,))
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
    found = fit_accelerometer_with(data, (term,))
    assert np.abs((found.sizes[0] - [0.0, 60.0, 0.0]) / found.errors[0]).max() < 4.0
    assert found.errors[0].max() < 0.1


def test_a_rest_cut_in_two_has_one_pose_before() -> None:
    """The second half of a disturbed rest remembers the pose before the first half."""
    made = session(20, repeats=0)
    cut = replace(
        made,
        up=np.insert(made.up, 5, made.up[5], axis=0),
        temperature=np.insert(made.temperature, 5, 25.0),
        vibration=np.insert(made.vibration, 5, 0.02),
    )
    before = hold_data(holds(cut), G, "m/s^2").circumstances.previous
    assert np.isnan(before[0]).all()
    np.testing.assert_array_equal(before[6], before[5])
    np.testing.assert_allclose(before[5], G * made.up[4], atol=1e-4)


def test_an_effect_of_another_sensor_is_refused() -> None:
    """An accelerometer has no g-sensitivity."""
    data = data_of(session())
    with pytest.raises(UsageError, match="g-sensitivity is no effect of the accelerometer"):
        fit_accelerometer_with(data, (Term(effect("g-sensitivity")),))
    with pytest.raises(UsageError, match="'sacle' is not in the base"):
        fit_accelerometer_with(data, (), ("sacle",))
