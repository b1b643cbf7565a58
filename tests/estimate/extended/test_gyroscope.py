"""The gyroscope with effects against what is known exactly."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import Circumstances, Effect
from imucal_wizard.model.rows.source import Parameters
from imucal_wizard.model.rows.table import ResidualTable
from imucal_wizard.model.terms import Term, Terms
from tests.estimate.extended.sizes import drawn
from tests.estimate.extended.turns import (
    DEGREE,
    Noise,
    course,
    measured,
    settled_rows,
    sizes_by,
    still_rms,
    twenty_turns,
    without,
)
from tests.estimate.truth import in_counts, typical_gyroscope

EFFECTS = effects_for("gyroscope")
G_SENSITIVITY = Term(effect("g-sensitivity"))
COEFFICIENTS = np.array([0.05, -0.12, 0.03, 0.08, 0.02, -0.06, 0.1, 0.04, -0.07])
QUIET = Noise(sample=0.05 * DEGREE, wander=0.004 * DEGREE, force=3e-3)
MADE = course(twenty_turns())


def at_setting(one: Effect, holds: Circumstances) -> Term:
    """The setting three quarters of the way: a rest with 11 rotations before it and 9 after.

    Before all rotations a step of the scale cannot be told from the scale of the base model.
    """
    variants = one.variants(holds)
    return Term(one, variants[3 * len(variants) // 4])


@pytest.mark.parametrize("one", EFFECTS, ids=lambda one: one.name)
def test_every_effect_is_found_exactly_where_there_is_no_noise(one: Effect) -> None:
    """Sizes come out as put in, to what the integration at 100 samples/s allows."""
    term = at_setting(one, MADE.holds)
    sizes = drawn(Terms("gyroscope", (term,)))
    found = fit(measured(MADE, (term,), sizes), (term,))
    typical = np.array([p.typical for p in one.parameters("gyroscope")])
    assert found.size_covariance is not None
    spread = np.linalg.eigvalsh(found.size_covariance / np.outer(typical, typical))
    # at 1 g the squares of the three forces add up to a constant, which is a bias; the same
    # g-sensitivity on all axes is a rate about up, which the Earth has as well
    unseen = {"g2-sensitivity": 3, "g-sensitivity": 1}.get(one.name, 0)
    assert (spread < 0.02**2).sum() == len(sizes) - unseen
    # one delay of all three axes moves no attitude from rest to rest: each is after their mean
    missed = found.sizes[0] - (sizes - sizes.mean() if one.gauge else sizes)
    inverse = np.linalg.pinv(found.size_covariance, hermitian=True)
    assert missed @ inverse @ missed < 9.0 * len(sizes)
    assert (np.abs(missed) < 9.0 * found.size_errors[0]).all()
    assert found.rms_fitted < 1e-5
    assert still_rms(found) < 1e-6
    true = typical_gyroscope().matrix
    assert np.abs(found.matrix - true).max() < 2e-5


@pytest.mark.parametrize("gain", [None, 4778.0])
def test_in_counts_it_is_the_same(gain: float | None) -> None:
    """Raw counts around 32768: matrix and bias in counts, sizes in °/s/g."""
    truth = typical_gyroscope() if gain is None else in_counts(typical_gyroscope(), gain)
    unit = "rad/s" if gain is None else "count"
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, gyroscope=truth, unit=unit)
    found = fit(data, (G_SENSITIVITY,))
    np.testing.assert_allclose(found.sizes[0], COEFFICIENTS, atol=1e-4)
    size = gain or 1.0
    np.testing.assert_allclose(found.matrix * size, truth.matrix * size, atol=2e-5)
    np.testing.assert_allclose(found.bias / size, truth.bias / size, rtol=1e-9, atol=2e-7)
    assert found.bias_unit == unit


def test_the_model_is_added_to_the_base_and_its_sizes_to_the_parameters() -> None:
    """Names and units as the JSON shows them."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(2))
    found = fit(data, (G_SENSITIVITY,))
    assert found.model == ("bias", "scale", "non-orthogonality", "g-sensitivity")
    named = {parameter.name: parameter for parameter in found.parameters}
    assert named["g-sensitivity_xy"].unit == "°/s/g"
    assert named["g-sensitivity_xy"].value == found.sizes[0][1]
    assert named["g-sensitivity_xy"].standard_error == found.size_errors[0][1]
    assert named["bias_x"].unit == "rad/s"


