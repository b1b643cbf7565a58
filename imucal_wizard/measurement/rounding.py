"""Resolution of readings: the size of their steps, and the effect on noise and averages."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.core.statistics import normal_below

STEP_SLICES = 20
SAMPLES_PER_SLICE = 20_000
"""The resolution is determined from this many slices of this many samples, spread over the
recording."""
MIN_STEP_SHARE = 0.02
"""Share of the changes that may be smaller than the resolution: occasional garbled numbers."""
FEW_STEPS, STEP_TOLERANCE = 20.0, 0.1
"""Changes by fewer steps than the first show the step; by chance, a fifth of them would be a
multiple of it within the second."""
MIN_EVEN_SHARE = 0.9
"""Share of the distances between readings that are multiples of their step within the tolerance:
half of them are by chance where the readings are multiples of half the step."""
NEGLIGIBLE_STEP = 3e-7
"""Step over the largest reading, below which rounding is less than the least noise of a hold."""
EQUAL_READINGS = 1e-8
"""Difference over the largest reading that is none: double numbers that should be equal differ by
less after many steps of Euclid's algorithm."""
STEP_RANGE = 1e-150, 1e150
"""Steps whose squares are finite and not zero; no sensor has others."""
FINE_RATIO = 1e6
"""σ²/q² above which steps do not matter."""
NO_ROUNDING = 1.0
"""σ²/q² from which on the first term, exp(−4π²), is below the rounding of double numbers."""
TURNED = 0.4
"""Variance of the mean error of a run that turns back inside a step, over q²/12: 1/3 for parabolas
of all heights by the square of their lengths, more where noise shortens the runs."""
LEAVING = 0.3
"""The same of a run that begins at rest and ends at the edge of the step, beyond the shift that it
shares with the rests."""
FOURIER_TERMS = np.arange(1, 200)
SHARED_TERMS = 10
"""Terms of the series of what averages share; those left out have less than a tenth of it."""
ANY_PLACE = 1.0 / 3.0
"""Variance over q² of rounded readings with σ = q/2, from which on it is the same at all places."""
PLACE_DOUBT = 0.01
"""Doubt of a variance over q² of a hundred samples and more."""
NOISE_ROUNDS = 30
"""Rounds of the likelihood of how noise is distributed; 170 more change a shift by about 1 %."""
_GRID = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 200)])
"""Values of σ²/q²; beyond them, rounding only adds q²/12."""


def resolution_of(values: FloatArray) -> FloatArray:
    """Resolution of each axis, shape (axes,); 0 if it never changes.

    For coarse readings this is the smallest step. Fine readings hardly ever change by a single
    step; for them the result is a small share of their noise, which is harmless.

    Args:
        values: readings in order of time, shape (n, axes).
    """
    starts = distinct(
        np.linspace(0, max(len(values) - SAMPLES_PER_SLICE, 0), STEP_SLICES).astype(int)
    )
    stop = np.append(
        np.minimum(starts[:-1] + SAMPLES_PER_SLICE, starts[1:]), starts[-1:] + SAMPLES_PER_SLICE
    )
    with np.errstate(invalid="ignore", over="ignore"):  # ``_step`` drops what is not finite
        pieces = [np.abs(np.diff(values[a:b], axis=0)) for a, b in zip(starts, stop, strict=True)]
    return np.array([_step(column) for column in np.concatenate(pieces).T])


def in_steps(values: FloatArray, steps: FloatArray) -> bool:
    """Whether readings change by whole multiples of their resolution.

    Numbers that are printed with many digits have a smallest change, too, but it is no step.

    Args:
        values: readings in order of time, shape (n, axes).
        steps: their resolution, shape (axes,).
    """
    with np.errstate(invalid="ignore", over="ignore"):  # what is not finite is no few steps
        changes = np.abs(np.diff(values[: 2 * SAMPLES_PER_SLICE], axis=0))
        ratio = changes[:, steps > 0.0] / steps[steps > 0.0]
    few = ratio[(ratio > 0.0) & (ratio < FEW_STEPS)]
    return not len(few) or bool(np.mean(np.abs(few - np.round(few)) < STEP_TOLERANCE) > 0.5)


