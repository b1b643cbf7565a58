"""What the size of gravity shows about the unit of accelerations: one rule for all callers.

An accelerometer measures one gravity most of the time. A gyroscope at rest shows no unit.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import median
from imucal_wizard.core.units import ACCELERATION, COUNT, STANDARD_GRAVITY

MAX_UNIT_ERROR = 0.3
"""Bias and scale of an uncalibrated sensor, and hand-held pauses, stay within this share of g."""
MIN_GRAVITY_COUNTS = 100.0
"""No sensor resolves gravity in fewer counts."""
UNITS_BY_SIZE = ("m/s^2", "g", "mg")
"""Units that are told apart by the size of gravity; cm/s² and mg are not."""


def median_magnitude(values: FloatArray) -> float:
    """Median magnitude of readings, shape (n, 3); NaN rows do not count."""
    lengths = np.sqrt(np.einsum("ij,ij->i", values, values))
    return median(lengths[~np.isnan(lengths)])


def are_whole_numbers(values: FloatArray) -> bool:
    """Whether all readings are whole numbers, as counts are."""
    finite = values[np.isfinite(values)]
    return bool(np.all(finite == np.floor(finite)))


def gravity_fits_unit(size: float, unit: str, within: float = MAX_UNIT_ERROR) -> bool:
    """Whether gravity may have this size in a unit, to so large a share of it."""
    if unit == COUNT:
        return size >= MIN_GRAVITY_COUNTS
    return abs(size * ACCELERATION[unit] / STANDARD_GRAVITY - 1.0) < within


def unit_of_gravity(size: float, within: float = MAX_UNIT_ERROR) -> str | None:
    """The unit in which one gravity has this size, to so large a share of it; None for counts."""
    return next((unit for unit in UNITS_BY_SIZE if gravity_fits_unit(size, unit, within)), None)


def acceleration_unit(size: float, whole: bool) -> str | None:
    """The acceleration unit in which gravity would have this size, or None.

    Args:
        size: usual magnitude of the readings.
        whole: whether all readings are whole numbers.
    """
    found = unit_of_gravity(size)
    if not whole or found == "mg":  # the only one of them that is printed in whole numbers
        return found
    return COUNT if gravity_fits_unit(size, COUNT) else None
