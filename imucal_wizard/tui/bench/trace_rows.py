"""The raw trace of one hold or turn: every reading of it, axis by axis."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.effects.effect import ACCELEROMETER
from imucal_wizard.readings import BoolArray, FloatArray, Series
from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.solver.result import FitReport
from imucal_wizard.tui.bench.field_views import field_point, field_span
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.bench.views import TURNS, View
from imucal_wizard.tui.bench.words import pose_at
from imucal_wizard.tui.text import Line, clock, line, number, unit_sign, wrapped
from imucal_wizard.tui.widgets.traces import trace
from imucal_wizard.units import COUNT

AROUND = 1.0
"""Seconds shown before and after, so that one sees how it came to rest."""
ROWS = 3
"""Rows of each axis."""
_LABEL = 11
_WIDE = 4.0
"""Standard deviations of the readings at rest that an axis spans at least: a jump stays a jump, and
the noise of a good hold fills the rows."""
_SCALES = {"m/s^2": (1.0, "m/s²"), "rad/s": (180.0 / np.pi, "°/s"), "uT": (1.0, "µT")}


@dataclass(frozen=True, eq=False)
class Stretch:
    """A piece of one sensor's readings.

    Attributes:
        name: of the sensor.
        series: the readings.
        rest: the part of them that was averaged, or None.
    """

    name: str
    series: Series
    rest: tuple[float, float] | None


def trace_rows(sight: Sight, view: View, place: int, width: int) -> list[Line]:
    """All readings of the hold or turn at a point of a picture.

    Args:
        sight: what was looked up.
        view: the picture.
        place: of the point in it.
        width: columns there are.
    """
    index = int(view.source[place])
    report = sight.said.report
    if report is None:
        return wrapped("The readings are not at hand.", width)
    if view.part == TURNS:
        head, start, end, rest = _turn(report, index)
    elif isinstance(sight.measured, FieldData) and index < len(sight.measured):
        head, rest = field_point(sight.measured, index)[0], None
        start, end = field_span(sight.measured, index)
    else:
        index = _hold_of(sight, index)
        hold = report.holds[index]
        head = f"pose {index + 1}, {_pose(sight, index)}, from {clock(hold.start)}"
        head += ", hand-held" * hold.hand_held
        start, end, rest = hold.start, hold.end, (hold.start, hold.end)
    left = f"what the model leaves of it: {number(float(view.y[place]), 3)} {view.unit}"
    rows = [line(head, "accent"), line(left if view.model is None else "", "quiet")]
    stretches = _stretches(sight, start, end, rest)
    if not stretches:
        why = "The readings themselves are not at hand, only their means."
        return [*rows, *wrapped(why, width)]
    for stretch in stretches:
        rows += _drawn(stretch, width)
    foot = "└ the part between the two │ was averaged" if rest else _moving(sight)
    return [*rows, line(f"  {foot}; {end - start:.1f} s of readings", "quiet")]


def _moving(sight: Sight) -> str:
    if isinstance(sight.measured, FieldData):
        return "of these the samples in this direction were averaged"
    return "the motion between two holds"


def _hold_of(sight: Sight, row: int) -> int:
    """The hold that a row of the measurement is of."""
    measured = sight.measured
    return int(measured.dips.hold[row - len(measured)]) if isinstance(measured, FieldData) else row


def _pose(sight: Sight, hold: int) -> str:
    report = sight.said.report
    if isinstance(sight.measured, FieldData) and report is not None:
        return report.holds[hold].pose or "between poses"
    return pose_at(sight, hold)


def _turn(report: FitReport, index: int) -> tuple[str, float, float, tuple[float, float] | None]:
    """Words, beginning and end of a turn."""
    rotation = report.rotations[index]
    about = f"about {rotation.axis}, " if rotation.axis else ""
    head = f"turn {index + 1}, {about}from {clock(float(rotation.time[0]))}"
    return head, float(rotation.time[0]), float(rotation.time[-1]), None


def _stretches(
    sight: Sight, start: float, end: float, rest: tuple[float, float] | None
) -> list[Stretch]:
    """The readings of this sensor, then those of the other one where they are at hand."""
    readings = sight.readings
    if readings is None:
        return _of_turn(sight, start, end) if rest is None else []
    names = [sight.sensor, *(n for n in (ACCELEROMETER, "gyroscope") if n != sight.sensor)]
    found = []
    for name in names:
        series: Series | None = getattr(readings, name)
        if series is not None:
            piece = series.between(start - AROUND, end + AROUND)
            if len(piece) > 1:
                found.append(Stretch(name, piece, rest))
    return found


def _of_turn(sight: Sight, start: float, end: float) -> list[Stretch]:
    """The rates of a turn, which are kept with it."""
    measured = sight.measured
    if not isinstance(measured, TurnData):
        return []
    samples = measured.samples
    series = Series(samples.time, samples.reading, measured.unit).between(start, end + 1e-9)
    return [Stretch("gyroscope", series, None)] if len(series) > 1 else []


def _drawn(stretch: Stretch, width: int) -> list[Line]:
    """Three axes, each in rows of its own with its limits."""
    series = stretch.series
    factor, unit = _SCALES.get(series.unit, (1.0, unit_sign(series.unit)))
    inside = _inside(stretch)
    columns = max(20, width - _LABEL - 2)
    rows: list[Line] = [line("")]
    largest = float(np.abs(series.values).max()) * factor * 1.05
    for k, axis in enumerate("xyz"):
        values = series.values[:, k] * factor
        # at rest each axis fills its rows; of a turn one sees which axis it was about
        low, high = -largest, largest
        if stretch.rest is not None:
            low, high = _limits(values, inside, series.unit)
        picture = trace(np.clip(values, low, high), low, high, columns, ROWS)
        labels = [number(high, 4), f"{axis} {unit}", number(low, 4)]
        words = _words(values[inside], unit, at_rest=stretch.rest is not None)
        rows.append(line(f"{stretch.name} {axis}   {words}", "strong"))
        edges = _edges(stretch, columns)
        for label, cells in zip(labels, picture, strict=True):
            marked = ["│" if c in edges and cell == " " else cell for c, cell in enumerate(cells)]
            rows.append(((f"{label:>{_LABEL}} ", "quiet"), ("".join(marked), "")))
    return rows


def _inside(stretch: Stretch) -> BoolArray:
    """Which samples were averaged, as a mask, shape (n,)."""
    time = stretch.series.time
    if stretch.rest is None:
        return np.ones(len(time), bool)
    return np.asarray((time >= stretch.rest[0]) & (time < stretch.rest[1]))


def _limits(values: FloatArray, inside: BoolArray, unit: str) -> tuple[float, float]:
    """Of what was averaged, with room for what is far out of it to be cut off."""
    kept = values[inside] if inside.any() else values
    middle, spread = float(np.median(kept)), float(kept.std())
    least = _WIDE * spread or (1.0 if unit == COUNT else 1e-3)
    reach = max(float(np.abs(kept - middle).max()), least)
    return middle - reach, middle + reach


def _words(values: FloatArray, unit: str, *, at_rest: bool) -> str:
    """Mean and noise at rest; the largest reading of a motion."""
    if not len(values):
        return ""
    if not at_rest:
        top = float(values[np.argmax(np.abs(values))])
        return f"largest {number(top, 3)} {unit}"
    return f"mean {number(float(values.mean()), 5)} {unit}, noise {number(float(values.std()), 2)}"


def _edges(stretch: Stretch, columns: int) -> set[int]:
    """Columns in which the averaged part begins and ends."""
    if stretch.rest is None:
        return set()
    time = stretch.series.time
    share = [(edge - time[0]) / max(time[-1] - time[0], 1e-9) for edge in stretch.rest]
    return {min(columns - 1, max(0, round(float(one) * (columns - 1)))) for one in share}
