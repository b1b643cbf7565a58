"""How well each explanation predicts what is left: marginal likelihood, noise size unknown.

With patterns U and strengths λ the whitened residual r (m numbers, base parameters projected out)
is Gaussian with covariance ``σ²I + U diag(λ) Uᵀ``, whose logarithm needs q numbers only:

    −2 log p = Σ log(1 + λ/σ²) + m log σ² + (|r|² − Σ (uᵀr)² λ/(λ + σ²)) / σ²

σ is the true noise in units of the noise measured within the holds. Within-hold noise is nearly the
whole truth for a white sensor and a half or a third of it for a coloured one, so σ is averaged over
a grid with a prior that allows both; it is the repeats in r itself that decide.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.bench.hypotheses import Hypothesis
from imucal_wizard.readings import FloatArray

SIGMAS = np.exp(np.linspace(np.log(0.6), np.log(8.0), 18))


def sigma_prior(share_white: float = 0.6) -> FloatArray:
    """Logarithm of the prior of each σ: a peak at one, and a broad shoulder above it."""
    x = np.log(SIGMAS)
    peak = np.exp(-0.5 * ((x - 0.03) / 0.12) ** 2) / 0.12
    broad = np.exp(-0.5 * ((x - 0.7) / 0.6) ** 2) / 0.6
    prior = share_white * peak + (1.0 - share_white) * broad
    return np.asarray(np.log(prior / prior.sum()))


class Jury:
    """All explanations of one design, ready to judge any residual of it.

    Args:
        across: complement of the base, shape (n, m).
        hypotheses: the explanations.
    """

    def __init__(self, across: FloatArray, hypotheses: Sequence[Hypothesis]) -> None:
        self.across = across
        self.hypotheses = list(hypotheses)
        self.log_prior = np.array([h.log_prior for h in self.hypotheses])
        self._sigma_prior = sigma_prior()
        self._basis = np.concatenate([h.basis for h in self.hypotheses], axis=1)
        counts = [len(h.strength) for h in self.hypotheses]
        self._starts = np.concatenate([[0], np.cumsum(counts)])[:-1]
        strength = np.concatenate([h.strength for h in self.hypotheses])
        squares = SIGMAS**2
        self._gain = strength[:, None] / (strength[:, None] + squares) / squares
        logs = np.log1p(strength[:, None] / squares)
        self._log_det = self._summed(logs) + across.shape[1] * np.log(squares)

    def _summed(self, rows: FloatArray) -> FloatArray:
        """Sum of rows (patterns, …) within each hypothesis, shape (hypotheses, …)."""
        totals = np.concatenate([np.zeros((1, *rows.shape[1:])), np.cumsum(rows, axis=0)])
        ends = np.append(self._starts[1:], len(rows))
        return np.asarray(totals[ends] - totals[self._starts])

    def log_likelihood(self, residual: FloatArray) -> FloatArray:
        """Logarithm of the marginal likelihood per hypothesis and σ, shape (h, sigmas).

        Args:
            residual: whitened, shape (n,).
        """
        projected = self.across.T @ residual
        squares = (self._basis.T @ projected) ** 2
        explained = self._summed(squares[:, None] * self._gain)
        left = float(projected @ projected) / SIGMAS**2 - explained
        return np.asarray(-0.5 * (self._log_det + left))

    def log_evidence(self, residual: FloatArray) -> FloatArray:
        """The same averaged over σ, shape (h,)."""
        return np.asarray(
            np.logaddexp.reduce(self.log_likelihood(residual) + self._sigma_prior, axis=1)
        )

    def posterior(self, residual: FloatArray) -> FloatArray:
        """Probability of each explanation, shape (h,)."""
        weight = self.log_evidence(residual) + self.log_prior
        return np.asarray(np.exp(weight - np.logaddexp.reduce(weight)))

    def sigma(self, residual: FloatArray, hypothesis: int) -> float:
        """Expected σ under one explanation."""
        weight = self.log_likelihood(residual)[hypothesis] + self._sigma_prior
        return float((np.exp(weight - np.logaddexp.reduce(weight)) * SIGMAS).sum())

    def log_evidences(self, residuals: FloatArray) -> FloatArray:
        """``log_evidence`` of many residuals, shape (k, n) -> (k, h), without a loop over them."""
        projected = residuals @ self.across
        squares = (projected @ self._basis) ** 2
        totals = (projected**2).sum(axis=1)
        best = np.full((len(residuals), len(self.hypotheses)), -np.inf)
        ends = np.append(self._starts[1:], squares.shape[1])
        for place, sigma in enumerate(SIGMAS):
            sums = np.cumsum(squares * self._gain[:, place], axis=1)
            sums = np.concatenate([np.zeros((len(residuals), 1)), sums], axis=1)
            explained = sums[:, ends] - sums[:, self._starts]
            left = totals[:, None] / sigma**2 - explained
            value = -0.5 * (self._log_det[:, place] + left) + self._sigma_prior[place]
            best = np.logaddexp(best, value)
        return best
