"""The gyroscope with effects against what is known exactly."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.effects.catalogue import effect, effects_for
from imucal_wizard.effects.effect import Effect
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.gyroscope import fit_gyroscope_with
from imucal_wizard.solver.extended.hold_data import BASE
from imucal_wizard.solver.extended.terms import Term, Terms
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.solver.extended.turn_fit import across, fit_turns, residual_of
from imucal_wizard.solver.extended.turn_judging import held_out_rotations
from tests.solver.extended.sizes import drawn
from tests.solver.extended.turns import (
    DEGREE,
    Noise,
    course,
    measured,
    settled_point,
    still_rms,
    twenty_turns,
    without,
)
from tests.solver.truth import in_counts, typical_gyroscope

EFFECTS = effects_for("gyroscope")
G_SENSITIVITY = Term(effect("g-sensitivity"))
COEFFICIENTS = np.array([0.05, -0.12, 0.03, 0.08, 0.02, -0.06, 0.1, 0.04, -0.07])
QUIET = Noise(sample=0.05 * DEGREE, wander=0.004 * DEGREE, force=3e-3)
MADE = course(twenty_turns())


@pytest.mark.parametrize("one", EFFECTS, ids=lambda one: one.name)
def test_every_effect_is_found_exactly_where_there_is_no_noise(one: Effect) -> None:
    """Sizes come out as put in, to what the integration at 100 samples/s allows."""
    term = Term(one, one.variants(MADE.holds)[0])
    sizes = drawn(Terms("gyroscope", (term,)))
    found = fit_gyroscope_with(measured(MADE, (term,), sizes), (term,))
    typical = np.array([p.typical for p in one.parameters("gyroscope")])
    assert found.covariance is not None
    spread = np.linalg.eigvalsh(found.covariance / np.outer(typical, typical))
    # at 1 g the squares of the three forces add up to a constant, which is a bias
    unseen = 3 if one.name == "g2-sensitivity" else 0
    assert (spread < 0.02**2).sum() == len(sizes) - unseen
    missed = found.sizes[0] - sizes
    assert missed @ np.linalg.solve(found.covariance, missed) < 9.0 * len(sizes)
    assert found.rms_fitted < 1e-5
    assert still_rms(found) < 1e-6
    true = typical_gyroscope().matrix
    assert np.abs(found.fit.matrix - true).max() < 2e-5


@pytest.mark.parametrize("gain", [None, 4778.0])
def test_in_counts_it_is_the_same(gain: float | None) -> None:
    """Raw counts around 32768: matrix and bias in counts, sizes in °/s/g."""
    truth = typical_gyroscope() if gain is None else in_counts(typical_gyroscope(), gain)
    unit = "rad/s" if gain is None else "count"
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, gyroscope=truth, unit=unit)
    found = fit_gyroscope_with(data, (G_SENSITIVITY,))
    np.testing.assert_allclose(found.sizes[0], COEFFICIENTS, atol=1e-4)
    size = gain or 1.0
    np.testing.assert_allclose(found.fit.matrix * size, truth.matrix * size, atol=2e-5)
    np.testing.assert_allclose(found.fit.bias / size, truth.bias / size, rtol=1e-9, atol=2e-7)
    assert found.fit.bias_unit == unit


def test_the_model_is_added_to_the_base_and_its_sizes_to_the_parameters() -> None:
    """Names and units as the JSON shows them."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(2))
    found = fit_gyroscope_with(data, (G_SENSITIVITY,))
    assert found.model == ("bias", "scale", "non-orthogonality", "g-sensitivity")
    named = {parameter.name: parameter for parameter in found.fit.parameters}
    assert named["g-sensitivity_xy"].unit == "°/s/g"
    assert named["g-sensitivity_xy"].value == found.sizes[0][1]
    assert named["g-sensitivity_xy"].standard_error == found.errors[0][1]
    assert named["bias_x"].unit == "rad/s"


def test_correcting_gives_back_the_true_rate() -> None:
    """``correct`` undoes the forward model on samples whose force is known."""
    terms = (G_SENSITIVITY, Term(effect("second-order")))
    sizes = np.concatenate([COEFFICIENTS, [1.2, -0.7, 0.9]])
    found = fit_gyroscope_with(measured(MADE, terms, sizes), terms)
    one, there = MADE.motions[3], MADE.inside[3]
    truth = typical_gyroscope()
    readings = truth.readings(one.rate + Terms("gyroscope", terms).columns(there) @ sizes)
    blind = replace(there, rate=np.zeros_like(one.rate))
    np.testing.assert_allclose(found.correct(readings, blind), one.rate, atol=1e-4)


