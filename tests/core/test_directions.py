"""Directions over the sphere."""

import numpy as np
import pytest

from imucal_wizard.core.directions import even_directions, farthest_from


@pytest.mark.parametrize("some", [12, 37, 150])
def test_directions_that_follow_one_another_are_spread(some: int) -> None:
    """The mean of n that chance draws is about 0.9 over the root of n long."""
    every = even_directions(20 * some)
    assert np.linalg.norm(every, axis=1) == pytest.approx(1.0)
    means = np.linalg.norm(every.reshape(20, some, 3).mean(axis=1), axis=1)
    assert means.max() < 3.5 / some


def test_the_largest_gap_between_directions_is_found() -> None:
    """Between the six faces it is the corners' 54.7°; without one face, its 90°."""
    faces = np.concatenate([np.eye(3), -np.eye(3)])
    middle, angle = farthest_from(faces)
    assert np.degrees(angle) == pytest.approx(54.7, abs=3.0)
    assert np.abs(middle) == pytest.approx(1.0 / np.sqrt(3.0), abs=0.1)
    middle, angle = farthest_from(faces[:-1])
    assert np.degrees(angle) == pytest.approx(90.0, abs=5.0)
    assert middle @ faces[-1] > np.cos(np.radians(5.0))
