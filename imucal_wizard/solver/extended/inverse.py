"""The inverse of normal matrices, many at once, over what they determine."""

import numpy as np

from imucal_wizard.readings import FloatArray

BLIND = 1e-12
"""Share of a combination of parameters in what the rows show, below which they do not."""


def inverted(normal: FloatArray) -> FloatArray:
    """Inverse of symmetric matrices, shape (…, p, p), over what is determined.

    By Cholesky where all is, which it is with a prior on every size, else by eigenvalues at many
    times the cost.
    """
    if not normal.shape[-1]:
        return normal
    scale = _scale(normal)
    outer = scale[..., :, None] * scale[..., None, :]
    try:
        lower = np.linalg.cholesky(normal / outer)
    except np.linalg.LinAlgError:
        lower = None
    if lower is None or np.einsum("...pp->...p", lower).min() ** 2 < BLIND:
        return np.asarray(np.linalg.pinv(normal / outer, rcond=BLIND, hermitian=True) / outer)
    root = np.linalg.inv(lower)
    return np.asarray(np.swapaxes(root, -1, -2) @ root / outer)


def determined(normal: FloatArray) -> bool:
    """Whether symmetric matrices, shape (…, p, p), determine every parameter."""
    scale = np.sqrt(np.maximum(np.einsum("...pp->...p", normal), 0.0))
    if not (scale > 0.0).all():
        return False
    try:
        lower = np.linalg.cholesky(normal / (scale[..., :, None] * scale[..., None, :]))
    except np.linalg.LinAlgError:
        return False
    return bool(np.einsum("...pp->...p", lower).min(initial=1.0) ** 2 > BLIND)


def _scale(normal: FloatArray) -> FloatArray:
    scale = np.sqrt(np.maximum(np.einsum("...pp->...p", normal), 0.0))
    return np.where(scale > 0.0, scale, 1.0)
