"""The effects that a model contains, as columns of one matrix with a prior on each."""

import itertools
from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.effect import Circumstances, Effect, EffectParameter


@dataclass(frozen=True)
class Term:
    """An effect in a model.

    Attributes:
        effect: which.
        variant: its setting of what is not linear in it, or None for the usual one.
    """

    effect: Effect
    variant: float | None = None

    @property
    def name(self) -> str:
        """The effect's name, as in the contract."""
        return self.effect.name


class Terms:
    """The effects of one sensor's model side by side: ``ε = Σ columns · sizes``.

    Attributes:
        sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
        terms: the effects.
        parameters: all their parameters in order, p of them.
        names: of the parameters, ``second-order_x``; a term that is there twice is numbered.
        precision: 1 / variance of the prior of each size, (1 / shown unit)², shape (p,).
    """

    def __init__(self, sensor: str, terms: Sequence[Term]) -> None:
        for term in terms:
            if sensor not in term.effect.sensors:
                raise UsageError(f"{term.name} is no effect of the {sensor}")
        self.sensor = sensor
        self.terms = tuple(terms)
        self._each = [term.effect.parameters(sensor) for term in terms]
        self.parameters: tuple[EffectParameter, ...] = tuple(p for each in self._each for p in each)
        self.names = tuple(self._names())
        typical = [one for t in terms for one in t.effect.typical(sensor, t.variant)]
        self.precision = np.array([_precision(one) for one in typical])

    def __len__(self) -> int:
        return len(self.parameters)

    def columns(self, c: Circumstances) -> FloatArray:
        """Error of the input per shown unit of each size, SI or µT, shape (n, 3, p)."""
        return columns_of(self.terms, self.sensor, c)

    @property
    def groups(self) -> tuple[slice, ...]:
        """Which parameters belong to each term."""
        ends = np.cumsum([0, *(len(each) for each in self._each)]).tolist()
        return tuple(slice(*pair) for pair in itertools.pairwise(ends))

    @property
    def open_groups(self) -> tuple[slice, ...]:
        """The groups whose sizes are quantities of their own, which those of a curve are not."""
        return tuple(
            group
            for term, group in zip(self.terms, self.groups, strict=True)
            if not term.effect.free
        )

    def split(self, sizes: FloatArray) -> tuple[FloatArray, ...]:
        """Sizes (…, p) term by term."""
        return tuple(sizes[..., group] for group in self.groups)

    def settings(self, without: Sequence[str] = ()) -> int:
        """How many settings the data chose, but for those of some effects."""
        return sum(one.variant is not None and one.name not in without for one in self.terms)

    def within_gauge(self, covariance: FloatArray) -> FloatArray:
        """Covariance of the sizes, (p, p), without what they have by convention only."""
        kept = np.eye(len(self))
        for term, own in zip(self.terms, self.groups, strict=True):
            if term.effect.gauge:
                fixed = np.array(term.effect.gauge).T
                kept[own, own] -= fixed @ np.linalg.pinv(fixed)
        return np.asarray(kept @ covariance @ kept)

    def _names(self) -> list[str]:
        seen: Counter[str] = Counter()
        names = []
        for term, each in zip(self.terms, self._each, strict=True):
            seen[term.name] += 1
            number = f"-{seen[term.name]}" if seen[term.name] > 1 else ""
            names += [f"{term.name}{number}_{parameter.name}" for parameter in each]
        return names


def columns_of(terms: Sequence[Term], sensor: str, c: Circumstances) -> FloatArray:
    """Error of the input per shown unit of the parameters of effects in turn, shape (n, 3, p).

    Raises:
        DataError: an effect has no value for some of the data.
    """
    each = [_finite(term, term.effect.columns(sensor, c, term.variant)) for term in terms]
    # one parameter after the other in memory: the inputs of each are then copied in one piece
    found = np.empty((sum(one.shape[2] for one in each), len(c), 3))
    first = 0
    for one in each:
        found[first : first + one.shape[2]] = one.transpose(2, 0, 1)
        first += one.shape[2]
    return found.transpose(1, 2, 0)


