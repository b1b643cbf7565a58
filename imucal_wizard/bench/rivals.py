"""How far these poses can tell a second or third order from any other characteristic of an axis.

Faces and edges hold an axis at five inputs only: 0, ±0.71 and ±1 g. Bias and scale absorb so much
that two numbers are left of any characteristic, and a second and a third order together make any
two. Corners and tilts at other angles show more of it.
"""

import numpy as np

from imucal_wizard.bench.misfit import Misfit, RowKind
from imucal_wizard.bench.noise import Frame, shown_axes
from imucal_wizard.bench.pairs import BENT
from imucal_wizard.bench.unknown import WAVES
from imucal_wizard.readings import FloatArray

AXES = "xyz"


def own_share(misfit: Misfit, frame: Frame) -> float:
    """Share of a rippled characteristic that no bent one imitates here.

    Args:
        misfit: what is left.
        frame: its coordinates.

    Returns:
        The median over axes and waves of the share of the visible pattern's square; 1 where no
        characteristic is among the suspects, as for a gyroscope, whose input is not gravity.
    """
    if not (misfit.kind == RowKind.HOLD).any():
        return 1.0
    shown = shown_axes(misfit)
    shares = []
    for axis in range(3):
        bent = _bent(misfit, AXES[axis])
        if bent.shape[1]:
            phase = misfit.direction[:, [axis]] * np.array(WAVES)
            waves = np.concatenate([np.sin(phase), np.cos(phase)], axis=1) * shown[:, [axis]]
            shares.append(_outside(frame.across.T @ waves, frame.across.T @ bent))
    return float(np.median(np.concatenate(shares))) if shares else 1.0


def _bent(misfit: Misfit, axis: str) -> FloatArray:
    """Columns of the plainest characteristic of each family on one axis, shape (n, p)."""
    columns = {
        candidate.family: candidate.columns[:, [candidate.names.index(axis)]]
        for candidate in reversed(misfit.candidates)
        if candidate.family in BENT and axis in candidate.names
    }
    return np.concatenate([np.zeros((len(misfit), 0)), *columns.values()], axis=1)


def _outside(waves: FloatArray, bent: FloatArray) -> FloatArray:
    """Share of each wave's square that no combination of the bent makes."""
    scaled = bent / np.maximum(np.linalg.norm(bent, axis=0), 1e-300)
    left, values, _ = np.linalg.svd(scaled, full_matrices=False)
    inside = left[:, values > 1e-6].T @ waves
    whole = np.maximum((waves**2).sum(axis=0), 1e-300)
    return np.asarray(1.0 - (inside**2).sum(axis=0) / whole)
