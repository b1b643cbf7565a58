"""Simulated residuals with an effect: the size at which a rule is met in most of them.

A simulated residual is the pattern of the effect plus a draw of the noise that these data allow. In
each draw the rule is met from one estimate ``l`` of the size on, in units of its standard deviation
``e``. The noise along the pattern itself moves the estimate and nothing else; it is Gaussian and
independent of all other noise, so that at a size ``s`` the rule is met in the share ``mean Φ(s/e −
l)`` of recordings. All other noise is drawn: it turns one bent characteristic into a rippled one
and a drift into a wandering bias, and the program estimates from it how large the noise is.

The coordinates of a residual along every explanation (see ``Spectrum``) are linear in the size:
draws are turned once, and each pattern once. Explanations and kinds of noise that hold next to no
probability where the rule is nearly met are left out. A first search with a few of the draws finds
about where that is: an effect that is seen may be several times larger than the one with which the
search begins, and noise and other effects then resemble it differently.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median, normal_below
from imucal_wizard.diagnose.posterior import HypothesisSet
from imucal_wizard.diagnose.random_walk import SIGMAS

DRAWS = 192
"""Of noise. Other draws change a size by 2 to 5 %."""
MAX_SHARE_LEFT_OUT = 0.001
"""Probability of all explanations, also among those by the effect's family, that are left out. Many
improbable ones together keep a bent characteristic from being named."""
MAX_NOISE_LEFT_OUT = 0.003
"""The same of all kinds of noise: the one draw in twenty that decides may be of a rare one."""
MIN_SIGMA_SHARE = 1e-3
"""Of the probability of the likeliest σ, below which a size of the noise is left out."""
USUAL_SLOPE = 0.8
"""By which log odds grow with the logarithm of a size, over the square of its estimate, until two
sizes were tried."""
MIN_SLOPE = 1.0
"""By which they grow with the logarithm at least."""
MAX_ESTIMATE = 100.0
"""Estimates looked at, in standard deviations."""
MAX_LOG_GROWTH = 0.7
"""Of the size from one trial to the next."""
MAX_TRIALS = 12
SEARCHES = (24, 8, 0.1), (DRAWS, 24, 0.02)
"""Of a size, one after the other: how many draws are used, how many of them tell which explanations
matter, and the relative change of the size from which on it has settled."""
BISECTIONS = 20
"""Of a size between nothing and one that is surely enough."""


class LikelyExplanations:
    """Explanations that matter, in the order of the spectra, and the kinds of noise that do.

    Args:
        hypotheses: the explanations of this design.
        kept: numbers of those that matter in the spectra; noise alone always does.
        noises: each wander that matters, with the places of its σ.

    Attributes:
        kept: as given.
        noises: as given.
        places: of the explanations among the hypotheses, noise alone first, shape (h,).
        rows: rows of each explanation, for each number q of patterns, shapes (g, q).
        gains: what the squares of these bring, for each wander, shapes (g, spreads · sigmas, q).
        priors: what each explanation has without them, for each wander, (h, spreads · sigmas, 1).
    """

    def __init__(
        self,
        hypotheses: HypothesisSet,
        kept: NDArray[np.intp],
        noises: list[tuple[int, NDArray[np.intp]]],
    ) -> None:
        self.kept, self.noises = kept, noises
        first = hypotheses.spectra[0]
        counts = np.diff(np.append(first.starts, len(first.gain)))[kept]
        self.places = np.concatenate([[0], 1 + np.argsort(first.order)[kept]])
        # explanations with the same number of patterns follow one another
        self.rows = [
            first.starts[kept[counts == count], None] + np.arange(count)
            for count in distinct(counts)
        ]
        self.gains, self.priors = [], []
        # single precision: millions of numbers of which a thousandth is enough
        for wander, sigmas in noises:
            one = hypotheses.spectra[wander]
            gains = [0.5 * one.gain[rows][..., sigmas] for rows in self.rows]
            gains = [np.swapaxes(each.reshape(*each.shape[:2], -1), 1, 2) for each in gains]
            self.gains.append([np.ascontiguousarray(each, np.float32) for each in gains])
            lost = 0.5 * one.log_det[kept][..., sigmas]
            prior = hypotheses.log_prior[self.places] - math.log(lost.shape[1])
            lost = np.concatenate([np.zeros((1, *lost.shape[1:])), lost])
            priors = (prior[:, None, None] - lost).reshape(len(prior), -1, 1)
            self.priors.append(priors.astype("f4"))


class NoiseDraws:
    """Draws of the noise that a recording allows, the same for all effects.

    Args:
        hypotheses: the explanations of this design.
        shares: probability of each kind of noise, shape (k,).
        variances: of each kind along each coordinate, shape (k, m).
        seed: of the draws.

    Attributes:
        hypotheses: the explanations.
        variance: along each coordinate in each draw, shape (draws, m).
        coordinates: the draws, shape (draws, m).
        along: the same along the rows of each spectrum, shape (rows, draws).
        every: all explanations, and the σ that such noise seems to have.
    """

    def __init__(
        self, hypotheses: HypothesisSet, shares: FloatArray, variances: FloatArray, seed: int = 0
    ) -> None:
        self.hypotheses = hypotheses
        kind = np.searchsorted(np.cumsum(shares), (np.arange(DRAWS) + 0.5) / DRAWS)
        # draws of any kind stand at any place, so that a part of them represents all
        rng = np.random.default_rng(seed)
        self.variance = variances[rng.permutation(kind)]
        white = _stratified(rng, self.variance.shape)
        self.coordinates = white * np.sqrt(self.variance)
        along = [one.along(self.coordinates) for one in hypotheses.spectra]
        self.along = [np.ascontiguousarray(one.T, np.float32) for one in along]
        alone = hypotheses.frame.log_noise(self.coordinates)
        likely = np.exp(alone - alone.max(axis=2, keepdims=True)).max(axis=0)
        noises = [(k, np.flatnonzero(own > MIN_SIGMA_SHARE)) for k, own in enumerate(likely)]
        self.every = LikelyExplanations(hypotheses, np.arange(len(hypotheses.single) - 1), noises)


@dataclass(frozen=True, eq=False)
class Weighed:
    """What is kept of the explanations, weighed in k draws.

    Attributes:
        places: of the explanations among the hypotheses, noise alone first, shape (h,).
        single: probability of each explanation, shape (h, k).
        sigma: expected noise under each explanation, shape (h, k).
        noise: probability of each wander and σ, shape (k, wanders, sigmas).
        taken: squares that each explanation takes away, expected over the wander, shape (h, k).
    """

    places: NDArray[np.intp]
    single: FloatArray
    sigma: FloatArray
    noise: FloatArray
    taken: FloatArray


class EffectInDraws:
    """One pattern of an effect in the draws.

    Args:
        draws: of the noise.
        pattern: what a size of one shows in the coordinates of the frame, shape (m,).
        family: of the effect.
    """

    def __init__(self, draws: NoiseDraws, pattern: FloatArray, family: str) -> None:
        self._draws, self._pattern = draws, pattern
        known = draws.hypotheses
        self._along = [one.along(pattern[None])[0].astype("f4") for one in known.spectra]
        # the noise along the pattern is averaged over, and therefore taken out of the draws
        weighted = pattern / draws.variance
        self._own = (weighted * draws.coordinates).sum(axis=1) / (weighted @ pattern)
        self._of_family = np.array([family in one.families for one in known.single])

    def size_meeting(
        self, rule: Callable[[Weighed], FloatArray], wanted: float, first: float
    ) -> float:
        """Size at which a rule is met in a share of recordings; infinite where none is enough.

        Args:
            rule: log odds, or half squares of the noise, by which it is met in each draw.
            wanted: the share.
            first: estimate at which the search begins, in standard deviations.
        """
        errors = 1.0 / np.sqrt((1.0 / self._draws.variance) @ self._pattern**2)
        size = first * median(errors)
        for count, pilots, change in SEARCHES:
            used = _some(count)
            known, error = self._likely(size, used, _some(pilots)), errors[used]
            slope: FloatArray = USUAL_SLOPE * (size / error) ** 2
            before: tuple[float, FloatArray] | None = None
            for _ in range(MAX_TRIALS):
                margin = rule(self._weighed(known, size, used))
                if before is not None:
                    slope = (margin - before[1]) / math.log(size / before[0])
                    slope = np.maximum(slope, MIN_SLOPE)
                before = size, margin
                # nearly right for draws in which the rule is just met, on the right side for others
                growth = np.clip(-margin / slope, -MAX_LOG_GROWTH, MAX_LOG_GROWTH)
                size = _size_reaching(wanted, error, size * np.exp(growth) / error)
                if abs(size - before[0]) < change * before[0]:
                    break
                if size > MAX_ESTIMATE * float(error.max()):
                    return np.inf
        return size

    def _likely(self, size: float, used: slice, pilots: slice) -> LikelyExplanations:
        """What is not improbable in these draws at about this size."""
        every, known = self._draws.every, self._draws.hypotheses
        single = self._weighed(every, size, pilots).single[1:]
        shares = single.mean(axis=1)
        keep = shares >= _least_kept(shares, MAX_SHARE_LEFT_OUT)
        # the family itself is asked about, however improbable it is
        own = self._of_family[every.places[1:]]
        inside = (single[own] / np.maximum(single[own].sum(axis=0), 1e-300)).mean(axis=1)
        keep[own] |= inside >= _least_kept(inside, MAX_SHARE_LEFT_OUT)
        kept = every.kept[keep]
        of_all = LikelyExplanations(known, kept, every.noises)
        kinds = self._weighed(of_all, size, used).noise.mean(axis=0)
        likely = kinds >= _least_kept(kinds.ravel(), MAX_NOISE_LEFT_OUT)
        noises = [(k, np.flatnonzero(one)) for k, one in enumerate(likely) if one.any()]
        return LikelyExplanations(known, kept, noises)

    def _weighed(self, known: LikelyExplanations, size: float, places: slice) -> Weighed:
        """Weigh explanations in some of the draws, with an effect of this size."""
        draws = self._draws
        times = size - self._own[places]
        coordinates = draws.coordinates[places] + times[:, None] * self._pattern
        alone = draws.hypotheses.frame.log_noise(coordinates)
        alone -= alone.max(axis=(1, 2), keepdims=True)
        weights, squares, times = [], [], times.astype("f4")
        for (wander, sigmas), gains, prior in zip(
            known.noises, known.gains, known.priors, strict=True
        ):
            along, added = draws.along[wander][:, places], self._along[wander]
            each = [(along[own] + added[own][..., None] * times) ** 2 for own in known.rows]
            nothing = np.zeros((1, len(times)), np.float32)
            squares.append(np.concatenate([nothing, *(own.sum(axis=1) for own in each)]))
            weight = np.empty((len(prior), prior.shape[1], len(times)), np.float32)
            weight[0], end = 0.0, 1
            for own, gain in zip(each, gains, strict=True):
                start, end = end, end + len(own)
                # a product of matrices is slow where there is nothing to add up
                product = np.multiply if own.shape[1] == 1 else np.matmul
                product(gain, own, out=weight[start:end])
            weight += prior
            quiet = alone[:, wander, sigmas].T.astype("f4")
            of_spreads = weight.reshape(len(prior), -1, *quiet.shape)
            of_spreads += quiet
            weights.append(of_spreads)
        highest = np.max([each.max(axis=(0, 1)).max(axis=0) for each in weights], axis=0)
        single = np.zeros(squares[0].shape)
        sigma, taken, noise = single.copy(), single.copy(), np.zeros_like(alone)
        for each_weight, (wander, sigmas) in zip(weights, known.noises, strict=True):
            each_weight -= highest
            by_sigma = np.exp(each_weight, out=each_weight).sum(axis=1)
            single += by_sigma.sum(axis=1)
            sigma += SIGMAS[sigmas].astype("f4") @ by_sigma
            noise[:, wander, sigmas] = by_sigma.sum(axis=0).T
        total = single.sum(axis=0)
        noise /= total[:, None, None]
        for (wander, _), each_squares in zip(known.noises, squares, strict=True):
            taken += noise[:, wander].sum(axis=1) * each_squares
        sigma /= np.maximum(single, 1e-300)
        return Weighed(known.places, single / total, sigma, noise, taken)


def _some(count: int) -> slice:
    """Which draws are used where so many are enough."""
    return slice(None, None, max(DRAWS // count, 1))


def _size_reaching(share: float, errors: FloatArray, least: FloatArray) -> float:
    """Size whose estimate is above the least one in a share of recordings.

    Args:
        share: of the recordings.
        errors: standard deviation of the estimate in each draw, shape (k,).
        least: estimate from which on a rule is met, in that, shape (k,).
    """
    low, high = 0.0, float(((least + 4.0) * errors).max())
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        deviates = (middle / errors - least) / math.sqrt(2.0)
        reached = 0.5 + 0.5 * sum(map(math.erf, deviates)) / len(errors)
        low, high = (middle, high) if reached < share else (low, middle)
    return high


def _least_kept(shares: FloatArray, left_out: float) -> float:
    """The least of these probabilities that is kept where the smallest are left out."""
    ordered = np.sort(shares)
    total = np.cumsum(ordered)
    return float(ordered[np.argmax(total >= left_out * total[-1])])


def _stratified(rng: "np.random.Generator", shape: tuple[int, int]) -> FloatArray:
    """Normal deviates, in each column one in each of as many equally likely ranges."""
    count, width = shape
    grid = np.linspace(-5.0, 5.0, 10_001)
    deviates = np.interp((np.arange(count) + 0.5) / count, normal_below(grid), grid)
    return np.asarray(rng.permuted(np.tile(deviates[:, None], (1, width)), axis=0))