def test_correcting_gives_back_the_true_rate() -> None:
    """``correct`` undoes the forward model on samples whose force is known."""
    terms = (G_SENSITIVITY, Term(effect("second-order")))
    sizes = np.concatenate([COEFFICIENTS, [1.2, -0.7, 0.9]])
    found = fit(measured(MADE, terms, sizes), terms)
    one, there = MADE.motions[3], MADE.inside[3]
    truth = typical_gyroscope()
    readings = truth.readings(one.rate + Terms("gyroscope", terms).columns(there) @ sizes)
    blind = replace(there, rate=np.zeros_like(one.rate))
    np.testing.assert_allclose(found.correct(readings, blind), one.rate, atol=1e-4)


def test_the_ladder_climbs_from_nothing() -> None:
    """Each further base term lowers the error; what is not fitted stays at its nominal value."""
    data = measured(MADE, noise=QUIET, rng=np.random.default_rng(3))
    ladder = [(), ("bias",), ("bias", "scale"), ("bias", "scale", "non-orthogonality")]
    fits = [fit(data, (), base) for base in ladder]
    errors = [one.rms_fitted for one in fits]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] == pytest.approx(fits[0].rms_before, rel=1e-12)
    np.testing.assert_array_equal(fits[1].matrix, np.eye(3))
    assert np.count_nonzero(fits[2].matrix) == 3
    assert errors[3] < 0.1 * errors[2]


def _table(found: SensorFit) -> ResidualTable:
    assert found.rows is not None
    return found.rows


def _shifted(
    data: GyroscopeExperiment, terms: Terms, at: tuple[FloatArray, FloatArray, FloatArray]
) -> FloatArray:
    """All residuals at a calibration, effects taken at its own rates and forces."""
    rows = settled_rows(data, terms, Parameters(*at))
    return np.concatenate([one.residual for one in rows])


@pytest.mark.parametrize("one", EFFECTS, ids=lambda one: one.name)
def test_the_linear_form_follows_the_residual(one: Effect) -> None:
    """``design_columns`` are the derivative of still means and closures by an effect's sizes."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(4))
    found = fit(data, (G_SENSITIVITY,))
    term = at_setting(one, MADE.holds)
    lift = _table(found).design_columns([term])
    both = Terms("gyroscope", (G_SENSITIVITY, term))
    typical = np.array([p.typical for p in one.parameters("gyroscope")])
    for k in (0, lift.shape[1] - 1):
        ends = []
        for sign in (1.0, -1.0):
            sizes = np.concatenate(
                [found.sizes[0], sign * 0.1 * typical * (np.arange(len(typical)) == k)]
            )
            ends.append(_shifted(data, both, (found.matrix, found.bias, sizes)))
        slope = (ends[0] - ends[1]) / (0.2 * typical[k])
        np.testing.assert_allclose(lift[:, k], slope, atol=5e-3 * np.abs(slope).max())


def test_the_base_columns_are_the_derivative_of_the_residual() -> None:
    """Matrix entries and biases, to the coning that the derivative leaves out."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(5))
    found = fit(data, (G_SENSITIVITY,))
    terms = Terms("gyroscope", (G_SENSITIVITY,))
    for index in range(12):
        ends = []
        for sign in (1.0, -1.0):
            matrix, bias = found.matrix.copy(), found.bias.copy()
            if index < 9:
                matrix.flat[index] += sign * 1e-5
            else:
                bias[index - 9] += sign * 1e-5
            ends.append(_shifted(data, terms, (matrix, bias, found.sizes[0])))
        slope = (ends[0] - ends[1]) / 2e-5
        np.testing.assert_allclose(
            _table(found).columns[:, index], slope, atol=5e-3 * np.abs(slope).max()
        )


def test_error_modes_of_the_accelerometer_are_columns_of_the_fit() -> None:
    """Gravity's directions moved along one doubt move the closures as its column says."""
    data = measured(MADE, noise=QUIET, rng=np.random.default_rng(6))
    found = fit(data)
    table = _table(found)
    names, closure = table.names, data.closure
    k = names.index("accelerometer_2") - names.index("accelerometer_0")
    before = closure.before + closure.before_doubt[:, :, k]
    after = closure.after + closure.after_doubt[:, :, k]
    moved = replace(
        closure,
        before=before / np.linalg.norm(before, axis=1)[:, None],
        after=after / np.linalg.norm(after, axis=1)[:, None],
    )
    # across the direction measured before, in which the rows are told
    object.__setattr__(moved, "basis", closure.basis)
    none, at = Terms("gyroscope", ()), Parameters(found.matrix, found.bias)
    change = moved.at(at, none).residual - closure.at(at, none).residual
    column = table.columns[table.kind == "rotation", names.index("accelerometer_2")]
    np.testing.assert_allclose(column, change, atol=0.02 * np.abs(change).max())
    place = names.index("accelerometer_2")
    assert table.prior[place, place] == 1.0