def rounding_step(values: FloatArray) -> FloatArray:
    """Step of each axis by which rounding shifts averages, shape (axes,); 0 where it shifts none.

    Coarse readings change by whole multiples of their resolution. Others may still be multiples of
    a smaller step: readings of few digits, which change by many steps at a time in motion and
    hardly ever at rest. Otherwise the smallest change is no step, even if the readings are constant
    at rest, and it says nothing about averages.

    Args:
        values: readings in order of time, shape (n, axes).
    """
    steps = resolution_of(values)
    for axis in np.flatnonzero(steps > 0.0):
        column = values[:, axis : axis + 1]
        if not in_steps(column, steps[axis : axis + 1]):
            known = column[np.abs(column) < STEP_RANGE[1]]
            steps[axis] = _even_step(known) or _common_step(known)
    return steps


def _even_step(values: FloatArray) -> float:
    """The step of readings whose codes were printed with few digits; 0 if they lie in no steps.

    Such codes are not exactly even, so that the smallest distance is not the step.
    """
    apart = np.diff(distinct(values))
    negligible = NEGLIGIBLE_STEP * float(np.abs(values).max(initial=0.0))
    if not len(apart):
        return 0.0
    step = float(apart[apart < 1.5 * apart.min()].mean())
    if step <= negligible:
        return 0.0
    steps = np.round(apart / step)
    step = float(apart.sum() / steps.sum())
    off = np.abs(apart - step * steps)
    even = np.mean(off < STEP_TOLERANCE * step) > MIN_EVEN_SHARE
    return step if even and step > negligible else 0.0


def _common_step(values: FloatArray) -> float:
    """The largest step of which all distances between readings are multiples; 0 if negligible.

    Euclid's algorithm for all distances at once: what the smallest of them leaves of the others is
    the next one.
    """
    largest = float(np.abs(values).max(initial=0.0))
    left, step = np.diff(distinct(values)), 0.0
    left = left[left > EQUAL_READINGS * largest]
    while len(left):
        distances, step = np.append(left, step), float(left.min())
        left = np.abs(distances - step * np.round(distances / step))
        left = left[left > EQUAL_READINGS * largest]
    return step if step > NEGLIGIBLE_STEP * largest else 0.0


def _step(changes: FloatArray) -> float:
    seen = changes[np.isfinite(changes) & (changes > 0.0)]
    if not len(seen):
        return 0.0
    place = int(MIN_STEP_SHARE * len(seen))
    step = float(np.partition(seen, place)[place])
    return step if STEP_RANGE[0] < step < STEP_RANGE[1] else 0.0


def rounding_noise(step: FloatArray) -> FloatArray:
    """Standard deviation that rounding adds to a moving reading: step / √12."""
    return np.asarray(step / np.sqrt(12.0))


def rounding_variance(before: FloatArray, step: FloatArray) -> FloatArray:
    """Mean square shift of an average by rounding, which averaging does not reduce.

    For normal noise σ rounded to steps q, the expected shift is a Fourier series in the position of
    the true value between two steps; its mean square over all positions is

        r² = (q²/2π²) Σ exp(−4π²k²σ²/q²) / k²,   k = 1, 2, …

    which is q²/12 without noise and negligible from σ = q/2 on (Widrow & Kollár, Quantization
    Noise, 2008).

    Args:
        before: σ² of single readings before rounding.
        step: q, of the same shape; 0 for none.
    """
    square = step**2
    if (before > NO_ROUNDING * square).all():
        return np.zeros(np.shape(before))
    return np.asarray(np.where(step > 0.0, _share(_in_steps(before, step)) * square, 0.0))


def _in_steps(variance: FloatArray, step: FloatArray) -> FloatArray:
    """Variance over q², limited to ``FINE_RATIO``, which also represents no step at all."""
    square = np.where(step > 0.0, step, 1.0) ** 2
    return np.where(step > 0.0, np.minimum(variance, FINE_RATIO * square) / square, FINE_RATIO)


def _share(ratio: FloatArray) -> FloatArray:
    """r²/q² by σ²/q²."""
    sums = (
        np.exp(-4.0 * np.pi**2 * np.multiply.outer(ratio, FOURIER_TERMS**2)) / FOURIER_TERMS**2
    ).sum(axis=-1)
    return np.asarray(sums / (2.0 * np.pi**2))


@cache
def _observed() -> FloatArray:
    """Variance after rounding over q² for each variance before it in ``_GRID``."""
    return _GRID + 1.0 / 12.0 - _share(_GRID)


