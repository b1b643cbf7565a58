"""The p-value of a suspect: how likely the best suspect looks in simulated noise alone.

The odds of a suspect are its marginal likelihood against noise alone, its settings and axes
averaged over. The simulated noise is as large, and wanders as far, as the data say.
"""

from functools import cached_property

import numpy as np

from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.hypotheses import DISTURBED, EFFECT
from imucal_wizard.diagnose.posterior import HypothesisSet
from imucal_wizard.diagnose.random_walk import SIGMAS

SIMULATIONS = 400
"""Enough for a threshold at one per cent: four of them lie beyond it."""
NOISE_SIZES: FloatArray = np.array([0.8, 1.0, 1.25, 1.6, 2.0, 2.6, 3.4, 4.5, 6.0, 8.0])
"""Noise, in units of that within the holds, at which chance is simulated."""
SEEN_P = 0.01
"""Chance that noise alone makes any suspect look as good, up to which a misfit is seen."""
LEVELS: FloatArray = np.arange(0.0, 30.0, 0.1)
"""Log odds among which the threshold is looked for; no more than noise alone ever reaches."""
MIN_WANDER_PROBABILITY = 0.05
"""A wander of the noise less likely than this is not simulated."""
MAX_LOG_ODDS = 80.0
"""Larger odds, and odds smaller than their inverse, are beyond single precision; noise alone
reaches neither."""
WEIGHED_AT_ONCE = 8
"""Explanations: in 400 simulations they take half a megabyte, which stays near the processor."""
MAX_LOG_FACTOR = 12.0
"""Noise sizes less likely than this (in logarithms) in all simulations are left out."""


@dataclass(frozen=True, eq=False)
class SimulatedOdds:
    """The best odds of any suspect in each simulation, shape (simulations,)."""

    best: FloatArray

    def p(self, log_odds: float) -> float:
        """Share of simulations in which some suspect reaches these odds."""
        return (1.0 + float((self.best >= log_odds).sum())) / (1.0 + len(self.best))

    @cached_property
    def p_at_levels(self) -> FloatArray:
        """The same for each of ``LEVELS``."""
        below = np.searchsorted(np.sort(self.best), LEVELS)
        return np.asarray((1.0 + len(self.best) - below) / (1.0 + len(self.best)))


def members(hypotheses: HypothesisSet) -> dict[str, list[int]]:
    """Places of the explanations by each single effect, and by a disturbed hold."""
    found: dict[str, list[int]] = {}
    for place, one in enumerate(hypotheses.single):
        if one.kind == EFFECT:
            found.setdefault(one.terms[0], []).append(place)
        elif one.kind == DISTURBED:
            found.setdefault(DISTURBED, []).append(place)
    return found


def log_odds(evidence: FloatArray, hypotheses: HypothesisSet, places: list[int]) -> FloatArray:
    """Marginal likelihood of a suspect over its settings and axes against noise alone.

    Args:
        evidence: of each explanation, shape (…, h); noise alone is the first.
        hypotheses: the explanations.
        places: those of the suspect.
    """
    weights = hypotheses.log_prior[places]
    share = weights - np.logaddexp.reduce(weights)
    odds = np.logaddexp.reduce(evidence[..., places] + share, axis=-1) - evidence[..., 0]
    return np.asarray(odds)


