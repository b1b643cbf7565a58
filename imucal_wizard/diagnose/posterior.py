"""The probability of each explanation of one design, given a residual.

With patterns X at the prior size s, noise ``σ² W⁻¹`` (see ``random_walk``) and t = (s/σ)², the
residual r is Gaussian, and its likelihood gains against noise alone

    2 ln(p/p₀) = −ln |I + t XᵀWX| + (t/σ²) rᵀWX (I + t XᵀWX)⁻¹ XᵀWr

which the eigenvectors of XᵀWX turn into sums of single numbers. Sizes, σ and the random walk are
averaged over; the repeats in r itself determine how large the noise is.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.hypotheses import (
    UNKNOWN,
    Hypothesis,
    Pairs,
    all_pairs,
    disturbances,
    effect_hypotheses,
    field_changes,
    noise_alone,
    unknown_structure,
)
from imucal_wizard.diagnose.random_walk import SIGMAS, SQUARES, Frame, frame_of
from imucal_wizard.diagnose.residuals import WhitenedResiduals


@dataclass(frozen=True, eq=False)
class Posterior:
    """Every explanation's share of the probability.

    Attributes:
        evidence: logarithm of the marginal likelihood of each single explanation, shape (h,).
        single: probability of each single explanation, shape (h,).
        paired: probability of each pair, shape (p,).
        sigma: expected noise under each single explanation, shape (h,).
        sigma_paired: the same under each pair, shape (p,).
        noise: probability of each wander and σ over all explanations, shape (wanders, sigmas).
        wander: expected wander of the noise, over all explanations.
    """

    evidence: FloatArray
    single: FloatArray
    paired: FloatArray
    sigma: FloatArray
    sigma_paired: FloatArray
    noise: FloatArray
    wander: float

    @property
    def wandering(self) -> float:
        """Probability that the noise wanders at all."""
        return float(self.noise[1:].sum())

    @property
    def expected_noise(self) -> float:
        """Expected noise over all explanations, in units of that within the holds."""
        return float(self.single @ self.sigma + self.paired @ self.sigma_paired)


class HypothesisSet:
    """All explanations of one design, ready to judge any residual of it.

    Args:
        frame: the coordinates.
        hypotheses: the single explanations; the first is noise alone.
        pairs: the pairs, or None.
    """

    def __init__(
        self, frame: Frame, hypotheses: Sequence[Hypothesis], pairs: Pairs | None = None
    ) -> None:
        self.frame = frame
        self.single = tuple(hypotheses)
        self.pairs = pairs
        self.log_prior = np.array([one.log_prior for one in hypotheses])
        others = self.single[1:]
        self.spectra = [spectrum(others, weights) for weights in frame.each_weights if others]

    def posterior(self, residual: FloatArray) -> Posterior:
        """Weigh all explanations.

        Args:
            residual: whitened, shape (n,).
        """
        coordinates = self.frame.across.T @ residual
        alone = self.frame.log_noise(coordinates)
        single = self._single(coordinates, alone)
        evidence = np.logaddexp.reduce(single, axis=(1, 2))
        single += self.log_prior[:, None, None]
        highest = single.max()
        paired = self._paired(coordinates, alone - highest)
        beyond = float(paired.max(initial=0.0))
        single = np.exp(single - (highest + beyond))
        paired -= np.float32(beyond)
        np.exp(paired, out=paired)
        total = single.sum() + paired.sum(dtype=np.float64)
        noise = (single.sum(axis=0) + paired.sum(axis=1, dtype=np.float64)) / total
        by_sigma = np.concatenate([single.sum(axis=1), paired.sum(axis=0)]) / total
        return self._weighed(evidence, noise, by_sigma)

    def expected(self, log_weights: FloatArray) -> Posterior:
        """The probabilities without pairs, from ``log_weights``."""
        weight = np.exp(log_weights - log_weights.max()).sum(axis=1)
        evidence = np.log(np.maximum(weight.sum(axis=(1, 2)), 1e-300)) - self.log_prior
        weight /= weight.sum()
        return self._weighed(evidence, weight.sum(axis=0), weight.sum(axis=1))

    def _weighed(self, evidence: FloatArray, noise: FloatArray, by_sigma: FloatArray) -> Posterior:
        """From the probability of each noise, and of each explanation and σ, (h + p, sigmas)."""
        share = by_sigma.sum(axis=1)
        sigma = (by_sigma @ SIGMAS) / np.maximum(share, 1e-300)
        count = len(self.single)
        return Posterior(
            evidence,
            share[:count],
            share[count:],
            sigma[:count],
            sigma[count:],
            noise,
            float(noise.sum(axis=1) @ np.array(self.frame.wanders)),
        )

    def unknown_beside(self, coordinates: FloatArray, inside: FloatArray) -> float:
        """Probability of unknown structure among the single explanations of what a name leaves.

        Args:
            coordinates: of a residual, shape (m,).
            inside: what the name takes up, orthonormal, shape (m, k).
        """

        def beside(patterns: FloatArray) -> FloatArray:
            return np.asarray(patterns - inside @ (inside.T @ patterns))

        left = [replace(one, patterns=beside(one.patterns)) for one in self.single]
        rest = HypothesisSet(self.frame, left)
        found = rest.posterior(self.frame.across @ beside(coordinates))
        return float(found.single[[one.kind == UNKNOWN for one in left]].sum())

    def log_weights(self, squares: Callable[[FloatArray], FloatArray], prior: bool) -> FloatArray:
        """Logarithms of likelihood and prior of every single explanation, size and noise.

        Args:
            squares: sum of squares of a residual along vectors, (m, k) to (k,). All is linear in
                it: the weights for a sum of residuals that are independent are sums as well.
            prior: with the part that does not depend on the residual.

        Returns:
            Shape (h, spreads, wanders, sigmas); without pairs.
        """
        along = squares(np.eye(len(self.frame.walk)))
        totals = np.array([along @ own for own in self.frame.each_weights])
        alone = self.frame.log_noise_of(totals) if prior else -0.5 * totals[:, None] / SQUARES
        gains = [one.gains_of(squares(one.basis), prior) for one in self.spectra]
        spreads = gains[0].shape[1]
        nothing = np.zeros((1, spreads, *alone.shape))
        found = alone + np.concatenate([nothing, np.stack(gains, axis=2)])
        if prior:
            found += self.log_prior[:, None, None, None] - np.log(spreads)
        return np.asarray(found)

    def _single(self, coordinates: FloatArray, alone: FloatArray) -> FloatArray:
        """Likelihood averaged over the size, shape (h, wanders, sigmas)."""
        gains = np.stack([one.gains(coordinates) for one in self.spectra], axis=1)
        averaged = np.logaddexp.reduce(gains, axis=2) - np.log(gains.shape[2])
        return np.asarray(alone + np.concatenate([np.zeros((1, *averaged.shape[1:])), averaged]))

    def _paired(self, coordinates: FloatArray, alone: FloatArray) -> NDArray[np.float32]:
        """Likelihood and prior, shape (wanders, p, sigmas)."""
        if self.pairs is None:
            return np.zeros((len(alone), 0, alone.shape[1]), np.float32)
        found = self.pairs.gains(coordinates, self.frame.each_weights)
        found += alone.astype(np.float32)[:, None, :]
        found += self.pairs.log_prior.astype(np.float32)[:, None]
        return found


def hypothesis_set(misfit: WhitenedResiduals, pairs: bool = True) -> HypothesisSet:
    """Everything that may explain a misfit of this design."""
    frame = frame_of(misfit)
    made = [noise_alone(frame), *effect_hypotheses(misfit, frame), *disturbances(misfit, frame)]
    made += unknown_structure(misfit, frame) + field_changes(misfit, frame)
    return HypothesisSet(frame, made, all_pairs(made) if pairs else None)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Explanations under one wander of the noise, each as a sum over rows.

    Attributes:
        basis: a residual's coordinates times this are independent numbers, shape (m, rows).
        gain: what the square of each of them adds to the log likelihood, (rows, spreads, sigmas).
        log_det: per explanation, shape (h, spreads, sigmas).
        starts: first row of each explanation, shape (h,).
    """

    basis: FloatArray
    gain: FloatArray
    log_det: FloatArray
    starts: NDArray[np.intp]

    def gains(self, coordinates: FloatArray) -> FloatArray:
        """What each explanation adds to the log likelihood of noise alone, (h, spreads, sigmas).

        Args:
            coordinates: of a residual, shape (m,).
        """
        return self.gains_of((coordinates @ self.basis) ** 2)

    def gains_of(self, squares: FloatArray, prior: bool = True) -> FloatArray:
        """The same from the squares of the rows; without ``prior`` only what these bring."""
        rows = squares[:, None, None] * self.gain
        found = np.add.reduceat(rows, self.starts, axis=0)
        return np.asarray(0.5 * (found - self.log_det if prior else found))


