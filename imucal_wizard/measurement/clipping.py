"""Clipping: readings at the end of a sensor's range, live and in recordings.

An axis that is clipped by its converter repeats one extreme value exactly. If noise or a filter
follows the clipping, the readings stand near one extreme for a while: fast and faster rotations
reach the same rate, and the integrated rate falls short of the angle that gravity shows.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.limits.data_quality import (
    COUNT_ENDS,
    MAX_CLIPPED_SHARE,
    MAX_RANGE_DIFFERENCE,
    MAX_STEADY_SHARE,
    MIN_CHECKED_SAMPLES,
    MIN_COUNT_SPAN,
    MIN_FLAT_ENDS,
    MIN_FLAT_SHARE,
    MIN_FLICKER_STEPS,
    MIN_FORCE_RANGE,
    MIN_FULL_SCALE_SHARE,
    MIN_LONG_PLATEAU,
    MIN_LONG_PLATEAU_JUMP,
    MIN_PLATEAU,
    MIN_PLATEAU_JUMP,
    MIN_PLATEAU_RATIO,
    MIN_RATE_RANGE,
    MIN_SHORTFALL,
    MIN_SILENT_HOLDS,
    MIN_SLOW_MOTIONS,
    MIN_UNKNOWN_SHORTFALL,
    NEAR_TOP,
    PLATEAU_BAND,
    SILENT_VARIANCE_SHARE,
)
from imucal_wizard.core.notices import Notice, NoticeKind, of_kind
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quantities import listed, true_minus, unit_sign, with_unit
from imucal_wizard.core.readings import BoolArray, FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import (
    median,
    median_of_rows,
    robust_deviation,
    sample_quantile,
    sphere_centre,
)
from imucal_wizard.core.units import COUNT
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.measurement.repeats import measured_rows
from imucal_wizard.measurement.stillness import Noise, Windows

CLIPPING_ADVICE = {
    "accelerometer": "set a wider range in the device, and do not shake it",
    "gyroscope": "turn more slowly, or set a wider range in the device",
    "magnetometer": "set a wider range, or take away the magnet near it",
}
"""What to do about an axis at the end of its range."""


def clipped_range(sensor: str, series: Series, *, short: bool = False) -> str:
    """Warning about an axis at the end of its range.

    Args:
        sensor: the sensor.
        series: its samples.
        short: the samples span only a few seconds, which may end in a rest; the end must then be
            beyond the smallest common range.
    """
    ends: dict[str, str] = {}
    for axis, end in _ends(sensor, series, short=short):
        ends.setdefault(AXES[axis], true_minus(f"{end:.5g}"))
    if not ends:
        return ""
    which, its, more = f"{listed(tuple(ends))} axes are", "their", "s"
    if len(ends) == 1:
        which, its, more = f"{next(iter(ends))} axis is", "its", ""
    read = with_unit(", ".join(dict.fromkeys(ends.values())), unit_sign(series.unit))
    return Notice(
        f"The {sensor}'s {which} at the end{more} of {its} range{more} ({read}); "
        f"{its} readings there are wrong: {CLIPPING_ADVICE[sensor]}.",
        NoticeKind.CLIPPED,
        sensor,
    )


def _ends(sensor: str, series: Series, *, short: bool = False) -> Iterator[tuple[int, float]]:
    """The ends of the range that the samples reach, each with its axis."""
    for axis, column in enumerate(series.values.T):
        for end in (float(column.max()), float(column.min())):
            if _is_end(column, end, sensor, series.unit, short=short):
                yield axis, end


def _is_end(column: FloatArray, end: float, sensor: str, unit: str, *, short: bool) -> bool:
    """Whether an extreme value is the end of the range."""
    if unit == COUNT and end in COUNT_ENDS:
        return True
    if unit == COUNT and float(np.ptp(column)) < MIN_COUNT_SPAN:
        return False
    least = MIN_FORCE_RANGE if sensor == "accelerometer" else MIN_RATE_RANGE
    if short and unit != COUNT and abs(end) < least:
        return False
    if not _flat_top(column if end == column.max() else -column):
        return False
    starts = np.concatenate([[0], np.flatnonzero(np.diff(column)) + 1])
    lengths = np.diff(np.append(starts, len(column)))
    here = column[starts] == end
    # a high quantile of the runs elsewhere, so that one stuck reading does not hide an end
    elsewhere = sample_quantile(lengths[~here], 0.999) if not here.all() else 0.0
    return short or bool(lengths[here].max() >= MIN_PLATEAU_RATIO * elsewhere)


def _flat_ends(motions: Sequence[FloatArray], rest: FloatArray) -> FloatArray | None:
    """The ends of a range that the motions show, shape (2, 3): lowest and highest readings.

    Clipping repeats one extreme value exactly. An extreme is an end if two motions or more are flat
    there, or if another one of the six, as far from rest, is flat too: one range usually holds for
    both senses and all axes.

    Args:
        motions: readings of each motion, shape (n, 3).
        rest: the reading at rest, shape (3,).

    Returns:
        The ends, infinite where an extreme is not flat; None if there is no sign of clipping.
    """
    values = np.concatenate(motions)
    if len(values) < MIN_CHECKED_SAMPLES:
        return None
    extremes = np.stack([values.min(axis=0), values.max(axis=0)])
    flat = np.zeros((2, 3), np.int64)
    for sense, axis in itertools.product(range(2), range(3)):
        there = [one[:, axis] for one in motions if (one[:, axis] == extremes[sense, axis]).any()]
        flat[sense, axis] = sum(_flat_top(column if sense else -column) for column in there)
    away = np.abs(extremes - rest)
    largest = float(away[flat > 0].max(initial=0.0))
    alike = (flat > 0) & (away >= (1.0 - MAX_RANGE_DIFFERENCE) * largest)
    ends = (flat >= MIN_FLAT_ENDS) | (alike & (alike.sum() >= MIN_FLAT_ENDS))
    return np.where(ends, extremes, np.array([[-np.inf], [np.inf]])) if ends.any() else None


def clipped_rotation(axis: str) -> Notice:
    """The problem of a rotation with a clipped axis, live and in a recording."""
    text = f"{axis} was clipped at the end of its range: turn more slowly"
    return Notice(text, NoticeKind.CLIPPED, "gyroscope")


def is_clipped(problem: str | None) -> bool:
    """Whether the problem of a rotation is clipping."""
    return problem is not None and bool(of_kind([problem], NoticeKind.CLIPPED))


@dataclass(frozen=True, eq=False)
class RateSegment:
    """The gyroscope's readings in a motion between two holds.

    Attributes:
        time: of the samples, s, shape (n,).
        rate: readings, shape (n, 3).
        rest: reading at rest, shape (3,).
        before: the accelerometer's reading in the hold before, shape (3,).
        after: the same after the motion.
    """

    time: FloatArray
    rate: FloatArray
    rest: FloatArray
    before: FloatArray
    after: FloatArray

    @property
    def turned(self) -> FloatArray:
        """The rate without the reading at rest, shape (n, 3)."""
        return self.rate - self.rest


def clipped_motions(
    motions: Sequence[RateSegment], unit: str, full_scale: float | None = None
) -> list[str | None]:
    """The axis that was clipped in each motion of a session, or None.

    Args:
        motions: all motions so far, without gaps; together they show the ends of the range.
        unit: of the rates.
        full_scale: of the gyroscope in this unit, if known.
    """
    if not motions:
        return []
    whole, motions = motions, _measured_once(motions)
    tops = np.array([_top(one.turned) for one in motions])
    highest = (1.0 - MAX_RANGE_DIFFERENCE) * float(tops[:, 0].max())
    slow = tops[:, 0] < highest
    rest = median_of_rows(np.array([one.rest for one in motions]))
    ends = _flat_ends([one.rate for one in motions], rest)
    axes = [
        clipped_axis(one.rate, one.rest, full_scale, unit)
        or (None if ends is None else _touched((one.rate <= ends[0]) | (one.rate >= ends[1])))
        for one in motions
    ]
    if full_scale is None:
        axes = _no_end_is_passed(motions, axes)
    exact = np.array([axis is not None for axis in axes])
    if full_scale is None and exact.any() and (unit != COUNT or (slow & ~exact).any()):
        # a turntable stands at one rate for most of a turn and loses nothing
        steadiness = [_steadiness(*one) for one in zip(motions, tops[:, 0], strict=True)]
        steady = exact & (np.array(steadiness) > MAX_STEADY_SHARE)
        if not _angle_lost(whole, steady, slow & ~exact, unit):
            # and the rate at which it stands is no end of the range in any other turn
            ratios = _gravity_ratios(whole, unit)
            others = ratios[slow & ~exact & np.isfinite(ratios)]
            usual = median(others) if len(others) >= MIN_SLOW_MOTIONS else 1.0
            shown = steady & (np.abs(ratios / usual - 1.0) < MIN_SHORTFALL)
            no_end = (1.0 + MAX_RANGE_DIFFERENCE) * float(tops[shown, 0].max(initial=0.0))
            honest = steady | (exact & (tops[:, 0] <= no_end))
            axes = [None if free else axis for axis, free in zip(axes, honest, strict=True)]
    piled = (tops[:, 1] >= MIN_FLAT_SHARE) & ~slow
    if piled.sum() >= MIN_FLAT_ENDS and _angle_lost(whole, piled, slow, unit):
        level = (1.0 - PLATEAU_BAND) * float(tops[:, 0].max())
        axes = [
            axis or _touched(np.abs(one.turned) >= level)
            for axis, one in zip(axes, motions, strict=True)
        ]
    return axes


def _measured_once(motions: Sequence[RateSegment]) -> Sequence[RateSegment]:
    """The motions with each measurement once, where the gyroscope is slower than the lines."""
    ends = np.cumsum([len(one.rate) for one in motions])
    rows = measured_rows(np.concatenate([one.rate for one in motions]))
    if rows is None:
        return motions
    each = np.split(rows, np.searchsorted(rows, ends[:-1]))
    first = [0, *ends[:-1].tolist()]
    return [
        replace(one, time=one.time[own - start], rate=one.rate[own - start]) if len(own) else one
        for one, own, start in zip(motions, each, first, strict=True)
    ]


def _no_end_is_passed(
    motions: Sequence[RateSegment], axes: Sequence[str | None]
) -> list[str | None]:
    """The clipped axes without those that read clearly more, in the same sense, in another motion.

    A turntable that is read by few samples stands at a rate as exactly as a clipped axis.
    """
    lowest, highest = (
        np.array([end(one.rate, axis=0) - one.rest for one in motions]) for end in (np.min, np.max)
    )
    out = list(axes)
    for place, name in enumerate(axes):
        if name is not None:
            axis = AXES.index(name)
            up, down = highest[:, axis], -lowest[:, axis]
            reached = up if up[place] > down[place] else down
            if reached[place] < (1.0 - MAX_RANGE_DIFFERENCE) * reached.max():
                out[place] = None
    return out


def _touched(at_end: BoolArray) -> str | None:
    """The axis with most of these samples, shape (n, 3), if it has enough of them."""
    touched = at_end.sum(axis=0)
    return AXES[int(touched.argmax())] if touched.max() >= MIN_PLATEAU else None


def _steadiness(motion: RateSegment, level: float) -> float:
    """Share of a motion's angle that was turned at its largest rate."""
    size = np.abs(motion.turned).max(axis=1)
    return float(size[np.abs(size - level) <= PLATEAU_BAND * level].sum() / size.sum())


