"""Directions over the sphere."""

import numpy as np
import pytest

from imucal_wizard.core.directions import even_directions


@pytest.mark.parametrize("some", [12, 37, 150])
def test_directions_that_follow_one_another_are_spread(some: int) -> None:
    """The mean of n that chance draws is about 0.9 over the root of n long."""
    every = even_directions(20 * some)
    assert np.linalg.norm(every, axis=1) == pytest.approx(1.0)
    means = np.linalg.norm(every.reshape(20, some, 3).mean(axis=1), axis=1)
    assert means.max() < 3.5 / some
