"""Units that the values themselves betray, and units that they contradict."""

import numpy as np

from imucal_wizard.devices.gravity import fits, looks_like, usual_size, whole_numbers
from imucal_wizard.errors import RecordingError
from imucal_wizard.readings import FloatArray
from imucal_wizard.units import ACCELERATION, COUNT


def acceleration_unit(values: FloatArray) -> tuple[str, str]:
    """The unit of accelerations, and a sentence that says how it was found.

    Args:
        values: readings, shape (n, 3).

    Raises:
        RecordingError: the size of gravity fits no unit.
    """
    size = usual_size(values)
    unit = looks_like(size, whole_numbers(values))
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
    if fits(size, unit) or not np.isfinite(size):
        return ()
    other = looks_like(size, whole=False)
    advice = f"it looks like {other}, then give --accel-unit {other}" if other else "check the unit"
    return (f"gravity measures {size:.4g} {unit}; {advice}",)
