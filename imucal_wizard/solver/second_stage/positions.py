"""Which still positions count for the alignment, and whether they leave one rotation only."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.ellipsoid.robust import NORMAL
from imucal_wizard.errors import DataError
from imucal_wizard.readings import BoolArray, FloatArray
from imucal_wizard.solver.fisher import exceeded
from imucal_wizard.solver.second_stage.descent import End, columns_of, errors
from imucal_wizard.solver.second_stage.rotation import rotation_vector

UNKNOWNS = 4
"""Three angles and the dip."""
FEWEST = 6
"""Still positions: two more, to contradict them."""
ANOTHER = np.radians(15.0)
"""Rotations that differ by less are one, whose error says how well it is known."""
UNLIKELY = 0.01
"""How rarely chance makes the errors of the wrong one of two rotations so much larger."""
FAR = 6.0
"""Robust standard deviations beyond which a position has no part in the first fit ..."""
OUTLIER = 4.0
"""... and how many beyond which it is left out (iron near that place)."""
SMALLEST = 1e-9
"""Error of a sine below which positions are exact."""


def near(up: FloatArray, field: FloatArray, end: End, doubt: FloatArray) -> BoolArray:
    """The positions that are not far off where absolute errors are least; all if they are few.

    Args:
        up: unit up in the accelerometer's frame, shape (n, 3).
        field: unit field in the magnetometer's own frame, shape (n, 3).
        end: R and level there.
        doubt: standard deviation of each error by what is not known of the calibrations, (n,).
    """
    error = np.abs(errors(up, field, *end))
    # as many of them as there are unknowns were made zero
    sigma = NORMAL * float(np.median(np.sort(error)[UNKNOWNS:]))
    close = error <= np.maximum(FAR * np.hypot(sigma, doubt), SMALLEST)
    return np.asarray(close) if close.sum() >= FEWEST else np.ones(len(up), bool)


def fitting(
    up: FloatArray, field: FloatArray, end: End, used: BoolArray, doubt: FloatArray
) -> BoolArray:
    """The positions within ``OUTLIER`` standard deviations, each where its share in the fit counts.

    With leverage h the error of one that was used is ``σ √(1 − h)``, of another ``σ √(1 + h)``.

    Args:
        up: unit up in the accelerometer's frame, shape (n, 3).
        field: unit field in the magnetometer's own frame, shape (n, 3).
        end: R and level of the positions used.
        used: which these are, shape (n,).
        doubt: standard deviation of each error by what is not known of the calibrations, (n,).
    """
    error, columns = errors(up, field, *end), columns_of(up, field @ end[0].T)
    sigma = np.sqrt((error[used] ** 2).sum() / (used.sum() - UNKNOWNS))
    inverse = np.linalg.pinv(columns[used].T @ columns[used])
    leverage = np.einsum("ni,ij,nj->n", columns, inverse, columns)
    share = np.maximum(1.0 + np.where(used, -leverage, leverage), 0.0)
    limit = OUTLIER * np.hypot(sigma * np.sqrt(share), doubt)
    return np.asarray(np.abs(error) <= np.maximum(limit, SMALLEST))


def refuse_two(up: FloatArray, field: FloatArray, best: End, others: Sequence[End]) -> None:
    """Refuse positions that fit with another rotation hardly worse.

    Raises:
        DataError: they do.
    """
    freedom = len(up) - UNKNOWNS
    least = float((errors(up, field, *best) ** 2).sum())
    for rotation, level in others:
        angle = float(np.linalg.norm(rotation_vector(rotation @ best[0].T)))
        ratio = float((errors(up, field, rotation, level) ** 2).sum()) / max(least, 1e-300)
        if angle > ANOTHER and exceeded(ratio, freedom, freedom) > UNLIKELY:
            raise DataError(
                "the still positions leave two rotations between magnetometer and accelerometer "
                f"possible, {np.degrees(angle):.0f}° apart: hold the device still in more "
                "orientations, its edges and corners up too"
            )