def spectrum(hypotheses: Sequence[Hypothesis], weights: FloatArray) -> Spectrum:
    """The spectrum of explanations, each with at least one pattern.

    Args:
        hypotheses: the explanations.
        weights: of each coordinate, shape (m,).
    """
    bases: list[FloatArray] = [np.zeros((0, 0))] * len(hypotheses)
    values: list[FloatArray] = [np.zeros(0)] * len(hypotheses)
    places: dict[int, list[int]] = {}
    for place, hypothesis in enumerate(hypotheses):
        places.setdefault(hypothesis.patterns.shape[1], []).append(place)
    for own in places.values():
        stack = np.stack([hypotheses[place].patterns for place in own]) * weights[:, None] ** 0.5
        strength, vectors = np.linalg.eigh(np.swapaxes(stack, 1, 2) @ stack)
        strength = np.maximum(strength, 0.0)
        length = np.sqrt(np.maximum(strength, 1e-12 * strength[:, -1:] + 1e-300))
        basis = weights[:, None] ** 0.5 * (stack @ vectors) / length[:, None, :]
        for place, one, own_values in zip(own, basis, strength, strict=True):
            bases[place], values[place] = one, own_values
    counts = np.array([len(one) for one in values])
    spreads = np.array([hypothesis.spreads for hypothesis in hypotheses])
    strengths = np.concatenate(values)[:, None] * np.repeat(spreads, counts, axis=0) ** 2
    ratio = strengths[:, :, None] / SQUARES
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    return Spectrum(
        np.concatenate(bases, axis=1),
        ratio / (1.0 + ratio) / SQUARES,
        np.add.reduceat(np.log1p(ratio), starts, axis=0),
        starts,
    )
