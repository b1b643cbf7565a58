"""Units that the values themselves betray: an accelerometer measures one gravity most of the time.

A gyroscope at rest betrays nothing, so its unit is never guessed.
"""

import numpy as np

from imucal_wizard.errors import RecordingError
from imucal_wizard.readings import FloatArray
from imucal_wizard.units import ACCELERATION, COUNT, STANDARD_GRAVITY

_NEAR = 0.3
"""Bias and scale of an uncalibrated sensor, and hand-held pauses, stay within this share of g."""
_FEWEST_COUNTS = 100.0
"""No sensor resolves gravity in fewer counts."""


def usual_size(values: FloatArray) -> float:
    """Median magnitude of readings, shape (n, 3); NaN rows do not count."""
    return float(np.nanmedian(np.sqrt(np.einsum("ij,ij->i", values, values))))


def looks_like(size: float, whole: bool) -> str | None:
    """The acceleration unit in which gravity would have this size, or None.

    Args:
        size: usual magnitude of the readings.
        whole: whether all readings are whole numbers, as counts are.
    """
    for unit in ("m/s^2", "g", "mg"):
        if abs(size * ACCELERATION[unit] / STANDARD_GRAVITY - 1.0) < _NEAR and not whole:
            return unit
    return COUNT if whole and size >= _FEWEST_COUNTS else None


def acceleration_unit(values: FloatArray) -> tuple[str, str]:
    """The unit of accelerations, and a sentence that says how it was found.

    Args:
        values: readings, shape (n, 3).

    Raises:
        RecordingError: the size of gravity fits no unit.
    """
    size = usual_size(values)
    finite = values[np.isfinite(values)]
    unit = looks_like(size, bool(np.all(finite == np.floor(finite))))
    if unit is None:
        raise RecordingError(
            f"the unit of the accelerations cannot be told: gravity measures {size:.4g}; give"
            f" --accel-unit with one of {', '.join(ACCELERATION)}, {COUNT}"
        )
    return unit, f"accelerations were taken as {unit}, because gravity measures {size:.4g}"


def doubt(values: FloatArray, unit: str) -> tuple[str, ...]:
    """A warning when gravity contradicts the unit that was given, else nothing.

    Args:
        values: readings in that unit, shape (n, 3).
        unit: the unit as it was given.
    """
    size = usual_size(values)
    if unit == COUNT:
        fits = size >= _FEWEST_COUNTS or not np.isfinite(size)
    else:
        fits = not abs(size * ACCELERATION[unit] / STANDARD_GRAVITY - 1.0) > _NEAR
    if fits:
        return ()
    other = looks_like(size, whole=False)
    advice = f"it looks like {other}, then give --accel-unit {other}" if other else "check the unit"
    return (f"gravity measures {size:.4g} {unit}; {advice}",)