def _angle_lost(
    motions: Sequence[RateSegment], fast: BoolArray, slow: BoolArray, unit: str
) -> bool:
    """Whether the integrated rate falls short of gravity in fast motions, but not in slow ones.

    Args:
        motions: all n of them.
        fast: the motions in question, shape (n,).
        slow: motions that do not come near the largest rate, shape (n,).
        unit: of the rates.
    """
    ratios = _gravity_ratios(motions, unit)
    short, honest = (ratios[which & np.isfinite(ratios)] for which in (fast, slow))
    if not len(short):
        return False
    usual, doubt = 1.0, np.inf
    if len(honest) >= MIN_SLOW_MOTIONS:
        usual = median(honest)
        spread = robust_deviation(honest - usual) / usual
        doubt = max(MIN_SHORTFALL, 5.0 * spread * np.sqrt(1.0 / len(short) + 1.0 / len(honest)))
    # too few, or about axes that differ by more than clipping takes away: the scale is not known
    if unit != COUNT and doubt > MIN_UNKNOWN_SHORTFALL:
        usual, doubt = 1.0, MIN_UNKNOWN_SHORTFALL
    return bool(median(short) / usual > 1.0 + doubt)


def _top(turned: FloatArray) -> tuple[float, float]:
    """The rate at which the liveliest axis stands longest near its extreme, and how flat that is.

    The share of the samples in the top tenth that lie in a band around their median: about a third
    at the top of a smooth turn, nearly all on a plateau, whatever noise or filter follows it.
    """
    best = (0.0, 0.0)
    axis = int(np.abs(turned).max(axis=0).argmax())
    for values in (turned[:, axis], -turned[:, axis]):
        high = values[values >= NEAR_TOP * values.max()]
        level = median(high)
        if level > best[0]:
            flat = float(np.mean(np.abs(high - level) <= PLATEAU_BAND * level))
            best = (level, flat if len(high) >= MIN_LONG_PLATEAU else 0.0)
    return best


