"""Which still positions count for the alignment."""

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.second_stage.alignment import (
    FAR_OFF,
    OUTLIER,
    dip_errors,
    fitting,
    near,
)
from tests.estimate.field_truth import all_over

LEVEL = -0.8
END = (np.eye(3), LEVEL)


def _with_errors(error: FloatArray, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Up and field of positions whose sine of the dip is off by so much."""
    rng = np.random.default_rng(seed)
    field = all_over(rng, len(error))
    across = np.cross(field, all_over(rng, len(error)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    sine = (LEVEL + error)[:, None]
    up = sine * field + np.sqrt(1.0 - sine**2) * across
    assert dip_errors(up, field, *END) == pytest.approx(error, abs=1e-12)
    return up, field


def test_the_four_errors_that_a_fit_makes_zero_say_nothing_of_the_others() -> None:
    """Of twelve errors four are zero and three small by chance: the scatter is that of eight."""
    error = 1e-3 * np.array([0, 0, 0, 0, 0.2, -0.2, 0.2, 1, -1, 1, -1, 8.0])
    assert near(*_with_errors(error), END, np.zeros(12)).all()
    error[-1] = 1e-3 * 1.6 * FAR_OFF
    kept = near(*_with_errors(error), END, np.zeros(12))
    assert np.flatnonzero(~kept).tolist() == [11]


def test_a_distance_explained_by_uncertainty_is_not_an_outlier() -> None:
    error = 1e-3 * np.array([0, 0, 0, 0, 1, -1, 1, 1, -1, 1, -1, 12.0])
    doubt = np.zeros(12)
    assert not near(*_with_errors(error), END, doubt)[11]
    doubt[11] = 2e-3
    assert near(*_with_errors(error), END, doubt).all()


def test_too_few_near_ones_are_no_choice() -> None:
    """Seven positions of which three would be left: then all of them stay in."""
    error = 1e-3 * np.array([0, 0, 0, 0, 1e-3, 40, -50.0])
    kept = near(*_with_errors(error), END, np.zeros(7))
    assert (~near(*_with_errors(np.append(error, [0.0, 1e-6])), END, np.zeros(9))).sum() == 2
    assert kept.all()


def test_a_position_is_judged_by_its_share_in_the_fit() -> None:
    """A used one errs by σ √(1 − h), another by σ √(1 + h): h from the columns written out."""
    rng = np.random.default_rng(1)
    error = 1e-3 * rng.standard_normal(14)
    used = np.arange(14) != 13
    up, field = _with_errors(error, 2)
    columns = np.column_stack([np.cross(field, up), -np.ones(14)])
    inverse = np.linalg.inv(columns[used].T @ columns[used])
    leverage = np.array([row @ inverse @ row for row in columns])
    sigma = np.sqrt((error[used] ** 2).sum() / (13 - 4))
    outside = OUTLIER * sigma * np.sqrt(1.0 + leverage[13])
    for share, stays in ((0.98, True), (1.02, False)):
        error[13] = share * outside
        up, field = _with_errors(error, 2)
        # up moves with its error by a thousandth, and its leverage with it
        assert fitting(up, field, END, used, np.zeros(14))[13] == stays


def test_a_position_that_decides_an_angle_may_err_less() -> None:
    """Its own error is in σ too: ``e² = c S/(1 − c)`` is the limit, ``c = 16 (1 − h)/(n − 4)``."""
    error = 1e-3 * np.tile([1.0, -1.0], 12)
    up, field = _with_errors(error, 3)
    columns = np.column_stack([np.cross(field, up), -np.ones(24)])
    leverage = np.einsum("ni,ij,nj->n", columns, np.linalg.inv(columns.T @ columns), columns)
    most = int(np.argmax(leverage))
    assert leverage[most] > 0.2
    error[most] = 0.0
    share = OUTLIER**2 * (1.0 - leverage[most]) / 20.0
    limit = np.sqrt(share * (error @ error) / (1.0 - share))
    used = np.ones(24, bool)
    for factor, stays in ((0.97, True), (1.03, False)):
        error[most] = factor * limit
        assert fitting(*_with_errors(error, 3), END, used, np.zeros(24))[most] == stays
    # what a doubt explains stays
    assert fitting(*_with_errors(error, 3), END, used, np.full(24, 1e-3))[most]
