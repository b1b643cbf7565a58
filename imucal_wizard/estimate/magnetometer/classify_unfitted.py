"""Samples that were not fitted, classified by the fit of the others: disturbed or not."""

from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import BoolArray, Series
from imucal_wizard.core.robust import robust_deviation
from imucal_wizard.estimate.ellipsoid.coverage import bin_of
from imucal_wizard.estimate.magnetometer.field_disturbances import (
    FEWEST_IN_BLOCK,
    find_disturbances,
)
from imucal_wizard.estimate.magnetometer.fit import MagnetometerFit
from imucal_wizard.measurement.rounding import resolution_of, rounding_shift

EXACT_SHARE = 1e-9
"""Scatter below which readings are exact, as a share of the field."""


def classify_unfitted(found: MagnetometerFit, series: Series, fitted: BoolArray) -> MagnetometerFit:
    """The fit of some samples, which says of the others, too, whether they were disturbed.

    The field may be another one there: what counts is that it is the same all the while.

    Args:
        found: by the samples fitted.
        series: all readings, in the order of time.
        fitted: which of them were fitted, shape (n,).
    """
    calm = np.zeros(len(series), bool)
    calm[fitted] = found.kept
    others = ~fitted
    if others.sum() > FEWEST_IN_BLOCK:
        corrected = (series.values[others] - found.fit.bias) @ found.fit.matrix.T
        length = np.linalg.norm(corrected, axis=1)
        usual = float(np.median(length))
        distance = length / usual - 1.0
        areas = bin_of((corrected / length[:, None]).T)
        sigma = max(robust_deviation(distance), EXACT_SHARE)
        gain = float(np.cbrt(abs(np.linalg.det(found.fit.matrix))))
        shift = rounding_shift(sigma, resolution_of(series.values[others]) * gain / usual)
        calm[others] = find_disturbances(distance, series.time[others], areas, sigma, shift)[0]
    return replace(found, calm=calm)
