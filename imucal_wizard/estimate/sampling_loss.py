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
gives the corner ν₀ of the filter, ``H = 1/(1 + (ν/ν₀)⁴)``, that of a usual digital output filter.
How fast the power falls is taken from all rotations together, its height from each: where a device
is put down hard, it is a hundred times that of a turn in the air.

That is an upper limit: a sensor that averages from one sample to the next has white noise like one
without a filter, a tremor at rest hides the filter, and the power may fall faster than by the
largest p. Where a hand holds the device and the spectrum at rest shows no level of the sensor's own
noise, its fall there is that of the hand's motion, and no filter is taken from it. How well the
rotations close only lessens the limit: what is left of closures is noise and misfit, so noise that
exceeds all of it (a 1 % test) is lost nowhere (``borne_out``). Where a hand holds the device, the
same lessens what the holds show of the motion across gravity, which cancels in their means in part;
where the spectrum at rest shows no level of the sensor's own noise, it lessens that. A misfit can
delay that, but cannot make the loss larger than the spectrum shows.

A hand that trembles at rest, too, makes the same error there: it is part of the noise at rest. A
tremor that has n times the power at f/2 in motion then aliases n times of that at most.

A rotation may lead through a rest that was too noisy for a hold, and collects what is noise there.
Noise is white, where the rate of a hand falls as 1/ν² at least: sampled, that has twice the power
at f/4 that it has at f/2, so that ``2 q(f/2) − q(f/4)`` is the power of white noise, or less. Nor
is that more than the power at any frequency.
"""

import itertools
from dataclasses import replace

import numpy as np

from imucal_wizard.core.attitude import RotationSamples
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.estimate.distributions import EXACT_FREEDOM, exceeded
from imucal_wizard.estimate.noise import shrunk
from imucal_wizard.estimate.rest_spectrum import (
    CLEAR,
    HALF,
    IMAGES,
    MIN_SPECTRUM_SAMPLES,
    QUARTER,
    RestSpectrum,
    passed,
)

NEAR = (0.35, 0.4)
"""Band around 3f/8, in units of f."""
FALLS = np.linspace(2.0, 4.0, 41)
"""Powers p that are tried: a hand's torque is at most white noise, and its rate then falls as
1/ν². On the flank of a tremor's peak the power falls faster than further on: a steeper fall below
f/2 does not go on to f."""
MIN_SHORT_P, KEPT_SHORT_P = 0.01, 0.05
"""Probability of closures as small as these under the loss that the spectrum allows, below which
the sensor loses less, and that under the loss which is then left: the most that they allow."""
NEGLIGIBLE = 1e-3
"""Share of the variance of closures that is no matter."""
SHARE_TOLERANCE = 1e-6
"""Of the share of the loss that closures bear out, as a variance."""
TAPERED = 0.05
"""Share of a rotation at either end that is faded; the device hardly moves there."""


@dataclass(frozen=True, eq=False)
class SamplingLoss:
    """Variance per second of the integral of a rate about one axis, rad²/s.

    Attributes:
        aliased: by motion above half the sampling rate, shape (m,).
        white: by noise beyond that of the holds, shape (m,).
        level: the noise of the rates at rest is known apart from a hand's motion.
        tilted: share of the noise across gravity, beyond that along it, which the means at rest
            have where a hand holds the device.
    """

    aliased: FloatArray
    white: FloatArray
    level: bool = False
    tilted: float = 1.0

    def with_more(self, count: int) -> "SamplingLoss":
        """The same with more rotations, which lose what the others lose in the mean.

        Args:
            count: how many.
        """
        more = np.full(count, self.aliased.mean())
        white = np.append(self.white, np.zeros(count))
        return replace(self, aliased=np.append(self.aliased, more), white=white)


def sampling_loss(
    samples: RotationSamples,
    rate: FloatArray,
    at_rest: RestSpectrum,
    noise: float,
    rounding: float = 0.0,
    held: bool = False,
) -> SamplingLoss:
    """What the spectrum of the rates shows of each rotation beside the noise at rest.

    Args:
        samples: of m rotations.
        rate: corrected rate of each sample, rad/s, shape (n, 3).
        at_rest: the spectrum of the rates at rest.
        noise: of the sensor at low frequencies, mean of the axes, rad²/s.
        rounding: variance × time by rounding that is not seen at rest, rad²/s.
        held: a hand holds the device at rest.
    """
    power, counts = _in_motion(samples, rate)
    own = float(at_rest.half.mean()) + rounding
    white = _white(power, counts, own)
    others = white == 0.0  # in most rotations only all together show it
    white[others] = _white(power[others].sum(axis=0), counts[others].sum(axis=0), own)
    totals = np.maximum(counts.sum(axis=0), 1)
    half, lower, _ = ((power - white[:, None] * counts).sum(axis=0) / totals).tolist()
    if half - own <= CLEAR * own / np.sqrt(totals[0]):
        return SamplingLoss(np.zeros(len(power)), white, at_rest.level)
    half, lower = half - own, lower - own
    corner = np.inf if held and not at_rest.level else at_rest.corner(noise)

    def image(at: float) -> FloatArray:
        """What is folded back to ``at`` for each power law with P(f/2) = 1."""
        where = np.abs(at + IMAGES)
        where = where[where > 0.0]
        return np.asarray((2.0 * where) ** -FALLS[:, None] @ passed(where, corner))

    falls = image(0.475) / image(0.375)
    law = int(np.argmin(np.abs(np.log(falls) - np.log(half / max(lower, 0.5 * half)))))
    folded = float(image(0.0)[law] / image(0.475)[law])
    if tremor := at_rest.tremor(noise):
        folded = min(folded, noise / tremor)
    each = shrunk(power[:, 0] / np.maximum(counts[:, 0], 1), 2 * counts[:, 0])
    return SamplingLoss(folded * np.maximum(each - white - own, 0.0), white, at_rest.level)


def borne_out(independent: FloatArray, shares: FloatArray, freedom: float) -> float:
    """Largest share of the loss that closures leave room for: 1 unless they are too small for it.

    Args:
        independent: what a fit leaves of each independent combination of closures over its standard
            deviation by all noise, squared, shape (n,).
        shares: which part of the variance of each is lost, shape (n,).
        freedom: degrees of freedom of all together.
    """
    if freedom < 1.0 or not (shares > NEGLIGIBLE).any():
        return 1.0

    def chance(share: float) -> float:
        """Probability of closures as small as these with this share of the loss."""
        mean = float((independent / (1.0 - (1.0 - share) * shares)).sum()) / freedom
        return 1.0 - exceeded(mean, freedom, EXACT_FREEDOM)

    if chance(1.0) >= MIN_SHORT_P:
        return 1.0
    low, high = 0.0, 1.0
    while high - low > SHARE_TOLERANCE:
        share = 0.5 * (low + high)
        low, high = (share, high) if chance(share) > KEPT_SHORT_P else (low, share)
    return low


def _white(power: FloatArray, count: IntArray, own: float) -> FloatArray:
    """Power of white noise beyond that at rest, shape (…); 0 where it is not clear.

    Args:
        power: see ``_in_motion``, shape (…, 3).
        count: the same.
        own: power at rest.
    """
    many = np.maximum(count, 1)
    each, doubt = power / many, power / many**1.5
    white = np.minimum(2.0 * each[..., 0] - each[..., 2], each.min(axis=-1)) - own
    clear = white > CLEAR * np.hypot(2.0 * doubt[..., 0], doubt[..., 2])
    return np.where(clear, white, 0.0)


def _in_motion(samples: RotationSamples, rate: FloatArray) -> tuple[FloatArray, IntArray]:
    """Power around f/2, 3f/8 and f/4 of each rotation, summed over values of all axes, (m, 3).

    And the number of these values, shape (m, 3).
    """
    power = np.zeros((len(samples.offsets) - 1, 3))
    count = np.zeros(power.shape, np.int64)
    for row, (first, past) in enumerate(itertools.pairwise(samples.offsets.tolist())):
        if past - first < MIN_SPECTRUM_SAMPLES:
            continue
        steps = np.diff(samples.time[first:past])
        step = median(steps)
        # across a gap a straight line, which has hardly any power at these frequencies
        at = np.append(0.0, np.cumsum(np.maximum(np.rint(steps / step), 1.0)))
        even = np.arange(at[-1] + 1.0)
        moved = np.stack([np.interp(even, at, axis) for axis in rate[first:past].T], axis=1)
        place = even / at[-1]
        window = np.minimum(1.0, np.minimum(place, 1.0 - place) / TAPERED)[:, None]
        spectrum = np.abs(np.fft.rfft(window * moved, axis=0)) ** 2
        density = step / float((window**2).sum()) * spectrum
        frequency = np.fft.rfftfreq(len(even))
        for number, (low, high) in enumerate((HALF, NEAR, QUARTER)):
            inside = density[(frequency >= low) & (frequency <= high)]
            power[row, number], count[row, number] = inside.sum(), inside.size
    return power, count
