"""Slow noise of a bias, estimated from what the fits of a session leave (restricted likelihood)."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import complement
from imucal_wizard.estimate.slow_errors import MOST_LACKING, Between, Fitted, SlowErrors, SlowKind
from imucal_wizard.estimate.slow_kernels import about_the_mean, averaged, relaxed, walked
from imucal_wizard.measurement.holds import Hold

MIN_REPEATS_OF_POSES = 4
"""Repeats of poses that show how the biases change with time."""
MIN_LONG_REST = 60.0
"""Seconds from which on a rest shows slow noise: twenty averages as long as a hold."""
PIECE = 3.0
"""Seconds of each of these averages."""
MOMENTS = 6
"""Parts of each of them, whose scatter is white noise."""
ALL_WHITE = 0.85, 0.6
"""Probability that no error of a session's holds is slow, where nothing measures slow noise and
where repeats or a long rest do: slow errors move the parameters less than white ones of the same
size, and without a measurement the residuals hardly distinguish the two."""
ALL_WHITE_OF_FIELD = 0.6
"""The same of a magnetometer, whose many rows are near in time, in a field that is hardly the same
everywhere and always. No residual shows what its model takes up of slow errors: the value lies
between 0.3, with which the intervals under white noise are too long, and 0.85, with which those of
circles under flicker noise are too short."""
FLICKER = 0.75
"""And the probability that slow errors are flicker noise and not a random walk."""
WANDER_SECONDS = (1.0, 3.0, 10.0)
"""Correlation times of what a place does to a sensor that is carried through it. What lasts longer
is like a random walk of the bias, whose mean over the session belongs to the bias."""
MEASURED_NOISE = 0.5
"""Probability that the white errors of holds are the noise measured within them and no more, where
that is known: else their size, which nothing measures, is any."""
LARGER = 60
"""Sizes of larger ones, up to ``MOST_LACKING``, each 12 % more in variance than the one before."""
PARTS = np.geomspace(0.1, 100.0, 13)
"""Variance of the slow part over that of the rest: from what no session shows to nearly all."""


def spans_of(holds: Sequence[Hold]) -> FloatArray:
    """Beginning and end of each hold, s, shape (n, 2)."""
    return np.array([[hold.start, hold.end] for hold in holds])


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
        self, kernel: Callable[[FloatArray], FloatArray], squares: FloatArray, axes: slice
    ) -> FloatArray:
        """Logarithm of the likelihood of slow noise of each of these sizes, shape (k,).

        Args:
            kernel: covariance of averages by slow noise of size one.
            squares: squares of the sizes, shape (k,).
            axes: whose slow noise has these sizes.
        """
        across = complement(np.ones((len(self.means), 1)))
        values, vectors = np.linalg.eigh(across.T @ kernel(self.spans - self.spans[0, 0]) @ across)
        turned = (vectors.T @ across.T @ self.means[:, axes]) ** 2
        slow = squares[:, None, None] * np.maximum(values, 0.0)[:, None]
        variance = self.white[axes] + slow
        return np.asarray(-0.5 * (np.log(variance) + turned / variance).sum(axis=(1, 2)))


def long_rest(series: Series, holds: Sequence[Hold], matrix: FloatArray) -> LongRest | None:
    """The longest rest of a recording, if it is long enough to show slow noise.

    Args:
        series: readings of the sensor.
        holds: still periods.
        matrix: SI per reading, shape (3, 3).
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
    centred = (inside.values - inside.values.mean(axis=0)) @ matrix.T
    means = np.array([np.bincount(moments, axis) / number for axis in centred.T])
    means = means.reshape(3, count, MOMENTS)
    pieces = means.mean(axis=2)
    white = ((means - pieces[:, :, None]) ** 2).sum(axis=(1, 2)) / (count * (MOMENTS - 1) * MOMENTS)
    if not (white > 0.0).all():
        return None
    edges = longest.start + seconds / count * np.arange(count + 1)
    return LongRest(np.column_stack([edges[:-1], edges[1:]]), pieces.T, white)


