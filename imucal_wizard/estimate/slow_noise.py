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

from collections.abc import Callable, Sequence

import numpy as np

from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.estimate.noise import rate_noise
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
MIN_LONG_REST = 60.0
"""Seconds from which on a rest shows slow noise: twenty averages as long as a hold."""
PIECE = 3.0
"""Seconds of each of these averages."""
MOMENTS = 6
"""Parts of each of them, whose scatter is white noise."""
ALL_WHITE = 0.85, 0.6
"""Probability that no error of a session's holds is slow, where nothing measures slow noise and
where repeats or a long rest do: slow errors move the parameters less than white ones of the same
size, and without a measurement what a fit leaves hardly tells the two apart ..."""
FLICKER = 0.75
"""... and the probability that slow errors are flicker noise and not a random walk."""
PARTS = np.geomspace(0.1, 100.0, 13)
"""Variance of the slow part over that of the rest: from what no session shows to nearly all."""


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


@dataclass(frozen=True, eq=False)
class LongRest:
    """One rest in one direction, cut into pieces: it shows slow noise apart from any model.

    Attributes:
        spans: beginning and end of each piece, s, shape (m, 2).
        means: of the pieces on each axis, shape (m, 3).
        white: variance of each by what differs from one moment to the next, shape (3,).
    """

    spans: FloatArray
    means: FloatArray
    white: FloatArray

    def evidence(
        self, kernel: Callable[[FloatArray], FloatArray], squares: FloatArray
    ) -> FloatArray:
        """Logarithm of the likelihood of slow noise of each of these sizes, shape (k,)."""
        across = complement(np.ones((len(self.means), 1)))
        values, vectors = np.linalg.eigh(across.T @ kernel(self.spans - self.spans[0, 0]) @ across)
        turned = (vectors.T @ across.T @ self.means) ** 2
        slow = squares[:, None, None] * np.maximum(values, 0.0)[:, None]
        variance = self.white + slow
        return np.asarray(-0.5 * (np.log(variance) + turned / variance).sum(axis=(1, 2)))


def long_rest(series: Series, holds: Sequence[Hold], gain: float) -> LongRest | None:
    """The longest rest of a recording, if it is long enough to show slow noise.

    Args:
        series: readings of the accelerometer.
        holds: still periods.
        gain: SI per reading.
    """
    longest = max(holds, key=lambda hold: hold.end - hold.start)
    seconds = longest.end - longest.start
    if seconds < MIN_LONG_REST:
        return None
    inside = series.between(longest.start, longest.end)
    count = int(seconds / PIECE)
    moments = np.floor((inside.time - longest.start) / (seconds / (count * MOMENTS))).astype(int)
    moments = np.clip(moments, 0, count * MOMENTS - 1)
    number = np.bincount(moments, minlength=count * MOMENTS)
    if number.min() < 1:
        return None  # samples are missing
    centred = gain * (inside.values - longest.accelerometer)
    means = np.array([np.bincount(moments, axis) / number for axis in centred.T])
    means = means.reshape(3, count, MOMENTS)
    pieces = means.mean(axis=2)
    white = ((means - pieces[:, :, None]) ** 2).sum(axis=(1, 2)) / (count * (MOMENTS - 1) * MOMENTS)
    if not (white > 0.0).all():
        return None
    edges = longest.start + seconds / count * np.arange(count + 1)
    return LongRest(np.column_stack([edges[:-1], edges[1:]]), pieces.T, white)


@dataclass(frozen=True, eq=False)
class Fitted:
    """A linear fit of holds, each with its weight.

    Attributes:
        errors: what the fit leaves of each hold, shape (n,).
        columns: derivative by what was fitted, shape (n, p).
        variance: by whose inverse each hold was weighed, shape (n,).
        alike: which share of the same slow error two holds show, shape (n, n).
        pull: by how much an error of each hold moves each parameter, shape (k, n).
    """

    errors: FloatArray
    columns: FloatArray
    variance: FloatArray
    alike: FloatArray
    pull: FloatArray