def test_the_ladder_climbs_from_nothing() -> None:
    """Each further base term lowers the error; what is not fitted stays at its nominal value."""
    data = measured(MADE, noise=QUIET, rng=np.random.default_rng(3))
    ladder = [(), ("bias",), ("bias", "scale"), ("bias", "scale", "non-orthogonality")]
    fits = [fit_gyroscope_with(data, (), base) for base in ladder]
    errors = [one.rms_fitted for one in fits]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] == fits[0].fit.rms_before
    np.testing.assert_array_equal(fits[1].fit.matrix, np.eye(3))
    assert np.count_nonzero(fits[2].fit.matrix) == 3
    assert errors[3] < 0.1 * errors[2]


def _shifted(
    data: TurnData, terms: Terms, at: tuple[FloatArray, FloatArray, FloatArray]
) -> FloatArray:
    """All residuals at a calibration, effects taken at its own rates and forces."""
    return residual_of(settled_point(data, terms, *at), across(data.after))


@pytest.mark.parametrize("one", EFFECTS, ids=lambda one: one.name)
def test_the_linear_form_follows_the_residual(one: Effect) -> None:
    """``lift`` is the derivative of still means and closures by an effect's sizes."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(4))
    found = fit_gyroscope_with(data, (G_SENSITIVITY,))
    variant = one.variants(data.circumstances)[0]
    lift = found.linear.lift(one, variant)
    both = Terms("gyroscope", (G_SENSITIVITY, Term(one, variant)))
    typical = np.array([p.typical for p in one.parameters("gyroscope")])
    for k in (0, lift.shape[1] - 1):
        ends = []
        for sign in (1.0, -1.0):
            sizes = np.concatenate(
                [found.sizes[0], sign * 0.1 * typical * (np.arange(len(typical)) == k)]
            )
            ends.append(_shifted(data, both, (found.fit.matrix, found.fit.bias, sizes)))
        slope = (ends[0] - ends[1]) / (0.2 * typical[k]) / found.linear.sigma
        np.testing.assert_allclose(lift[:, k], slope, atol=5e-3 * np.abs(slope).max())


def test_the_base_columns_are_the_derivative_of_the_residual() -> None:
    """Matrix entries and biases, to the coning that the derivative leaves out."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(5))
    found = fit_gyroscope_with(data, (G_SENSITIVITY,))
    terms = Terms("gyroscope", (G_SENSITIVITY,))
    for index in range(12):
        ends = []
        for sign in (1.0, -1.0):
            matrix, bias = found.fit.matrix.copy(), found.fit.bias.copy()
            if index < 9:
                matrix.flat[index] += sign * 1e-5
            else:
                bias[index - 9] += sign * 1e-5
            ends.append(_shifted(data, terms, (matrix, bias, found.sizes[0])))
        slope = (ends[0] - ends[1]) / 2e-5 / found.linear.sigma
        np.testing.assert_allclose(
            found.linear.base[:, index], slope, atol=3e-3 * np.abs(slope).max()
        )


def test_doubts_about_the_accelerometer_are_columns_of_the_fit() -> None:
    """Gravity's directions moved along one doubt move the closures as its column says."""
    data = measured(MADE, noise=QUIET, rng=np.random.default_rng(6))
    found = fit_gyroscope_with(data)
    names = found.linear.names
    k = names.index("accelerometer_2") - names.index("accelerometer_0")
    before = data.before + data.before_doubt[:, :, k]
    after = data.after + data.after_doubt[:, :, k]
    moved = replace(
        data,
        before=before / np.linalg.norm(before, axis=1)[:, None],
        after=after / np.linalg.norm(after, axis=1)[:, None],
    )
    basis = across(data.after)
    none = Terms("gyroscope", ())
    at = (found.fit.matrix, found.fit.bias, np.zeros(0))
    change = residual_of(settled_point(moved, none, *at), basis) - residual_of(
        settled_point(data, none, *at), basis
    )
    column = found.linear.base[:, names.index("accelerometer_2")]
    expected = change / found.linear.sigma
    np.testing.assert_allclose(column, expected, atol=0.02 * np.abs(expected).max())
    assert found.linear.precision[names.index("accelerometer_2")] == 1.0