def estimate_slow_errors(
    spans: FloatArray,
    fitted: Sequence[Fitted],
    measured: bool,
    rest: LongRest | None = None,
    between: Between | None = None,
) -> SlowErrors | None:
    """Tell slow errors from what fits leave.

    The errors of the holds are independent, with variances in the ratio of the weights, and part of
    them is slow: flicker noise or a random walk, less its mean over the session. Of a field it may
    also be the strength that drifts, or what differs from place to place, which is no part of the
    bias and counts in full. Their size, and which part is slow, are estimated from the residuals
    by restricted likelihood. No prior knows the size, so that white errors have the intervals of
    least squares with Student's t; which part is slow is judged by measured noise too, where it is
    given: residuals that it explains leave little to slow errors.

    Args:
        spans: beginning and end of each hold, s, shape (n, 2).
        fitted: the fit of each axis, or of the magnitude; the slow part of all is the same share,
            and the errors of one are independent of those of another.
        measured: whether repeats or a rest show slow noise apart from the model.
        rest: a rest so long that it shows slow noise by itself.
        between: rows of what was measured between the holds.

    Returns:
        None where a fit leaves nothing to judge by.
    """
    every = spans if between is None else np.concatenate([spans, between.spans])
    of_field = any(one.strength is not None for one in fitted)
    left = [complement(one.columns / np.sqrt(one.variance)[:, None]) for one in fitted]
    if not all(across.shape[1] for across in left):
        return None
    all_white = ALL_WHITE_OF_FIELD if of_field else ALL_WHITE[measured]
    of_parts = np.append(all_white, np.full(len(PARTS), (1.0 - all_white) / len(PARTS)))
    order = np.argsort(every[:, 0], kind="stable")
    place = np.argsort(order)
    kinds = []
    for ordered, chance, kernel, of_strength in _kinds(every[order], of_field):
        kind = _kind(ordered[np.ix_(place, place)], fitted, left, of_strength, between)
        log = kind.weight + np.log(chance * of_parts)
        if rest is not None and kernel is not None:
            for k, size in enumerate(kind.size):
                axes = slice(k, k + 1) if len(fitted) > 1 else slice(None)
                log += rest.evidence(kernel, size, axes)
        kinds.append(replace(kind, weight=log, long=of_strength or kernel is not None))
    highest = max(float(kind.weight.max()) for kind in kinds)
    total = sum(float(np.exp(kind.weight - highest).sum()) for kind in kinds)
    return SlowErrors(
        tuple(replace(kind, weight=np.exp(kind.weight - highest) / total) for kind in kinds),
        tuple(one.variance for one in fitted),
    )


def _kind(
    whole: FloatArray,
    fitted: Sequence[Fitted],
    left: Sequence[FloatArray],
    of_strength: bool,
    between: Between | None,
) -> SlowKind:
    """Slow errors of one kind, with the logarithm of their likelihood as their weight.

    Args:
        whole: covariance by slow errors of size one of holds and what lies between them.
        fitted: see ``estimate_slow_errors``.
        left: combinations of the holds that each fit does not move, shape (n, f).
        of_strength: whether they are errors of the field's strength.
        between: see ``estimate_slow_errors``.
    """
    count = len(fitted[0].alike)
    log, share = np.zeros(1 + len(PARTS)), np.ones(1 + len(PARTS))
    scales, sizes, slows, shown = [], [], [], []
    for one, across in zip(fitted, left, strict=True):
        slow = whole[:count, :count] * (_strengths(one) if of_strength else one.alike)
        mixed = one.independent.rows(one.independent.rows(slow).T)
        sigma = np.sqrt(one.variance)
        evidence, scale, size, left_in = _explained(
            one.errors / sigma, mixed / np.outer(sigma, sigma), across
        )
        log += evidence
        if one.own is not None:
            least = float(np.mean(one.own / one.variance))
            log += _with_measured_noise(scale / least, across.shape[1])
        scales.append(scale)
        sizes.append(size)
        slows.append(slow)
        shown.append(left_in)
    if between is not None:
        among = [moved @ whole[count:, count:] @ moved.T for moved in between.slow]
        evidence, share = between.explained(among, np.array(sizes))
        log += evidence
    of_each = np.array(scales), np.array(sizes), np.array(slows)
    return SlowKind(log, *of_each, whole, share, min(shown), long=False)


def _kinds(
    spans: FloatArray, of_field: bool
) -> Iterator[tuple[FloatArray, float, Callable[[FloatArray], FloatArray] | None, bool]]:
    """Covariance of the averages by each kind of slow error, its probability, and its kernel.

    Last, whether it is one of the field's strength; else it is one of the bias.
    """
    of_bias = 1.0 / 3.0 if of_field else 1.0
    yield about_the_mean(spans, averaged), of_bias * FLICKER, averaged, False
    by_walk = about_the_mean(spans, walked)
    yield by_walk, of_bias * (1.0 - FLICKER), walked, False
    if of_field:
        yield by_walk, 1.0 / 3.0, None, True
        start, end = spans.T
        gap = np.maximum(np.maximum.outer(start, start) - np.minimum.outer(end, end), 0.0)
        for tau in WANDER_SECONDS:
            of_places = relaxed(end - start, np.exp(-gap / tau), tau)
            yield of_places, 1.0 / 3.0 / len(WANDER_SECONDS), None, False


