"""Sensors that no chance draws: a perfect one, and one that is read as raw counts."""

from dataclasses import replace

import numpy as np

from imucal_wizard.devices.virtual import SensorModel
from imucal_wizard.devices.virtual.sensor import Triad
from imucal_wizard.units import COUNT


def ideal() -> SensorModel:
    """No bias, no error, no noise, no rounding."""
    return SensorModel(
        Triad(np.eye(3), np.zeros(3), "m/s^2"),
        Triad(np.eye(3), np.zeros(3), "rad/s"),
        temperature_step=0.0,
    )


def offset_binary(model: SensorModel) -> SensorModel:
    """Read as unsigned 16-bit counts around 32768, with the gains of an Xsens MTi-G."""
    return replace(
        model,
        accelerometer=_in_counts(model.accelerometer, 415.0, 32768.0),
        gyroscope=_in_counts(model.gyroscope, 4778.0, 32768.0),
    )


def _in_counts(triad: Triad, gain: float, offset: float) -> Triad:
    """The same axes by a 16-bit converter: ``gain`` counts per SI unit around ``offset``."""
    lowest = offset - 2.0**15
    return replace(
        triad,
        sensitivity=triad.sensitivity * gain,
        bias=triad.bias * gain + offset,
        unit=COUNT,
        step=1.0,
        lowest=lowest,
        highest=lowest + 2.0**16 - 1.0,
    )
