"""What is not known of the accelerometer is not known of the gyroscope either."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.directions import unit_vectors
from tests.estimate.motions import experiment, hand_turns
from tests.estimate.truth import typical_gyroscope


def test_the_uncertainty_of_the_frame_is_in_the_covariance() -> None:
    """Against a whole refit with both ends of every rotation moved by each doubt in turn.

    What the doubts add to the gains is the sum over them of what these then move by, squared.
    """
    rng = np.random.default_rng(0)
    data = experiment(hand_turns(4, rng), typical_gyroscope(), rng, tilt_sigma=1e-3)
    count = len(data.reference.up)
    doubt = rng.normal(scale=2e-4, size=(count, 3, 2))
    doubted = replace(data, reference=replace(data.reference, doubt=doubt))
    plain, whole = data.fit(), doubted.fit()
    assert plain.covariance is not None
    assert whole.covariance is not None
    error = np.sqrt(np.diag(whole.covariance)[:9])
    assert (np.abs(whole.matrix - plain.matrix).ravel() < error).all()
    added = (whole.covariance - plain.covariance)[:9, :9]
    expected = np.zeros((9, 9))
    for k in range(2):
        ends = []
        for sign in (1.0, -1.0):
            up = unit_vectors(data.reference.up + sign * doubt[:, :, k])
            other = replace(data, reference=replace(data.reference, up=up)).fit()
            ends.append(other.matrix.ravel())
        change = 0.5 * (ends[0] - ends[1])
        expected += np.outer(change, change)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # what the closures themselves tell of the doubts is taken off
    assert (np.diag(added) < 1.1 * np.diag(expected)).all()
    assert (np.diag(added) > 0.3 * np.diag(expected)).all()
    assert added / scale == pytest.approx(expected / scale, abs=0.5)