def seconds_at_end(time: FloatArray, rate: FloatArray) -> float:
    """Time for which the liveliest axis of a clipped motion stays at its extreme, s."""
    turned = rate - rate[0]
    level = (1.0 - PLATEAU_BAND) * _top(turned)[0]
    at_end = (np.abs(turned) >= level).any(axis=1)
    return float(at_end.sum() * np.diff(time).mean())


def _gravity_ratios(motions: Sequence[RateSegment], unit: str) -> FloatArray:
    """Angle by gravity over the integrated rate of each motion; NaN where gravity shows none."""
    angles, felt = np.full(len(motions), np.nan), np.full(len(motions), np.nan)
    centre = sphere_centre(np.array([one.before for one in motions] + [motions[-1].after]))
    centre = np.zeros(3) if centre is None else centre
    for i, one in enumerate(motions):
        steps = np.gradient(one.time)[:, None] * one.turned
        total = steps.sum(axis=0)
        size = float(np.linalg.norm(total))
        if size < 0.9 * float(np.linalg.norm(steps, axis=1).sum()):  # about several axes
            continue
        axis = total / size
        before, after = one.before - centre, one.after - centre
        first, last = before - axis * (axis @ before), after - axis * (axis @ after)
        level = float(np.linalg.norm(first)) / float(np.linalg.norm(before))
        if level > 0.5:  # gravity shows a rotation about a level axis
            # gravity turns the other way in the body frame
            angles[i] = -np.arctan2(axis @ np.cross(first, last), first @ last)
            felt[i] = size
    known = np.isfinite(felt)
    if not known.any():
        return felt
    scale = 1.0 if unit != COUNT else median(np.abs(angles[known]) / felt[known])
    whole = 2.0 * np.pi * np.round((scale * felt - angles) / (2.0 * np.pi))
    return np.asarray((angles + whole) / felt)


