"""Slow noise of a bias, estimated from what the fits of a session leave (restricted likelihood)."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray, distinct
from imucal_wizard.core.statistics import complement
from imucal_wizard.estimate.slow_errors import (
    MIN_DETERMINED,
    MOST_LACKING,
    Between,
    Fitted,
    SlowErrors,
    SlowKind,
)
from imucal_wizard.estimate.slow_kernels import (
    Kernel,
    about_the_mean,
    averaged,
    walked,
)
from imucal_wizard.estimate.slow_rests import RestPieces
from imucal_wizard.measurement.holds import Hold

MIN_REPEATS_OF_POSES = 4
"""Repeats of poses that show how the biases change with time."""
ALL_WHITE = 0.85, 0.6
"""Probability that no error of a session's holds is slow, where nothing measures slow noise and
where repeats or a long rest do: slow errors move the parameters less than white ones of the same
size, and without a measurement the residuals hardly distinguish the two."""
ALL_WHITE_OF_FIELD = 0.2
"""The same of a magnetometer, in a field that is hardly the same everywhere and always."""
FLICKER = 0.75
"""And the probability that slow errors are flicker noise and not a random walk."""
FIELD_FLICKER, FIELD_WALK, FIELD_DRIFT = 0.02, 0.04, 0.02
"""The same of a magnetometer: flicker noise or a random walk of its bias, or a field whose strength
drifts. The rest is what the place does to the sensor, which differs within a room by more than the
bias wanders."""
FIELD_PLACE = 1.0 - FIELD_FLICKER - FIELD_WALK - FIELD_DRIFT
"""For intervals of the parameters, which places move most. For the sizes from which effects are
seen, flicker noise counts as much as places do: every sensor has some."""
PLACE_SECONDS = 3.0, 6.0
"""Seconds of motion from one place to another that does something else to the sensor. What lasts
longer is like a random walk of the bias, whose mean over the session belongs to the bias."""
MEASURED_NOISE = 0.7
"""Probability that the white errors of holds are the noise measured within them and no more, where
that is known: else their size, which nothing measures, is any."""
LARGER = 60
"""Sizes of larger ones, up to ``MOST_LACKING``, each 12 % more in variance than the one before."""
MOMENT = 1e-3
"""Seconds at one place in which a device that moves steadily does not leave it."""
TOUCHING = 0.01
"""Share of a span in common with the one before that is a matter of rounding."""
PARTS = np.geomspace(0.1, 100.0, 13)
"""Variance of the slow part over that of the rest: from what no session shows to nearly all."""


def spans_of(holds: Sequence[Hold]) -> FloatArray:
    """Beginning and end of each hold, s, shape (n, 2)."""
    return np.array([[hold.start, hold.end] for hold in holds])


def estimate_slow_errors(
    spans: FloatArray,
    fitted: Sequence[Fitted],
    measured: bool,
    rests: RestPieces | None = None,
    between: Between | None = None,
) -> SlowErrors | None:
    """Tell slow errors from what fits leave.

    The errors of the holds are independent, with variances in the ratio of the weights, and part of
    them is slow: flicker noise or a random walk, less its mean over the session. Of a field it may
    also be the strength that drifts, or what differs from place to place, which is no part of the
    bias and counts in full. Their size, and which part is slow, are estimated from the residuals
    by restricted likelihood. No prior knows the size of white errors, so that they have the
    intervals of least squares with Student's t; the prior of the share of slow ones is Jeffreys'.
    Which part is slow is judged by measured noise too, where it is given: residuals that it
    explains leave little to slow errors.

    Args:
        spans: beginning and end of each hold, s, shape (n, 2).
        fitted: the fit of each axis, or of the magnitude; the slow part of all is the same share,
            and the errors of one are independent of those of another.
        measured: whether repeats or a rest show slow noise apart from the model.
        rests: rests that show slow noise by themselves.
        between: rows of what was measured between the holds.

    Returns:
        None where a fit leaves nothing to judge by.
    """
    every = spans if between is None else np.concatenate([spans, between.spans])
    of_field = any(one.strength is not None for one in fitted)
    left = [complement(one.columns / np.sqrt(one.white)[:, None]) for one in fitted]
    if not all(across.shape[1] for across in left):
        return None
    all_white = ALL_WHITE_OF_FIELD if of_field else ALL_WHITE[measured]
    of_parts = np.append(all_white, np.full(len(PARTS), (1.0 - all_white) / len(PARTS)))
    order = np.argsort(every[:, 0], kind="stable")
    place = np.argsort(order)
    still = np.ones(len(every), bool) if fitted[0].still is None else fitted[0].still
    kinds = []
    for ordered, chance, kernel, of_strength in _kinds(every[order], still[order], of_field):
        kind = _kind(ordered[np.ix_(place, place)], fitted, left, of_strength, between)
        log = kind.weight + np.log(chance * of_parts)
        if rests is not None:
            log += rests.evidence(kernel, kind.size, of_strength)
        # a session hardly tells flicker noise from places, and it hides a slow effect more
        again = FIELD_PLACE / FIELD_FLICKER if of_field and kernel is averaged else 1.0
        kinds.append(replace(kind, weight=log, long=kernel is not None, again=again))
    highest = max(float(kind.weight.max()) for kind in kinds)
    total = sum(float(np.exp(kind.weight - highest).sum()) for kind in kinds)
    return SlowErrors(
        tuple(replace(kind, weight=np.exp(kind.weight - highest) / total) for kind in kinds),
        tuple(one.white for one in fitted),
        apart=measured,
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
    information = np.zeros(1 + len(PARTS))
    scales, sizes, slows, shown = [], [], [], []
    for one, across in zip(fitted, left, strict=True):
        slow = whole[:count, :count] * (_strengths(one) if of_strength else one.alike)
        mixed = one.independent.rows(one.independent.rows(slow).T)
        sigma = np.sqrt(one.white)
        evidence, known, scale, size, left_in = _explained(
            one.errors / sigma, mixed / np.outer(sigma, sigma), across
        )
        log += evidence
        information += known
        if one.own is not None:
            log += _with_measured_noise(scale, across.shape[1])
        scales.append(scale)
        sizes.append(size)
        slows.append(slow)
        shown.append(left_in)
    # Jeffreys: a share that white errors would hide is less likely than one that shows
    prior = np.sqrt(np.maximum(information[1:], np.finfo(float).tiny))
    log[1:] += np.log(prior / prior.mean())
    if between is not None:
        among = [moved @ whole[count:, count:] @ moved.T for moved in between.slow]
        evidence, share = between.explained(among, np.array(sizes))
        log += evidence
    of_each = np.array(scales), np.array(sizes), np.array(slows)
    return SlowKind(log, *of_each, whole, share, min(shown), long=False)


def _kinds(
    spans: FloatArray, still: BoolArray, of_field: bool
) -> Iterator[tuple[FloatArray, float, Kernel | None, bool]]:
    """Covariance of the averages by each kind of slow error, its probability, and its kernel.

    What a place does has none: it is the same throughout a rest. Last, whether it is an error of
    the field's strength; else it is one of the bias.
    """
    by_walk = about_the_mean(spans, walked)
    flicker, walk = (FIELD_FLICKER, FIELD_WALK) if of_field else (FLICKER, 1.0 - FLICKER)
    yield about_the_mean(spans, averaged), flicker, averaged, False
    yield by_walk, walk, walked, False
    if of_field:
        yield by_walk, FIELD_DRIFT, walked, True
        begin, end = _moved(spans, still)
        for seconds in PLACE_SECONDS:
            of_place = _of_places(begin, end, still, seconds)
            yield of_place @ of_place.T, FIELD_PLACE / len(PLACE_SECONDS), None, False


def _of_places(begin: FloatArray, end: FloatArray, still: BoolArray, seconds: float) -> FloatArray:
    """Which share of what each place does is in the average over each span, shape (n, r).

    Each rest is another place, and so is every so many seconds of a longer motion. On its way the
    device passes steadily from one to the next.

    Args:
        begin: how long the device had moved at the beginning of each span, s, shape (n,).
        end: the same at its end.
        still: which of them were measured at rest, shape (n,).
        seconds: of motion from one place to the next.
    """
    middle, half = 0.5 * (begin + end), np.maximum(0.5 * (end - begin), MOMENT)
    rests = distinct(middle[still]) if still.any() else begin[:1]
    before, after = (
        (one // seconds + 1.0) * seconds for one in (rests[0] - begin.min(), end.max() - rests[-1])
    )
    known = [rests[0] - before, *rests, rests[-1] + after]
    places = distinct(
        np.concatenate(
            [
                np.linspace(one, other, max(round((other - one) / seconds), 1) + 1)
                for one, other in pairwise(known)
            ]
        )
    )
    to_next = np.append(np.diff(places), seconds)
    from_last = np.append(seconds, to_next[:-1])

    def until(moved: FloatArray) -> FloatArray:
        beyond = moved[:, None] - places
        coming = np.clip(1.0 + beyond / from_last, 0.0, 1.0)
        going = np.clip(1.0 - beyond / to_next, 0.0, 1.0)
        return np.asarray(0.5 * (from_last * coming**2 + to_next * (1.0 - going**2)))

    return np.asarray((until(middle + half) - until(middle - half)) / (2.0 * half)[:, None])


def _moved(spans: FloatArray, still: BoolArray) -> FloatArray:
    """How long the device had moved at the beginning and the end of each span, s, shape (2, n).

    Args:
        spans: in order, s, shape (n, 2).
        still: which of them were measured at rest, shape (n,).
    """
    out, moved, until, resting = np.empty((2, len(spans))), 0.0, float(spans[0, 0]), False
    for k, ((start, end), rest) in enumerate(zip(spans.tolist(), still.tolist(), strict=True)):
        if start > until - TOUCHING * (end - start):
            moved += PLACE_SECONDS[-1] if rest and resting else max(start - until, 0.0)
        begin = moved
        if end > until:
            moved += 0.0 if rest else end - max(start, until)
            until, resting = end, rest
        out[:, k] = begin, moved
    return out


def _explained(
    errors: FloatArray, slow: FloatArray, across: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """How well white and slow errors explain what a fit leaves, for each share of the slow part.

    Args:
        errors: what it leaves of each hold, over its standard deviation, shape (n,).
        slow: covariance of the slow part of size one, likewise, shape (n, n).
        across: combinations of the holds that the fit does not move, shape (n, f).

    Returns:
        Logarithm of the restricted likelihood, how well the share is known by it (Fisher's
        information about the logarithm of its size, but for a factor), variance of the white part
        over that assumed, and variance of the slow part, each of shape (k,); the share of the slow
        part that the fit leaves in the errors.
    """
    freedom, parts = across.shape[1], np.append(0.0, PARTS)
    values, vectors = np.linalg.eigh(across.T @ slow @ across)
    values = np.maximum(values, 0.0)
    # what the fit takes up whole shows nothing, nor do spans without an order in time
    left, whole = float(values.sum()), float(np.trace(slow))
    shown = left > MIN_DETERMINED * float(np.abs(np.diag(slow)).sum())
    size = float(values.mean()) if shown else 1.0
    square = (vectors.T @ (across.T @ errors)) ** 2
    variance = 1.0 + np.outer(parts, values / size)
    scale = (square / variance).sum(axis=1) / freedom
    log = -0.5 * np.log(variance).sum(axis=1)
    log -= 0.5 * freedom * np.log(np.maximum(scale, np.finfo(float).tiny))
    left_in = left / whole if whole > np.finfo(float).tiny else 0.0
    information = ((1.0 - 1.0 / variance) ** 2).sum(axis=1)
    return log, information, scale, scale * shown * parts / size, left_in


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
    rests: RestPieces | None = None,
    between: Between | None = None,
) -> FloatArray | None:
    """Covariance of the parameters, the bias being its mean over the session, shape (k, k).

    Args:
        spans: beginning and end of each hold, s, shape (n, 2).
        fitted: see ``estimate_slow_errors``.
        measured: see ``estimate_slow_errors``.
        rests: see ``estimate_slow_errors``.
        between: rows of what was measured between the holds.

    Returns:
        The covariance; None where a fit leaves nothing to judge by.
    """
    found = estimate_slow_errors(spans, fitted, measured, rests, between)
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
