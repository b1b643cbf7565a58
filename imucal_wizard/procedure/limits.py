"""From the noise of the settle step to limits of rest that a hand at a desk can keep."""

import math

import numpy as np

from imucal_wizard.procedure.scales import Scales
from imucal_wizard.procedure.stillness import Limits, Noise
from imucal_wizard.readings import FloatArray

FACTOR = 5.0
"""Limit over noise. Published recordings need from 1.7 to 11 (3 to 120 times the variance)."""
FLOOR_G = 0.003
"""No limit is below 3 mg: a desk on which somebody leans shakes by as much."""
FLOOR_TREMOR = math.radians(0.3)
FLOOR_TURN = math.radians(0.8)
"""No limit is below 0.8 °/s of mean rate: a bias that drifts is not a turn."""
COARSE_G = 0.02
COARSE_RATE = math.radians(1.0)
"""A device that shows more than this is not lying on anything, whatever its noise."""


def fine(
    noise: Noise, quantum: tuple[FloatArray, FloatArray], one_g: float, units: Scales
) -> Limits:
    """Limits of rest for the steps that follow.

    Args:
        noise: from the settle step.
        quantum: smallest step of each accelerometer and gyroscope axis, shape (3,) each; 0 where
            none was seen. A reading that flickers between two neighbours is at rest.
        one_g: what the accelerometer reads for one gravity, in its unit.
        units: units of the readings.
    """
    limits = noise.limits(FACTOR)
    accelerometer = np.maximum(limits.accelerometer, np.maximum(quantum[0], FLOOR_G * one_g))
    if limits.gyroscope is None:
        return Limits(accelerometer)
    tremor, turn = (FLOOR_TREMOR, FLOOR_TURN) if units.gyroscope_known else (1e-9, 1e-9)
    gyroscope = np.maximum(limits.gyroscope, np.maximum(quantum[1], tremor))
    rate = np.maximum(limits.gyroscope * 1.5, np.maximum(2.0 * quantum[1], turn))
    return Limits(accelerometer, gyroscope, noise.mean_g, rate)


def coarse(one_g: float, units: Scales, *, gyroscope: bool) -> Limits:
    """Limits before any noise is known. Counts of a gyroscope say nothing yet."""
    accelerometer = np.full(3, COARSE_G * one_g)
    if not gyroscope or not units.gyroscope_known:
        return Limits(accelerometer)
    return Limits(accelerometer, np.full(3, COARSE_RATE))