def clipped_axis(
    rate: FloatArray, rest: FloatArray, full_scale: float | None, unit: str
) -> str | None:
    """The axis that was clipped during a rotation, or None.

    Args:
        rate: readings, shape (n, 3).
        rest: the reading at rest, shape (3,).
        full_scale: full scale of the gyroscope in the reading's unit, or None.
        unit: unit of the readings; a plateau within the smallest common range is not clipping.
    """
    for index, axis in enumerate(AXES if len(rate) else ""):
        column = rate[:, index]
        if full_scale is not None and np.abs(column).max() >= MIN_FULL_SCALE_SHARE * full_scale:
            return axis
        if unit == COUNT and float(np.ptp(column)) < MIN_COUNT_SPAN:
            continue
        turned = column - rest[index]
        for signed, end in ((turned, column.max()), (-turned, column.min())):
            within = unit != COUNT and abs(end) < MIN_RATE_RANGE
            if not within and float(signed.max()) > 0.0 and _flat_top(signed):
                return axis
    return None


def _flat_top(values: FloatArray) -> bool:
    """Whether a plateau at the largest value is entered by a jump.

    A smooth peak in coarse steps also forms a plateau, but it is entered step by step.
    """
    if len(values) <= MIN_PLATEAU:
        return False
    at_top = np.flatnonzero(values == values.max())
    if len(at_top) < MIN_PLATEAU:
        return False
    steps = np.abs(np.diff(values))
    resolution = float(steps[steps > 0.0].min(initial=np.inf))
    for plateau in np.split(at_top, np.flatnonzero(np.diff(at_top) > 1) + 1):
        if plateau[0] == 0:  # nothing shows how it was entered
            continue
        jump = steps[plateau[0] - 1] / resolution
        if len(plateau) >= MIN_PLATEAU and jump >= MIN_PLATEAU_JUMP:
            return True
        if len(plateau) >= MIN_LONG_PLATEAU and jump >= MIN_LONG_PLATEAU_JUMP:
            return True
    return False


