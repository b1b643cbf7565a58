"""What coarse steps do to the integrals of rotations, against motions that are truly rounded."""

from functools import cache

import numpy as np
import pytest

from imucal_wizard.core.attitude import rotation_samples
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.rounding_in_motion import rounding_in_motion
from tests.estimate.truth import hold, turn

INTERVAL = 0.02
ROTATIONS = 20


def _motion(rng: np.random.Generator) -> FloatArray:
    """Rates in °/s, from rest to rest: 90° about one axis and a little about the others."""
    wobble = 0.05 * rng.standard_normal(3)
    vector = rng.choice([-1.6, 1.6]) * np.eye(3)[0]
    motion = turn(np.eye(3)[2], vector, seconds=rng.uniform(1.2, 2.5), wobble=wobble, rate=50.0)
    return np.asarray(np.degrees(motion.rate), np.float64)


@cache
def _moved(sessions: int) -> list[tuple[FloatArray, list[FloatArray]]]:
    """Where in a step the device rests, and the motions, of each session."""
    rng = np.random.default_rng(31)
    return [
        (rng.uniform(-0.5, 0.5, 3), [_motion(rng) for _ in range(ROTATIONS)])
        for _ in range(sessions)
    ]


def _sessions(step: float, sessions: int) -> list[tuple[FloatArray, ...]]:
    """Error of each rotation's integral, what it shares with the rests, its beginning, variance."""
    found: list[tuple[FloatArray, ...]] = []
    for place, motions in _moved(sessions):
        rates = [motion / step for motion in motions]
        rounded = [np.asarray(np.round(rate + place), np.float64) for rate in rates]
        times = [np.asarray(INTERVAL * np.arange(len(rate)), np.float64) for rate in rates]
        rests = [hold(np.ones(3), 0.0, gyroscope=np.zeros(3))]
        said = rounding_in_motion(rotation_samples(times, rounded), np.ones(3), rests)
        offsets = np.cumsum([0, *map(len, rates)])[:-1]
        error = np.array([(a - b - place).sum(axis=0) for a, b in zip(rounded, rates, strict=True)])
        resting = np.add.reduceat(said.resting.astype(float), offsets)
        begun = np.add.reduceat(said.begun, offsets)
        found.append((error, -place * resting, begun, said.variance / INTERVAL**2))
    return found


@pytest.mark.parametrize("step", [0.25, 1.0])
def test_rotations_err_by_rounding_as_said(step: float) -> None:
    """A rotation has the error of the rests for as long as it is said to rest.

    To 15 %, by the slope of the errors of 2,000 rotations over what they are said to share. What
    is left on the fastest axis in the sense of its rotations has the variance that is said, to a
    factor of two: its sum over a session is an error of the scale.
    """
    found = _sessions(step, 100)
    error, shared = (np.concatenate([one[k] for one in found]) for k in (0, 1))
    slope = float((error * shared).sum() / (shared**2).sum())
    assert slope == pytest.approx(1.0, abs=0.15)
    left, said = [], []
    for error, shared, begun, variance in found:
        sense = np.where(begun[:, 0] < 0.0, -1.0, 1.0)
        left.append(((error - shared)[:, 0] * sense).sum())
        said.append(variance[:, 0].sum() + np.abs(begun[:, 0]).sum() ** 2 / 12.0)
    assert 0.5 < np.mean(np.square(left)) / np.mean(said) < 1.6


def test_steps_that_the_noise_carries_the_readings_over_are_none() -> None:
    """Rounding is noise at rest and in motion alike then."""
    rng = np.random.default_rng(32)
    rate = _motion(rng)
    samples = rotation_samples(
        [np.asarray(INTERVAL * np.arange(len(rate)), np.float64)],
        [np.asarray(np.round(rate), np.float64)],
    )
    rests = [hold(np.ones(3), 0.0, gyroscope=np.zeros(3), gyroscope_sigma=0.2)]
    said = rounding_in_motion(samples, np.ones(3), rests)
    assert not said.variance.any()
    assert not said.resting.any()