def axis_columns_of(term: Term, sensor: str, c: Circumstances) -> FloatArray | None:
    """See ``Effect.axis_columns``.

    Raises:
        DataError: as ``columns_of``.
    """
    own = term.effect.axis_columns(sensor, c, term.variant)
    return None if own is None else _finite(term, own)


def _finite(term: Term, values: FloatArray) -> FloatArray:
    if not np.isfinite(values).all():
        raise DataError(
            f"{term.name} has no value for some of these data: what it depends on was not "
            "recorded, or its formula divides by zero or takes a root of what is negative"
        )
    return np.asarray(values, np.float64)


def _precision(typical: float) -> float:
    """Of the Gaussian prior; 0 for a parameter of which nothing is known."""
    return typical**-2 if 0.0 < typical < np.inf else 0.0


WIDE_PRIOR = 100.0
"""By how much the variance of a prior is widened to begin with."""


def widened(precision: FloatArray, sizes: FloatArray, groups: Sequence[slice]) -> FloatArray:
    """Precision of the priors, less where the sizes of a term go far beyond what is typical.

    A sensor may be worse than a consumer part. The variance of a term's prior is then the mean
    square of its sizes: below it nothing changes, and above it only sizes that are some 2 √p times
    their standard error can keep it wide.
    """
    out = precision.copy()
    for group in groups:
        out[group] /= max(1.0, float(np.mean(precision[group] * sizes[group] ** 2)))
    return out


OPEN_SHARE = 0.05
"""Share of its prior's variance that the rows leave of a size, at which its own width counts half:
a standard error of a fifth of the prior's."""


def widened_where_open(
    precision: FloatArray, sizes: FloatArray, groups: Sequence[slice], covariance: FloatArray
) -> FloatArray:
    """Precision of the priors, less where large sizes are shown together only.

    Of sizes of which the rows show a combination, like ``a + b``, the prior alone tells how far
    each may be from its part. One of them may make all of it, and the other sizes of the term
    nothing: the width follows from these sizes, as the sum of the squares of what the rows show of
    them over the number of combinations that the rows show. If one of k sizes makes all of their
    sum, it is about √k − 1/√k standard errors from its part.

    Args:
        precision: of the priors, one width for each term, shape (p,).
        sizes: shape (p,).
        groups: the terms whose sizes are quantities of their own.
        covariance: of the sizes with these priors, shape (p, p).
    """
    out = precision.copy()
    for group in groups:
        root = np.sqrt(precision[group])
        open_share = root[:, None] * covariance[group, group] * root
        shown = np.eye(len(root)) - open_share
        shown = shown @ shown
        alike, left = open_share**2, np.diag(open_share)
        seen, number = alike @ (shown @ (root * sizes[group])) ** 2, alike @ np.diag(shown)
        own = seen / np.maximum(number, np.finfo(float).tiny)
        out[group] /= np.maximum(1.0, own * left / (left + OPEN_SHARE))
    return out


MAX_PASSES = 30
"""Of the fixed point by which readings are corrected."""
CONVERGED = 1e-13
"""Change at which it is reached, as a share of the largest reading."""
MAX_RATIO = 0.5
"""Of one change to the one before, above which Newton's steps are taken: where an error grows about
as fast as the input, the fixed point is reached slowly or never."""
MIN_DETERMINANT = 1e-3
"""Of the slope of what is solved, below which it has no inverse worth a step."""
MAX_STEP_HALVINGS = 5
STEP = 1e-4
"""For the derivative of ε by x, as a share of the largest x."""


def true_input(
    linear: FloatArray, error: Callable[[FloatArray], FloatArray], scale: float
) -> FloatArray:
    """``x = linear − error(x)``; far away, infinite or NaN where there is none.

    Args:
        linear: ``M (y − b)``, SI, shape (n, 3).
        error: of the true input x, SI, shape (n, 3) to (n, 3).
        scale: of the inputs, SI.
    """
    found, before = linear, np.inf
    for _ in range(MAX_PASSES):
        with np.errstate(over="ignore", invalid="ignore"):
            step = linear - error(found) - found
        change = _largest(step)
        if MAX_RATIO * before < change < np.inf:
            return _by_newton(linear, error, found, scale)
        found = found + step
        if change <= CONVERGED * scale:
            break
        before = change
    return found