def variance_before_rounding(rounded: FloatArray, step: FloatArray) -> FloatArray:
    """Variance σ² of readings before rounding from their variance after it.

    Averaged over all positions between two steps, ``σ² + q²/12 − r²(σ)`` is observed; it grows with
    σ.

    Args:
        rounded: mean variance of rounded readings.
        step: q, of the same shape; 0 for none.
    """
    ratio = _in_steps(rounded, step)
    seen = _observed()
    inside = np.interp(ratio, seen, _GRID)
    plain = np.maximum(ratio - 1.0 / 12.0, 0.0)
    found = np.where(ratio < seen[-1], inside, plain) * step**2
    return np.asarray(np.where(ratio < FINE_RATIO, found, rounded))


def noise_at_one_place(rounded: FloatArray, step: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Noise and shift of readings that all average the same value, from their variance.

    It lies at one place between two steps, and variance by more noise in the middle of a step looks
    like that by hardly any near its edge. All places are as likely beforehand, and so are all
    orders of magnitude of the noise.

    Args:
        rounded: variance of rounded readings.
        step: q, of the same shape; 0 for none.

    Returns:
        Mean variance σ² before rounding, and mean square shift of the average.
    """
    before = variance_before_rounding(rounded, step)
    shift = rounding_variance(before, step)
    for one in np.flatnonzero((step > 0.0) & (rounded < ANY_PLACE * step**2)):
        noise, shifts, seen, _ = (table.ravel() for table in _at_places())
        weight = np.exp(-0.5 * ((seen - rounded[one] / step[one] ** 2) / PLACE_DOUBT) ** 2)
        weight /= weight.sum()
        before[one], shift[one] = step[one] ** 2 * np.array([weight @ noise, weight @ shifts])
    return before, shift


def shift_at_places(rounded: FloatArray, step: float, samples: FloatArray) -> FloatArray:
    """Mean square shift by rounding of averages that lie at any places between two steps.

    The variance of readings near the edge of a step is large, that in its middle small, and a hand
    that trembles in some of them makes it larger there. How the noise σ is distributed over all
    averages has the largest likelihood without any form given to it (Laird, Nonparametric maximum
    likelihood estimation of a mixing distribution, 1978); with that as the prior the variance of
    each gives its own.

    Args:
        rounded: variance of rounded readings in each average, shape (n,), finite.
        step: q.
        samples: number of readings of each, shape (n,).

    Returns:
        r² of each average over all positions, see ``rounding_variance``, shape (n,).
    """
    out, coarse = np.zeros(len(rounded)), np.flatnonzero(rounded < NO_ROUNDING * step**2)
    if not len(coarse):
        return out
    noise, _, seen, scatter = _at_places()
    shifts = rounding_variance(noise[:, 0], np.ones(len(noise)))
    likelihood = np.empty((len(coarse), len(noise)))
    for row, k in enumerate(coarse.tolist()):
        # a variance of n samples is known to a part of a sample on the next step at best
        doubt = np.sqrt(scatter / samples[k] + (0.5 / samples[k]) ** 2)
        off = (min(rounded[k] / step**2, seen.max()) - seen) / doubt
        likelihood[row] = (np.exp(-0.5 * off**2) / doubt).mean(axis=1)
    likelihood += np.finfo(float).tiny
    share = np.full(len(noise), 1.0 / len(noise))
    for _ in range(NOISE_ROUNDS):
        share *= (likelihood / (likelihood @ share)[:, None]).mean(axis=0)
    weight = likelihood * share
    out[coarse] = step**2 * (weight @ shifts) / weight.sum(axis=1)
    return out


@cache
def _at_places() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Readings of each noise (rows) at each place between two steps (columns), steps of 1.

    Variance σ² before rounding, square of the shift, variance after rounding, and the variance of
    the latter by chance times the number of samples, shape (150, 51) each.
    """
    sigma, place = (
        one.ravel()
        for one in np.meshgrid(
            np.geomspace(0.01, 0.7, 150), np.linspace(0.0, 0.5, 51), indexing="ij"
        )
    )
    below = np.arange(-6, 7)
    passed = normal_below((below + 0.5 - place[:, None]) / sigma[:, None])
    share = np.diff(passed, prepend=0.0, append=1.0)
    steps = np.append(below, below[-1] + 1)
    mean = share @ steps
    away = (steps - mean[:, None]) ** 2
    seen = (share * away).sum(axis=1)
    scatter = np.maximum((share * away**2).sum(axis=1) - seen**2, 0.0)
    shape = 150, 51
    found = (sigma**2, (mean - place) ** 2, seen, scatter)
    first, second, third, fourth = (one.reshape(shape) for one in found)
    return first, second, third, fourth


def integrated_rounding(reading: FloatArray, step: FloatArray) -> FloatArray:
    """Variance by rounding of the sum of readings that move, reading², shape (axes,).

    Readings stay on a step for a run of n samples. If the motion passes the step, the errors of the
    run add up to that of one sample, q²/12. Those of n samples that stand still add up to n² q²/12,
    those of a run that turns back inside the step to a part of it (``TURNED``), and so do those of
    the first and of the last run (``LEAVING``).

    Args:
        reading: samples that follow one another, shape (n, axes).
        step: q of each axis, shape (axes,); an axis without steps has the variance 0.
    """
    out = np.zeros(len(step))
    for axis in np.flatnonzero(step > 0.0) if len(reading) else ():
        change = np.diff(reading[:, axis])
        ends = np.flatnonzero(np.abs(change) > 0.5 * step[axis])
        length = np.diff(np.concatenate([[-1], ends, [len(reading) - 1]]))
        way, size = np.sign(change[ends]), np.full(len(length), LEAVING) * length**2
        size[1:-1] = np.where(way[1:] == way[:-1], 1.0, TURNED * length[1:-1] ** 2)
        out[axis] = size.sum() if len(ends) else float(length[0]) ** 2
    return np.asarray(out * step**2 / 12.0)


def rounding_shift(sigma: float, step: FloatArray) -> float:
    """Root mean square shift of the mean of a rest by rounding, on the axis with the largest one.

    Args:
        sigma: standard deviation of rounded readings, the same on all axes.
        step: resolution of each axis in the same unit, shape (axes,).
    """
    before = variance_before_rounding(np.full(step.shape, sigma**2), step)
    return float(np.sqrt(rounding_variance(before, step).max()))


def rounding_covariance(
    before: float, step: float, apart: FloatArray, doubt: FloatArray
) -> FloatArray:
    """What averages have in common by rounding: an average of the same reading shifts alike.

    With ``rounding_variance`` over all positions between two steps, averages x apart have the
    covariance

        (q²/2π²) Σ exp(−4π²k²σ²/q²) cos(2πkx/q) / k²

    and a normal error of x with variance v multiplies its terms by exp(−2π²k²v/q²).

    Args:
        before: σ² of single readings before rounding.
        step: q.
        apart: x of two averages.
        doubt: v, of the same shape.
    """
    out = np.zeros(np.shape(apart))
    for k in FOURIER_TERMS[:SHARED_TERMS]:
        angle = 2.0 * np.pi * k / step
        out += np.exp(-0.5 * angle**2 * (2.0 * before + doubt)) * np.cos(angle * apart) / k**2
    return np.asarray(step**2 / (2.0 * np.pi**2) * out)


class Resolution:
    """Tracks the smallest steps of the samples.

    A coarse reading may be constant in one pose and flicker in another, so tracking continues after
    the noise has been measured.
    """

    def __init__(self) -> None:
        self._steps = [np.full(3, np.inf), np.full(3, np.inf)]

    def see(self, samples: Sequence[FloatArray | None]) -> bool:
        """Add samples of accelerometer and gyroscope; True if a smaller step is found."""
        news = False
        for index, values in enumerate(samples):
            if values is not None:
                ordered = np.sort(values, axis=0)
                steps = ordered[1:] - ordered[:-1]
                smaller = (steps > 0.0) & (steps < self._steps[index])
                if smaller.any():  # rare, and each block is looked at
                    found = np.where(smaller, steps, np.inf).min(axis=0)
                    self._steps[index] = np.minimum(self._steps[index], found)
                    news = True
        return news

    @property
    def steps(self) -> tuple[FloatArray, FloatArray]:
        """Resolution of each accelerometer and gyroscope axis; 0 if no step was seen."""
        first, second = (np.where(np.isfinite(steps), steps, 0.0) for steps in self._steps)
        return first, second
