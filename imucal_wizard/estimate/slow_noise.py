"""Slow noise of a bias: what it adds to the covariance of holds, estimated from their scatter.

A bias wanders (flicker noise, power h/f; its Allan deviation is flat at the bias instability
``B = √(2 ln 2 · h)``, IEEE 952, annex C). Its slowest part is the same in all holds of a session:
no residual shows it, and it lies wholly in the bias that is fitted. The faster part shows, and the
two belong together: a sum of Gauss–Markov processes, one per octave of the correlation time τ, each
of the variance ``h ln 2``. Averages over holds of T₁ and T₂ s, d s apart, then have the covariance

    h ln 2 Σ (τ²/T₁T₂) (1 − e^(−T₁/τ)) (1 − e^(−T₂/τ)) e^(−d/τ)

(of one hold with itself ``2 (τ/T)² (T/τ − 1 + e^(−T/τ))``). B is estimated from the
scatter of the holds (restricted likelihood).
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.distributions import EXACT_FREEDOM, exceeded, outside
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.model.rows.decorrelation import Decorrelation

OCTAVES = 0.3 * 2.0 ** np.arange(12)
"""Correlation times, s: 0.3 to 600. What is slower than a session is the bias that it has."""
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
WANDER_SECONDS = (1.0, 3.0, 10.0, 30.0)
"""Correlation times of what a place does to a sensor that is carried through it."""
MOST_LACKING = 1e3
"""Variance of what a model may leave over that by noise: a closure thirty times too large."""
SMALLEST_CHANCE = 1e-100
"""Of any model, so that its logarithm is a number."""
MEASURED_NOISE = 0.5
"""Probability that the white errors of holds are the noise measured within them and no more, where
that is known: else their size, which nothing measures, is any."""
LARGER = 60
"""Sizes of larger ones, up to ``MOST_LACKING``, each 12 % more in variance than the one before."""
MIN_SLOW_SHARE = 0.3
"""Variance of a combination of holds by slow noise over that by white noise, below which a fit does
not weigh it: the variance of the parameters is then at most 2.3²/(4 · 1.3) = 1.017 times the least
(Kantorovich)."""
MIN_SLOW_PROBABILITY = 0.01
"""A kind of slow errors less likely than this does not weigh the holds."""
MIN_LEFT_SHARE = 0.5
"""Share of slow errors, mean square, that the model does not take up, from which on they are
measured: what it takes up is then no more than what is seen of them."""
MIN_DETERMINED = 1e-9
"""Variance of a combination of parameters by white errors, over the largest, that is none."""
INTERVAL = 0.95
"""Probability in the intervals that are reported."""
FARTHEST = 16.0
"""Standard deviations that hold ``INTERVAL`` with one degree of freedom, and some more."""
LENGTH_HALVINGS = 20
"""Of such an interval: it is found to a hundred thousandth of the longest."""
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


@dataclass(frozen=True, eq=False)
class Fitted:
    """A linear fit of holds, each with its weight.

    Attributes:
        errors: what the fit leaves of each independent row, shape (n,).
        columns: derivative by what was fitted, shape (n, p).
        variance: by whose inverse each independent row was weighed, shape (n,).
        alike: which share of the same slow error two holds show, shape (n, n).
        pull: by how much an error of each independent row moves each parameter, shape (k, n).
        strength: by how much each hold moves with the strength of a field that is not the same
            everywhere and always, shape (n,); None where the input is gravity or rest.
        independent: how independent rows come from the holds.
        own: variance of each independent row by measured noise, shape (n,), which its white errors
            have at least; None where the white errors may be of any size.
    """

    errors: FloatArray
    columns: FloatArray
    variance: FloatArray
    alike: FloatArray
    pull: FloatArray
    strength: FloatArray | None = None
    independent: Decorrelation = Decorrelation()
    own: FloatArray | None = None

    @property
    def pull_of_holds(self) -> FloatArray:
        """By how much an error of each hold moves each parameter, shape (k, n)."""
        return self.independent.measured(self.pull.T).T


@dataclass(frozen=True, eq=False)
class Between:
    """Rows between the holds, which the same slow errors move; the holds give their size.

    Attributes:
        spans: beginning and end of what was measured, s, shape (m, 2).
        slow: derivative of the n rows by the mean error of each of the f fitted axes in each span,
            shape (f, n, m).
        pull: by how much an error of each row moves each parameter, shape (k, n).
        own: variance of each row by measured noise, shape (n,).
        variance: the same as the fit leaves it, slow errors included, shape (n,).
    """

    spans: FloatArray
    slow: FloatArray
    pull: FloatArray
    own: FloatArray
    variance: FloatArray

    def explained(
        self, slow: Sequence[FloatArray], sizes: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """How well the measured noise and slow errors of each size explain what the fit leaves.

        Either they make all of it (a χ² with the degrees of freedom of their sum after
        Satterthwaite), or the model lacks something beside them, of any size, which is as likely
        beforehand. Slow errors that would leave far more than is left are refuted by both.

        Args:
            slow: covariance of the rows by slow errors of size one on each axis, shape (n, n) each.
            sizes: their variances on each of the f axes, shape (f, k).

        Returns:
            Logarithm of the likelihood, and the share of what is left that is no slow error, both
            of shape (k,).
        """
        total, own = float(self.variance.sum()), float(self.own.sum())
        moved = sizes.T @ [np.trace(one) for one in slow]
        products = np.array([[(one * other).sum() for other in slow] for one in slow])
        crossed = sizes.T @ [np.diag(one) @ self.own for one in slow]
        squares = (sizes * (products @ sizes)).sum(axis=0) + 2.0 * crossed + self.own @ self.own
        half = 0.5 * (own + moved) ** 2 / squares
        ratio = total / (own + moved)
        gamma = np.array([math.lgamma(one) for one in half])
        whole = half * np.log(half) - gamma + half * (np.log(ratio) - ratio)
        # what lacks, of a size from nothing up, only adds to what they leave
        less = [1.0 - exceeded(r, 2.0 * h, EXACT_FREEDOM) for h, r in zip(half, ratio, strict=True)]
        lacking = np.log(np.maximum(less, SMALLEST_CHANCE) / math.log(MOST_LACKING))
        log = np.logaddexp(whole, lacking)
        least = min(own, total)
        white = np.exp(whole - log) * least
        white += np.exp(lacking - log) * np.maximum(total - moved, least)
        return log, white / total


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
        fitted: see ``slow_errors``.
        measured: see ``slow_errors``.
        rest: see ``slow_errors``.
        between: rows of what was measured between the holds.

    Returns:
        The covariance; None where a fit leaves nothing to judge by.
    """
    found = slow_errors(spans, fitted, measured, rest, between)
    return None if found is None else found.covariance(fitted, between)


