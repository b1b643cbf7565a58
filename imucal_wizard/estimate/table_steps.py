"""Steps of constant rate and turns of known angle on a rate table or turntable.

The readings show which listed rate each step has. Within one mounting, the readings of all steps
lie on a line through the bias, in the ratio of their rates, whatever the scales of the axes. Until
a calibration is known, each mounting is therefore compared with the list by a scale of its own.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.directions import group_directions, unit_vectors
from imucal_wizard.core.limits.stillness import ROTATION_OVERLAP_SECONDS
from imucal_wizard.core.quantities import plural, quantity
from imucal_wizard.core.readings import MAX_SAMPLE_INTERVALS, FloatArray, Series, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import lengths, root_mean_square
from imucal_wizard.core.units import COUNT
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.model.rows.source import Parameters

MAX_SCALE_ERROR = 1.6
"""Factor by which the scale of a mounting may be wrong before the calibration: no device is further
from its data sheet."""
MAX_MISMATCH = 0.04
"""Largest relative difference between a step and a listed rate or angle once the scale of its
mounting is known; nonlinearity is some tenths of a per cent."""
EQUAL_MISFIT = 0.002
"""Relative misfits to the list that differ by less are equal: noise makes such a difference."""
MAX_WOBBLE = np.radians(3.0)
"""Largest rms angle between the rate and its mean axis in a turn of a turntable; a hand wobbles by
10° and more."""
PIECE_SECONDS = 1.0 / 30.0
"""Duration of the pieces of a turn; the rate of a table changes little within one."""
MAX_REST_SPREAD = 0.02
"""Largest difference between rests, as a share of the range of all readings, if no rates are listed
that would show the rests."""
MAX_NAMED_RATES = 6
"""Rates in a message."""


@dataclass(frozen=True)
class KnownRates:
    """The rates and angles of the table, as the user lists them.

    Attributes:
        rates: magnitudes of its constant rates, rad/s; rests count as rate 0 without being listed.
        turns: magnitudes of its angles between rests, rad.
    """

    rates: tuple[float, ...] = ()
    turns: tuple[float, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.rates or self.turns)


@dataclass(frozen=True, eq=False)
class TableTurn:
    """A stretch of time in which the table turned by a known angle.

    Attributes:
        start: s.
        end: s.
        reading: mean readings of its pieces, shape (q, 3).
        seconds: duration of each piece, s, shape (q,).
        angle: rad.
        hold: of a step of constant rate, its mean with its noise; None of a turn.
    """

    start: float
    end: float
    reading: FloatArray
    seconds: FloatArray
    angle: float
    hold: Hold | None = None

    @property
    def mean(self) -> FloatArray:
        """Mean reading, shape (3,)."""
        return np.asarray(self.seconds @ self.reading / self.seconds.sum())


@dataclass(frozen=True, eq=False)
class TableData:
    """Rests, steps and turns of the table in a recording.

    Attributes:
        rests: still periods.
        turned: steps and turns, in the order of time.
        start: a first calibration.
        left_out: steady stretches at none of the listed rates: start, s, and rate, rad/s.
    """

    rests: tuple[Hold, ...]
    turned: tuple[TableTurn, ...]
    start: Parameters
    left_out: tuple[tuple[float, float], ...] = ()

    @property
    def misfit(self) -> float:
        """Rms difference from the list at the first calibration, relative."""
        if not self.turned:
            return np.inf
        matrix, bias = self.start.matrix, self.start.bias
        means = np.array([one.mean for one in self.turned])
        rates = np.array([one.angle / one.seconds.sum() for one in self.turned])
        sizes = np.linalg.norm((means - bias) @ matrix.T, axis=1)
        return root_mean_square(sizes / rates - 1.0)

    @property
    def steady(self) -> list[tuple[float, float]]:
        """Spans in which the table turned, s."""
        return [(one.start, one.end) for one in self.turned]


def starting_points(
    holds: Sequence[Hold], series: Series, given: KnownRates
) -> Iterator[Parameters]:
    """Scales and biases with which the recording may have the listed rates or angles.

    These are the nominal scale, if the unit is known, and the scale that makes the fastest rate, or
    the largest angle, the largest of the list.
    """
    means = np.array([hold.gyroscope for hold in holds])
    middle = (means.min(axis=0) + means.max(axis=0)) / 2.0
    if not given.rates:  # the steady reading that most others repeat is the rest
        apart = np.linalg.norm(means[:, None] - means, axis=2)
        near = apart < MAX_REST_SPREAD * float(np.ptp(series.values, axis=0).max())
        middle = means[near[near.sum(axis=1).argmax()]].mean(axis=0)
    for bias in (middle, np.zeros(3)) if series.unit != COUNT else (middle,):
        if series.unit != COUNT:
            yield Parameters(np.eye(3), bias)
        if given.rates:
            largest, known = float(np.linalg.norm(means - bias, axis=1).max()), max(given.rates)
        else:
            spans = itertools.pairwise(holds)
            angles = [np.linalg.norm(_integral(series, *pair, bias)) for pair in spans]
            largest, known = float(max(angles, default=0.0)), max(given.turns)
        if largest > 0.0:
            yield Parameters(known / largest * np.eye(3), bias)


def _integral(series: Series, before: Hold, after: Hold, bias: FloatArray) -> FloatArray:
    part = series.between(before.end, after.start)
    return np.asarray(np.trapezoid(part.values - bias, part.time, axis=0))


def one_sense(axes: FloatArray) -> FloatArray:
    """Axes, unit vectors, with those that lie along an earlier one turned to its sense, (n, 3)."""
    out = axes.copy()
    for place in range(1, len(out)):
        along = out[:place] @ out[place]
        if along[np.abs(along).argmax()] < 0.0:
            out[place] = -out[place]
    return out


def assign_rates(
    holds: Sequence[Hold],
    series: Series,
    given: KnownRates,
    start: Parameters,
    *,
    calibrated: bool,
) -> TableData:
    """Assign the listed values to steady stretches and to motions between rests.

    Args:
        holds: the steady stretches, in the order of time.
        series: all readings of the gyroscope.
        given: what the table did.
        start: a calibration.
        calibrated: whether it was fitted to these data; else each mounting has its own scale.
    """
    means = np.array([hold.gyroscope for hold in holds])
    bias = start.bias
    for _ in range(1 if calibrated else 2):  # the rests found first improve the bias
        rates = (means - bias) @ start.matrix.T
        if given.rates:
            listed = _listed(rates, given.rates, calibrated)
        else:
            gain = float(np.linalg.norm(start.matrix, 2))
            limit = gain * MAX_REST_SPREAD * float(np.ptp(series.values, axis=0).max())
            listed = np.where(np.linalg.norm(rates, axis=1) < limit, 0.0, np.nan)
        if calibrated or not (listed == 0.0).any():
            break
        bias = means[listed == 0.0].mean(axis=0)
    rests = [hold for hold, rate in zip(holds, listed, strict=True) if rate == 0.0]
    turned = [
        TableTurn(
            hold.start,
            hold.end,
            np.asarray(hold.gyroscope)[None],
            np.array([hold.end - hold.start]),
            float(rate * (hold.end - hold.start)),
            hold,
        )
        for hold, rate in zip(holds, listed, strict=True)
        if rate > 0.0
    ]
    if given.turns:
        turned += _turns(
            rests, series, given.turns, Parameters(start.matrix, bias), turned, calibrated
        )
    turned.sort(key=lambda one: one.start)
    sizes = np.linalg.norm(rates, axis=1)
    left_out = tuple(
        (hold.start, float(size))
        for hold, rate, size in zip(holds, listed, sizes, strict=True)
        if np.isnan(rate)
    )
    return TableData(tuple(rests), tuple(turned), Parameters(start.matrix, bias), left_out)


def _listed(vectors: FloatArray, known: Sequence[float], calibrated: bool) -> FloatArray:
    """The listed magnitude of each vector, 0 for a rest, NaN if none is near, shape (n,).

    Args:
        vectors: rates or angles, shape (n, 3).
        known: the list.
        calibrated: whether the vectors are calibrated; else those along one axis share a factor.
    """
    listed, sizes = np.array(sorted({one for one in known if one > 0.0})), lengths(vectors)
    out = np.where(sizes < 0.5 * listed[0] / (1.0 if calibrated else MAX_SCALE_ERROR), 0.0, np.nan)
    moving = np.flatnonzero(np.isnan(out))
    if not len(moving):
        return out
    if calibrated:
        groups = np.zeros(len(moving), np.int64)
    else:
        groups = group_directions(one_sense(unit_vectors(vectors[moving])))
    for group in distinct(groups):
        rows = moving[groups == group]
        out[rows] = _matched(sizes[rows], listed, [1.0] if calibrated else None)
    return out


def _matched(sizes: FloatArray, listed: FloatArray, factors: Sequence[float] | None) -> FloatArray:
    """The listed value of each size, with the factor that matches most of them; NaN for the others.

    Among factors that match equally many, the best fit counts, then the factor nearest to 1.
    """
    if factors is None:
        tried = listed / sizes.max()
        factors = tried[np.abs(np.log(tried)) <= np.log(MAX_SCALE_ERROR)].tolist()
    best, least = np.full(len(sizes), np.nan), (0.0, 0.0)
    for factor in sorted(factors, key=lambda one: abs(np.log(one))):
        near = listed[np.abs(factor * sizes[:, None] - listed).argmin(axis=1)]
        off = factor * sizes / near - 1.0
        fits = np.abs(off) <= MAX_MISMATCH
        if fits.any():
            rms = root_mean_square(off[fits])
            score = -float(fits.sum()), np.floor(rms / EQUAL_MISFIT)
            if score < least:
                best, least = np.where(fits, near, np.nan), score
    return best


def _turns(
    rests: Sequence[Hold],
    series: Series,
    known: Sequence[float],
    start: Parameters,
    steps: Sequence[TableTurn],
    calibrated: bool,
) -> list[TableTurn]:
    """Motions between neighbouring rests about one axis and by a listed angle."""
    found = []
    for before, after in itertools.pairwise(rests):
        if not any(before.end <= one.start < after.start for one in steps):
            turn = _turn(series, before, after, start)
            found += [] if turn is None else [turn]
    if not found:
        return []
    rates = np.array([(one.mean - start.bias) @ start.matrix.T for one in found])
    seconds = np.array([one.seconds.sum() for one in found])
    angles = _listed(rates * seconds[:, None], known, calibrated)
    return [
        replace(one, angle=float(angle))
        for one, angle in zip(found, angles, strict=True)
        if angle > 0.0
    ]


def _turn(series: Series, before: Hold, after: Hold, start: Parameters) -> TableTurn | None:
    """The motion between two rests, without its angle; None if it is not about one axis."""
    part = series.between(
        before.end - ROTATION_OVERLAP_SECONDS, after.start + ROTATION_OVERLAP_SECONDS
    )
    step = np.diff(part.time)
    if len(step) < 2 or step.max() > MAX_SAMPLE_INTERVALS / series.rate or step.min() <= 0.0:
        return None
    middle = 0.5 * (part.values[1:] + part.values[:-1])
    rate = (middle - start.bias) @ start.matrix.T
    about = np.linalg.eigvalsh(rate.T @ (rate * step[:, None]))
    if about[:2].sum() > np.sin(MAX_WOBBLE) ** 2 * about.sum():
        return None
    first = np.arange(0, len(step), max(round(PIECE_SECONDS * series.rate), 1))
    seconds = np.add.reduceat(step, first)
    reading = np.add.reduceat(middle * step[:, None], first, axis=0) / seconds[:, None]
    return TableTurn(float(part.time[0]), float(part.time[-1]), reading, seconds, 0.0)


def same_assignment(one: TableData, other: TableData) -> bool:
    """Whether two assignments are the same."""

    def key(data: TableData) -> list[tuple[float, float]]:
        return [(turned.start, turned.angle) for turned in data.turned]

    return key(one) == key(other)


def why_no_match(found: TableData, given: KnownRates, unit: str) -> str:
    """Why the listed rates or angles do not match the recording, and what the recording has."""
    if not given.rates:
        return (
            f"found {plural(len(found.rests), 'rest')}, but hardly any rotation between them "
            "about one axis by a listed angle: check the list, and let the table rest for two "
            "seconds before and after each rotation"
        )
    if not found.left_out:
        return (
            f"found {plural(len(found.turned), 'step')} of constant rate and "
            f"{plural(len(found.rests), 'rest')}: let the table rotate at each rate for some "
            "seconds, in several mountings"
        )
    gain = float(np.linalg.norm(found.start.matrix, 2)) if unit != COUNT else 1.0
    there = dict.fromkeys(
        quantity(rate / gain, "rad/s", 2) for rate in sorted(rate for _, rate in found.left_out)
    )
    rates = ", ".join(list(there)[:MAX_NAMED_RATES]) + (
        " …" if len(there) > MAX_NAMED_RATES else ""
    )
    return (
        f"{len(found.left_out)} of {len(found.left_out) + len(found.turned)} steps of constant "
        f"rate are at none of the listed rates: they read {rates}. Check the list, its unit and "
        "the unit of the readings"
    )
