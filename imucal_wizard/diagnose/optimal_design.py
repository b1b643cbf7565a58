"""A greedy design: what to measure so that the data separate two explanations of a misfit.

With the columns J of the model, the patterns of two effects A and B, and noise one, the part of A
that neither the model nor B can imitate is ``(I − P_[J, B]) A``; where A or B is an effect of the
model already, J is without it. Its length times the size of A is the number of standard deviations
by which the data separate the two. Measurements are chosen one after the other, each the one that
makes this length grow most.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar, cast

import numpy as np

from imucal_wizard.core.attitude import rotation_samples
from imucal_wizard.core.limits.procedure import ROTATION_RATES
from imucal_wizard.core.poses import AXES, DIRECTIONS, NAMED, START_POSES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.measurement.rotation_angle import soft_rotation
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE, Circumstances, Effect
from imucal_wizard.model.identifiability import design
from imucal_wizard.model.rows.gravity_closure import GravityClosure
from imucal_wizard.model.rows.source import Parameters, RowLabels
from imucal_wizard.model.rows.table import ResidualTable
from imucal_wizard.model.terms import Term, Terms

T = TypeVar("T")

ROTATIONS_PER_AXIS = 2 * len(ROTATION_RATES)
"""Each rate in both senses."""
ROTATION_ANGLE = 120.0
"""How far a hand turns a device in one go, degrees."""
SAMPLE_INTERVAL = 0.01
"""Between two samples of an imagined rotation, s."""
WARMER = 15.0
"""Degrees by which a hand, a lamp or a box warms a device."""
SECONDS_PER_POSE = 15.0
DEVIATIONS_APART = 2.33 + 1.645
"""Standard deviations for one mistake in a hundred and five misses in a hundred."""
ENOUGH_LENGTH = 2.0 * DEVIATIONS_APART
"""When an effect of half the size would be separated, no more poses are asked for; but never one
alone, which could as well be a disturbed hold."""


@dataclass(frozen=True, eq=False)
class Explained:
    """One of the explanations to be separated.

    Attributes:
        effect: the effect.
        variant: its setting.
        size: its estimated size per parameter, shown unit, shape (p,).
    """

    effect: Effect
    variant: float | None
    size: FloatArray


Patterns = tuple[FloatArray, FloatArray, FloatArray]
"""Whitened rows: columns of the model, the first explanation at its size, the second's columns."""


def beside(fit: SensorFit, first: Explained, second: Explained) -> tuple[Term, ...]:
    """The effects of a model beside two explanations, one of which it may contain."""
    names = first.effect.name, second.effect.name
    return tuple(one for one in fit.terms if one.name not in names)


def _with_priors(rows: Patterns, held: FloatArray) -> Patterns:
    """The rows with those of priors, shape (p, b), of which neither explanation moves any."""
    own, other = (np.zeros((len(held), one.shape[1])) for one in rows[1:])
    return _stacked(rows, (held, own, other))


def choose(
    now: Patterns,
    offers: Callable[[Sequence[T]], Sequence[tuple[T, Patterns]]],
    most: int,
    growth: float,
) -> tuple[list[T], float, float]:
    """Take the best offer again and again, until two explanations are apart or nothing helps.

    Args:
        now: the rows there are.
        offers: what could be measured as the next, each with the rows that it would add, given what
            has been chosen already.
        most: offers to take at most.
        growth: factor by which each must lengthen what separates the explanations.

    Returns:
        What was chosen; the size needed before and after, in shares of the first one's estimate.
    """
    length = apart_length(*now)
    before, chosen = size_needed(length), list[T]()
    for place in range(most):
        if length >= ENOUGH_LENGTH and place != 1:
            break
        known = offers(chosen)
        lengths = [apart_length(*_stacked(now, patterns)) for _, patterns in known]
        best = int(np.argmax(lengths))
        if lengths[best] < growth * length + 1e-9:
            break
        offer, patterns = known[best]
        now, length = _stacked(now, patterns), lengths[best]
        chosen.append(offer)
    return chosen, before, size_needed(length)


def size_needed(length: float) -> float:
    """Share of an estimate that stands out where all of it does by so many sigma."""
    return DEVIATIONS_APART / length if length > 0.0 else np.inf


