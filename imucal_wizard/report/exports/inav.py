"""INAV: command-line settings of the accelerometer.

``acc = (adc − acczero) · accgain / 4096`` in whole counts, before the board's alignment.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.report.axes import (
    ASSUMED,
    NEUTRAL,
    USUAL_COUNTS_PER_G,
    Axes,
    axes_of,
    check_range,
    named_values,
    one_g,
)
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.proof import Correction, Samples
from imucal_wizard.report.reduced import Kept

_UNITY = 4096.0
_READS = "# one g reads nominally "


def _settings(data: bytes | None) -> Axes:
    values = named_values(data)
    if not values:
        return NEUTRAL
    zero = np.array([values.get(f"acczero_{axis}/0", 0.0) for axis in "xyz"])
    gain = np.array([values.get(f"accgain_{axis}/0", _UNITY) for axis in "xyz"])
    return Axes(zero, gain / _UNITY)


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    sensor = calibration["accelerometer"]
    reads, counts = one_g(sensor), settings.counts_per_g or USUAL_COUNTS_PER_G
    own = axes_of(sensor)
    further = Axes(own.offset * counts / reads, own.scale * reads / STANDARD_GRAVITY)
    both = _settings(settings.present).then(further)
    zero, gain = np.rint(both.offset), np.rint(_UNITY * both.scale)
    check_range("acczero_{axis}", zero, -32768, 32767)
    check_range("accgain_{axis}", gain, 1, 8192)
    lines = [
        f"# imucal-wizard {calibration.program}, {calibration.created}",
        f"{_READS}{reads:.9g} here and {counts:.9g} in the controller",
    ]
    for word, values in (("acczero", zero), ("accgain", gain)):
        lines += [f"set {word}_{a} = {int(one)}" for a, one in zip("xyz", values, strict=True)]
    return {"": ("\n".join([*lines, "save"]) + "\n").encode()}


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """INAV's formula in counts, as accelerations.

    Raises:
        ValueError: the settings are not there.
    """
    new, before = _settings(files[""]), _settings(settings.present)
    words = files[""].decode().split(_READS)[1].split()
    reads, counts = float(words[0]), float(words[3])

    def correct(samples: Samples) -> FloatArray:
        adc = before.raw(samples.reading * counts / reads)
        return np.asarray(new.corrected(adc) * STANDARD_GRAVITY / counts)

    return {"accelerometer": correct}


def notes_of_counts(calibration: Calibration, settings: ExportSettings) -> tuple[str, ...]:
    """What a controller that counts leaves open."""
    del calibration
    notes = ["the controller measures the gyroscope's bias itself at every start"]
    if settings.counts_per_g is None:
        notes.append(f"1 g is taken for {USUAL_COUNTS_PER_G:g} counts in the controller")
    if settings.present is None:
        notes.append(ASSUMED)
    return tuple(notes)


TARGET = ExportTarget(
    name="inav",
    title="INAV: settings for its command line",
    formula="acc = (adc − acczero) · accgain / 4096",
    suffix=".txt",
    cannot_hold=(
        "non-orthogonality of the accelerometer",
        "gyroscope",
        "magnetometer",
        "effects",
        "standard errors",
        "fractions of a count",
    ),
    keeps={"accelerometer": Kept(("bias", "scale"))},
    write=_write,
    read=_read,
    notes=notes_of_counts,
    composes=("acczero_", "accgain_"),
)
