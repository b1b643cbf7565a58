"""The noise that explanations are judged under: it may wander, at rest and while turning."""

import numpy as np
import pytest

from benchmarks.hidden.designs import EXACT, REPEATED, STANDARD
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.explained_variance import discriminability
from imucal_wizard.diagnose.random_walk import frame_of, wandering
from imucal_wizard.diagnose.residuals import RowKind, WhitenedResiduals
from imucal_wizard.diagnose.unexplained_text import MIN_WANDERING
from tests.diagnose.recordings import fitted
from tests.diagnose.sessions import session


@pytest.fixture(scope="module")
def gyroscope() -> WhitenedResiduals:
    bench = Benches(*fitted(rotations=6)).bench("gyroscope")
    assert bench is not None
    return bench.look().misfit


def test_a_bias_moves_a_mean_at_rest_by_one_and_a_closure_by_its_seconds(
    gyroscope: WhitenedResiduals,
) -> None:
    """Turns of this hand last between one second and eight; two of three axes close."""
    rest = gyroscope.kind == RowKind.STILL
    axes = gyroscope.axis[rest]
    own = np.abs(gyroscope.lever[rest][np.arange(len(axes)), axes])
    np.testing.assert_allclose(own, 1.0, atol=0.05)
    seconds = np.linalg.norm(gyroscope.lever[gyroscope.kind == RowKind.ROTATION], axis=1)
    assert np.median(seconds) > 0.5
    assert seconds.max() < 10.0


def test_a_wandering_bias_is_noise_for_rotations_too(gyroscope: WhitenedResiduals) -> None:
    """A random walk that reaches them as it reaches the rests is likelier as noise than a drift."""
    frame = frame_of(gyroscope)
    moved = gyroscope.lever * (gyroscope.time - gyroscope.time.mean())[:, None] / 60.0
    drift = frame.across.T @ (moved * np.radians(0.01) / gyroscope.sigma[:, None])
    calm, walking = ((frame.weights(w) @ drift**2).sum() for w in (0.0, 2.0))
    assert walking < 0.02 * calm


@pytest.mark.parametrize("size", [1.0, 300.0])
def test_what_follows_the_time_is_told_from_chance_at_any_size(size: float) -> None:
    """Seats off by 300 times the noise are as far off in the next visit, a walk is not."""
    misfit, hypotheses = session(design=REPEATED.name)
    frame, rng = hypotheses.frame, np.random.default_rng(7)
    minutes = (misfit.time - misfit.time.min()) / 60.0
    told = []
    for walks in (False, True):
        found = []
        for _ in range(40):
            steps = rng.normal(size=(len(misfit), 3))
            if walks:
                steps *= 20.0 * np.sqrt(np.diff(minutes, prepend=0.0))[:, None]
                steps = np.cumsum(steps, axis=0)
            residual = size * ((steps * misfit.direction).sum(axis=1) + rng.normal(size=len(steps)))
            likely = wandering(misfit, frame, frame.across.T @ residual)
            found.append(likely > MIN_WANDERING)
        told.append(np.mean(found))
    assert told[0] <= 0.05
    assert told[1] >= 0.9


def test_what_each_motion_leaves_behind_in_a_gyroscope_does_not_follow_the_time(
    gyroscope: WhitenedResiduals,
) -> None:
    """Rotations and the rests after them read another bias each time, or one that walks."""
    frame, rng, size = frame_of(gyroscope), np.random.default_rng(9), np.radians(0.07)
    moments, visit = np.unique(gyroscope.time, return_inverse=True)
    steps = np.sqrt(np.diff(moments, prepend=moments[0]) / np.diff(moments).mean())
    told = []
    for walks in (False, True):
        found = []
        for _ in range(20):
            bias = size * rng.normal(size=(len(moments), 3))
            if walks:
                bias = np.cumsum(steps[:, None] * bias, axis=0)
            else:  # rests and rotations alternate
                bias[2::2] = bias[1:-1:2]
            bias -= bias.mean(axis=0)
            moved = (gyroscope.lever * bias[visit]).sum(axis=1)
            residual = gyroscope.whitened(moved[:, None])[:, 0] + rng.normal(size=len(moved))
            likely = wandering(gyroscope, frame, frame.across.T @ residual)
            found.append(likely > MIN_WANDERING)
        told.append(np.mean(found))
    assert told[0] <= 0.05
    assert told[1] >= 0.9


def test_faces_and_edges_show_two_numbers_of_a_characteristic_corners_more() -> None:
    """Second and third order imitate every ripple on exact faces and edges.

    Exactly so if all holds weigh alike; holds in which the hand trembled weigh less.
    """
    shares = {
        plan.name: discriminability(misfit, hypotheses.frame)
        for plan in (EXACT, STANDARD, REPEATED)
        for misfit, hypotheses in [session(design=plan.name)]
    }
    assert shares[EXACT.name] < 0.06
    assert shares[STANDARD.name] < 0.1
    assert shares[REPEATED.name] > 0.25
