"""The accelerometer by N's methods, and the gyroscope's offset from several still positions."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.estimate.methods.offset import fit_offset
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.simulate.scripts import TILTED_POSES
from tests.estimate.truth import (
    EIGHTEEN,
    TWENTY_SIX,
    Truth,
    hold,
    holds_of,
    in_counts,
    random_triangular,
    tilted,
    typical_accelerometer,
)

GRAVITY = 9.80665
EIGHT = np.array(TILTED_POSES)
"""N's eight orientations, not tilted all alike."""


@pytest.mark.parametrize("method", ["algebraic", "numeric"])
@pytest.mark.parametrize("counts", [False, True])
def test_exact_holds_give_the_truth_in_the_triangular_gauge(method: str, counts: bool) -> None:
    """The same matrix as least squares finds, though N's is symmetric."""
    truth = typical_accelerometer()
    truth = in_counts(truth, 415.0) if counts else truth
    unit = "count" if counts else "m/s^2"
    fit = fit_accelerometer(holds_of(truth, TWENTY_SIX), GRAVITY, unit, method)
    assert np.abs(fit.matrix - truth.matrix).max() < 1e-6 * np.abs(truth.matrix).max()
    assert np.abs(fit.bias - truth.bias).max() < 1e-5 * np.abs(truth.bias).max()
    assert (fit.matrix[np.tril_indices(3, -1)] == 0.0).all()


def test_two_step_errs_where_the_ellipsoid_is_no_sphere() -> None:
    """Its first step takes scale errors for a shifted centre; on a near sphere it is right."""
    rng = np.random.default_rng(0)
    up = tilted(EIGHTEEN, 1.5, rng)
    strong = Truth(np.diag([1.05, 0.95, 1.0]), np.array([0.3, -0.2, 0.1]))
    weak = Truth(np.diag([1.0005, 0.9995, 1.0]), np.array([0.3, -0.2, 0.1]))
    errors = []
    for truth in (strong, weak):
        fit = fit_accelerometer(holds_of(truth, up), GRAVITY, "m/s^2", "two-step")
        errors.append(float(np.abs(fit.bias - truth.bias).max()))
        assert all(parameter.standard_error is None for parameter in fit.parameters)
    assert errors[0] > 50.0 * errors[1]


def test_noise_is_carried_as_well_as_by_least_squares() -> None:
    """Numeric and algebraic differ from least squares by less than a standard error."""
    rng = np.random.default_rng(1)
    truth = random_triangular(rng)
    noise = 3e-3 * rng.standard_normal((26, 3))
    holds = holds_of(truth, tilted(TWENTY_SIX, 1.0, rng), noise=noise, sigma=3e-3)
    best = fit_accelerometer(holds, GRAVITY, "m/s^2")
    for method in ("algebraic", "numeric"):
        fit = fit_accelerometer(holds, GRAVITY, "m/s^2", method)
        for mine, its in zip(fit.parameters, best.parameters, strict=True):
            assert its.standard_error is not None
            assert abs(mine.value - its.value) < 0.2 * its.standard_error
        assert fit.rms_held_out == pytest.approx(best.rms_held_out, rel=0.05)


@pytest.mark.parametrize("method", ["least_squares", "algebraic", "two-step", "numeric"])
def test_eight_tilted_orientations_leave_out_the_off_diagonals(method: str) -> None:
    """N's procedure: bias and scale, and the angles are said not to be carried (VII-A)."""
    rng = np.random.default_rng(2)
    truth = Truth(np.diag([1.01, 0.985, 1.005]), np.array([0.2, -0.1, 0.3]))
    holds = holds_of(truth, tilted(EIGHT, 1.5, rng))
    fit = fit_accelerometer(holds, GRAVITY, "m/s^2", method)
    assert fit.model == ("bias", "scale")
    dropped = [parameter.name for parameter in fit.parameters if not parameter.carried]
    assert dropped == ["theta_yz", "theta_zy", "theta_zx"]
    assert any("do not determine" in text for text in fit.warnings)
    if method != "two-step":
        assert np.abs(fit.matrix - truth.matrix).max() < 1e-6


def test_eight_tilts_that_are_all_alike_determine_no_three_scales() -> None:
    """With one angle the squares of all directions are two triples: refused, not invented."""
    up = [(s * np.sin(0.6), 0.0, z * np.cos(0.6)) for s in (1, -1) for z in (1, -1)]
    up += [(0.0, s * np.sin(0.6), z * np.cos(0.6)) for s in (1, -1) for z in (1, -1)]
    holds = holds_of(typical_accelerometer(), np.array(up))
    with pytest.raises(DataError):
        fit_accelerometer(holds, GRAVITY, "m/s^2", "two-step")


def test_the_offset_is_the_mean_over_positions_with_their_scatter() -> None:
    """By hand: three positions that differ by 1, 2, 3 mrad/s; repeats of one count once."""
    rates = [1e-3, 2e-3, 3e-3, 3e-3]
    holds = [
        hold(np.zeros(3), 10.0 * i, gyroscope=np.array([rate, 0.0, -rate]))
        for i, rate in enumerate(rates)
    ]
    fit = fit_offset(holds, np.array([0, 1, 2, 2]), "rad/s")
    assert fit.bias == pytest.approx([2e-3, 0.0, -2e-3])
    assert fit.parameters[0].standard_error == pytest.approx(1e-3 / np.sqrt(3.0))
    assert fit.rms_held_out == pytest.approx(1.5 * fit.rms_fitted)
    assert (fit.matrix == np.eye(3)).all()
    assert fit.model == ("bias",)


def test_a_position_in_which_the_device_moved_counts_for_less() -> None:
    """One hand-held hold of eight turned at 2 mrad/s on average; its scatter shows it."""
    rng = np.random.default_rng(0)
    rates = 1e-4 * rng.standard_normal((8, 3))
    rates[3] += 2e-3
    holds = [
        hold(np.zeros(3), 10.0 * i, gyroscope=rate, gyroscope_sigma=2e-3 if i == 3 else 1e-4)
        for i, rate in enumerate(rates)
    ]
    fit = fit_offset(holds, np.arange(8), "rad/s")
    assert np.abs(fit.bias).max() < 1e-4
    errors = [parameter.standard_error or 0.0 for parameter in fit.parameters]
    assert (np.abs(fit.bias) < 3.5 * np.array(errors)).all()
    assert fit.held_out is not None
    assert fit.held_out[3] == pytest.approx(np.linalg.norm(rates[3] - fit.bias), rel=0.02)


def test_an_offset_needs_two_positions_and_a_scale() -> None:
    """One position does not show what differs between them; counts have no unit of rate."""
    one = hold(np.zeros(3), 0.0, gyroscope=np.zeros(3))
    with pytest.raises(DataError, match="two positions"):
        fit_offset([one, replace(one, start=10.0, end=12.0)], np.zeros(2, int), "rad/s")
    with pytest.raises(DataError, match="give the unit"):
        fit_offset([one, one], np.arange(2), "count")
