"""What slow errors of the holds do to the parameters of fits: covariance, intervals, weights."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.distributions import EXACT_FREEDOM, exceeded, outside
from imucal_wizard.model.rows.decorrelation import Decorrelation

MOST_LACKING = 1e3
"""Variance of what a model may leave over that by noise: a closure thirty times too large."""
SMALLEST_CHANCE = 1e-100
"""Of any model, so that its logarithm is a number."""
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
        still: which holds were at rest, where the device may move while others are measured, shape
            (n,); None where all were.
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
    still: BoolArray | None = None
    independent: Decorrelation = Decorrelation()
    own: FloatArray | None = None

    @property
    def white(self) -> FloatArray:
        """Variance of the white errors of each row but for a factor, shape (n,).

        What the fit finds beyond the measured noise is not the same in every row: it is what slow
        errors explain.
        """
        if self.own is None:
            return self.variance
        return np.maximum(self.own, self.variance / MOST_LACKING)

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


@dataclass(frozen=True, eq=False)
class SlowKind:
    """Slow errors of one kind, of each of s sizes.

    Attributes:
        weight: probability of each size, shape (s,).
        scale: variance of the white errors over ``Fitted.white``, of each fit, shape (f, s).
        size: variance of the slow errors of each fit, shape (f, s).
        slow: covariance of the holds by slow errors of size one, of each fit, shape (f, n, n).
        whole: the same of holds and what lies between them, as one axis has them, (n + m, n + m).
        white: share of what is left between the holds that is no slow error, shape (s,).
        shown: least share of them that a fit leaves in its errors and does not take up.
        long: whether they last as long as the session.
        again: how much likelier another session is to have them than the weights say.
    """

    weight: FloatArray
    scale: FloatArray
    size: FloatArray
    slow: FloatArray
    whole: FloatArray
    white: FloatArray
    shown: float
    long: bool
    again: float = 1.0

    def moving(self, k: int, one: Fitted, between: Between | None) -> tuple[FloatArray, FloatArray]:
        """By how much slow errors of fit ``k`` move each parameter, and their covariance.

        With what lies between the holds, where that is given.
        """
        if between is None:
            return one.pull_of_holds, self.slow[k]
        among = between.pull @ between.slow[k]
        return np.concatenate([one.pull_of_holds, among], axis=1), self.whole


@dataclass(frozen=True, eq=False)
class SlowErrors:
    """What the errors of a session's holds may be, each kind with its probability.

    Attributes:
        kinds: the kinds of slow errors.
        variance: of the white errors of each hold but for a factor, in each of the fits that tell
            these errors, shape (n,) each. Fits of other weights have the same errors.
        apart: whether repeats or a rest show slow errors apart from the model.
    """

    kinds: tuple[SlowKind, ...]
    variance: tuple[FloatArray, ...]
    apart: bool = False

    @property
    def measured(self) -> bool:
        """Whether the holds show slow errors of every kind apart from the model."""
        return all(kind.shown > MIN_LEFT_SHARE for kind in self.kinds if kind.long)

    def foreseen(
        self, fitted: Sequence[Fitted], between: Between | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """What the errors of another session with this sensor may be.

        That none of them is slow is left out where nothing shows them apart from the model: what
        is small in such a session may be so by chance, or taken up by the model.

        Args:
            fitted: the fits of the same holds, with any combinations in place of the parameters.
            between: rows between the holds, likewise.

        Returns:
            Probability of each kind and size of slow errors, shape (s,), and variance of the k
            combinations under each, shape (s, k).
        """
        shares, found = [], []
        first = 0 if self.apart else 1
        for kind in self.kinds:
            total = np.zeros((len(kind.weight), len(fitted[0].pull)))
            for k, one in enumerate(fitted):
                pull, slow = kind.moving(k, one, between)
                total += np.outer(kind.scale[k], one.pull**2 @ self.variance[k])
                total += np.outer(kind.size[k], ((pull @ slow) * pull).sum(axis=1))
            if between is not None:
                total += np.outer(kind.white, between.pull**2 @ between.variance)
            shares.append(kind.again * kind.weight[first:])
            found.append(total[first:])
        share = np.concatenate(shares)
        return np.asarray(share / share.sum()), np.concatenate(found)

    def scaled(self, factor: float) -> "SlowErrors":
        """The same in a unit of which the old one is so many."""
        kinds = tuple(replace(kind, size=factor**2 * kind.size) for kind in self.kinds)
        return replace(self, kinds=kinds, variance=tuple(factor**2 * v for v in self.variance))

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
                pull, slow = kind.moving(k, one, between)
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