def test_leaving_a_rotation_out_by_one_step_is_a_refit_without_it() -> None:
    """The shortcut agrees with fits of their own to all other rotations."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(7))
    fit = fit_turns(data, (G_SENSITIVITY,), BASE)
    shortcut = held_out_rotations(fit)
    assert shortcut is not None
    size = float(np.sqrt((shortcut**2).sum(axis=1).mean()))
    for index in (0, 7, 13):
        own = fit_turns(
            without(data, index), (G_SENSITIVITY,), ("bias", "scale", "non-orthogonality")
        )
        there = settled_point(data, fit.terms, own.point.matrix, own.point.bias, own.point.sizes)
        errors = fit.basis[index] @ there.closure[index]
        np.testing.assert_allclose(errors, shortcut[index], atol=0.05 * size)


def test_neither_still_means_nor_rotations_drown_the_other() -> None:
    """Each kind of row gets the scatter it has, whatever the noise within holds claims."""
    wander = Noise(sample=0.02 * DEGREE, wander=0.02 * DEGREE, force=3e-3)
    scatter = []
    for seed in range(6):
        data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, wander, np.random.default_rng(seed))
        found = fit_gyroscope_with(data, (G_SENSITIVITY,))
        still = [row.kind == "still" for row in found.linear.rows]
        scatter.append(np.sqrt(np.mean(found.linear.sigma[still] ** 2)))
        assert found.linear.residual @ found.linear.residual < 1.2 * len(still)
    assert np.mean(scatter) / wander.wander == pytest.approx(1.0, abs=0.06)


def test_the_standard_errors_of_sizes_are_honest() -> None:
    """In 50 recordings 95 % intervals hold the true g-sensitivity 95 times in 100."""
    rng = np.random.default_rng(8)
    made = course(twenty_turns(9, count=10))
    scaled = []
    for _ in range(50):
        data = measured(made, (G_SENSITIVITY,), COEFFICIENTS, QUIET, rng)
        fit = fit_turns(data, (G_SENSITIVITY,), BASE)
        own = slice(len(fit.free), fit.model)
        errors = np.sqrt(np.diag(fit.found.covariance[own, own]))
        scaled.append((fit.point.sizes - COEFFICIENTS) / errors)
    inside = np.mean(np.abs(scaled) < 2.0)
    assert 0.92 < inside < 0.98


def test_still_means_and_rotations_bear_the_same_witness() -> None:
    """Each alone finds the g-sensitivity, within their combined standard errors."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(10))
    found = fit_gyroscope_with(data, (G_SENSITIVITY,))
    assert found.witnesses is not None
    still, turned = found.witnesses
    apart = still.sizes - turned.sizes
    squares = apart @ np.linalg.solve(still.covariance + turned.covariance, apart)
    assert squares < 21.7  # 99 % of χ² with nine degrees of freedom
    together = np.trace(found.covariance if found.covariance is not None else np.zeros((9, 9)))
    assert together < np.trace(still.covariance) < np.trace(turned.covariance)


def test_g_sensitivity_falls_to_the_noise_when_it_is_in_the_model() -> None:
    """Closure held out and early to late, and the still means."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(11))
    without_it, with_it = fit_gyroscope_with(data), fit_gyroscope_with(data, (G_SENSITIVITY,))
    for name in ("rms_held_out", "rms_late"):
        assert getattr(with_it, name) < 0.35 * getattr(without_it, name), name
    assert still_rms(with_it) < 0.35 * still_rms(without_it)
    assert with_it.fit.floor is not None
    assert with_it.rms_held_out is not None
    assert with_it.rms_held_out < 2.0 * with_it.fit.floor


def test_an_effect_far_larger_than_its_prior_is_not_taken_for_scatter() -> None:
    """Thirty typical sizes of one coefficient come out within their standard error."""
    large = COEFFICIENTS + 3.0 * np.eye(9)[4]
    data = measured(MADE, (G_SENSITIVITY,), large, QUIET, np.random.default_rng(14))
    found = fit_gyroscope_with(data, (G_SENSITIVITY,))
    assert np.abs((found.sizes[0] - large) / found.errors[0]).max() < 4.0
    assert found.errors[0].max() < 0.01


def test_a_drift_of_the_bias_is_predicted_only_when_it_is_in_the_model() -> None:
    """Early → late on rotations; the still means show it, too."""
    drift = Term(effect("bias-drift"))
    data = measured(
        MADE, (drift,), np.array([0.02, -0.03, 0.015]), QUIET, np.random.default_rng(12)
    )
    without_it, with_it = fit_gyroscope_with(data), fit_gyroscope_with(data, (drift,))
    assert without_it.rms_late is not None
    assert with_it.rms_late is not None
    assert with_it.rms_late < 0.5 * without_it.rms_late
    assert still_rms(with_it) < 0.2 * still_rms(without_it)
