"""Sizes of effects by chance."""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.terms import Terms


def drawn(terms: Terms, seed: int = 1) -> FloatArray:
    """Sizes as the prior expects them, shape (p,)."""
    typical = np.array([one.typical for one in terms.parameters])
    return np.asarray(np.random.default_rng(seed).normal(0.0, 1.0, len(terms)) * typical)