def axes_without_noise(holds: Sequence[Hold], step: FloatArray) -> tuple[list[Notice], BoolArray]:
    """Holds in which an axis of the accelerometer repeats one reading without noise.

    At the end of the range they do so in every hold beyond it; elsewhere the converter skips codes,
    or the sensor has stopped measuring for a while.

    Readings whose noise is smaller than their step cannot be judged: any hold may be silent.

    Args:
        holds: holds without the contribution of rounding to their covariance.
        step: smallest step of the readings of each axis, shape (3,).

    Returns:
        A warning about the ends of the range, one for each axis that is stuck elsewhere, and which
        holds they are, shape (h,).
    """
    wrong = np.zeros(len(holds), np.bool_)
    if len(holds) <= MIN_SILENT_HOLDS:
        return [], wrong
    means = np.array([hold.accelerometer for hold in holds])
    variances = np.array([np.diag(hold.accelerometer_covariance) for hold in holds])
    samples = median([hold.samples for hold in holds])
    notes, ends = list[Notice](), list[str]()
    for axis in range(3):
        usual = median(variances[:, axis])
        if not usual * samples > step[axis] ** 2:
            continue
        silent = variances[:, axis] <= SILENT_VARIANCE_SHARE * usual
        wrong |= silent
        for end in (means[:, axis].min(), means[:, axis].max()):
            # the mean of equal readings equals them only up to rounding
            there = np.isclose(means[:, axis], end, rtol=1e-9, atol=0.0) & silent
            count = int(there.sum())
            if count >= MIN_SILENT_HOLDS:
                read = true_minus(f"{end:.5g}")
                ends.append(f"{AXES[axis]} axis reads {read} in {count} holds")
                silent &= ~there
        stuck = [hold for hold, quiet in zip(holds, silent, strict=True) if quiet]
        if stuck:
            at_end = bool(set(means[silent, axis]) & {means[:, axis].min(), means[:, axis].max()})
            end = "this is the end of its range, " if at_end else ""
            places = ", ".join(f"{one.start:.1f} to {one.end:.1f} s" for one in stuck[:3])
            more = f" and {len(stuck) - 3} more" if len(stuck) > 3 else ""
            text = (
                f"the accelerometer's {AXES[axis]} axis does not change at all in the holds from "
                f"{places}{more}: {end}its converter skips codes there, or the sensor repeated one "
                "reading; these readings are wrong and not used: measure these holds again at "
                "another angle"
            )
            notes.append(Notice(text, NoticeKind.STUCK_HOLDS, "accelerometer"))
    if ends:
        text = (
            f"the accelerometer's {', '.join(ends)}, without any noise: the end of its range; "
            f"these readings are wrong and not used: {CLIPPING_ADVICE['accelerometer']}, and "
            "measure again"
        )
        notes.insert(0, Notice(text, NoticeKind.CLIPPED_HOLDS, "accelerometer"))
    return notes, wrong


def partly_clipped(holds: Sequence[Hold], series: Series) -> tuple[list[Notice], BoolArray]:
    """Holds in which some samples of the accelerometer are at the end of its range.

    Args:
        holds: the holds.
        series: all samples of the accelerometer.

    Returns:
        A warning, and which holds they are, shape (h,).
    """
    ends, wrong = list(_ends("accelerometer", series)), np.zeros(len(holds), np.bool_)
    for place, hold in enumerate(holds if ends else ()):
        values = hold.readings(series).values
        shares = [float((values[:, axis] == end).mean()) for axis, end in ends if len(values)]
        wrong[place] = max(shares, default=0.0) > MAX_CLIPPED_SHARE
    if not wrong.any():
        return [], wrong
    places = [
        f"{holds[place].start:.1f} to {holds[place].end:.1f} s"
        for place in np.flatnonzero(wrong).tolist()
    ]
    more = f" and {len(places) - 3} more" if len(places) > 3 else ""
    text = (
        f"in the holds from {', '.join(places[:3])}{more} some samples of the accelerometer are at "
        f"the end of its range, so that their means are wrong; not used: "
        f"{CLIPPING_ADVICE['accelerometer']}, and measure again"
    )
    return [Notice(text, NoticeKind.CLIPPED_HOLDS, "accelerometer")], wrong


def frozen_axis(window: Windows, noise: Noise | None, steps: FloatArray) -> str:
    """Warning about an accelerometer axis that normally has noise and shows none, or "".

    A reading at the end of its range, or one that is repeated, does not flicker.
    """
    if noise is None:
        return ""
    alive = (noise.std_a > MIN_FLICKER_STEPS * steps) & (steps > 0.0)
    frozen = np.flatnonzero(alive & (window.std_a[0] == 0.0))
    if not len(frozen):
        return ""
    axis = AXES[int(frozen[0])]
    return (
        f"{axis} of the accelerometer does not change at all in this pose, as at the end of its "
        f"range. If so, {CLIPPING_ADVICE['accelerometer']}."
    )
