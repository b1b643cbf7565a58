"""imucal (MaD Lab): the JSON of its ``FerrarisCalibrationInfo``.

    a = R_a⁻¹ K_a⁻¹ (y_a − b_a),    w = R_g⁻¹ K_g⁻¹ (y_g − K_ga a − b_g)

K·R is the inverse of our matrix. ``K_ga`` acts in the reading and on corrected accelerations: our
g-sensitivity G is an error of the input, so ``K_ga = (K_g R_g) G``. Rates come out in °/s.
"""

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import ACCELERATION_UNITS, RATE_UNITS
from imucal_wizard.report.calibration_file import Calibration, SavedEffect, Sensor
from imucal_wizard.report.exports import BACKWARD, ExportSettings, ExportTarget, Files
from imucal_wizard.report.proof import Correction, Samples
from imucal_wizard.report.reduced import Kept

_DEGREE = RATE_UNITS["deg/s"]
_KEYS = ("K_a", "R_a", "b_a", "K_g", "R_g", "K_ga", "b_g")


def is_g_sensitivity(one: SavedEffect) -> bool:
    """Whether an effect is a matrix from the force to the rate."""
    return one.term == "g-sensitivity"


def sensitivity_to_g(sensor: Sensor) -> FloatArray:
    """G: error of the true rate, rad/s per m/s², shape (3, 3); zeros where it was not fitted."""
    for one in sensor.effects:
        if is_g_sensitivity(one):
            sizes = np.array(one.sizes).reshape(3, 3)  # °/s per g
            return np.asarray(sizes * _DEGREE / ACCELERATION_UNITS["g"])
    return np.zeros((3, 3))


def _split(sensitivity: NDArray[Any]) -> tuple[FloatArray, FloatArray]:
    """K diagonal and R with rows of length 1, ``K R = S``."""
    scale = np.diag(np.linalg.norm(sensitivity, axis=1))
    return scale, np.linalg.inv(scale) @ sensitivity


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    del settings
    if "accelerometer" not in calibration.sensors:
        raise UsageError("imucal needs an accelerometer's calibration, and this file has none")
    accelerometer = calibration["accelerometer"]
    K_a, R_a = _split(np.linalg.inv(accelerometer.matrix))
    numbers = {"K_a": K_a, "R_a": R_a, "b_a": np.array(accelerometer.bias)}
    units = {"acc_unit": "m/s^2", "gyr_unit": "deg/s", "from_acc_unit": accelerometer.bias_unit}
    gyroscope = calibration.sensors.get("gyroscope")
    if gyroscope is None:
        nothing = {"K_g": np.eye(3), "R_g": np.eye(3), "K_ga": np.zeros((3, 3)), "b_g": np.zeros(3)}
        numbers, units = numbers | nothing, units | {"from_gyr_unit": "deg/s"}
    else:
        per_rate = np.linalg.inv(gyroscope.matrix)  # reading per rad/s
        K_g, R_g = _split(per_rate * _DEGREE)
        numbers |= {"K_g": K_g, "R_g": R_g, "b_g": np.array(gyroscope.bias)}
        numbers["K_ga"] = per_rate @ sensitivity_to_g(gyroscope)
        units |= {"from_gyr_unit": gyroscope.bias_unit}
    document = {
        "cal_type": "Ferraris",
        "_format_version": "2.0.0",
        **units,
        "comment": calibration.made_by,
        **{key: numbers[key].tolist() for key in _KEYS},
    }
    return {"": (json.dumps(document, indent=4) + "\n").encode()}


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """Imucal's two formulas.

    Raises:
        ValueError: it is no Ferraris calibration.
    """
    del settings
    document = json.loads(files[""])
    if document["cal_type"] != "Ferraris":
        raise ValueError("no Ferraris calibration")
    K_a, R_a, b_a, K_g, R_g, K_ga, b_g = (np.array(document[key]) for key in _KEYS)
    acc_mat = np.linalg.inv(R_a) @ np.linalg.inv(K_a)
    gyr_mat = np.linalg.inv(R_g) @ np.linalg.inv(K_g)

    def acceleration(reading: FloatArray) -> FloatArray:
        return np.asarray((reading - b_a) @ acc_mat.T)

    def rate(samples: Samples) -> FloatArray:
        offset = acceleration(samples.accelerometer) @ K_ga.T + b_g
        return np.asarray(np.radians((samples.reading - offset) @ gyr_mat.T))

    found: dict[str, Correction] = {"accelerometer": lambda one: acceleration(one.reading)}
    return found | ({"gyroscope": rate} if document["from_gyr_unit"] != "deg/s" else {})


TARGET = ExportTarget(
    name="imucal",
    title="imucal: JSON of a FerrarisCalibrationInfo",
    formula="a = R_a⁻¹ K_a⁻¹ (y_a − b_a);  w = R_g⁻¹ K_g⁻¹ (y_g − K_ga a − b_g)",
    suffix=".json",
    cannot_hold=("magnetometer", "effects other than g-sensitivity", "standard errors"),
    keeps={"accelerometer": Kept(), "gyroscope": Kept(takes=is_g_sensitivity)},
    write=_write,
    read=_read,
    direction=BACKWARD,
)
