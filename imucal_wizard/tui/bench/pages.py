"""The pages of the bench as rows: lesson, next poses, raw trace."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.poses import direction_in_words, pose_in_words
from imucal_wizard.core.quantities import number, size_with_unit, true_minus, unit_sign
from imucal_wizard.core.readings import BoolArray, FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.core.units import COUNT
from imucal_wizard.diagnose.bench import Entry
from imucal_wizard.diagnose.diagnosis import Apart
from imucal_wizard.diagnose.next_poses import to_measure
from imucal_wizard.diagnose.reservation_text import differing_in_new_poses
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.diagnose.verdict_text import beyond_these
from imucal_wizard.diagnose.views import Point, ResidualView, clearest, point_of, views_over
from imucal_wizard.measurement.requests import MeasurementRequest
from imucal_wizard.model.effect import ACCELEROMETER, Effect
from imucal_wizard.model.lesson import BASE_LESSONS, lesson, picture
from imucal_wizard.tui.bench.panels import picture_rows
from imucal_wizard.tui.bench.snapshot import BenchSnapshot
from imucal_wizard.tui.panels.traces import trace
from imucal_wizard.tui.text import Line, Span, clock, line, wrapped

LESSON_PLOT_ROWS = 11
"""Rows of the plot in a lesson."""


def rows_for(snapshot: BenchSnapshot, term: str, width: int, *, hidden: bool = False) -> list[Line]:
    """The lesson about an effect, a term of the base, or a disturbed hold.

    Args:
        snapshot: of the bench.
        term: what it is about.
        width: columns available.
        hidden: the answer is hidden: show the data without the prediction of the effect.
    """
    known = {effect.name: effect for effect in snapshot.catalogue}
    if term not in known:
        return plain_rows(term, snapshot.sensor, width)
    suspect = next((one for one in snapshot.findings.suspects if one.term == term), None)
    views = views_over(snapshot.views, known[term], snapshot.sensor)
    own = None if suspect is None else clearest(snapshot.findings, views, suspect)
    if own is not None and hidden:
        own = replace(own, predicted=None, suspect="")
    return lesson_rows(known[term], snapshot, width, own)


def lesson_rows(
    effect: Effect, snapshot: BenchSnapshot, width: int, own: ResidualView | None = None
) -> list[Line]:
    """The lesson about an effect, with the user's own points (``own``) over its prediction."""
    sensor = snapshot.sensor
    words = lesson(effect, sensor, snapshot.catalogue)
    rows = [*_heading(effect.title), *wrapped(words.what, width), line("")]
    rows += _part("equation", words.equation, width)
    rows += [line(f"    {effect.equation}", "key"), line("")]
    rows += _part("what it looks like", words.signature, width)
    rows += [*signature_rows(effect, sensor, width), line("")]
    if own is not None:
        rows += [
            line("your data", "strong"),
            line(f"  {own.part}: {own.title}, {own.unit}", "quiet"),
        ]
        rows += [line(f"  {own.legend}", "quiet")]
        rows += [*picture_rows(own, min(width, 90), LESSON_PLOT_ROWS), line("")]
    rows += _part("usual sizes", words.sizes, width)
    rows += [line(""), *_part("data that show it", words.needs, width)]
    rows += [line(""), *_part("cost of ignoring it", words.cost, width)]
    more = (
        ("what to do about it", words.remedy),
        ("how to confirm it without this program", words.confirm),
        ("source", words.source),
        ("what looks like it", words.alike),
    )
    for name, text in more:
        if text:
            rows += [line(""), *_part(name, text, width)]
    return rows


def plain_rows(term: str, sensor: str, width: int) -> list[Line]:
    """The same for a term of the base or a disturbed hold."""
    text = BASE_LESSONS[sensor].get(term, "There is no lesson about it.")
    return [*_heading(term), *wrapped(text, width)]


def signature_rows(effect: Effect, sensor: str, width: int) -> list[Line]:
    """The plot of the residuals that the effect causes in an ordinary session."""
    drawn = picture(effect, sensor)
    places = np.arange(len(drawn.x))
    view = ResidualView("", "", "", drawn.x_label, "", drawn.x, drawn.y, places, "")
    head = line(f"  residual of the base model: {drawn.y_label}", "quiet")
    return [head, *picture_rows(view, min(width, 90), LESSON_PLOT_ROWS)]


def _heading(text: str) -> list[Line]:
    return [line(text.upper(), "accent"), line("")]


def _part(name: str, text: str, width: int) -> list[Line]:
    return [line(name, "strong"), *wrapped(text, width)]


