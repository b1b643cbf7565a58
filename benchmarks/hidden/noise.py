"""Noise of hold averages, exactly as long averages of coloured noise have it.

A Gauss–Markov process of variance v and correlation time τ goes from x to ``x e^(−a)`` in a time
a τ, plus noise of the variance ``v (1 − e^(−2a))``. Its average on the way is ``x (1 − e^(−a))/a``
plus noise of the variance ``v (2a − 3 + 4 e^(−a) − e^(−2a))/a²``; the covariance of the two is
``v (1 − e^(−a))²/a``. Flicker noise is a sum of such processes, as in ``simulate.noise``; a
random walk is one that forgets in far longer than any session.
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

NEVER_FORGETS = 1e6
"""Correlation time that stands for a random walk, s."""
SMALL = 1e-3
"""Step over correlation time below which the variance of the average is a series."""


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

    def scaled(self, factor: float) -> "Colour":
        """The same noise, so many times as large."""
        sizes = (factor * one for one in (self.density, self.floor, self.walk, self.scatter))
        return Colour(self.name, *sizes)


CONSUMER = Colour("consumer")
WHITE = Colour("white", density=0.5, floor=0.0)
FLICKER = Colour("flicker", density=0.150, floor=0.120)
WANDERING = Colour("walk", walk=0.3)
COLOURS = {colour.name: colour for colour in (CONSUMER, WHITE, FLICKER, WANDERING)}


def batch_noise(
    colour: Colour, schedule: Schedule, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Noise of the batch averages of every hold, mg, shape (n, BATCHES, 3).

    And the mean over all of them of how the bias wanders, mg, shape (3,).
    """
    n = len(schedule.start)
    length = (schedule.end - schedule.start) / BATCHES
    white = colour.density / np.sqrt(2.0 * length)
    noise = white[:, None, None] * rng.standard_normal((n, BATCHES, 3))
    wander = np.zeros_like(noise)
    variance = colour.floor**2 * np.log(CORRELATION_TIME_RATIO) / (2.0 * np.log(2.0))
    for tau in CORRELATION_TIMES if colour.floor else ():
        wander += np.sqrt(variance) * _gauss_markov(schedule, length, float(tau), rng)
    if colour.walk:
        size = colour.walk * np.sqrt(0.5 * NEVER_FORGETS / 60.0)
        wander += size * _gauss_markov(schedule, length, NEVER_FORGETS, rng)
    noise += colour.scatter * rng.standard_normal((n, 1, 3))
    noise += wander + _tremor(schedule, length, rng)
    return noise, wander.mean(axis=(0, 1))


def _gauss_markov(
    schedule: Schedule, length: FloatArray, tau: float, rng: np.random.Generator
) -> FloatArray:
    """Batch averages of a process of variance 1, shape (n, BATCHES, 3)."""
    from scipy.signal import lfilter  # takes longer to import than all else of this package

    now, last = rng.standard_normal(3), schedule.start[0]
    made = []
    for start, end, seconds in zip(schedule.start, schedule.end, length, strict=True):
        idle = (start - last) / tau
        now = np.exp(-idle) * now + np.sqrt(-np.expm1(-2.0 * idle)) * rng.standard_normal(3)
        a = seconds / tau
        decay, faded = np.exp(-a), -np.expm1(-a)
        new = -np.expm1(-2.0 * a)
        shared = faded**2 / (a * new)
        exact = (2.0 * a - 3.0 + 4.0 * decay - decay**2) / a**2
        around = (2.0 * a / 3.0 - 0.5 * a**2 if a < SMALL else exact) - shared**2 * new
        pushes = np.sqrt(new) * rng.standard_normal((BATCHES, 3))
        after, _ = lfilter([1.0], [1.0, -decay], pushes, axis=0, zi=decay * now[None])
        before = np.concatenate([now[None], after[:-1]])
        own = np.sqrt(max(around, 0.0)) * rng.standard_normal((BATCHES, 3))
        made.append(before * faded / a + shared * pushes + own)
        now, last = after[-1], end
    return np.array(made)


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
        exact: mean readings, m/s².
        step: least significant bit, m/s².
        dither: noise of a sample, m/s², broadcast to the readings.
    """
    if step <= 0.0:
        return exact
    error = np.zeros_like(exact)
    for k in range(1, 8):
        left = np.exp(-2.0 * (np.pi * k * np.asarray(dither) / step) ** 2)
        error += (-1.0) ** k * left / (np.pi * k) * np.sin(2.0 * np.pi * k * exact / step) * step
    return exact + error


MILLI_G = STANDARD_GRAVITY / 1000.0
