"""The size of errors as one number."""

import numpy as np

from imucal_wizard.core.readings import FloatArray


def root_mean_square(errors: FloatArray) -> float:
    """Of errors of any shape; of vectors, of their lengths when they are the last axis."""
    squares = errors**2 if errors.ndim == 1 else (errors**2).sum(axis=-1)
    return float(np.sqrt(squares.mean()))
