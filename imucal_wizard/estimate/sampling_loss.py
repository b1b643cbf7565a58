"""What sampling loses of a rotation: motion at multiples of the sampling rate f looks like a rate.

A hand that trembles while it turns the device moves it at all frequencies. Power at f, 2f, … is
sampled as a constant rate, and its integral walks away from the true angle as that of white noise
does, with the variance ``2 T Σ P(k f)`` in T seconds (P: two-sided power density of the true rate).
Power below half of f is integrated correctly.

No sample shows P(f), but the spectrum of the rates tells how P falls towards it. With a power law
``P ∝ ν^(−p)`` the sampled spectrum, noise taken off, is

    q₂ = 2 P(f/2) (1 + 3^(−p) + 5^(−p) + …)    at f/2, where the power above folds back,
    q₄ =   P(f/4) (1 + 3^(−p) + 5^(−p) + …)    at f/4,

so that ``2^(−p) = q₂/2q₄`` and ``2 Σ P(k f) = q₂ 2^(−p) / (1 − 2^(−p))``. That is what sampling may
lose: a sensor that averages from one sample to the next loses less, and its samples do not tell.
The closures then say which share of it they have lost (``gyroscope.share_lost``), never more.
"""

import itertools

import numpy as np

from imucal_wizard.core.attitude import RotationSamples
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import median

HALF, QUARTER = (0.45, 0.5), (0.225, 0.275)
"""Bands around f/2 and f/4, in units of f."""
STEEPEST_UNSEEN = 0.25
"""Largest 2^(−p): a hand's torque is at most white noise, and its rate then falls as 1/ν²."""
TAPERED = 0.05
"""Share of a rotation at either end that is faded; the device hardly moves there."""
MIN_SPECTRUM_SAMPLES = 16
"""Of a rotation, for a spectrum with something in each band."""
CLEAR = 3.0
"""Standard errors by which power exceeds the noise if it is more than noise."""


def sampling_loss(samples: RotationSamples, rate: FloatArray, noise: FloatArray) -> float:
    """Variance per second of the integral of a rate about one axis, rad²/s.

    Args:
        samples: of the rotations.
        rate: corrected rate of each sample, rad/s, shape (n, 3).
        noise: variance × time of the samples' own noise on each axis, rad²/s, shape (3,).
    """
    power, count = {HALF: 0.0, QUARTER: 0.0}, {HALF: 0, QUARTER: 0}
    for first, past in itertools.pairwise(samples.offsets.tolist()):
        own, step = rate[first:past], median(np.diff(samples.time[first:past]))
        if len(own) < MIN_SPECTRUM_SAMPLES:
            continue
        place = np.arange(len(own)) / (len(own) - 1.0)
        window = np.minimum(1.0, np.minimum(place, 1.0 - place) / TAPERED)
        spectrum = np.abs(np.fft.rfft(window[:, None] * own, axis=0)) ** 2
        density = step * spectrum / (window @ window)
        frequency = np.fft.rfftfreq(len(own))
        for band in (HALF, QUARTER):
            inside = density[(frequency >= band[0]) & (frequency <= band[1])]
            power[band] += float(inside.sum())
            count[band] += inside.size
    if not count[HALF]:
        return 0.0
    own_noise = float(noise.mean())
    half = power[HALF] / count[HALF] - own_noise
    quarter = power[QUARTER] / count[QUARTER] - own_noise
    if half <= CLEAR * own_noise / float(np.sqrt(count[HALF])):
        return 0.0
    share = min(half / (2.0 * max(quarter, 0.5 * half)), STEEPEST_UNSEEN)
    return half * share / (1.0 - share)
