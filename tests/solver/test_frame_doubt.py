"""What is not known of the accelerometer is not known of the gyroscope either."""

from dataclasses import replace

import numpy as np
import pytest

from tests.solver.motions import experiment, hand_turns
from tests.solver.truth import typical_gyroscope


def test_the_doubt_about_the_frame_is_in_the_covariance() -> None:
    """Against a whole refit with both ends of every rotation moved by each doubt in turn.

    What the doubts add to the gains is the sum over them of what these then move by, squared.
    """
    rng = np.random.default_rng(0)
    data = experiment(hand_turns(4, rng), typical_gyroscope(), rng, tilt_sigma=1e-3)
    count = len(data.turns.before)
    before, after = rng.normal(scale=2e-4, size=(2, count, 3, 2))
    doubted = replace(data, turns=replace(data.turns, before_doubt=before, after_doubt=after))
    plain, whole = data.fit(), doubted.fit()
    assert (whole.matrix == plain.matrix).all()
    added = whole.covariance - plain.covariance
    expected = np.zeros((9, 9))
    for k in range(2):
        ends = []
        for sign in (1.0, -1.0):
            moved = replace(
                data.turns,
                before=data.turns.before + sign * before[:, :, k],
                after=data.turns.after + sign * after[:, :, k],
            )
            other = replace(data, turns=moved).fit()
            ends.append(other.matrix.ravel())
        change = 0.5 * (ends[0] - ends[1])
        expected += np.outer(change, change)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # the doubts are a fifth of the errors that the closures have: not wholly linear
    assert added[:9, :9] / scale == pytest.approx(expected / scale, abs=0.02)