def apart_length(base: FloatArray, own: FloatArray, other: FloatArray) -> float:
    """Length of what neither the base nor the other explanation can imitate.

    Args:
        base: whitened columns of what is fitted already, shape (n, b).
        own: the first explanation at its size, shape (n, 1).
        other: columns of the second one, shape (n, p).
    """
    both = np.concatenate([base, other], axis=1)
    scale = np.linalg.norm(both, axis=0)
    both = both[:, scale > 0.0] / scale[scale > 0.0]
    left, values, _ = np.linalg.svd(both, full_matrices=False)
    inner = left[:, values > 1e-9 * values[0]]
    rest = own - inner @ (inner.T @ own)
    length = float(np.linalg.norm(rest))
    return length if length > 1e-9 * float(np.linalg.norm(own)) else 0.0


def _stacked(rows: Patterns, more: Patterns) -> Patterns:
    base, own, other = (np.concatenate(pair) for pair in zip(rows, more, strict=True))
    return base, own, other


def pose_patterns(
    first: Explained,
    second: Explained,
    where: Circumstances,
    sigma: FloatArray,
    radial: bool,
    others: Sequence[Term] = (),
) -> Patterns:
    """Of poses held: along gravity, or on each axis of a sensor at rest.

    Args:
        first: the likelier explanation.
        second: the other one.
        where: the poses, n of them.
        sigma: noise of each, SI, shape (n,) or (1,).
        radial: along gravity.
        others: effects of the model, see ``beside``.
    """
    sensor = ACCELEROMETER if radial else GYROSCOPE
    shown = *others, *(Term(one.effect, one.variant) for one in (first, second))
    felt = [np.nan_to_num(one.effect.columns(sensor, where, one.variant)) for one in shown]
    noise = np.broadcast_to(sigma, len(where))
    if radial:
        up = where.force / np.linalg.norm(where.force, axis=1)[:, None]
        base = design(up)
        rows = [np.einsum("ni,nip->np", up, columns) for columns in felt]
    else:
        base, noise = np.tile(np.eye(3), (len(where), 1)), np.repeat(noise, 3)
        rows = [np.concatenate(columns) for columns in felt]
    *more, own, other = rows
    base, weight = np.column_stack([base, *more]), 1.0 / noise[:, None]
    return base * weight, (own @ first.size)[:, None] * weight, other * weight


def poses_done(now: Patterns, radial: bool, others: Sequence[Term]) -> Patterns:
    """The patterns of the poses there are with the priors of the model's effects."""
    sensor = ACCELEROMETER if radial else GYROSCOPE
    usual = [one.effect.typical(sensor, one.variant) for one in others]
    width = np.concatenate([np.zeros(0), *usual])
    free = np.zeros((len(width), now[0].shape[1] - len(width)))
    return _with_priors(now, np.concatenate([free, np.diag(1.0 / width)], axis=1))


def one_more_hold(
    done: Circumstances, chosen: Sequence[tuple[str, bool]], name: str, warm: bool
) -> Circumstances:
    """The circumstances of one more hold in this pose.

    Args:
        done: of the holds there are.
        chosen: the poses that come between, with whether the device is warmer there.
        name: of the pose.
        warm: the device is warmer; it is held once the temperature has settled.
    """
    last = float(done.temperature[-1])
    return Circumstances(
        force=NAMED[name][None] * done.gravity,
        rate=np.zeros((1, 3)),
        temperature=np.array([last + WARMER * warm]),
        time=np.array([float(done.time[-1]) + SECONDS_PER_POSE * (len(chosen) + 1)]),
        previous=NAMED[chosen[-1][0]][None] * done.gravity if chosen else done.force[-1:],
        vibration=np.array([float(np.mean(done.vibration))]),
        gravity=done.gravity,
        reference_temperature=done.reference_temperature,
        reference_time=done.reference_time,
    )


