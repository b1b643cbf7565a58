"""Covariance of averages over spans of time by slow noise: flicker noise and a random walk.

A bias wanders (flicker noise, power h/f; its Allan deviation is flat at the bias instability
``B = √(2 ln 2 · h)``, IEEE 952, annex C). Its slowest part is the same in all holds of a session:
no residual shows it, and it lies wholly in the bias that is fitted. The faster part shows, and the
two belong together: a sum of Gauss–Markov processes, one per octave of the correlation time τ, each
of the variance ``h ln 2``. Averages over holds of T₁ and T₂ s, d s apart, then have the covariance

    h ln 2 Σ (τ²/T₁T₂) (1 − e^(−T₁/τ)) (1 − e^(−T₂/τ)) e^(−d/τ)

(of one hold with itself ``2 (τ/T)² (T/τ − 1 + e^(−T/τ))``).
"""

from collections.abc import Callable

import numpy as np

from imucal_wizard.core.readings import FloatArray

Kernel = Callable[[FloatArray], FloatArray]
"""Covariance of averages over spans of time, (n, 2) to (n, n), by slow errors of size one."""
OCTAVES = 0.3 * 2.0 ** np.arange(12)
"""Correlation times, s: 0.3 to 600. What is slower than a session is the bias that it has."""

WITHIN = 0.375 / (2.0 * np.log(2.0))
"""Variance of a mean by flicker noise with B = 1 as the power at one and two cycles of the hold
tells it, ``h (1 + 1/2) / 4``: see ``holds.mean_and_covariance``."""

SHORTEST = 1e-6
"""Length of an average over its correlation time that is none: a value at one moment."""


def averaged(spans: FloatArray) -> FloatArray:
    """Covariance of averages over these spans of time, (n, 2), where B is one, shape (n, n)."""
    start, end = spans.T
    gap = np.maximum(np.maximum.outer(start, start) - np.minimum.outer(end, end), 0.0)
    out, fallen = np.zeros((len(spans), len(spans))), np.exp(-gap / OCTAVES[-1])
    for tau in OCTAVES[::-1]:
        out += 0.5 * _relaxed(end - start, fallen, tau)  # h ln 2 = B²/2
        fallen *= fallen  # half the correlation time
    return out


def walked(spans: FloatArray) -> FloatArray:
    """Covariance of averages of a random walk over separate spans, with unit variance per second.

    It begins at zero at time zero, before all of them, shape (n, n).
    """
    start, end = spans.T
    middle = 0.5 * (start + end)
    out = np.minimum.outer(middle, middle)
    np.fill_diagonal(out, start + (end - start) / 3.0)
    return np.asarray(out)


def _relaxed(length: FloatArray, fallen: FloatArray, tau: float) -> FloatArray:
    """Covariance of averages of a Gauss–Markov process of variance one, shape (n, n).

    Args:
        length: of the spans of time, s, shape (n,).
        fallen: by how much the correlation falls off in the gap between two of them, shape (n, n).
        tau: correlation time, s.
    """
    share = np.maximum(length / tau, SHORTEST)
    mean = -np.expm1(-share) / share
    apart = fallen * mean
    apart *= mean[:, None]
    np.fill_diagonal(apart, 2.0 * (share + np.expm1(-share)) / share**2)
    return np.asarray(apart)


def about_the_mean(spans: FloatArray, kernel: Kernel) -> FloatArray:
    """Covariance of averages over spans of time about the mean from the first to the last one."""
    gaps = np.column_stack([spans[:-1, 1], spans[1:, 0]])
    shortest = 1e-9 * float(spans[-1, 1] - spans[0, 0])
    pieces = np.concatenate([spans, gaps[np.diff(gaps)[:, 0] > shortest]]) - spans[0, 0]
    covariance, length = kernel(pieces), pieces[:, 1] - pieces[:, 0]
    share, count = length / length.sum(), len(spans)
    with_mean = covariance[:count] @ share
    of_mean = float(share @ covariance @ share)
    own = covariance[:count, :count]
    return np.asarray(own - with_mean[:, None] - with_mean[None, :] + of_mean)


def flicker_between(spans: FloatArray) -> FloatArray:
    """A root of what flicker noise with a bias instability of one adds to holds, shape (n, m).

    About its mean over the session, and beyond the part that the noise within each hold contains.

    Args:
        spans: beginning and end of each hold in the order of time, s, shape (n, 2).
    """
    beyond = about_the_mean(spans, averaged) - WITHIN * np.eye(len(spans))
    values, vectors = np.linalg.eigh(beyond)
    shown = values > 0.0
    return np.asarray(vectors[:, shown] * np.sqrt(values[shown]))
