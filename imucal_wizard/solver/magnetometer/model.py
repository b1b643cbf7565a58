"""Which of the nine parameters these directions carry.

Every direction counts as one reading that the model explains to a per cent or two of the field,
however many samples it holds: a thousand samples of one half circle say nothing of the other half.
What such an error becomes anywhere on the sphere is the amplification of the design.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.ellipsoid.algebraic import quadrics
from imucal_wizard.ellipsoid.bins import BINS
from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.carried import amplification, basis_of
from imucal_wizard.solver.magnitude import BIAS, SCALE, SIZE

LARGEST = 6.0
"""Amplification up to which a model is carried: a misfit of 1 % is then nowhere more than 6 %."""
LARGEST_OF_SPHERE = 2.5
"""The same for the bias alone, which leaves the largest errors unseen."""
FEWEST = 3
"""Samples from which a direction counts."""
ENOUGH = 70
"""Areas of a hundred beyond which no gap needs a word."""

CROSS_NAMES = ("soft_iron_xy", "soft_iron_xz", "soft_iron_yz")


@dataclass(frozen=True, eq=False)
class FieldModel:
    """The model that the directions carry.

    Attributes:
        basis: free directions of θ, shape (9, p).
        quadrics: the same for the algebraic fit, shape (10, q).
        cross: whether the off-diagonal entries are free.
        scales: whether each axis has a scale of its own.
        terms: names of the terms.
        dropped: names of parameters left at zero.
        reason: why, in one sentence, or "".
    """

    basis: FloatArray
    quadrics: FloatArray
    cross: bool
    scales: bool
    terms: tuple[str, ...]
    dropped: tuple[str, ...] = ()
    reason: str = ""


WHOLE = FieldModel(
    np.eye(SIZE),
    quadrics(tuple(range(SIZE))),
    True,
    True,
    ("bias", "soft-iron"),
)
"""All nine parameters."""


def decide(directions: FloatArray, areas: NDArray[np.intp]) -> FieldModel:
    """The richest model that the directions carry.

    Args:
        directions: unit vectors, shape (3, n).
        areas: area of each, shape (n,).

    Raises:
        DataError: they do not carry even the bias.
    """
    seen = _means(directions, areas)
    if amplification(seen, WHOLE.basis).max() <= LARGEST:
        return WHOLE
    turn = "Turn the device with each of its six faces up, a whole circle each"
    upright = (*BIAS, *SCALE)
    if amplification(seen, basis_of(upright)).max() <= LARGEST:
        why = f"{len(seen)} directions do not carry the off-diagonal soft iron: left at zero. "
        model = ("bias", "scale")
        return FieldModel(
            basis_of(upright), quadrics(upright), False, True, model, CROSS_NAMES, why + turn
        )
    if amplification(seen, basis_of(BIAS, common_scale=True)).max() <= LARGEST_OF_SPHERE:
        why = f"{len(seen)} directions carry the hard iron only: the soft iron is left out. "
        return FieldModel(
            basis_of(BIAS, common_scale=True),
            quadrics(BIAS),
            False,
            False,
            ("bias",),
            CROSS_NAMES,
            why + turn,
        )
    raise DataError(
        f"the readings cover {len(seen)} of {BINS} directions, too few for a calibration. {turn}"
    )


def _means(directions: FloatArray, areas: NDArray[np.intp]) -> FloatArray:
    """Mean unit vector of each area that counts, shape (k, 3)."""
    count = np.bincount(areas, minlength=BINS)
    sums = np.array([np.bincount(areas, axis, BINS) for axis in directions])
    means = sums[:, count >= min(FEWEST, max(1, len(areas) // BINS))].T
    means = means[np.linalg.norm(means, axis=1) > 0.0]
    return np.asarray(means / np.linalg.norm(means, axis=1)[:, None])
