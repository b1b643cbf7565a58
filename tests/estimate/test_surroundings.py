"""The pose before a hold."""

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.estimate.surroundings import circumstances_of
from imucal_wizard.measurement.holds import Hold


def test_the_pose_before_is_that_of_the_rest_before() -> None:
    """A device put down in the same direction again comes from there, a rest cut in two not."""
    up = unit_vectors(np.array([[1.0, 0, 0], [0, 1, 0], [0, 1, 0.05], [0, 1, 0.051], [0, 0, 1]]))
    spans = [(0.0, 4.0), (6.0, 10.0), (12.0, 14.0), (14.4, 17.0), (19.0, 22.0)]
    holds = [
        Hold(start, end, 9.8 * reading, np.eye(3), None, None, 100)
        for (start, end), reading in zip(spans, up, strict=True)
    ]
    found = circumstances_of(holds, up, 9.8, 1.0, None).previous / 9.8
    assert np.isnan(found[0]).all()
    np.testing.assert_allclose(found[1:], up[[0, 1, 1, 3]])
