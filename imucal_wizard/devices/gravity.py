"""What the size of gravity says of the unit of accelerations: one rule for streams and for files.

An accelerometer measures one gravity most of the time. A gyroscope at rest betrays nothing.
"""

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.units import ACCELERATION, COUNT, STANDARD_GRAVITY

NEAR = 0.3
"""Bias and scale of an uncalibrated sensor, and hand-held pauses, stay within this share of g."""
FEWEST_COUNTS = 100.0
"""No sensor resolves gravity in fewer counts."""
GUESSED = ("m/s^2", "g", "mg")
"""Units that are told apart by the size of gravity; cm/s² and mg are not."""


def usual_size(values: FloatArray) -> float:
    """Median magnitude of readings, shape (n, 3); NaN rows do not count."""
    return float(np.nanmedian(np.sqrt(np.einsum("ij,ij->i", values, values))))


def whole_numbers(values: FloatArray) -> bool:
    """Whether all readings are whole numbers, as counts are."""
    finite = values[np.isfinite(values)]
    return bool(np.all(finite == np.floor(finite)))


def fits(size: float, unit: str, within: float = NEAR) -> bool:
    """Whether gravity may have this size in a unit, to so large a share of it."""
    if unit == COUNT:
        return size >= FEWEST_COUNTS
    return abs(size * ACCELERATION[unit] / STANDARD_GRAVITY - 1.0) < within


def unit_of_gravity(size: float, within: float = NEAR) -> str | None:
    """The unit in which one gravity has this size, to so large a share of it; None for counts."""
    return next((unit for unit in GUESSED if fits(size, unit, within)), None)


def looks_like(size: float, whole: bool) -> str | None:
    """The acceleration unit in which gravity would have this size, or None.

    Args:
        size: usual magnitude of the readings.
        whole: whether all readings are whole numbers.
    """
    found = unit_of_gravity(size)
    if not whole or found == "mg":  # the only one of them that is printed in whole numbers
        return found
    return COUNT if fits(size, COUNT) else None