def _explained(
    errors: FloatArray, slow: FloatArray, across: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """How well white and slow errors explain what a fit leaves, for each share of the slow part.

    Args:
        errors: what it leaves of each hold, over its standard deviation, shape (n,).
        slow: covariance of the slow part of size one, likewise, shape (n, n).
        across: combinations of the holds that the fit does not move, shape (n, f).

    Returns:
        Logarithm of the restricted likelihood, variance of the white part over that assumed, and
        variance of the slow part, each of shape (k,); the share of the slow part that the fit
        leaves in the errors.
    """
    freedom, parts = across.shape[1], np.append(0.0, PARTS)
    values, vectors = np.linalg.eigh(across.T @ slow @ across)
    values = np.maximum(values, 0.0)
    shown = bool(values.any())  # spans without an order in time show nothing
    size = float(values.mean()) if shown else 1.0
    square = (vectors.T @ (across.T @ errors)) ** 2
    variance = 1.0 + np.outer(parts, values / size)
    scale = (square / variance).sum(axis=1) / freedom
    log = -0.5 * np.log(variance).sum(axis=1)
    log -= 0.5 * freedom * np.log(np.maximum(scale, np.finfo(float).tiny))
    left_in = float(values.sum()) / max(float(np.trace(slow)), np.finfo(float).tiny)
    return log, scale, scale * shown * parts / size, left_in


def _with_measured_noise(ratio: FloatArray, freedom: int) -> FloatArray:
    """How well measured noise explains white errors of each of these sizes, shape (k,).

    White errors are either the measured noise or larger, by any factor alike in its logarithm.
    With white errors of a fixed size the likelihood has this over what it has with the size that
    fits best.

    Args:
        ratio: variance of the white part that fits best, over that of measured noise, shape (k,).
        freedom: degrees of freedom of the residuals.
    """
    ratio = np.maximum(ratio, np.finfo(float).tiny)
    larger = ratio / np.geomspace(1.0, MOST_LACKING, LARGER)[:, None]
    measured, each = (0.5 * freedom * (np.log(one) + 1.0 - one) for one in (ratio, larger))
    some = np.logaddexp.reduce(each, axis=0) - math.log(LARGER)
    known, any_size = math.log(MEASURED_NOISE), math.log1p(-MEASURED_NOISE)
    return np.asarray(np.logaddexp(known + measured, any_size + some))


def _strengths(one: Fitted) -> FloatArray:
    """By how much the same strength of the field moves two rows, shape (n, n)."""
    strength = np.zeros(len(one.errors)) if one.strength is None else one.strength
    return np.multiply.outer(strength, strength)


def in_session(
    spans: FloatArray,
    fitted: Sequence[Fitted],
    measured: bool,
    rest: LongRest | None = None,
    between: Between | None = None,
) -> FloatArray | None:
    """Covariance of the parameters, the bias being its mean over the session, shape (k, k).

    Args:
        spans: beginning and end of each hold, s, shape (n, 2).
        fitted: see ``estimate_slow_errors``.
        measured: see ``estimate_slow_errors``.
        rest: see ``estimate_slow_errors``.
        between: rows of what was measured between the holds.

    Returns:
        The covariance; None where a fit leaves nothing to judge by.
    """
    found = estimate_slow_errors(spans, fitted, measured, rest, between)
    return None if found is None else found.covariance(fitted, between)


def slow_rate(holds: Sequence[Hold], shares: FloatArray | None = None) -> FloatArray:
    """By how much slow noise makes the mean rate over holds less certain, reading units², (3,).

    On top of what follows from their scatter.

    Args:
        holds: still periods with a gyroscope.
        shares: with which share each hold is in that mean, shape (n,); all alike by default.
    """
    spans, count = spans_of(holds), len(holds)
    means = np.array([hold.gyroscope for hold in holds])
    noise = 1.0 / (spans[:, 1] - spans[:, 0])
    ones, alike = np.ones((count, 1)), np.ones((count, count))
    shares = ones[:, 0] / count if shares is None else shares
    left = means - means.T @ (1.0 / noise) / (1.0 / noise).sum()
    axes = [
        Fitted(left[:, k], ones, noise, alike, np.outer(np.eye(3)[k], shares)) for k in range(3)
    ]
    whole = in_session(spans, axes, measured=True)
    if whole is None:
        return np.zeros(3)
    scatter = (left**2 / noise[:, None]).sum(axis=0) / (count - 1)
    return np.asarray(np.maximum(np.diag(whole) - scatter * float(shares**2 @ noise), 0.0))