def in_session(
    spans: FloatArray, fitted: Fitted, measured: bool, rest: LongRest | None = None
) -> FloatArray | None:
    """Covariance of the parameters, the bias being its mean over the session, shape (k, k).

    The errors of the holds are independent, with variances in the ratio of the weights, and part of
    them is slow: flicker noise or a random walk, less its mean over the session. Their size, and
    which part is slow, are told from what the fit leaves, by restricted likelihood. No prior knows
    the size, so that white errors have the intervals of least squares with Student's t.

    Args:
        spans: beginning and end of each hold, s, in the order of time, shape (n, 2).
        fitted: the fit.
        measured: whether repeats or a rest show slow noise apart from the model.
        rest: a rest so long that it shows slow noise by itself.

    Returns:
        The covariance; None where the fit leaves nothing to judge by.
    """
    sigma = np.sqrt(fitted.variance)
    across = complement(fitted.columns / sigma[:, None])
    freedom = across.shape[1]
    if not freedom:
        return None
    turned = across.T @ (fitted.errors / sigma)
    white = (fitted.pull * fitted.variance) @ fitted.pull.T
    logs, covariances = [], []
    for kernel, share in ((averaged, FLICKER), (walked, 1.0 - FLICKER)):
        whole = about_the_mean(spans, kernel)
        slow = whole * fitted.alike
        values, vectors = np.linalg.eigh(across.T @ (slow / np.outer(sigma, sigma)) @ across)
        values = np.maximum(values, 0.0)
        size = float(values.mean())
        if not size > 0.0:
            continue
        added = fitted.pull @ slow @ fitted.pull.T / size
        square = (vectors.T @ turned) ** 2
        parts = np.append(0.0, PARTS)
        all_white = ALL_WHITE[measured]
        prior = share * np.append(all_white, np.full(len(PARTS), (1.0 - all_white) / len(PARTS)))
        variance = 1.0 + np.outer(parts, values / size)
        scale = (square / variance).sum(axis=1) / freedom
        log = np.log(prior) - 0.5 * np.log(variance).sum(axis=1)
        log -= 0.5 * freedom * np.log(np.maximum(scale, np.finfo(float).tiny))
        if rest is not None:
            log += rest.evidence(kernel, scale * parts / size)
        logs.append(log)
        covariances.append(scale[:, None, None] * (white + parts[:, None, None] * added))
    if not logs:
        return np.asarray(white * float(turned @ turned) / freedom)
    log = np.concatenate(logs)
    weight = np.exp(log - log.max())
    return np.asarray(
        np.tensordot(weight / weight.sum(), np.concatenate(covariances), axes=1), np.float64
    )


def about_the_mean(spans: FloatArray, kernel: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Covariance of averages over spans of time about the mean from the first to the last one."""
    gaps = np.column_stack([spans[:-1, 1], spans[1:, 0]])
    pieces = np.concatenate([spans, gaps[gaps[:, 1] > gaps[:, 0]]]) - spans[0, 0]
    covariance, length = kernel(pieces), pieces[:, 1] - pieces[:, 0]
    share, count = length / length.sum(), len(spans)
    with_mean = covariance[:count] @ share
    of_mean = float(share @ covariance @ share)
    own = covariance[:count, :count]
    return np.asarray(own - with_mean[:, None] - with_mean[None, :] + of_mean)


def walked(spans: FloatArray) -> FloatArray:
    """Covariance of averages of a random walk over separate spans, with unit variance per second.

    It begins at zero at time zero, before all of them, shape (n, n).
    """
    start, end = spans.T
    middle = 0.5 * (start + end)
    out = np.minimum.outer(middle, middle)
    np.fill_diagonal(out, start + (end - start) / 3.0)
    return np.asarray(out)


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
    density = rate_noise(holds)
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