def rotation_patterns(
    fit: SensorFit, gravity: float, first: Explained, second: Explained, axis: str
) -> tuple[Patterns, Patterns]:
    """Patterns of all rows of a fit, and of rotations about an axis that nobody has made yet.

    The rotations are made as by a hand: from the start pose to the left and back, each rate once.
    What each does to the closures is the derivative that the fit itself works with.

    Args:
        fit: the present fit.
        gravity: m/s².
        first: the likelier explanation.
        second: the other one.
        axis: the body axis to rotate about.
    """
    table = fit.rows
    assert table is not None, "a fit by rotations has rows"  # noqa: S101 (narrows the type)
    named = tuple(f"{one.effect.name}_" for one in (first, second))
    kept = [not name.startswith(named) for name in table.names]
    held = np.diag(np.sqrt(np.diag(table.prior)))[np.ix_(kept, kept)]
    white = table.variance**-0.5
    one, two = ([Term(each.effect, each.variant)] for each in (first, second))
    own, other = table.design_columns(one) @ first.size[:, None], table.design_columns(two)
    own, other = (table.independent.scaled(white, columns) for columns in (own, other))
    columns = table.independent.scaled(white, table.columns[:, kept])
    now = _with_priors((columns, own, other), held)
    imagined = _imagined(table, fit, gravity, axis)
    rows = imagined.at(Parameters(fit.matrix, fit.bias), Terms(fit.sensor, ()))
    assert fit.experiment is not None, "its directions are the experiment's"  # noqa: S101 (narrows)
    fitted = [
        rows.base_columns() @ fit.experiment.directions(fit.base).columns,
        rows.term_columns(fit.terms),
    ]
    # closures against the field share errors of the magnetometer, which these rows do not
    columns = np.zeros((len(rows.residual), len(table.names)))
    count = sum(one.shape[1] for one in fitted)
    columns[:, :count] = np.concatenate(fitted, axis=1)
    columns[:, [table.names.index(name) for name in imagined.shared]] = rows.shared_columns()
    weight = 1.0 / np.sqrt(rows.own)[:, None]
    more_own, more_other = rows.term_columns(one) @ first.size[:, None], rows.term_columns(two)
    return now, (columns[:, kept] * weight, more_own * weight, more_other * weight)


def _imagined(table: ResidualTable, fit: SensorFit, gravity: float, axis: str) -> GravityClosure:
    """Rotations to the left and back at each rate, beginning in the start pose."""
    closure, along = closure_of(table), np.eye(3)[AXES.index(axis)]
    start, angle = DIRECTIONS[START_POSES[axis]], np.radians(ROTATION_ANGLE)
    end = start * np.cos(angle) - np.cross(along, start) * np.sin(angle)
    pulses = [
        soft_rotation(sense * angle, np.radians(rate), SAMPLE_INTERVAL)
        for rate in ROTATION_RATES
        for sense in (1.0, -1.0)
    ]
    rates = [pulse[:, None] * along for _, pulse in pulses]
    before = np.array([start, end] * len(ROTATION_RATES))
    after = np.array([end, start] * len(ROTATION_RATES))
    inverse = np.linalg.inv(fit.matrix)
    times = [time for time, _ in pulses]
    samples = rotation_samples(times, [rate @ inverse.T + fit.bias for rate in rates])
    known, force = closure.motion, gravity * before[samples.rotation]
    # right after the session, at its last temperature
    motion = replace(
        known,
        force=force,
        rate=np.concatenate(rates),
        temperature=np.full(len(force), float(known.temperature[-1])),
        time=float(known.time[-1]) + samples.time,
        previous=force,
        vibration=np.full(len(force), float(np.mean(known.vibration))),
    )
    none = np.full(2 * len(rates), -1)
    return replace(
        closure,
        samples=samples,
        before=before,
        after=after,
        before_doubt=_doubt(closure, before),
        after_doubt=_doubt(closure, after),
        noise=np.full(len(rates), median(table.sigma[table.kind == "rotation"] ** 2)),
        motion=motion,
        labels=RowLabels(none, none, none, none, none * 1.0, np.zeros((len(none), 2)), none),
        rounding=np.zeros(3),  # averaged out by a hand that is never still
        resting=None,
        begun=None,
        earth=None,
    )


def _doubt(closure: GravityClosure, up: FloatArray) -> FloatArray:
    """The error of up there: as at the hold nearest to it, shape (m, 3, k)."""
    return np.asarray(closure.before_doubt[np.argmax(up @ closure.before.T, axis=1)])


def closure_of(table: ResidualTable) -> GravityClosure:
    """The rotations of a table."""
    return cast("GravityClosure", next(one for one in table.sources if one.moving and one.judged))
