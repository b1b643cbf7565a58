"""Samples that a magnetometer's fit has not seen, judged by it: which of them were disturbed."""

from dataclasses import replace

import numpy as np

from imucal_wizard.ellipsoid.bins import bin_of
from imucal_wizard.ellipsoid.robust import spread
from imucal_wizard.procedure.rounding import rounding_shift, steps_of
from imucal_wizard.readings import BoolArray, Series
from imucal_wizard.solver.magnetometer.disturbances import FEWEST, find
from imucal_wizard.solver.magnetometer.report import MagnetometerFit

SMALLEST = 1e-9
"""Scatter below which readings are exact, as a share of the field."""


def judged_elsewhere(found: MagnetometerFit, series: Series, fitted: BoolArray) -> MagnetometerFit:
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
    if others.sum() > FEWEST:
        corrected = (series.values[others] - found.fit.bias) @ found.fit.matrix.T
        length = np.linalg.norm(corrected, axis=1)
        usual = float(np.median(length))
        distance = length / usual - 1.0
        areas = bin_of((corrected / length[:, None]).T)
        sigma = max(spread(distance), SMALLEST)
        gain = float(np.cbrt(abs(np.linalg.det(found.fit.matrix))))
        shift = rounding_shift(sigma, steps_of(series.values[others]) * gain / usual)
        calm[others] = find(distance, series.time[others], areas, sigma, shift)[0]
    return replace(found, calm=calm)
