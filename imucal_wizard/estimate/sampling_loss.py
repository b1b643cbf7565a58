"""The error of rotations by sampling: motion at multiples of the sampling rate f aliases to a rate.

A hand that trembles while it turns the device moves it at all frequencies. What the sensor passes
of the power at f, 2f, … is sampled as a constant rate, and its integral walks away from the true
angle as that of white noise does, with the variance ``2 T Σ H(kf) P(kf)`` in T seconds (P:
two-sided power density of the true rate, H: share of the power that the sensor's low-pass filter
passes). Power below half of f is integrated correctly.

No sample shows P(f), but the spectrum of the rates shows how P falls towards it, and the noise at
rest, which is white before the filter, shows what the filter passes. The sampled spectrum at ν is

    q(ν) = Σ H(ν + kf) P(ν + kf)    over all k, positive and negative.

Three of its figures are taken: its height at f/2 and its fall from 3f/8 to f/2 in motion, the power
at rest off, which give P as a power law ``P ∝ ν^(−p)``, and its fall from f/4 to f/2 at rest, which
gives the corner ν₀ of the filter, ``H = 1/(1 + (ν/ν₀)⁴)``, that of a usual digital output filter. A
sensor that averages from one sample to the next has white noise like one without a filter: for it
the estimate is too large. It never depends on how well the rotations close.

A hand that trembles at rest, too, makes the same error there: it is part of the noise at rest. A
tremor that has n times the power at f/2 in motion then aliases n times of that at most.
"""

import itertools

import numpy as np

from imucal_wizard.core.attitude import RotationSamples
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import median
from imucal_wizard.estimate.rest_spectrum import (
    CLEAR,
    HALF,
    IMAGES,
    MIN_SPECTRUM_SAMPLES,
    RestSpectrum,
    passed,
)

NEAR = (0.35, 0.4)
"""Band around 3f/8, in units of f."""
FALLS = np.linspace(2.0, 8.0, 121)
"""Powers p that are tried: a hand's torque is at most white noise, and its rate then falls as
1/ν²."""
TAPERED = 0.05
"""Share of a rotation at either end that is faded; the device hardly moves there."""


def sampling_loss(
    samples: RotationSamples,
    rate: FloatArray,
    at_rest: RestSpectrum,
    noise: float,
    rounding: float = 0.0,
) -> float:
    """Variance per second of the integral of a rate about one axis, rad²/s.

    Args:
        samples: of the rotations.
        rate: corrected rate of each sample, rad/s, shape (n, 3).
        at_rest: the spectrum of the rates at rest.
        noise: of the sensor at low frequencies, mean of the axes, rad²/s.
        rounding: variance × time by rounding that is not seen at rest, rad²/s.
    """
    half, lower, count = _in_motion(samples, rate)
    own = float(at_rest.half.mean()) + rounding
    if half - own <= CLEAR * own / np.sqrt(max(count, 1)):
        return 0.0
    half, lower = half - own, lower - own
    corner = at_rest.corner(noise)

    def image(at: float) -> FloatArray:
        """What is folded back to ``at`` for each power law with P(f/2) = 1."""
        where = np.abs(at + IMAGES)
        where = where[where > 0.0]
        return np.asarray((2.0 * where) ** -FALLS[:, None] @ passed(where, corner))

    falls = image(0.475) / image(0.375)
    law = int(np.argmin(np.abs(np.log(falls) - np.log(half / max(lower, 0.5 * half)))))
    lost = float(half * image(0.0)[law] / image(0.475)[law])
    tremor = at_rest.tremor(noise)
    return min(lost, half / tremor * noise) if tremor else lost


def _in_motion(samples: RotationSamples, rate: FloatArray) -> tuple[float, float, int]:
    """Power density around f/2 and 3f/8, mean of the axes; number of values of the first."""
    power, count = np.zeros(2), np.zeros(2, int)
    for first, past in itertools.pairwise(samples.offsets.tolist()):
        if past - first < MIN_SPECTRUM_SAMPLES:
            continue
        place = np.arange(past - first) / (past - first - 1.0)
        window = np.minimum(1.0, np.minimum(place, 1.0 - place) / TAPERED)
        step = median(np.diff(samples.time[first:past])) / float(window @ window)
        density = step * np.abs(np.fft.rfft(window[:, None] * rate[first:past], axis=0)) ** 2
        frequency = np.fft.rfftfreq(past - first)
        for number, (low, high) in enumerate((HALF, NEAR)):
            inside = density[(frequency >= low) & (frequency <= high)]
            power[number] += inside.sum()
            count[number] += inside.size
    half, lower = (power / np.maximum(count, 1)).tolist()
    return half, lower, int(count[0])