_LIVE: Span = ("m measures these now, one by one, and returns here.", "accent")
_RECORDING = (
    "This is a recording. To measure these, open the bench from the wizard, with the device: "
    "there m measures them one by one."
)
MORE_DATA = (
    "More data show smaller effects: hold new directions, and repeat the first poses (they show a "
    "drift)."
)
_OPTIONAL = "Nothing has to be measured: these would show smaller effects."
_NEVER = (
    "None of the poses tried here separates them. Many more holds, stronger forces or another "
    "course of the temperature may separate them."
)
_NEVER_TURNING = "None of the rotations tried here separates them; {} may."


def next_rows(
    snapshot: BenchSnapshot, width: int, *, chosen: Entry | None = None, live: bool = False
) -> list[Line]:
    """The whole verdict, then what to measure next.

    Args:
        snapshot: of the bench.
        width: columns available.
        chosen: the selected suspect.
        live: the source is a device, which can measure more.
    """
    poses, apart = to_measure(snapshot.diagnosis, None if chosen is None else chosen.suspect)
    repeated = chosen is not None and chosen.term == "disturbed" and bool(poses)
    rows = [*wrapped(snapshot.diagnosis.says, width), line("")]
    if apart is not None:
        head = f"{apart.first} OR {apart.second}?".upper()
        rows += [line(head, "accent"), *gain_rows(apart, snapshot.catalogue, width), line("")]
    asked = repeated or snapshot.diagnosis.next_poses or snapshot.diagnosis.base_left_out
    if not poses:
        waits = snapshot.diagnosis.verdict is Verdict.WAITING
        return rows if asked or waits else [*rows, *wrapped(MORE_DATA, width), line("")]
    # nothing is missing, and the poses that were added agree
    said = snapshot.diagnosis
    optional = not asked and apart is None and said.settled
    optional &= said.bench is None or differing_in_new_poses(said) is None
    rows.append(line("MEASURE NEXT, IF YOU LIKE" if optional else "MEASURE NEXT", "accent"))
    if optional:
        rows += wrapped(_OPTIONAL, width, "quiet")
    if live:
        rows.append((_LIVE,))
    else:
        rows += wrapped(_RECORDING, width, "quiet")
    for k, pose in enumerate(poses):
        rows += next_pose_rows(k + 1, pose, width, short=apart is not None and apart.poses > 0)
    return rows


def gain_rows(apart: Apart, catalogue: Sequence[Effect], width: int) -> list[Line]:
    """The size from which two effects of a catalogue are separated, now and with the poses."""
    pair = f"{apart.first} and {apart.second}"
    now = f"These data do not separate {pair} at any size."
    if np.isfinite(apart.before):
        least = size_with_unit(apart.before, apart.unit)
        now = f"These data separate {pair} from a size of {least} on."
    now += f" The size here is about {size_with_unit(apart.size, apart.unit)}."
    if apart.enough and not apart.poses:
        return wrapped(f"{now} They are separated already.", width, "strong")
    if apart.never or not apart.poses:
        never = _NEVER
        if apart.turning:
            kind = next(one.kind for one in catalogue if one.name == apart.first)
            never = _NEVER_TURNING.format(beyond_these(kind, turning=True))
        return [*wrapped(now, width), *wrapped(never, width, "warn")]
    worth = "this is enough" if apart.enough else "this is not enough yet"
    if apart.before <= apart.size:
        worth = "they are separated already; this confirms it"
    after = size_with_unit(apart.after, apart.unit)
    then = f"With {apart.things}: from a size of {after} on; {worth}."
    return [*wrapped(now, width), *wrapped(then, width, "strong")]


def next_pose_rows(place: int, pose: MeasurementRequest, width: int, *, short: bool) -> list[Line]:
    """A pose with its number, its name and its purpose."""
    name = f"{true_minus(pose.pose).upper()} UP" if pose.pose else "TILTED"
    if pose.axis:
        name = f"ABOUT {pose.axis.upper()}, {pose.turns}×"
    # the purpose of all poses together stands above them
    text = pose_in_words(pose.pose) if pose.pose else direction_in_words(pose.direction)
    text += f", {pose.brief}" if pose.brief and not short else ""
    text = pose.brief if pose.axis else text
    text = f"{'warm the device first; ' * pose.warm}{text}"
    why = wrapped(text, max(30, width - 20))
    rows: list[Line] = [((f"{place:>3}  ", "key"), (f"{name:<14} ", "strong"), *why[0])]
    return rows + [((" " * 20, ""), *more) for more in why[1:]]


AROUND = 1.0
"""Seconds shown before and after, so that the approach to rest is visible."""
TRACE_ROWS = 3
"""Rows of each axis."""
_AXIS_LABEL = 11
_SPAN_SIGMAS = 4.0
"""Least span of an axis in standard deviations of the readings at rest: a jump stays visible, and
the noise of a good hold fills the rows."""
_SCALES = {"m/s^2": (1.0, "m/s²"), "rad/s": (180.0 / np.pi, "°/s"), "uT": (1.0, "µT")}