def test_leaving_a_rotation_out_by_one_step_is_a_refit_without_it() -> None:
    """The shortcut agrees with fits of their own to all other rotations."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(7))
    found = fit(data, (G_SENSITIVITY,))
    assert found.held_out is not None
    size = float(np.sqrt((found.held_out**2).mean()))
    for index in (0, 7, 13):
        own = fit(without(data, index), (G_SENSITIVITY,))
        at = Parameters(own.matrix, own.bias, own.sizes[0])
        _, closures = settled_rows(data, Terms("gyroscope", own.terms), at)
        errors = closures.residual[2 * index : 2 * index + 2]
        assert np.linalg.norm(errors) == pytest.approx(found.held_out[index], abs=0.05 * size)


def test_neither_still_means_nor_rotations_drown_the_other() -> None:
    """Each kind of row gets the scatter it has, whatever the noise within holds claims."""
    wander = Noise(sample=0.02 * DEGREE, wander=0.02 * DEGREE, force=3e-3)
    scatter = []
    for seed in range(6):
        data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, wander, np.random.default_rng(seed))
        found = fit(data, (G_SENSITIVITY,))
        table = _table(found)
        scatter.append(np.sqrt(np.mean(table.variance[table.kind == "still"])))
        assert (table.residual**2 / table.variance).sum() < 1.2 * len(table)
    assert np.mean(scatter) / wander.wander == pytest.approx(1.0, abs=0.06)


@pytest.mark.study
def test_the_standard_errors_of_sizes_are_honest() -> None:
    """In 20 recordings 95 % intervals hold the true g-sensitivity 95 times in 100."""
    rng = np.random.default_rng(8)
    made = course(twenty_turns(9, count=10))
    scaled = []
    for _ in range(20):
        data = measured(made, (G_SENSITIVITY,), COEFFICIENTS, QUIET, rng)
        found = fit(data, (G_SENSITIVITY,))
        scaled.append((found.sizes[0] - COEFFICIENTS) / found.size_errors[0])
    inside = np.mean(np.abs(scaled) < 2.0)
    # three binomial deviations of 180
    assert 0.90 < inside < 0.999


def test_still_means_and_rotations_agree() -> None:
    """Each alone finds the g-sensitivity, within their combined standard errors."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(10))
    found = fit(data, (G_SENSITIVITY,))
    still, of_still = sizes_by(found, moving=False)
    turned, of_turned = sizes_by(found, moving=True)
    squares = (still - turned) @ np.linalg.solve(of_still + of_turned, still - turned)
    assert squares < 21.7  # 99 % of χ² with nine degrees of freedom
    assert found.size_covariance is not None
    together = np.trace(found.size_covariance)
    assert together < np.trace(of_still) < np.trace(of_turned)


def test_g_sensitivity_falls_to_the_noise_when_it_is_in_the_model() -> None:
    """Closure held out and early to late, and the still means."""
    data = measured(MADE, (G_SENSITIVITY,), COEFFICIENTS, QUIET, np.random.default_rng(11))
    without_it, with_it = fit(data), fit(data, (G_SENSITIVITY,))
    for name in ("rms_held_out", "rms_late"):
        assert getattr(with_it, name) < 0.35 * getattr(without_it, name), name
    assert still_rms(with_it) < 0.35 * still_rms(without_it)
    assert with_it.floor is not None
    assert with_it.rms_held_out is not None
    assert with_it.rms_held_out < 2.0 * with_it.floor


def test_an_effect_far_larger_than_its_prior_is_not_taken_for_scatter() -> None:
    """Thirty typical sizes of one coefficient come out within their standard error."""
    large = COEFFICIENTS + 3.0 * np.eye(9)[4]
    data = measured(MADE, (G_SENSITIVITY,), large, QUIET, np.random.default_rng(14))
    found = fit(data, (G_SENSITIVITY,))
    assert np.abs((found.sizes[0] - large) / found.size_errors[0]).max() < 4.0
    assert found.size_errors[0].max() < 0.01


def test_a_drift_of_the_bias_is_predicted_only_when_it_is_in_the_model() -> None:
    """Early → late on rotations; the still means show it, too."""
    drift = Term(effect("bias-drift"))
    data = measured(
        MADE, (drift,), np.array([0.02, -0.03, 0.015]), QUIET, np.random.default_rng(12)
    )
    without_it, with_it = fit(data), fit(data, (drift,))
    assert without_it.rms_late is not None
    assert with_it.rms_late is not None
    assert with_it.rms_late < 0.5 * without_it.rms_late
    assert still_rms(with_it) < 0.2 * still_rms(without_it)
