"""The log odds that an effect of a given size will have against noise alone: mean and spread.

With coordinates ``x = s p + n``, n of variance ``v``, and q(w, σ) the probability of each wander
and noise without the effect, q'(w, σ) with it, the log odds change with each coordinate by

    ∂/∂xᵢ = s pᵢ Σ_w Wᵢ [Σ_σ q/σ² − Σ_σ q' (1 − ρ)/σ²],   ρ = t/(1 + t),  t = spread² XᵀWX/σ²

and with its square by ``½ Σ_w Wᵢ Σ_σ (q − q')/σ²``. The spread follows to first order: the noise
moves the estimate, and it makes the noise itself seem to wander more or less far.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.bench.evidence import Jury
from imucal_wizard.bench.hypotheses import SPREADS
from imucal_wizard.bench.noise import SQUARES
from imucal_wizard.readings import FloatArray


@dataclass(frozen=True, eq=False)
class Foreseen:
    """Log odds of parameters at sizes, each alone in the data.

    Attributes:
        mean: with the expected squares put in, shape (p, k).
        deviation: standard deviation over recordings, shape (p, k).
    """

    mean: FloatArray
    deviation: FloatArray


def foresee(
    jury: Jury,
    patterns: FloatArray,
    typical: FloatArray,
    sizes: FloatArray,
    noise: float,
    wander: float,
) -> Foreseen:
    """The log odds that each parameter will have.

    Args:
        jury: the explanations of this design.
        patterns: of each parameter at a size of one, in the jury's coordinates, shape (m, p).
        typical: prior standard deviation of each, shape (p,).
        sizes: to look at, shape (p, k).
        noise: in units of that within the holds.
        wander: of the bias.
    """
    weights = np.stack(jury.weights)
    usual = noise**2 / jury.frame.weights(wander)
    strength = weights @ patterns**2
    squares = sizes[:, :, None] ** 2 * strength.T[:, None]
    alone = jury.log_noise_of(squares + weights @ usual)
    spread = (strength.T * typical[:, None] ** 2)[:, None, :, None] * np.array(SPREADS) ** 2
    ratio = spread[..., None] / SQUARES
    share = ratio / (1.0 + ratio)
    gain = 0.5 * ((squares + noise**2)[..., None, None] * share / SQUARES - np.log1p(ratio))
    effect = alone[..., None, :] + gain - np.log(len(SPREADS))
    without, with_it = _shares(alone), _shares(effect)
    mean = _log_sum(effect) - _log_sum(alone)
    pull = (without / SQUARES).sum(axis=-1)
    along = pull - (with_it * (1.0 - share) / SQUARES).sum(axis=(-2, -1))
    apart = pull - (with_it / SQUARES).sum(axis=(-2, -1))
    by_pattern = np.einsum("ai,bi,i,ip->pab", weights, weights, usual, patterns**2)
    by_noise = (weights * usual**2) @ weights.T
    variance = sizes**2 * np.einsum("pka,pab,pkb->pk", along, by_pattern, along)
    variance += 0.5 * np.einsum("pka,ab,pkb->pk", apart, by_noise, apart)
    return Foreseen(mean, np.sqrt(np.maximum(variance, 0.0)))


def _shares(values: FloatArray) -> FloatArray:
    """Probabilities from logarithms, over all axes but the first two."""
    inner = tuple(range(2, values.ndim))
    found: FloatArray = np.exp(values - values.max(axis=inner, keepdims=True))
    return np.asarray(found / found.sum(axis=inner, keepdims=True))


def _log_sum(values: FloatArray) -> FloatArray:
    """Logarithm of the sum of exponentials over all axes but the first two."""
    inner = tuple(range(2, values.ndim))
    highest = values.max(axis=inner, keepdims=True)
    total = np.exp(values - highest).sum(axis=inner)
    return np.asarray(np.log(total) + highest.reshape(total.shape))
