"""The calibration file of this program, under another name."""

import msgspec

from imucal_wizard.core.output import encode_json
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import Correction, ExportTarget


def _read(data: bytes) -> Correction:
    """The correction by the file's matrix, bias and effects.

    Raises:
        ValueError: it is no calibration file.
    """
    try:
        calibration = msgspec.json.decode(data, type=Calibration)
    except msgspec.MsgspecError as error:
        raise ValueError(str(error)) from error
    sensor, where = calibration["accelerometer"], calibration.circumstances()
    return lambda readings: sensor.apply(readings, where)


TARGET = ExportTarget(
    name="json",
    title="this program's own calibration file",
    formula="x = M · (reading − b) − ε(x)",
    suffix=".json",
    cannot_hold=(),
    holds_effects=True,
    write=encode_json,
    read=_read,
)
