"""The sizes of effects as parameters of a result."""

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.terms import Terms
from imucal_wizard.solver.result import Parameter


def size_errors(terms: Terms, covariance: FloatArray | None) -> FloatArray:
    """Standard error of each size, shown units, shape (p,); NaN where nothing is known of them."""
    if covariance is None:
        return np.full(len(terms), np.nan)
    return np.sqrt(np.maximum(np.diag(covariance), 0.0))


def size_parameters(terms: Terms, sizes: FloatArray, errors: FloatArray) -> tuple[Parameter, ...]:
    """The sizes (p,) with their standard errors (p,) under their names."""
    return tuple(
        Parameter(name, float(size), float(error) if np.isfinite(error) else None, one.unit)
        for name, size, error, one in zip(terms.names, sizes, errors, terms.parameters, strict=True)
    )
