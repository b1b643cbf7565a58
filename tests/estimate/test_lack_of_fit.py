"""Lack of fit and repeatability: what visits to one pose say of the noise."""

import numpy as np
import pytest
from scipy.stats import kstest

from benchmarks.hold_sessions import DESIGNS, Noise, session
from imucal_wizard.estimate.distributions import EXACT_FREEDOM
from imucal_wizard.estimate.lack_of_fit import Visits, lack_of_fit
from imucal_wizard.estimate.noise import hold_noise
from imucal_wizard.estimate.repeatability import WITHIN_FREEDOM, pure_error


def test_visits_of_unequal_noise_share_what_the_model_lacks() -> None:
    """Twelve directions, each wrong by 30 times the noise, each held for long and for a moment.

    The difference of two visits has the variances of both, whatever they share.
    """
    rng, sigma = np.random.default_rng(3), np.tile([1.0, 3.0], 12)
    group, visit = np.repeat(np.arange(12), 2), np.arange(24)
    chances = []
    for _ in range(400):
        residual = np.repeat(30.0 * rng.normal(size=12), 2) + sigma * rng.normal(size=24)
        first, second = residual[::2], residual[1::2]
        share, freedom = pure_error(residual, sigma, group, visit)
        assert freedom == 12
        assert np.isclose(12.0 * share, ((first - second) ** 2 / 10.0).sum())
        chances.append(12.0 * share)
    assert kstest(chances, "chi2", args=(12,)).pvalue > 0.01


def test_a_pose_that_repeats_is_not_blamed_for_what_the_model_lacks() -> None:
    """The misfit is one of direction; only every fiftieth session has visits that differ so."""
    rng, sigma = np.random.default_rng(4), np.tile([0.5, 2.0], 10)
    visits = Visits(
        np.ones(20, bool), np.repeat(np.arange(10), 2), np.arange(20), np.ones(20), EXACT_FREEDOM
    )
    blamed = 0
    for _ in range(200):
        residual = np.repeat(40.0 * rng.normal(size=10), 2) + sigma * rng.normal(size=20)
        found = lack_of_fit(residual / sigma, np.ones((20, 1)) / sigma[:, None], sigma, visits)
        assert found.ratio > 5.0
        blamed += found.not_repeatable
    assert blamed <= 6


def test_what_a_place_does_to_the_magnitude_it_does_to_the_dip() -> None:
    """Rows that repeat nothing, but move by half as much, were held to the noise within a hold."""
    rng, count = np.random.default_rng(6), 24
    repeated = np.arange(2 * count) < count
    share = np.where(repeated, 1.0, 0.5)
    group = np.where(repeated, np.arange(2 * count) // 2, np.arange(2 * count))
    visits = Visits(repeated, group, np.arange(2 * count), share, EXACT_FREEDOM)
    noise = np.full(2 * count, 0.05)
    refused = 0
    for _ in range(200):
        residual = np.hypot(share, noise) * rng.normal(size=2 * count)
        found = lack_of_fit(residual / noise, np.ones((2 * count, 1)), noise, visits)
        refused += found.between_directions
    assert refused <= 8


def test_few_repeats_do_not_excuse_rows_in_motion() -> None:
    """Visits that differ a little more than the noise by chance hide no misfit of rotations.

    Three repeats bound the variance between visits to a factor of 26; sixty rows at rest, to two.
    """
    rng, rest = np.random.default_rng(7), np.arange(100) < 60
    group = np.where(np.arange(100) < 6, np.arange(100) // 2, np.arange(100))
    share = np.where(rest, 1.0, 3.0)
    visits = Visits(rest, group, np.arange(100), share, EXACT_FREEDOM)
    noise, differing = np.where(rest, 1.0, 5.0), 0
    for _ in range(100):
        residual = noise * rng.normal(size=100)
        residual[~rest] *= 2.5
        found = lack_of_fit(residual / noise, np.ones((100, 1)) / noise[:, None], noise, visits)
        differing += (found.share or 0.0) > 1.0
        assert not found.within_noise
    assert differing > 20


@pytest.mark.study
@pytest.mark.parametrize("poses", [18, 54])
def test_the_noise_within_holds_has_at_least_the_freedom_that_is_said(poses: int) -> None:
    """By the scatter of what is found of white noise, from one session to another."""
    rng, count = np.random.default_rng(poses), 200
    design = np.tile(DESIGNS["18"], (poses // 18, 1))
    found = []
    for _ in range(count):
        made = session(design, Noise(), rng)
        along = (made.up @ np.linalg.inv(made.sensitivity)) ** 2
        true = (along * made.variance).sum(axis=1)
        found.append(float(np.mean(hold_noise(made.holds).accelerometer / true)))
    freedom = 2.0 * np.mean(found) ** 2 / np.var(found, ddof=1) / poses
    print(f"{poses} holds: {freedom:.1f} ± {freedom * np.sqrt(2.0 / count):.1f} per hold")
    assert np.mean(found) == pytest.approx(1.0, abs=0.03)
    assert freedom > WITHIN_FREEDOM * (1.0 - 2.5 * np.sqrt(2.0 / count))
    assert freedom < 12.0


@pytest.mark.parametrize("settings", [0, 1])
def test_a_setting_that_the_data_chose_counts_as_a_parameter(settings: int) -> None:
    """A decay whose time constant fits best explains as much of the noise as two parameters.

    Uncounted, the chance is too large: a model that lacks something is called complete.
    """
    rng, count, time = np.random.default_rng(7), 12, np.linspace(0.0, 1.0, 12)
    decays = np.exp(-time / np.geomspace(0.1, 1.0, 401)[:, None])
    shapes = [np.column_stack([np.ones(count), one]) for one in decays]
    inside = np.array([np.linalg.qr(one)[0] for one in shapes])
    alone = np.zeros(count, bool)
    visits = Visits(alone, np.arange(count), np.arange(count), np.ones(count), EXACT_FREEDOM)
    chances = []
    for _ in range(1000):
        left = 20.0 * decays[200] + rng.normal(size=count)
        best = int(np.argmax(((left @ inside) ** 2).sum(axis=1)))
        found = lack_of_fit(left, shapes[best], np.ones(count), visits, settings)
        chances.append(found.p)
    assert bool(kstest(chances, "uniform").pvalue > 0.01) is (settings == 1)