def likely_noise(noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Probability of each wander that is not improbable, and its middle σ, shapes (…, wanders)."""
    shares = noise.sum(axis=-1)
    sizes = np.exp(noise @ np.log(SIGMAS) / np.maximum(shares, 1e-300))
    shares = np.where(shares > MIN_WANDER_PROBABILITY, shares, 0.0)
    return shares / shares.sum(axis=-1, keepdims=True), sizes


class Chances:
    """Simulations of one design for any noise, each made when it is first asked for.

    Args:
        hypotheses: the explanations of this design.
        seed: of the simulations.
    """

    def __init__(self, hypotheses: HypothesisSet, seed: int = 0) -> None:
        self._hypotheses, self._seed = hypotheses, seed
        self._known: dict[tuple[int, int], SimulatedOdds] = {}

    def at(self, sigma: float, wander: int) -> SimulatedOdds:
        """Simulations with about this noise, and the frame's wander of this number."""
        key = (int(np.argmin(np.abs(np.log(NOISE_SIZES / sigma)))), wander)
        if key not in self._known:
            wanders = self._hypotheses.frame.wanders
            self._known[key] = self._simulated(float(NOISE_SIZES[key[0]]), wanders[wander])
        return self._known[key]

    def p(self, log_odds: float, noise: FloatArray) -> float:
        """Chance that noise alone makes any suspect look as good.

        Args:
            log_odds: of the suspect.
            noise: probability of each wander and σ, shape (wanders, sigmas).
        """
        shares, sizes = likely_noise(noise)
        return sum(
            float(share) * self.at(float(size), k).p(log_odds)
            for k, (share, size) in enumerate(zip(shares, sizes, strict=True))
            if share > 0.0
        )

    def threshold(self, noise: FloatArray) -> FloatArray:
        """Log odds from which on p is at most 0.01, shape (k,).

        Args:
            noise: probability of each wander and σ in k recordings, shape (k, wanders, sigmas).
        """
        shares, sizes = likely_noise(noise)
        keys = np.abs(np.log(NOISE_SIZES[:, None, None] / sizes)).argmin(axis=0)
        p = np.zeros((len(noise), len(LEVELS)))
        for wander in range(noise.shape[1]):
            for key in distinct(keys[shares[:, wander] > 0.0, wander]):
                own = np.where(keys[:, wander] == key, shares[:, wander], 0.0)
                p += own[:, None] * self.at(float(NOISE_SIZES[key]), wander).p_at_levels
        return np.asarray(LEVELS[np.argmax(p <= SEEN_P, axis=1)])

    def _simulated(self, sigma: float, wander: float) -> SimulatedOdds:
        """The best odds of any suspect in simulations of noise alone.

        Args:
            sigma: noise in units of that within the holds.
            wander: of the bias, see ``random_walk``.
        """
        rng = np.random.default_rng(self._seed)
        noise = rng.standard_normal((SIMULATIONS, len(self._hypotheses.frame.walk)))
        coordinates = sigma * noise / np.sqrt(self._hypotheses.frame.weights(wander))
        suspects, own = self._suspects
        evidence = log_evidences(suspects, coordinates)
        best = np.full(SIMULATIONS, -np.inf)
        for places in own:
            best = np.maximum(best, log_odds(evidence, suspects, places))
        return SimulatedOdds(best)

    @cached_property
    def _suspects(self) -> tuple[HypothesisSet, list[list[int]]]:
        """Noise alone and the explanations by a suspect, and the places of each suspect's."""
        known = self._hypotheses
        places = sorted(place for each in members(known).values() for place in each)
        suspects = HypothesisSet(known.frame, [known.single[place] for place in (0, *places)])
        return suspects, list(members(suspects).values())


def log_evidences(hypotheses: HypothesisSet, coordinates: FloatArray) -> FloatArray:
    """Marginal likelihood of many residuals under every single explanation, shape (k, h).

    In single precision, which is 1e-5 of a logarithm: enough to count simulations.

    Args:
        hypotheses: the explanations.
        coordinates: of the residuals, shape (k, m).
    """
    alone = hypotheses.frame.log_noise(coordinates)
    highest = alone.max(axis=(1, 2), keepdims=True)
    alone -= highest
    likelihood = np.zeros((len(hypotheses.single), len(coordinates)))
    likelihood[0] = np.exp(alone).sum(axis=(1, 2))
    for wander, one in enumerate(hypotheses.spectra):
        sigmas = np.flatnonzero(alone[:, wander].max(axis=0) > -MAX_LOG_FACTOR)
        if not len(sigmas):
            continue
        noise = alone[:, wander, sigmas].T.astype(np.float32)
        gain = 0.5 * one.gain[:, :, sigmas].astype(np.float32)
        log_det = 0.5 * one.log_det[:, :, sigmas].astype(np.float32)
        squares = ((coordinates @ one.basis).T ** 2).astype(np.float32)
        log_det = log_det.reshape(len(log_det), -1, 1)
        found, first, start = [], 0, 0
        for turned in one.turned:  # explanations with the same number of patterns
            count, patterns = turned.shape[:2]
            stop = start + count * patterns
            own = squares[start:stop].reshape(count, patterns, -1)
            gains = np.swapaxes(gain[start:stop].reshape(count, patterns, -1), 1, 2)
            # a product of matrices is slow where there is nothing to add up
            product = np.multiply if patterns == 1 else np.matmul
            for begin in range(0, count, WEIGHED_AT_ONCE):
                some = slice(begin, begin + WEIGHED_AT_ONCE)
                each = product(gains[some], own[some])
                each -= log_det[first : first + len(each)]
                by_sigma = each.reshape(len(each), -1, *noise.shape)
                by_sigma += noise
                np.exp(np.clip(each, -MAX_LOG_ODDS, MAX_LOG_ODDS, out=each), out=each)
                found.append(by_sigma.sum(axis=2).mean(axis=1))
                first += len(each)
            start = stop
        likelihood[1:] += np.concatenate(found)[one.order]
    return np.asarray(np.log(likelihood.T) + highest[:, :, 0])
