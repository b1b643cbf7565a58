"""All explanations of one design against each other: the probability of each, given a residual."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.bench.hypotheses import Hypothesis, disturbed, effects, nothing
from imucal_wizard.bench.misfit import Misfit
from imucal_wizard.bench.noise import SIGMAS, SQUARES, Frame, frame_of, sigma_prior
from imucal_wizard.bench.pairs import Pairs, all_pairs
from imucal_wizard.bench.passing import passing
from imucal_wizard.bench.spectrum import spectrum
from imucal_wizard.bench.unknown import unknown
from imucal_wizard.readings import FloatArray


@dataclass(frozen=True, eq=False)
class Weighed:
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


class Jury:
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
        self.hypotheses = tuple(hypotheses)
        self.pairs = pairs
        self.log_prior = np.array([one.log_prior for one in hypotheses])
        self.weights = [frame.weights(wander) for wander in frame.wanders]
        others = self.hypotheses[1:]
        self.spectra = [spectrum(others, weights) for weights in self.weights if others]
        spread = -np.array([np.log(weights).sum() for weights in self.weights])
        volume = frame.across.shape[1] * np.log(SQUARES) + spread[:, None]
        self._log_volume = frame.log_prior[:, None] + sigma_prior() - 0.5 * volume

    def log_noise(self, coordinates: FloatArray) -> FloatArray:
        """Likelihood and prior of noise alone, shape (…, wanders, sigmas).

        Args:
            coordinates: of residuals, shape (…, m).
        """
        squares = coordinates**2
        return self.log_noise_of(np.stack([squares @ own for own in self.weights], axis=-1))

    def log_noise_of(self, totals: FloatArray) -> FloatArray:
        """The same from weighted sums of squares under each wander, shape (…, wanders)."""
        return np.asarray(self._log_volume - 0.5 * totals[..., None] / SQUARES)

    def weigh(self, residual: FloatArray) -> Weighed:
        """Weigh all explanations.

        Args:
            residual: whitened, shape (n,).
        """
        coordinates = self.frame.across.T @ residual
        alone = self.log_noise(coordinates)
        single = self._single(coordinates, alone)
        paired = self._paired(coordinates, alone)
        evidence = np.logaddexp.reduce(single, axis=(1, 2))
        joint = np.concatenate([single + self.log_prior[:, None, None], paired])
        weight = np.exp(joint - joint.max())
        weight /= weight.sum()
        share = weight.sum(axis=(1, 2))
        by_sigma = weight.sum(axis=1)
        sigma = (by_sigma @ SIGMAS) / np.maximum(share, 1e-300)
        noise = weight.sum(axis=0)
        count = len(self.hypotheses)
        return Weighed(
            evidence,
            share[:count],
            share[count:],
            sigma[:count],
            sigma[count:],
            noise,
            float(noise.sum(axis=1) @ np.array(self.frame.wanders)),
        )

    def _single(self, coordinates: FloatArray, alone: FloatArray) -> FloatArray:
        """Likelihood averaged over the size, shape (h, wanders, sigmas)."""
        gains = np.stack([one.gains(coordinates) for one in self.spectra], axis=1)
        averaged = np.logaddexp.reduce(gains, axis=2) - np.log(gains.shape[2])
        return np.asarray(alone + np.concatenate([np.zeros((1, *averaged.shape[1:])), averaged]))

    def _paired(self, coordinates: FloatArray, alone: FloatArray) -> FloatArray:
        """Likelihood and prior, shape (p, wanders, sigmas)."""
        if self.pairs is None:
            return np.zeros((0, *alone.shape))
        gains = [self.pairs.gains(coordinates, weights) for weights in self.weights]
        return np.asarray(alone + np.stack(gains, axis=1) + self.pairs.log_prior[:, None, None])


def make_jury(misfit: Misfit, pairs: bool = True) -> Jury:
    """Everything that may explain a misfit of this design."""
    frame = frame_of(misfit)
    made = [nothing(frame), *effects(misfit, frame), *disturbed(misfit, frame)]
    made += unknown(misfit, frame) + passing(misfit, frame)
    return Jury(frame, made, all_pairs(made) if pairs else None)
