"""INAV: command-line settings of the accelerometer.

``acc = (adc − acczero) · accgain / 4096`` in whole counts, before the board's alignment.
"""

import numpy as np

from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.report.axes import (
    NEUTRAL,
    Axes,
    Counts,
    axes_of,
    check_range,
    named_values,
    notes_of_counts,
    read_counts,
)
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.reduced import Kept

_UNITY = 4096.0


def _settings(data: bytes | None) -> Axes:
    values = named_values(data)
    if not values:
        return NEUTRAL
    zero = np.array([values.get(f"acczero_{axis}/0", 0.0) for axis in "xyz"])
    gain = np.array([values.get(f"accgain_{axis}/0", _UNITY) for axis in "xyz"])
    return Axes(zero, gain / _UNITY)


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    sensor = calibration["accelerometer"]
    g, own = Counts.of(sensor, settings.counts_per_g), axes_of(sensor)
    further = Axes(own.offset * g.there / g.here, own.scale * g.here / STANDARD_GRAVITY)
    both = _settings(settings.present).then(further)
    zero, gain = np.rint(both.offset), np.rint(_UNITY * both.scale)
    check_range("acczero_{axis}", zero, -32768, 32767)
    check_range("accgain_{axis}", gain, 1, 8192)
    lines = [
        f"set {word}_{axis} = {int(one)}"
        for word, values in (("acczero", zero), ("accgain", gain))
        for axis, one in zip("xyz", values, strict=True)
    ]
    return {"": g.commands(calibration, lines)}


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
    read=lambda files, settings: read_counts(_settings, files[""], settings.present),
    notes=lambda one, settings: notes_of_counts(one, settings.counts_per_g, settings.present),
    composes=("acczero_", "accgain_"),
    uses=("counts_per_g",),
)
