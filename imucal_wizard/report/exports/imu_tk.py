"""imu_tk: ``.calib`` files, one per sensor, that its ``CalibratedTriad`` loads.

``X' = T · K · (X − B)`` with K the diagonal of scales and T of misalignments, ones on its diagonal:
with ``M = T K``, K is the diagonal of M and ``T = M K⁻¹``. The accelerometer's T is upper
triangular as M is. The file has the nine numbers of T by rows, those of K, and B.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.report.calibration_file import Calibration, Sensor
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.proof import Correction
from imucal_wizard.report.reduced import Kept

_GYROSCOPE = "_gyro.calib"


def _rows(matrix: FloatArray) -> str:
    return "\n".join(" ".join(f"{value:.17g}" for value in row) for row in np.atleast_2d(matrix))


def _triad(sensor: Sensor) -> bytes:
    matrix = np.array(sensor.matrix)
    scale = np.diag(np.diag(matrix))
    blocks = matrix / np.diag(matrix), scale, np.array(sensor.bias)[:, None]
    return ("\n\n".join(_rows(block) for block in blocks) + "\n\n").encode()


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    del settings
    tails = {"accelerometer": "", "gyroscope": _GYROSCOPE}
    return {tails[name]: _triad(sensor) for name, sensor in calibration.sensors.items()}


def _loaded(data: bytes) -> Correction:
    """The 21 numbers as ``CalibratedTriad::load`` takes them.

    Raises:
        ValueError: there are others.
    """
    numbers = np.array([float(word) for word in data.decode().split()])
    if len(numbers) != 21:
        raise ValueError("no file of a CalibratedTriad: it has 21 numbers")
    both = numbers[:9].reshape(3, 3) @ numbers[9:18].reshape(3, 3)
    return lambda samples: np.asarray((both @ (samples.reading - numbers[18:]).T).T)


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    del settings
    found = {"accelerometer": _loaded(files[""])} if "" in files else {}
    return found | ({"gyroscope": _loaded(files[_GYROSCOPE])} if _GYROSCOPE in files else {})


TARGET = ExportTarget(
    name="imu_tk",
    title="imu_tk: .calib of accelerometer and gyroscope",
    formula="x = T · K · (reading − B)",
    suffix=".calib",
    cannot_hold=("magnetometer", "effects", "standard errors"),
    keeps={"accelerometer": Kept(), "gyroscope": Kept()},
    write=_write,
    read=_read,
)
