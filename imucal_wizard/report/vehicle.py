"""Undoes the correction that a flight controller applies to the readings it sends.

The formulas are those of the export targets: ``corrected = scale · (raw − offset)``. A calibration
and its rechecks then describe the bare sensor, whatever the parameters of the controller are.
"""

from collections.abc import Callable, Mapping

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.quantities import number
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.report.axes import Axes
from imucal_wizard.report.exports import ExportSettings, target_named

_STAYS = {"px4": "; the biases that its estimator has found stay subtracted: restart it before"}
"""Corrections that no parameter shows."""
SENSORS_OF_VEHICLE = ("accelerometer", "gyroscope")


def _present_axes(autopilot: str, parameters: Mapping[str, float]) -> dict[str, Axes]:
    """The correction of each sensor of a vehicle's first IMU.

    Args:
        autopilot: name of its export target.
        parameters: of the vehicle.

    Raises:
        UsageError: it corrects in a way that cannot be undone, as by the temperature.
    """
    corrects = target_named(autopilot).corrects
    if corrects is None:
        raise UsageError(f"nothing is known of how {autopilot} corrects its readings")
    text = "".join(f"{name} {value:.9g}\n" for name, value in parameters.items())
    settings = ExportSettings(present=text.encode())
    return {sensor: corrects(settings, sensor) for sensor in SENSORS_OF_VEHICLE}


def undoing(autopilot: str, parameters: Mapping[str, float]) -> Callable[[FloatArray], FloatArray]:
    """From accelerations and rates as the vehicle sends them, (n, 6), to those of the bare sensor.

    The arguments and errors are those of ``_present_axes``.
    """
    both = _present_axes(autopilot, parameters)
    first, second = (both[sensor] for sensor in SENSORS_OF_VEHICLE)

    def undo(sent: FloatArray) -> FloatArray:
        return np.concatenate([first.raw(sent[:, :3]), second.raw(sent[:, 3:])], axis=1)

    return undo


def undone_text(autopilot: str, parameters: Mapping[str, float]) -> str:
    """What was undone, in a sentence."""
    corrections = []
    for sensor, axes in _present_axes(autopilot, parameters).items():
        offset, scale = (
            ", ".join(number(one, 4) for one in each) for each in (axes.offset, axes.scale)
        )
        corrections.append(f"{sensor} offsets {offset}, scales {scale}")
    stays = _STAYS.get(autopilot, "")
    name = target_named(autopilot).title.partition(":")[0]
    return f"undone, as {name} had applied it: {'; '.join(corrections)} (SI){stays}"
