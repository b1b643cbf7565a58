"""Readings without any noise: what is left is an error, and no step of the readings excuses it."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from imucal_wizard.core.poses import DIRECTIONS
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.recording import fit_readings

MILLI_G = STANDARD_GRAVITY / 1000.0
MOVE_SECONDS = 1.2


def _bench(
    error: Callable[[FloatArray], FloatArray],
    hold: float = 3.0,
    rate: float = 50.0,
    digits: int = 9,
    repeats: int = 12,
) -> Bench:
    """The accelerometer in 26 poses and some again, with an error that depends on the force.

    Args:
        error: of forces in g, m/s², shape (n, 3) to (n, 3).
        hold: seconds of each pose.
        rate: Hz.
        digits: decimals of the readings.
        repeats: poses that are held again.
    """
    rng = np.random.default_rng(0)
    poses = np.array(list(DIRECTIONS.values()))
    poses = np.concatenate([poses, poses[:repeats]])
    poses = poses + 0.05 * rng.standard_normal(poses.shape)
    poses /= np.linalg.norm(poses, axis=1)[:, None]
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, round(MOVE_SECONDS * rate)))
    still = np.ones(round(hold * rate))
    up = [still[:, None] * poses[0]]
    for last, following in pairwise(poses):
        # a slight detour, so that opposite poses do not pass zero
        way = last + share[:, None] * (following - last)
        way += 0.3 * np.sin(np.pi * share)[:, None] * np.roll(last, 1)
        up += [way / np.linalg.norm(way, axis=1)[:, None], still[:, None] * following]
    force = np.concatenate(up)
    read = STANDARD_GRAVITY * force * [1.01, 0.98, 1.005] + [0.2, -0.1, 0.05] + error(force)
    series = Series(np.arange(len(read)) / rate, np.round(read, digits), "m/s^2")
    readings = Readings(series, None)
    return Benches(fit_readings(readings), readings).accelerometer


def _squares(size: float) -> Callable[[FloatArray], FloatArray]:
    return lambda force: size * MILLI_G * force**2


@pytest.mark.parametrize("digits", [6, 9])
@pytest.mark.parametrize(("hold", "rate"), [(3.0, 100.0), (10.0, 50.0), (30.0, 25.0)])
def test_a_small_error_is_named_however_long_the_holds_are(
    hold: float, rate: float, digits: int
) -> None:
    """The share of the readings in motion decides nothing."""
    bench = _bench(_squares(0.5), hold, rate, digits)
    opinion = bench.look().opinion
    assert opinion.verdict is Verdict.MISSING
    assert opinion.terms == (("second-order",),)
    assert bench.fit.floor is not None
    assert bench.fit.floor < 1e-3 * MILLI_G
    bench.add("second-order")
    assert bench.look().opinion.verdict is Verdict.COMPLETE
    assert bench.fit.rms_held_out is not None
    assert bench.fit.rms_held_out < 1e-3 * MILLI_G


@pytest.mark.parametrize("size", [2.0, 5.0])
def test_an_error_thousands_of_times_the_noise_has_its_own_name(size: float) -> None:
    """Its square, too, is far above the noise, and resembles another effect."""
    assert _bench(_squares(size)).look().opinion.terms == (("second-order",),)


def test_a_ripple_thousands_of_times_the_noise_has_no_name() -> None:
    """A cubic cross-axis term leaves a twentieth of it, far more than noise."""
    opinion = _bench(lambda force: 2.0 * MILLI_G * force**2 * np.sin(9.0 * force)).look().opinion
    assert opinion.verdict is Verdict.UNEXPLAINED
    assert opinion.families == ()


@pytest.mark.parametrize("digits", [3, 6, 9])
def test_a_model_that_leaves_nothing_is_complete(digits: int) -> None:
    """What the digits leave is their own rounding."""
    bench = _bench(lambda force: 0.0 * force, digits=digits)
    assert bench.look().opinion.verdict is Verdict.COMPLETE
    assert bench.fit.floor is not None
    assert bench.fit.floor < max(10.0**-digits, 1e-3 * MILLI_G)
