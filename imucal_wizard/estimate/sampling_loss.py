"""The error of rotations by sampling: motion at multiples of the sampling rate f aliases to a rate.

A hand that trembles while it turns the device moves it at all frequencies. What the sensor passes
of the power at f, 2f, … is sampled as a constant rate, and its integral walks away from the true
angle as that of white noise does, with the variance ``2 T Σ H(kf) P(kf)`` in T seconds (P:
two-sided power density of the true rate, H: share of the power that the sensor's low-pass filter
passes). Power below half of f is integrated correctly.

No sample shows P(f), but the spectrum of the rates shows how P falls towards it, and the noise at
rest, which is white before the filter, shows what the filter passes. The sampled spectrum at ν is

    q(ν) = Σ H(ν + kf) P(ν + kf)    over all k, positive and negative.

Three of its figures are taken, noise off: its height at f/2 and its fall from 3f/8 to f/2 in
motion, which give P as a power law ``P ∝ ν^(−p)``, and its fall from f/4 to f/2 at rest, which
gives the corner ν₀ of the filter, ``H = 1/(1 + (ν/ν₀)⁴)``, that of a usual digital output filter. A
sensor that averages from one sample to the next has white noise like one without a filter: for it
the estimate is too large. It never depends on how well the rotations close.
"""

import itertools
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from imucal_wizard.core.attitude import RotationSamples
from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.core.statistics import median
from imucal_wizard.measurement.holds import Hold

HALF, NEAR, QUARTER = (0.45, 0.5), (0.35, 0.4), (0.225, 0.275)
"""Bands below f/2 and around 3f/8 and f/4, in units of f."""
FALLS = np.linspace(2.0, 8.0, 121)
"""Powers p that are tried: a hand's torque is at most white noise, and its rate then falls as
1/ν²."""
CORNERS = np.geomspace(0.08, 2.0, 60)
"""Corners of filters that are tried, in units of f."""
IMAGES = np.arange(-15, 16)
"""Multiples of f from which power is folded back."""
TAPERED = 0.05
"""Share of a rotation at either end that is faded; the device hardly moves there."""
MIN_SPECTRUM_SAMPLES = 16
"""Of a rotation, for a spectrum with something in each band."""
ENOUGH_AT_REST = 500_000
"""Samples at rest that give the spectrum of the noise to a per cent; later holds are not needed."""
CLEAR = 3.0
"""Standard errors by which power exceeds the noise if it is more than noise."""


Bands = tuple[float, float, int]
"""Power density around f/2 and in a lower band, (rad/s)²/Hz, mean of the axes; how many values."""


def sampling_loss(
    samples: RotationSamples,
    rate: FloatArray,
    noise: FloatArray,
    resting: Callable[[], Bands] | None = None,
) -> float:
    """Variance per second of the integral of a rate about one axis, rad²/s.

    Args:
        samples: of the rotations.
        rate: corrected rate of each sample, rad/s, shape (n, 3).
        noise: variance × time of the samples' own noise on each axis, rad²/s, shape (3,).
        resting: gives ``spectrum_at_rest``; without it the sensor is taken to have no filter.
    """
    turned = []
    for first, past in itertools.pairwise(samples.offsets.tolist()):
        if past - first >= MIN_SPECTRUM_SAMPLES:
            place = np.arange(past - first) / (past - first - 1.0)
            window = np.minimum(1.0, np.minimum(place, 1.0 - place) / TAPERED)
            step = median(np.diff(samples.time[first:past]))
            turned.append((window[:, None] * rate[first:past], step, float(window @ window)))
    half, lower, count = _bands(turned, NEAR)
    own = float(noise.mean())
    if half - own <= CLEAR * own / np.sqrt(max(count, 1)):
        return 0.0
    half, lower = half - own, lower - own
    corner = np.inf if resting is None else _corner(resting())

    def image(at: float) -> FloatArray:
        """What is folded back to ``at`` for each power law with P(f/2) = 1."""
        where = np.abs(at + IMAGES)
        where = where[where > 0.0]
        return np.asarray((2.0 * where) ** -FALLS[:, None] @ _passed(where, corner))

    falls = image(0.475) / image(0.375)
    law = int(np.argmin(np.abs(np.log(falls) - np.log(half / max(lower, 0.5 * half)))))
    return float(half * image(0.0)[law] / image(0.475)[law])


def spectrum_at_rest(series: Series, holds: Sequence[Hold], matrix: FloatArray) -> Bands:
    """The spectrum of a gyroscope's noise around f/2 and f/4.

    Args:
        series: its readings.
        holds: still periods.
        matrix: M.
    """
    still, seen = [], 0
    for hold in holds:
        if seen > ENOUGH_AT_REST:
            break
        own = series.between(hold.start, hold.end)
        if len(own) >= MIN_SPECTRUM_SAMPLES:
            values = (own.values - own.values.mean(axis=0)) @ matrix.T
            still.append((values, median(np.diff(own.time)), float(len(own))))
            seen += len(own)
    return _bands(still, QUARTER)


def _bands(parts: Iterable[tuple[FloatArray, float, float]], lower: tuple[float, float]) -> Bands:
    """From rates, the seconds between them, and the sum of squares of their window."""
    bands = HALF, lower
    power, count = np.zeros(2), np.zeros(2, int)
    for rate, step, length in parts:
        density = step * np.abs(np.fft.rfft(rate, axis=0)) ** 2 / length
        frequency = np.fft.rfftfreq(len(rate))
        for place, (low, high) in enumerate(bands):
            inside = density[(frequency >= low) & (frequency <= high)]
            power[place] += inside.sum()
            count[place] += inside.size
    half, below = (power / np.maximum(count, 1)).tolist()
    return half, below, int(count[0])


def _corner(resting: Bands) -> float:
    """Corner of the filter by which noise falls as it does, in units of f; ∞ if it hardly falls."""
    half, lower, count = resting
    if half >= lower * (1.0 - CLEAR / np.sqrt(max(count, 1))):
        return np.inf
    falls = np.array(
        [
            _passed(np.abs(0.475 + IMAGES), one).sum() / _passed(np.abs(0.25 + IMAGES), one).sum()
            for one in CORNERS
        ]
    )
    return float(np.interp(half / lower, falls, CORNERS))


def _passed(frequency: FloatArray, corner: float) -> FloatArray:
    """Share of the power that the filter passes."""
    return np.asarray(1.0 / (1.0 + (frequency / corner) ** 4))