@dataclass(frozen=True, eq=False)
class SlowKind:
    """Slow errors of one kind, of each of s sizes.

    Attributes:
        weight: probability of each size, shape (s,).
        scale: variance of the white errors over that of the weights, of each fit, shape (f, s).
        size: variance of the slow errors of each fit, shape (f, s).
        slow: covariance of the holds by slow errors of size one, of each fit, shape (f, n, n).
        whole: the same of holds and what lies between them, as one axis has them, (n + m, n + m).
        white: share of what is left between the holds that is no slow error, shape (s,).
        shown: least share of them that a fit leaves in its errors and does not take up.
        long: whether they last as long as the session.
    """

    weight: FloatArray
    scale: FloatArray
    size: FloatArray
    slow: FloatArray
    whole: FloatArray
    white: FloatArray
    shown: float
    long: bool


@dataclass(frozen=True, eq=False)
class SlowErrors:
    """What the errors of a session's holds may be, each kind with its probability.

    Attributes:
        kinds: the kinds of slow errors.
        variance: by whose inverse each hold was weighed in each of the fits that tell these errors,
            shape (n,) each. Fits of other weights have the same errors.
    """

    kinds: tuple[SlowKind, ...]
    variance: tuple[FloatArray, ...]

    @property
    def measured(self) -> bool:
        """Whether the holds show slow errors of every kind apart from the model."""
        return all(kind.shown > MIN_LEFT_SHARE for kind in self.kinds if kind.long)

    def foreseen(
        self, fitted: Sequence[Fitted], between: Between | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """What the errors of another session with this sensor may be.

        That none of them is slow is left out: a session in which slow errors happened to be small
        does not show that the next one has none.

        Args:
            fitted: the fits of the same holds, with any combinations in place of the parameters.
            between: rows between the holds, likewise.

        Returns:
            Probability of each kind and size of slow errors, shape (s,), and variance of the k
            combinations under each, shape (s, k).
        """
        shares, found = [], []
        for kind in self.kinds:
            total = np.zeros((len(kind.weight), len(fitted[0].pull)))
            for k, one in enumerate(fitted):
                pull, slow = one.pull_of_holds, kind.slow[k]
                if between is not None:
                    pull = np.concatenate([pull, between.pull @ between.slow[k]], axis=1)
                    slow = kind.whole
                total += np.outer(kind.scale[k], one.pull**2 @ self.variance[k])
                total += np.outer(kind.size[k], ((pull @ slow) * pull).sum(axis=1))
            if between is not None:
                total += np.outer(kind.white, between.pull**2 @ between.variance)
            shares.append(kind.weight[1:])
            found.append(total[1:])
        share = np.concatenate(shares)
        return np.asarray(share / share.sum()), np.concatenate(found)

    def scaled(self, factor: float) -> "SlowErrors":
        """The same in a unit of which the old one is so many."""
        kinds = tuple(replace(kind, size=factor**2 * kind.size) for kind in self.kinds)
        return SlowErrors(kinds, tuple(factor**2 * one for one in self.variance))

    def loading(self, independent: Decorrelation) -> FloatArray:
        """By how much the latent slow errors that matter move the holds of the one fit, (n, m).

        What weighs the holds is the mean of the inverse covariances: a large error that is hardly
        likely then takes little away from the information in a combination of holds.

        Args:
            independent: how the independent rows of the fit come from its holds.
        """
        sigma, slow = np.sqrt(self.variance[0]), [float(one.weight[1:].sum()) for one in self.kinds]
        if sum(slow) < MIN_SLOW_SHARE / (1.0 + MIN_SLOW_SHARE):
            return np.zeros((len(sigma), 0))  # however large they are, they take away too little
        weight = np.zeros((len(sigma), len(sigma)))
        for kind, share in zip(self.kinds, slow, strict=True):
            if share < MIN_SLOW_PROBABILITY:
                weight[np.diag_indices_from(weight)] += (kind.weight / kind.scale[0]).sum()
                continue
            mixed = independent.rows(independent.rows(kind.slow[0]).T)
            values, vectors = np.linalg.eigh(mixed / np.outer(sigma, sigma))
            of_each = kind.scale[0] + np.outer(np.maximum(values, 0.0), kind.size[0])
            weight += (vectors * (kind.weight / of_each).sum(axis=1)) @ vectors.T
        values, vectors = np.linalg.eigh(weight)
        beyond = 1.0 / values - 1.0 / values[-1]
        shown = beyond * values[-1] > MIN_SLOW_SHARE
        return independent.measured(sigma[:, None] * vectors[:, shown] * np.sqrt(beyond[shown]))

    def covariance(self, fitted: Sequence[Fitted], between: Between | None = None) -> FloatArray:
        """Of the parameters, shape (k, k).

        Args:
            fitted: the fits, of any weights, of the same holds.
            between: rows between the holds.
        """
        total = np.zeros((1, 1))
        for kind in self.kinds:
            for k, one in enumerate(fitted):
                pull, slow = one.pull_of_holds, kind.slow[k]
                if between is not None:
                    pull = np.concatenate([pull, between.pull @ between.slow[k]], axis=1)
                    slow = kind.whole
                variance = kind.weight @ kind.scale[k] * self.variance[k]
                total = total + (one.pull * variance) @ one.pull.T
                total = total + kind.weight @ kind.size[k] * pull @ slow @ pull.T
            if between is not None:
                white = (between.pull * between.variance) @ between.pull.T
                total = total + kind.weight @ kind.white * white
        return np.asarray(total, np.float64)

    def covariance_of_intervals(self, fitted: Fitted, freedom: float) -> FloatArray:
        """Of the parameters of one fit, for intervals that hold 95 % of all probability, (k, k).

        An error that is large but hardly likely makes the mean of the covariances larger than any
        such interval asks for. In each principal direction of that mean, by the white errors, the
        interval of all kinds and sizes together has the length that this covariance gives it.

        Args:
            fitted: the fit, of any weights, of the same holds.
            freedom: degrees of freedom of its residuals, with which Student's t is used.
        """
        white = (fitted.pull * self.variance[0]) @ fitted.pull.T
        unit = np.sqrt(np.diag(white))
        unit = np.where(unit > 0.0, unit, 1.0)
        values, vectors = np.linalg.eigh(white / np.outer(unit, unit))
        some = values > MIN_DETERMINED * values.max(initial=np.finfo(float).tiny)
        root = unit[:, None] * vectors[:, some] * np.sqrt(values[some])
        pull = (vectors[:, some] / unit[:, None] / np.sqrt(values[some])).T @ fitted.pull_of_holds
        slow = [pull @ kind.slow[0] @ pull.T for kind in self.kinds]
        sizes = [float(kind.weight @ kind.size[0]) for kind in self.kinds]
        _, main = np.linalg.eigh(np.einsum("k,kij->ij", sizes, slow))
        variance = [
            kind.scale[0][:, None] + np.outer(kind.size[0], ((main.T @ s) * main.T).sum(axis=1))
            for kind, s in zip(self.kinds, slow, strict=True)
        ]
        weight = np.concatenate([kind.weight for kind in self.kinds])
        length = _reach(weight, np.concatenate(variance), freedom)
        root = root @ main * (length / _reach(np.ones(1), np.ones((1, 1)), freedom))
        return np.asarray(root @ root.T)


def _reach(weight: FloatArray, variance: FloatArray, freedom: float) -> FloatArray:
    """How far intervals reach that hold 95 % of a mixture of Student's distributions, shape (r,).

    Args:
        weight: probability of each of k parts, shape (k,).
        variance: of each of r variables in each part, shape (k, r).
        freedom: degrees of freedom of all.
    """
    sigma = np.sqrt(np.maximum(variance, np.finfo(float).tiny))
    low, high = np.zeros(sigma.shape[1]), FARTHEST * sigma.max(axis=0)
    for _ in range(LENGTH_HALVINGS):
        middle = 0.5 * (low + high)
        beyond = weight @ outside(middle / sigma, freedom) > 1.0 - INTERVAL
        low, high = np.where(beyond, middle, low), np.where(beyond, high, middle)
    return np.asarray(0.5 * (low + high))


def slow_errors(
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
    count, every = len(spans), spans if between is None else np.concatenate([spans, between.spans])
    order = np.argsort(every[:, 0], kind="stable")
    place = np.argsort(order)
    of_field = any(one.strength is not None for one in fitted)
    all_white = ALL_WHITE_OF_FIELD if of_field else ALL_WHITE[measured]
    of_parts = np.append(all_white, np.full(len(PARTS), (1.0 - all_white) / len(PARTS)))
    sigmas = [np.sqrt(one.variance) for one in fitted]
    left = [
        complement(one.columns / sigma[:, None]) for one, sigma in zip(fitted, sigmas, strict=True)
    ]
    if not all(across.shape[1] for across in left):
        return None
    kinds = []
    for ordered, chance, kernel, of_strength in _slow_errors(every[order], of_field):
        log = np.log(chance * of_parts)
        whole = ordered[np.ix_(place, place)]
        scales, sizes, slows, shown = [], [], [], []
        for k, (one, sigma, across) in enumerate(zip(fitted, sigmas, left, strict=True)):
            slow = whole[:count, :count] * (_strengths(one) if of_strength else one.alike)
            mixed = one.independent.rows(one.independent.rows(slow).T)
            evidence, scale, size, left_in = _explained(
                one.errors / sigma, mixed / np.outer(sigma, sigma), across
            )
            log += evidence
            if one.own is not None:
                least = float(np.mean(one.own / one.variance))
                log += _with_measured_noise(scale / least, across.shape[1])
            shown.append(left_in)
            sizes.append(size)
            if rest is not None and kernel is not None:
                axes = slice(k, k + 1) if len(fitted) > 1 else slice(None)
                log += rest.evidence(kernel, sizes[k], axes)
            scales.append(scale)
            slows.append(slow)
        share = np.ones(len(of_parts))
        if between is not None:
            among = [moved @ whole[count:, count:] @ moved.T for moved in between.slow]
            evidence, share = between.explained(among, np.array(sizes))
            log += evidence
        of_each = np.array(scales), np.array(sizes), np.array(slows)
        long = of_strength or kernel is not None
        kinds.append(SlowKind(log, *of_each, whole, share, min(shown), long))
    highest = max(float(kind.weight.max()) for kind in kinds)  # a logarithm until here
    total = sum(float(np.exp(kind.weight - highest).sum()) for kind in kinds)
    return SlowErrors(
        tuple(replace(kind, weight=np.exp(kind.weight - highest) / total) for kind in kinds),
        tuple(one.variance for one in fitted),
    )


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


def _slow_errors(
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


def _strengths(one: Fitted) -> FloatArray:
    """By how much the same strength of the field moves two rows, shape (n, n)."""
    strength = np.zeros(len(one.errors)) if one.strength is None else one.strength
    return np.multiply.outer(strength, strength)


def about_the_mean(spans: FloatArray, kernel: Callable[[FloatArray], FloatArray]) -> FloatArray:
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


def walked(spans: FloatArray) -> FloatArray:
    """Covariance of averages of a random walk over separate spans, with unit variance per second.

    It begins at zero at time zero, before all of them, shape (n, n).
    """
    start, end = spans.T
    middle = 0.5 * (start + end)
    out = np.minimum.outer(middle, middle)
    np.fill_diagonal(out, start + (end - start) / 3.0)
    return np.asarray(out)


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


def averaged(spans: FloatArray) -> FloatArray:
    """Covariance of averages over these spans of time, (n, 2), where B is one, shape (n, n)."""
    start, end = spans.T
    gap = np.maximum(np.maximum.outer(start, start) - np.minimum.outer(end, end), 0.0)
    out, fallen = np.zeros((len(spans), len(spans))), np.exp(-gap / OCTAVES[-1])
    for tau in OCTAVES[::-1]:
        out += 0.5 * relaxed(end - start, fallen, tau)  # h ln 2 = B²/2
        fallen *= fallen  # half the correlation time
    return out


def relaxed(length: FloatArray, fallen: FloatArray, tau: float) -> FloatArray:
    """Covariance of averages of a Gauss–Markov process of variance one, shape (n, n).

    Args:
        length: of the spans of time, s, shape (n,).
        fallen: by how much the correlation falls off in the gap between two of them, shape (n, n).
        tau: correlation time, s.
    """
    share = length / tau
    mean = -np.expm1(-share) / share
    apart = fallen * mean
    apart *= mean[:, None]
    np.fill_diagonal(apart, 2.0 * (share + np.expm1(-share)) / share**2)
    return np.asarray(apart)


def complement(columns: FloatArray) -> FloatArray:
    """Orthonormal basis of what no combination of columns makes, shape (n, n − rank)."""
    left, values, _ = np.linalg.svd(columns, full_matrices=True)
    rank = int((values > 1e-9 * values.max(initial=0.0)).sum())
    return np.asarray(left[:, rank:])
