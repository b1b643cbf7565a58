"""NumPy: one ``.npz`` with matrix, bias and covariance of each sensor."""

from io import BytesIO
from zipfile import BadZipFile

import numpy as np

from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.proof import Correction
from imucal_wizard.report.reduced import Kept


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    del settings
    arrays = {"gravity": np.array(calibration.gravity.value)}
    for name, sensor in calibration.sensors.items():
        arrays |= {
            f"{name}_matrix": np.array(sensor.matrix),
            f"{name}_bias": np.array(sensor.bias),
            f"{name}_bias_unit": np.array(sensor.bias_unit),
            f"{name}_parameter_names": np.array(list(sensor.parameters)),
            f"{name}_parameters": np.array([one.value for one in sensor.parameters.values()]),
        }
        if sensor.parameter_covariance is not None:
            arrays[f"{name}_covariance"] = np.array(sensor.parameter_covariance)
    file = BytesIO()
    np.savez(file, **arrays)  # type: ignore[arg-type] # arrays by name
    return {"": file.getvalue()}


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """``(y − bias) @ matrix.T``, as a user of NumPy writes it."""
    del settings
    try:
        arrays = dict(np.load(BytesIO(files[""]), allow_pickle=False))
    except BadZipFile as error:
        raise ValueError(str(error)) from error
    names = [key.removesuffix("_matrix") for key in arrays if key.endswith("_matrix")]
    if not names:
        raise ValueError("no array is a matrix")

    def correction(name: str) -> Correction:
        matrix, bias = arrays[f"{name}_matrix"], arrays[f"{name}_bias"]
        return lambda samples: np.asarray((samples.reading - bias) @ matrix.T)

    return {name: correction(name) for name in names}


TARGET = ExportTarget(
    name="numpy",
    title="NumPy: arrays in one .npz",
    formula="x = (y - bias) @ matrix.T",
    suffix=".npz",
    cannot_hold=("effects: the arrays are those of the model without them",),
    keeps={name: Kept() for name in ("accelerometer", "gyroscope", "magnetometer")},
    write=_write,
    read=_read,
)
