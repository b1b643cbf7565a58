"""The calibration file of this program, under another name."""

import msgspec

from imucal_wizard.core.output import encode_json
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.proof import Correction, own
from imucal_wizard.report.reduced import Kept


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    del settings
    return {"": encode_json(calibration)}


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """The corrections by the file's matrices, biases and effects.

    Raises:
        ValueError: it is no calibration file.
    """
    try:
        return own(msgspec.json.decode(files[""], type=Calibration), settings.effects)
    except msgspec.MsgspecError as error:
        raise ValueError(str(error)) from error


_ALL = Kept(takes=lambda _one: True)
TARGET = ExportTarget(
    name="json",
    title="JSON: this program's own calibration file",
    formula="x = M · (reading − b) − ε(x)",
    suffix=".json",
    cannot_hold=(),
    keeps={"accelerometer": _ALL, "gyroscope": _ALL, "magnetometer": _ALL},
    write=_write,
    read=_read,
)
