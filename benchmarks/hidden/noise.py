"""Noise of hold averages, exactly as long averages of coloured noise have it.

A Gauss–Markov process of variance v and correlation time τ, averaged over an interval of length T,
has the variance ``2 v (τ/T)² (T/τ − 1 + e^(−T/τ))``; averages over two intervals with a gap d
between them have the covariance ``v (τ²/T₁T₂) (1 − e^(−T₁/τ)) (1 − e^(−T₂/τ)) e^(−d/τ)``.
Flicker noise is a sum of such processes, as in ``devices.virtual.noise``.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.hidden.designs import BATCHES, Schedule
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.simulate.noise import CORRELATION_TIME_RATIO, CORRELATION_TIMES

TREMOR_FREQUENCY = 8.0
"""Of a hand and of what a desk passes on, Hz."""
SHAKING_FREQUENCY = 25.0
"""Of a fan or a motor on the support, Hz."""


@dataclass(frozen=True)
class Colour:
    """What the noise of a sensor is made of.

    Attributes:
        name: for the tables.
        density: white noise, mg/√Hz.
        floor: Allan deviation of the bias instability, mg.
        walk: random walk of the bias, mg per square root of minute.
        scatter: error by chance from placing to placing, mg.
    """

    name: str
    density: float = 0.150
    floor: float = 0.030
    walk: float = 0.0
    scatter: float = 0.0


CONSUMER = Colour("consumer")
WHITE = Colour("white", density=0.5, floor=0.0)
FLICKER = Colour("flicker", density=0.150, floor=0.120)
WANDERING = Colour("walk", walk=0.3)
COLOURS = {colour.name: colour for colour in (CONSUMER, WHITE, FLICKER, WANDERING)}


def batch_noise(colour: Colour, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
    """Noise of the batch averages of every hold, mg, shape (n, BATCHES, 3)."""
    n = len(schedule.start)
    length = (schedule.end - schedule.start) / BATCHES
    start = (schedule.start[:, None] + length[:, None] * np.arange(BATCHES)).ravel()
    length = np.repeat(length, BATCHES)
    root = np.linalg.cholesky(_covariance(colour, start, length))
    noise = (root @ rng.standard_normal((len(start), 3))).reshape(n, BATCHES, 3)
    noise += colour.scatter * rng.standard_normal((n, 1, 3))
    return noise + _tremor(schedule, length[::BATCHES], rng)


def _covariance(colour: Colour, start: FloatArray, length: FloatArray) -> FloatArray:
    gap = np.abs(start[:, None] - start) - np.where(
        start[:, None] < start, length[:, None], length[None, :]
    )
    total = np.diag(colour.density**2 / (2.0 * length))
    variance = colour.floor**2 * np.log(CORRELATION_TIME_RATIO) / (2.0 * np.log(2.0))
    for tau in CORRELATION_TIMES if colour.floor else ():
        mean = tau / length * -np.expm1(-length / tau)
        apart = variance * np.outer(mean, mean) * np.exp(-np.maximum(gap, 0.0) / tau)
        share = length / tau
        np.fill_diagonal(apart, 2.0 * variance * (share + np.expm1(-share)) / share**2)
        total += apart
    middle = start + 0.5 * length
    walked = np.minimum(middle[:, None], middle) - length.min() / 6.0 * np.eye(len(middle))
    return np.asarray(total + colour.walk**2 / 60.0 * walked)


def _tremor(schedule: Schedule, length: FloatArray, rng: np.random.Generator) -> FloatArray:
    """The mean of a vibration is the change of its velocity, which does not grow with time."""
    n = len(schedule.start)
    rms = 1000.0 * np.sqrt(schedule.vibration / 3.0)  # mg per axis
    frequency = np.where(schedule.shaken, SHAKING_FREQUENCY, TREMOR_FREQUENCY)
    speed = rms / (2.0 * np.pi * frequency)
    velocity = speed[:, None, None] * rng.standard_normal((n, BATCHES + 1, 3))
    return np.asarray(np.diff(velocity, axis=1) / length[:, None, None])


def averaged_rounding(exact: FloatArray, step: float, dither: FloatArray | float) -> FloatArray:
    """Average of rounded readings whose noise has the standard deviation ``dither``.

    The error of rounding is a saw tooth; noise takes from its harmonic k the factor
    ``exp(−2 (π k dither/step)²)``. What is left is the part that averaging never removes.

    Args:
        exact: mean readings, m/s², shape (n, 3).
        step: least significant bit, m/s².
        dither: noise of a sample, m/s².
    """
    if step <= 0.0:
        return exact
    error = np.zeros_like(exact)
    for k in range(1, 8):
        left = np.exp(-2.0 * (np.pi * k * np.asarray(dither) / step) ** 2)
        error += (-1.0) ** k * left / (np.pi * k) * np.sin(2.0 * np.pi * k * exact / step) * step
    return exact + error


MILLI_G = STANDARD_GRAVITY / 1000.0
