"""Times of the samples: from a column, a counter or the rate.

Nothing is mended in silence: the warnings come beside the times.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.errors import RecordingError
from imucal_wizard.readings import BoolArray, FloatArray
from imucal_wizard.recordings.clockwork import in_order, rolled_over, spread, unwrapped
from imucal_wizard.units import TIME

_PLAUSIBLE_RATES = (5.0, 20_000.0)
_POSSIBLE_RATES = (0.05, 200_000.0)
_UNITS_TRIED = ("s", "ms", "us", "ns")
_GAP_STEPS = 1.75
"""A step longer than this many usual ones has lost a sample."""
_BACK = 0.2
"""More steps back than this share make a column that is no time."""
_JUMP = 3600.0
"""Seconds from which a step is a clock that was set, not samples that are missing."""
_UNEVEN = 0.1
_BURST = 5.0
"""Steps between bursts are so many times those within them."""
_JITTER = 0.05
"""More gaps than this share of the steps are jitter of the clock and no loss."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """Times of the rows that are kept.

    Attributes:
        time: seconds, shape (n,), never decreasing.
        rows: places of these rows in the table, shape (n,).
        warnings: what was put right.
    """

    time: FloatArray
    rows: NDArray[np.intp]
    warnings: tuple[str, ...] = ()


def from_rate(rows: int, rate: float) -> Timeline:
    """Times of samples that come ``rate`` times per second, the first at 0."""
    return Timeline(np.arange(rows) / rate, np.arange(rows))


def from_counter(counter: FloatArray, rate: float) -> Timeline:
    """Times of samples that the device numbered; missing numbers are missing samples."""
    rows = np.flatnonzero(np.isfinite(counter))
    numbers, wrapped = unwrapped(counter[rows], "sample counter")
    numbers, kept, mended = in_order(numbers, near=5.0, gap=rate, what="sample counter")
    time = (numbers - numbers[:1]) / rate
    return _gaps_told(Timeline(time, rows[kept], wrapped + mended))


def from_column(ticks: FloatArray, unit: str, rate: float | None) -> Timeline:
    """Times from a column.

    Args:
        ticks: the column, shape (n,); rows without a number are left out.
        unit: its unit, or ``""`` to take the one that gives a plausible rate.
        rate: samples per second if the user gave it; the unit is chosen by it.

    Raises:
        RecordingError: no unit gives a plausible rate, or the column is no time and no rate is
            given.
    """
    rows = np.flatnonzero(np.isfinite(ticks))
    if says := _no_time(ticks[rows]):
        if rate is None:
            raise RecordingError(f"{says}; leave it out with --columns (- in its place) and --rate")
        line = from_rate(len(ticks), rate)
        return replace(line, warnings=(f"{says} and was not used; times are from --rate",))
    ticks = ticks[rows]
    guessed: tuple[str, ...] = ()
    if not unit:
        unit, guessed = guess_unit(ticks, rate)
    _possible(ticks, unit)
    ticks, wrapped = (ticks, ()) if unit == "s" else unwrapped(ticks, "device's clock")
    time, over = rolled_over(ticks * TIME[unit])
    wrapped += over
    found = time
    time, kept, mended = in_order(time, near=5.0 * usual_step(time), gap=1.0, what="time")
    time, even = spread(time)
    timeline = Timeline(time, rows[kept], guessed + wrapped + mended + even)
    return _rate_told(_gaps_told(timeline, np.diff(found[kept]) < 0), rate)


def _no_time(ticks: FloatArray) -> str:
    """Why a column is no time, or ""."""
    steps = np.diff(ticks)
    if not len(steps):
        return ""
    if not (steps != 0).any():
        return f"the time column stands still at {ticks[0]:.6g}"
    back = float((steps < 0).mean())
    return f"the time column goes back in {back:.0%} of its steps" if back > _BACK else ""


def _possible(ticks: FloatArray, unit: str) -> None:
    """A unit in which no IMU can have sampled is refused.

    Raises:
        RecordingError: the unit is wrong.
    """
    step = usual_step(ticks) * TIME[unit]
    if step > 0.0 and not _POSSIBLE_RATES[0] <= 1.0 / step <= _POSSIBLE_RATES[1]:
        raise RecordingError(
            f"the times in {unit} would mean {1.0 / step:.3g} samples per second; give their unit"
            " with --columns, for example t[ms]"
        )


def guess_unit(ticks: FloatArray, rate: float | None) -> tuple[str, tuple[str, ...]]:
    """The unit of a time column that gives a plausible rate, and a warning that it was guessed.

    Raises:
        RecordingError: there is none.
    """
    step = usual_step(ticks)
    rates = {unit: 1.0 / (step * TIME[unit]) for unit in _UNITS_TRIED if step > 0}
    low, high = (0.3 * rate, 3.0 * rate) if rate else _PLAUSIBLE_RATES
    for unit, found in rates.items():
        if low <= found <= high:
            return unit, (f"the time column was taken as {unit}, which gives {found:.6g} Hz",)
    raise RecordingError(
        f"the unit of the time column cannot be told from steps of {step:.6g}; name it in the"
        " header or with --columns, for example t[ms]"
    )


def usual_step(ticks: FloatArray) -> float:
    """Median of the steps forward; 0 when there are none."""
    steps = np.diff(ticks)
    steps = steps[steps > 0]
    return float(np.median(steps)) if len(steps) else 0.0


def _gaps_told(timeline: Timeline, restarts: BoolArray | None = None) -> Timeline:
    """The same, with a warning about what is missing; at a restart nobody knows what is."""
    steps = np.diff(timeline.time)
    usual = float(np.median(steps)) if len(steps) else 0.0
    jumps = np.flatnonzero(steps > _JUMP)
    if len(jumps):
        timeline = replace(timeline, warnings=(*timeline.warnings, _jumped(timeline, jumps)))
    long = (steps > _GAP_STEPS * usual) & (steps <= _JUMP)
    if restarts is not None:
        long &= ~restarts
    gaps = np.flatnonzero(long) if usual > 0 else np.zeros(0, np.intp)
    if not len(gaps):
        return timeline
    longest = gaps[np.argmax(steps[gaps])]
    if len(gaps) > _JITTER * len(steps) and _uneven(steps[gaps] / usual):
        says = (
            "the times jitter as if they were taken where the samples arrived; let the device"
            " print its own time, or leave the column out and give --rate"
        )
    else:
        lost = int(np.round(steps[gaps] / usual - 1.0).sum())
        where = f"{len(gaps)} gap{'s' * (len(gaps) > 1)}"
        says = (
            f"about {lost} samples are missing in {where}, the longest {steps[longest]:.3g} s at"
            f" {timeline.time[longest]:.6g} s; rotations across a gap are not used"
        )
    return replace(timeline, warnings=(*timeline.warnings, says))


def _uneven(ratios: FloatArray) -> bool:
    """Whether long steps are not two or three usual ones, as those without some samples are."""
    parts = np.abs(ratios - np.round(ratios))
    return float(np.median(parts)) > _UNEVEN or float(np.median(ratios)) > _BURST


def _jumped(timeline: Timeline, jumps: NDArray[np.intp]) -> str:
    """What to say of steps of hours."""
    first = int(jumps[0])
    step = timeline.time[first + 1] - timeline.time[first]
    return (
        f"the time jumps by {step:.3g} s after {timeline.time[first]:.6g} s (a clock that was set,"
        " or a garbled line); nothing is measured across it"
    )


def _rate_told(timeline: Timeline, rate: float | None) -> Timeline:
    """The same, with a warning when the times contradict the rate that was given."""
    step = usual_step(timeline.time)
    if rate is None or step == 0.0 or abs(1.0 / step - rate) <= 0.01 * rate:
        return timeline
    says = (
        f"--rate {rate:g} was not used: the times in the file say {1.0 / step:.6g} Hz; if they are"
        " wrong, leave the time column out with --columns (- in its place)"
    )
    return replace(timeline, warnings=(*timeline.warnings, says))
