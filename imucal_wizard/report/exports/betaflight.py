"""Betaflight: the accelerometer's offsets for its command line.

``acc = aligned(adc) − acc_calibration`` in whole counts; there is no scale. The fourth number says
that the calibration is done.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.report.axes import USUAL_COUNTS_PER_G, check_range, named_values, one_g
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.exports.inav import notes_of_counts
from imucal_wizard.report.proof import Correction, Samples
from imucal_wizard.report.reduced import Kept

_READS = "# one g reads nominally "


def _offsets(data: bytes | None) -> FloatArray:
    values = named_values(data)
    if not values:
        return np.zeros(3)
    return np.array([values[f"acc_calibration/{place}"] for place in range(3)])


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    sensor = calibration["accelerometer"]
    reads, counts = one_g(sensor), settings.counts_per_g or USUAL_COUNTS_PER_G
    offsets = np.rint(_offsets(settings.present) + np.array(sensor.bias) * counts / reads)
    check_range("acc_calibration {axis}", offsets, -32768, 32767)
    x, y, z = (int(one) for one in offsets)
    lines = [
        f"# imucal-wizard {calibration.program}, {calibration.created}",
        f"{_READS}{reads:.9g} here and {counts:.9g} in the controller",
        f"set acc_calibration = {x},{y},{z},1",
        "save",
    ]
    return {"": ("\n".join(lines) + "\n").encode()}


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """Betaflight's formula in counts, as accelerations.

    Raises:
        ValueError: the setting is not there.
    """
    new, before = _offsets(files[""]), _offsets(settings.present)
    words = files[""].decode().split(_READS)[1].split()
    reads, counts = float(words[0]), float(words[3])

    def correct(samples: Samples) -> FloatArray:
        adc = samples.reading * counts / reads + before
        return np.asarray((adc - new) * STANDARD_GRAVITY / counts)

    return {"accelerometer": correct}


TARGET = ExportTarget(
    name="betaflight",
    title="Betaflight: offsets for its command line",
    formula="acc = adc − acc_calibration",
    suffix=".txt",
    cannot_hold=(
        "scale and non-orthogonality of the accelerometer",
        "gyroscope",
        "magnetometer",
        "effects",
        "standard errors",
        "fractions of a count",
    ),
    keeps={"accelerometer": Kept(("bias",))},
    write=_write,
    read=_read,
    notes=notes_of_counts,
    composes=("acc_calibration/2",),
)