def _largest(values: FloatArray) -> float:
    """Of the sizes; NaN, of samples that are missing, does not count."""
    return float(np.fmax.reduce(np.abs(values), axis=None, initial=0.0))


def _by_newton(
    linear: FloatArray, error: Callable[[FloatArray], FloatArray], found: FloatArray, scale: float
) -> FloatArray:
    """See ``true_input``: row by row, each step halved until less is left."""

    def left(at: FloatArray) -> FloatArray:
        return np.asarray(linear - error(at) - at)

    with np.errstate(over="ignore", invalid="ignore"):
        rest = left(found)
        for _ in range(MAX_PASSES):
            slope = np.eye(3) + _slope(error, found, scale)
            flat = ~(np.abs(np.linalg.det(slope)) > MIN_DETERMINANT)
            slope[flat] = 2.0 * np.eye(3)
            step = np.linalg.solve(slope, rest[:, :, None])[:, :, 0]
            size, share = np.linalg.norm(rest, axis=1), np.ones((len(found), 1))
            moved = left(found + step)
            for _ in range(MAX_STEP_HALVINGS):
                worse = np.linalg.norm(moved, axis=1) > size
                if not worse.any():
                    break
                share[worse] *= 0.5
                moved = left(found + share * step)
            better = (np.linalg.norm(moved, axis=1) <= size)[:, None]
            found, rest = (
                np.where(better, found + share * step, found),
                np.where(better, moved, rest),
            )
            if not better.any() or _largest(rest) <= CONVERGED * scale:
                break
    return found


def _slope(
    error: Callable[[FloatArray], FloatArray], found: FloatArray, scale: float
) -> FloatArray:
    """``∂error/∂x`` by central differences, shape (n, 3, 3)."""
    aside = STEP * max(scale, 1e-12) * np.eye(3)
    ends = [(error(found + one) - error(found - one)) for one in aside]
    return np.asarray(np.stack(ends, axis=2) / (2.0 * aside[0, 0]))


def corrected(
    calibration: tuple[FloatArray, FloatArray],
    terms: Terms,
    sizes: FloatArray,
    readings: FloatArray,
    circumstances: Circumstances,
) -> FloatArray:
    """``x = M (y − b) − ε(x, circumstances)``, SI, shape (n, 3).

    Args:
        calibration: matrix M and bias b.
        terms: the effects of the sensor.
        sizes: of all of them one after the other, shown units, shape (p,).
        readings: y, in the bias's unit, shape (n, 3).
        circumstances: of each reading. What the sensor itself measures (the force of an
            accelerometer, the rate of a gyroscope) is put in here and need not be right.
    """
    matrix, bias = calibration
    linear = np.asarray((readings - bias) @ matrix.T)
    if not len(terms):
        return linear

    def error(found: FloatArray) -> FloatArray:
        return np.asarray(terms.columns(circumstances.sensing(terms.sensor, found)) @ sizes)

    return true_input(linear, error, float(np.abs(linear).max(initial=0.0)))


def slope_of_corrected(
    terms: Terms, sizes: FloatArray, found: FloatArray, circumstances: Circumstances
) -> FloatArray:
    """``∂x/∂(M (y − b)) = (I + ∂ε/∂x)⁻¹``, shape (n, 3, 3).

    Args:
        terms: see ``corrected``.
        sizes: see ``corrected``.
        found: x, SI, shape (n, 3).
        circumstances: of each x.
    """
    if not len(terms):
        return np.tile(np.eye(3), (len(found), 1, 1))

    def error(at: FloatArray) -> FloatArray:
        return np.asarray(terms.columns(circumstances.sensing(terms.sensor, at)) @ sizes)

    slope = np.eye(3) + _slope(error, found, float(np.abs(found).max(initial=0.0)))
    return np.asarray(np.linalg.inv(slope), np.float64)
