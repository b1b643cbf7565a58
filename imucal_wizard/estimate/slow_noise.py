"""Slow noise of a bias: what it adds to the covariance of holds, told from how these scatter.

A bias wanders (flicker noise, power h/f; its Allan deviation is flat at the bias instability
``B = √(2 ln 2 · h)``, IEEE 952, annex C). Its slowest part is the same in all holds of a session:
no residual shows it, and it lies wholly in the bias that is fitted. The faster part shows, and the
two belong together: a sum of Gauss–Markov processes, one per octave of the correlation time τ, each
of the variance ``h ln 2``. Averages over holds of T₁ and T₂ s, d s apart, then have the covariance

    h ln 2 Σ (τ²/T₁T₂) (1 − e^(−T₁/τ)) (1 − e^(−T₂/τ)) e^(−d/τ)

(of one hold with itself ``2 (τ/T)² (T/τ − 1 + e^(−T/τ))``). How large B is against the white noise
N is not known; data sheets say about what to expect, and the probability of each ratio given the
scatter of the holds (restricted likelihood) says what to think of it here.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.estimate.noise import hold_noise
from imucal_wizard.measurement.holds import Hold

OCTAVES = 0.3 * 2.0 ** np.arange(12)
"""Correlation times, s: 0.3 to 600. What is slower than a session is the bias that it has."""
RATIOS = np.concatenate([[0.0], np.geomspace(0.02, 3.0, 20)])
"""Bias instability B over white noise density N, 1/√s."""
USUAL = 0.2
"""The middle of what data sheets of MEMS accelerometers and gyroscopes say of it ..."""
FACTOR = 2.0
"""... and the factor by which two in three are at most away from it."""
WHITE = 0.35
"""Share of sensors (and of simulations) with no slow noise that matters."""
SCATTERS = np.exp(np.linspace(-0.5, 3.5, 22))
"""Variance from hold to hold that is of no order in time, over that by the noise within them."""
KNOWN_TO = 0.12
"""How well the noise within the holds is known (logarithm of the variance) ..."""
NOTHING_ELSE = 0.9
"""... and how often nothing else scatters from hold to hold; else up to some ten times as much."""


@dataclass(frozen=True, eq=False)
class Shown:
    """What one axis or one magnitude shows of slow noise, in n holds.

    Attributes:
        errors: what a linear fit leaves of each hold, shape (n,).
        columns: derivative by what was fitted, shape (n, p).
        noise: variance of each by the noise within the hold alone, shape (n,).
        alike: which share of the same slow error two holds show, shape (n, n), or 1.
    """

    errors: FloatArray
    columns: FloatArray
    noise: FloatArray
    alike: FloatArray | float = 1.0


def spans_of(holds: Sequence[Hold]) -> FloatArray:
    """Beginning and end of each hold, s, shape (n, 2)."""
    return np.array([[hold.start, hold.end] for hold in holds])


def slow_covariances(spans: FloatArray, shown: Sequence[Shown]) -> list[FloatArray]:
    """Expected covariance of the holds' errors by slow noise, shape (n, n) for each.

    All of them are taken to have the same ratio of slow to white noise.

    Args:
        spans: beginning and end of each hold, s, shape (n, 2).
        shown: axes of one sensor. Without any noise in the holds nothing tells it: then none.
    """
    kernel = averaged(spans)
    seconds = spans[:, 1] - spans[:, 0]
    slow = [2.0 * median(one.noise * seconds) * kernel * one.alike for one in shown]
    if not all((one.noise > 0.0).all() for one in shown):
        return [0.0 * one for one in slow]
    log = _prior(RATIOS) + sum(_evidence(*pair) for pair in zip(shown, slow, strict=True))
    share = np.exp(log - log.max())
    square = float(share @ RATIOS**2 / share.sum())
    return [square * one for one in slow]


def unseen(slow: FloatArray, columns: FloatArray, scatter: float) -> FloatArray:
    """What a fit's own standard errors do not say of slow noise, shape (n, n).

    They take the variance ``rᵀr/(n − p)`` of what is left for that of independent errors; of slow
    noise with the covariance K it holds ``tr((I − H) K)/(n − p)`` already, H being the leverage.

    Args:
        slow: K, in the unit of the rows, shape (n, n).
        columns: derivative of the rows by what was fitted, shape (n, p).
        scatter: that variance; no more than all of it is taken off.
    """
    across = complement(columns)
    seen = float(np.einsum("ij,ik,kj->", across, slow, across)) / max(across.shape[1], 1)
    return np.asarray(slow - min(seen, scatter) * np.eye(len(slow)))


def slow_rate(holds: Sequence[Hold], shares: FloatArray | None = None) -> FloatArray:
    """What slow noise adds to the variance of the mean rate over holds, reading units², shape (3,).

    On top of what follows from their scatter.

    Args:
        holds: still periods with a gyroscope.
        shares: with which share each hold is in that mean, shape (n,); all alike by default.
    """
    density = hold_noise(holds).gyroscope_density
    if density is None:
        return np.zeros(3)
    spans = spans_of(holds)
    means = np.array([hold.gyroscope for hold in holds])
    noise = density / (spans[:, 1] - spans[:, 0])[:, None]
    errors, ones = means - means.mean(axis=0), np.ones((len(holds), 1))
    shares = ones[:, 0] / len(holds) if shares is None else shares
    shown = [Shown(errors[:, axis], ones, noise[:, axis]) for axis in range(3)]
    scatter = (errors**2).sum(axis=0) / max(len(holds) - 1, 1)
    slow = zip(slow_covariances(spans, shown), scatter, strict=True)
    return np.array([shares @ unseen(one, ones, all_of_it) @ shares for one, all_of_it in slow])


def averaged(spans: FloatArray) -> FloatArray:
    """Covariance of averages over these spans of time, (n, 2), where B is one, shape (n, n)."""
    start, end = spans.T
    length = end - start
    gap = np.maximum(np.maximum.outer(start, start) - np.minimum.outer(end, end), 0.0)
    out = np.zeros((len(spans), len(spans)))
    for tau in OCTAVES:
        share = length / tau
        mean = -np.expm1(-share) / share
        apart = np.outer(mean, mean) * np.exp(-gap / tau)
        np.fill_diagonal(apart, 2.0 * (share + np.expm1(-share)) / share**2)
        out += 0.5 * apart  # h ln 2 = B²/2
    return out


def _prior(ratios: FloatArray) -> FloatArray:
    """Logarithm of the probability of each ratio, the first of them being none at all."""
    usual = np.exp(-0.5 * (np.log(ratios[1:] / USUAL) / np.log(FACTOR)) ** 2)
    return np.asarray(np.log(np.append(WHITE, (1.0 - WHITE) * usual / usual.sum())))


def _scatter_prior() -> FloatArray:
    """Logarithm of the probability of each scatter: mostly one, sometimes anything."""
    log = np.log(SCATTERS)
    peak, broad = np.exp(-0.5 * (log / KNOWN_TO) ** 2), np.exp(-0.5 * (log - 0.6) ** 2)
    mixed = NOTHING_ELSE * peak / peak.sum() + (1.0 - NOTHING_ELSE) * broad / broad.sum()
    return np.asarray(np.log(mixed))


def _evidence(shown: Shown, slow: FloatArray) -> FloatArray:
    """Restricted log likelihood of each ratio, averaged over the scatter."""
    sigma = np.sqrt(shown.noise)
    across = complement(shown.columns / sigma[:, None])
    values, vectors = np.linalg.eigh(across.T @ (slow / np.outer(sigma, sigma)) @ across)
    square = (vectors.T @ (across.T @ (shown.errors / sigma))) ** 2
    variance = SCATTERS[:, None, None] + np.outer(RATIOS**2, np.maximum(values, 0.0))
    log = -0.5 * (np.log(variance) + square / variance).sum(axis=2) + _scatter_prior()[:, None]
    return np.asarray(np.logaddexp.reduce(log, axis=0))


def complement(columns: FloatArray) -> FloatArray:
    """Orthonormal basis of what no combination of columns makes, shape (n, n − rank)."""
    left, values, _ = np.linalg.svd(columns, full_matrices=True)
    rank = int((values > 1e-9 * values.max(initial=0.0)).sum())
    return np.asarray(left[:, rank:])
