"""Betaflight: the accelerometer's offsets for its command line.

``acc = aligned(adc) − acc_calibration`` in whole counts; there is no scale. The fourth number says
that the calibration is done.
"""

import numpy as np

from imucal_wizard.report.axes import (
    NEUTRAL,
    Axes,
    Counts,
    check_range,
    named_values,
    notes_of_counts,
    read_counts,
)
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.reduced import Kept


def _settings(data: bytes | None) -> Axes:
    values = named_values(data)
    if not values:
        return NEUTRAL
    offset = np.array([values[f"acc_calibration/{place}"] for place in range(3)])
    return Axes(offset, np.ones(3))


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    sensor = calibration["accelerometer"]
    g = Counts.of(sensor, settings.counts_per_g)
    further = np.array(sensor.bias) * g.there / g.here
    offsets = np.rint(_settings(settings.present).offset + further)
    check_range("acc_calibration {axis}", offsets, -32768, 32767)
    x, y, z = (int(one) for one in offsets)
    return {"": g.commands(calibration, [f"set acc_calibration = {x},{y},{z},1"])}


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
    read=lambda files, settings: read_counts(_settings, files[""], settings.present),
    notes=lambda one, settings: notes_of_counts(one, settings.counts_per_g, settings.present),
    composes=("acc_calibration/2",),
    uses=("counts_per_g",),
)
