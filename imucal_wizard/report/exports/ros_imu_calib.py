"""ROS ``imu_calib`` (dpkoch): the YAML file of its node ``apply_calib``.

The node computes ``corrected = SM · raw − bias`` for ``sensor_msgs/Imu``, in m/s². Our ``corrected
= M (raw − b)`` is that with ``SM = M`` and ``bias = M b``: the bias acts after the matrix. The node
measures the gyroscope's bias itself when it starts.
"""

import json

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.proof import Correction, Samples
from imucal_wizard.report.reduced import Kept

_SIZES = {"SM": 9, "bias": 3}
"""Keys of the file, and how many numbers each has."""


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    """Row-major matrix and bias, with all digits."""
    del settings
    sensor = calibration["accelerometer"]
    matrix, bias = np.array(sensor.matrix), np.array(sensor.bias)
    numbers = {"SM": matrix.ravel(), "bias": matrix @ bias}
    lines = [f"{key}: {json.dumps(values.tolist())}" for key, values in numbers.items()]
    return {"": ("\n".join(lines) + "\n").encode()}


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """``SM · raw − bias`` of a file.

    Raises:
        ValueError: it is no file of ``imu_calib``.
    """
    del settings
    found = {}
    for line in files[""].decode().splitlines():
        key, _, text = line.partition(":")
        values = np.array(json.loads(text), np.float64)
        if values.shape != (_SIZES.get(key),):
            raise ValueError(f"{key} is no key of imu_calib with its numbers")
        found[key] = values
    if found.keys() != _SIZES.keys():
        raise ValueError("SM or bias is missing")
    matrix, bias = found["SM"].reshape(3, 3), found["bias"]

    def correct(samples: Samples) -> FloatArray:
        return np.asarray(samples.reading @ matrix.T - bias)

    return {"accelerometer": correct}


def _notes(calibration: Calibration, settings: ExportSettings) -> tuple[str, ...]:
    del settings
    there = (
        "to prove it there: run apply_calib with the parameter calib_file; at rest, in any pose, "
        f"the length of linear_acceleration in corrected is {calibration.gravity.value:.3f} m/s²"
    )
    return (there,)


TARGET = ExportTarget(
    name="ros-imu-calib",
    title="ROS imu_calib: YAML for the node apply_calib",
    formula="corrected = SM · raw − bias",
    suffix=".yaml",
    cannot_hold=(
        "gyroscope: the node measures its bias itself at start",
        "magnetometer",
        "effects",
        "standard errors",
    ),
    keeps={"accelerometer": Kept()},
    write=_write,
    read=_read,
    counts=False,
    notes=_notes,
)