@dataclass(frozen=True, eq=False)
class TracePiece:
    """A piece of one sensor's readings.

    Attributes:
        name: of the sensor.
        series: the readings.
        rest: the time that was averaged, or None.
    """

    name: str
    series: Series
    rest: tuple[float, float] | None


def raw_trace_rows(
    snapshot: BenchSnapshot, view: ResidualView, place: int, width: int
) -> list[Line]:
    """All readings of the hold or rotation at a point of a plot.

    Args:
        snapshot: of the bench.
        view: the plot.
        place: index of the point.
        width: columns available.
    """
    point = point_of(snapshot.diagnosis.report, view, place)
    if not np.isfinite(point.start):
        return wrapped("The readings are not available.", width)
    head = f"{point.name}, from {clock(point.start)}"
    left = f"residual: {number(float(view.y[place]), 3)} {view.unit}"
    rows = [line(head, "accent"), line(left if view.model is None else "", "quiet")]
    stretches = _stretches(snapshot, point)
    if not stretches:
        why = "Only the means of the readings are available."
        return [*rows, *wrapped(why, width)]
    for stretch in stretches:
        rows += _drawn(stretch, width)
    foot = "the motion between two holds"
    if point.at_rest:
        foot = "└ the part between the two │ was averaged"
    elif view.rows is not None and not view.rows[0].moving:
        foot = "the samples in this direction were averaged"
    return [*rows, line(f"  {foot}; {point.end - point.start:.1f} s of readings", "quiet")]


def _stretches(snapshot: BenchSnapshot, point: Point) -> list[TracePiece]:
    """The readings of this sensor, then those of the other one, if they are available."""
    readings = snapshot.readings
    rest = (point.start, point.end) if point.at_rest else None
    if readings is None:
        kept = point.samples
        if kept is None:
            return []
        return [
            TracePiece(
                snapshot.sensor, Series(kept.time, kept.values, snapshot.fit.bias_unit), None
            )
        ]
    names = [snapshot.sensor, *(n for n in (ACCELEROMETER, "gyroscope") if n != snapshot.sensor)]
    found = []
    for name in names:
        series: Series | None = getattr(readings, name)
        if series is not None:
            piece = series.between(point.start - AROUND, point.end + AROUND)
            if len(piece) > 1:
                found.append(TracePiece(name, piece, rest))
    return found


def _drawn(stretch: TracePiece, width: int) -> list[Line]:
    """Three axes, each in its own rows with its own limits."""
    series = stretch.series
    factor, unit = _SCALES.get(series.unit, (1.0, unit_sign(series.unit)))
    inside = _inside(stretch)
    columns = max(20, width - _AXIS_LABEL - 2)
    rows: list[Line] = [line("")]
    largest = float(np.abs(series.values).max()) * factor * 1.05
    for k, axis in enumerate("xyz"):
        values = series.values[:, k] * factor
        # at rest each axis has its own span; a common span shows the axis of a rotation
        low, high = -largest, largest
        if stretch.rest is not None:
            low, high = _limits(values, inside, series.unit)
        picture = trace(np.clip(values, low, high), low, high, columns, TRACE_ROWS)
        labels = [number(high, 4), f"{axis} {unit}", number(low, 4)]
        words = _words(values[inside], unit, at_rest=stretch.rest is not None)
        rows.append(line(f"{stretch.name} {axis}   {words}", "strong"))
        edges = _edges(stretch, columns)
        for label, cells in zip(labels, picture, strict=True):
            marked = ["│" if c in edges and cell == " " else cell for c, cell in enumerate(cells)]
            rows.append(((f"{label:>{_AXIS_LABEL}} ", "quiet"), ("".join(marked), "")))
    return rows


def _inside(stretch: TracePiece) -> BoolArray:
    """Which samples were averaged, as a mask, shape (n,)."""
    time = stretch.series.time
    if stretch.rest is None:
        return np.ones(len(time), bool)
    return np.asarray((time >= stretch.rest[0]) & (time < stretch.rest[1]))


def _limits(values: FloatArray, inside: BoolArray, unit: str) -> tuple[float, float]:
    """Limits from the averaged samples; others may be cut off."""
    kept = values[inside] if inside.any() else values
    middle, spread = median(kept), float(kept.std())
    least = _SPAN_SIGMAS * spread or (1.0 if unit == COUNT else 1e-3)
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


def _edges(stretch: TracePiece, columns: int) -> set[int]:
    """Columns in which the averaged part begins and ends."""
    if stretch.rest is None:
        return set()
    time = stretch.series.time
    share = [(edge - time[0]) / max(time[-1] - time[0], 1e-9) for edge in stretch.rest]
    return {min(columns - 1, max(0, round(float(one) * (columns - 1)))) for one in share}
