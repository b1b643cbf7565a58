"""How well each explanation predicts what is left: marginal likelihood, size and noise unknown.

With patterns X at the prior size s, noise ``σ² W⁻¹`` (see ``noise``) and t = (s/σ)², the residual r
is Gaussian, and against noise alone its likelihood gains

    2 ln(p/p₀) = −ln |I + t XᵀWX| + (t/σ²) rᵀWX (I + t XᵀWX)⁻¹ XᵀWr

which the eigenvectors of XᵀWX turn into sums of single numbers. Sizes, σ and the wander of the
noise are averaged over; it is the repeats in r itself that decide how large the noise is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.bench.hypotheses import Hypothesis
from imucal_wizard.bench.noise import SQUARES
from imucal_wizard.readings import FloatArray


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
        squares = (coordinates @ self.basis) ** 2
        rows = squares[:, None, None] * self.gain
        return np.asarray(0.5 * (np.add.reduceat(rows, self.starts, axis=0) - self.log_det))


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
