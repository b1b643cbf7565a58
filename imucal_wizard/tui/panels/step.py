"""The parts of a measuring step as rows: stillness, progress, notices, poses, rotation, stream."""

from collections.abc import Sequence

from imucal_wizard.core.limits.procedure import FULL_ANGLE_DEG, MAX_CIRCLES, SPEEDS_WANTED
from imucal_wizard.core.quantities import decimals, fixed, number, plural, true_minus, unit_sign
from imucal_wizard.guide.kinds import Act, EventKind
from imucal_wizard.guide.state import (
    AxisMotion,
    AxisStart,
    Event,
    Offer,
    RotationStatus,
    Status,
    StillStatus,
)
from imucal_wizard.guide.wording import signed as signed_angle
from imucal_wizard.run.snapshot import StreamStatus
from imucal_wizard.tui.text import Line, Span, bar, clean, compact, line, width_of, wrapped

_NO_SAMPLES = (Act.CONNECT, Act.ENDED)
_BAR_CELLS = 5
"""Cells of a short bar; the limit is at the third cell."""
_AT_LIMIT = 3
_LETTERS = {"a": "a", "g": "ω"}
"""The symbol for a channel's first letter."""


def reason(status: Status) -> Line:
    """Whether the device is still; if not, which axis moves, by how much, and its limit."""
    label, still = ("STILL?  ", "strong"), status.still
    if status.act in _NO_SAMPLES:
        return label, ("no samples", "quiet")
    if not still.motions:
        return label, ("listening …", "quiet")
    if still.still:
        return label, ("yes ●", "good")
    return label, (f"no ▲ {still.reason}".rstrip(), "warn")


def short_bar(motion: AxisMotion) -> Span:
    """A bar of five cells; the third cell is the limit."""
    share = motion.value / motion.limit if motion.limit > 0 else 0.0
    if share != share:  # not a number: the channel is dead or garbled
        return "?" * _BAR_CELLS, "bad"
    filled = min(_BAR_CELLS, max(1, round(share * _AT_LIMIT)))
    filled = max(filled, _AT_LIMIT + 1) if motion.moving else min(filled, _AT_LIMIT)
    return "▪" * filled + "·" * (_BAR_CELLS - filled), "warn" if motion.moving else ""


def still_rows(still: StillStatus, width: int, height: int) -> list[Line]:
    """A row for each axis if there is room, else a row for each sensor."""
    if height >= len(still.motions) > 0:
        return [_full(motion, width) for motion in still.motions]
    sensors = [[m for m in still.motions if m.channel[0] == s] for s in ("a", "g")]
    return [compact_row(motions) for motions in sensors if motions]


def compact_row(motions: list[AxisMotion]) -> Line:
    """The axes of one sensor in one row, with as many decimals as the limits need."""
    name = f"{_LETTERS[motions[0].channel[0]]} {unit_sign(motions[0].unit)}"
    places = decimals(min(motion.limit for motion in motions))
    spans: list[Span] = [(f"{name:<7}", "quiet")]
    for motion in motions:
        value = compact(motion.value, places)
        sign = "▲" if motion.moving else " "
        spans += [(f" {motion.channel[-1]} ", "strong"), short_bar(motion)]
        spans.append((f"{sign}{value:<4}", "warn" if motion.moving else "quiet"))
    return tuple(spans)


def _full(motion: AxisMotion, width: int) -> Line:
    cells = max(10, min(40, width - 40))
    share = motion.value / motion.limit if motion.limit > 0 else 0.0
    at_limit = cells * 2 // 3
    filled = cells if share != share else min(cells, round(share * at_limit))
    drawn = "▪" * filled + "·" * (cells - filled)
    places = decimals(motion.limit)
    words = f" {fixed(motion.value, places)} of {fixed(motion.limit, places)}"
    words += f" {unit_sign(motion.unit)}"
    style = "warn" if motion.moving else ""
    name = f"{_LETTERS[motion.channel[0]]} {motion.channel[-1]}  "
    return (
        (name, "strong"),
        (drawn[:at_limit] + "│" + drawn[at_limit:], style),
        (words + (" ▲ moves" if motion.moving else ""), style),
    )


_SIGNS: dict[str, tuple[str, str]] = {
    EventKind.HOLD_TAKEN: ("✓", "good"),
    EventKind.ROTATION_TAKEN: ("✓", "good"),
    EventKind.STEP_DONE: ("✓", "good"),
    EventKind.FINISHED: ("✓", "good"),
    EventKind.LINK_BACK: ("✓", "good"),
    EventKind.FLOWING: ("✓", "good"),
    EventKind.FIELD_BACK: ("✓", "good"),
    EventKind.STALLED: ("▲", "bad"),
    EventKind.UNDONE: ("↶", "accent"),
    EventKind.STEP_SKIPPED: ("▲", "warn"),
    EventKind.HOLD_BROKEN: ("▲", "warn"),
    EventKind.WRONG_POSE: ("▲", "warn"),
    EventKind.ALREADY_DONE: ("▲", "warn"),
    EventKind.ROTATION_REJECTED: ("▲", "warn"),
    EventKind.STUCK: ("▲", "warn"),
    EventKind.LINK_LOST: ("▲", "bad"),
    EventKind.WARNING: ("▲", "warn"),
}


def notice_rows(
    problem: str, offers: Sequence[Offer], event: Event | None, width: int, height: int
) -> list[Line]:
    """The most important messages in the rows available: problem, offers, newest event."""
    rows = wrapped(f" ▲ {problem}", width - 2, "bad", indent="   ") if problem else []
    choices = offer_rows(offers, width - 2)
    room = height - len(rows) - len(choices)
    if event is not None and room > 0 and not problem:
        rows += event_rows(event, width - 2)[:room]
    return (rows + choices)[:height]


OFFER_KEYS = {
    "loosen": "l",
    "take": "t",
    "remeasure": "n",
    "enough": "g",
    "skip": "g",
    "count-faces": "f",
}
"""The key of each command that the procedure may offer."""


def offer_rows(offers: Sequence[Offer], width: int) -> list[Line]:
    """The offers with their keys, as many in a row as fit."""
    rows: list[list[Span]] = []
    for offer in offers:
        spans: list[Span] = [(f" {OFFER_KEYS[offer.command]} ", "key"), (f" {offer.text}  ", "")]
        if rows and width_of((*rows[-1], *spans)) <= width + 2:
            rows[-1] += spans
        else:
            rows.append(spans)
    return [tuple(row) for row in rows]


def event_rows(event: Event, width: int) -> list[Line]:
    """An event with its sign, wrapped."""
    sign, style = _SIGNS.get(event.kind, ("·", "quiet"))
    return wrapped(f" {sign} {event.text}", width, style, indent="   ")


def pose_rows(
    done: Sequence[str],
    missing: Sequence[str],
    wanted: str | None,
    recognised: str | None,
    width: int,
    height: int,
) -> list[Line]:
    """``●`` taken, ``◎`` asked for next, ``·`` missing: faces, edges, tilts, corners.

    The present pose is in brackets. If there is no room for all poses, only the missing ones are
    shown.
    """
    names = sorted(
        {*done, *missing, *([wanted] if wanted else [])},
        key=lambda name: (len(name), name[1::2], name[::2]),
    )
    signs = {name: _pose_signs(name, done, missing, wanted) for name in names}

    def laid(shown: Sequence[str]) -> list[Line]:
        rows: list[Line] = []
        for label, length in (("faces", 2), ("edges", 4), ("tilts", 5), ("corners", 6)):
            cells = [_pose(n, signs[n], recognised) for n in shown if len(n) == length]
            rows += _pose_cells(label, cells, width)
        return rows

    rows = laid(names)
    return rows if len(rows) <= height else laid([n for n in names if set(signs[n]) != {"●"}])


def _pose_signs(name: str, done: Sequence[str], missing: Sequence[str], wanted: str | None) -> str:
    """One sign for each time that a pose is needed."""
    left = max(0, missing.count(name) - (name == wanted))
    return "●" * done.count(name) + "◎" * (name == wanted) + "·" * left


def _pose(name: str, signs: str, recognised: str | None) -> Span:
    style = "accent" if "◎" in signs else "quiet" if "·" in signs else "good"
    text = f"{true_minus(name)} {signs}"
    return (f"[{text}]", style) if name == recognised else (f" {text} ", style)


def _pose_cells(label: str, cells: list[Span], width: int) -> list[Line]:
    if not cells:
        return []
    wide = max(len(text) for text, _ in cells) + 1
    per_row = max(1, (width - 9) // wide)
    per_row = 6 if len(cells) == 12 and 6 <= per_row < 12 else per_row
    rows: list[Line] = []
    for start in range(0, len(cells), per_row):
        head: Span = (f" {label if start == 0 else '':<7}", "quiet")
        part = cells[start : start + per_row]
        rows.append((head, *((text.ljust(wide), style) for text, style in part)))
    return rows


def start_rows(
    done: Sequence[str], wanted: str | None, start_values: Sequence[AxisStart]
) -> list[Line]:
    """Both faces of each axis, and the bias and sensitivity from them."""
    known = {start.axis: start for start in start_values}
    return [_start(axis, done, wanted, known.get(axis)) for axis in "xyz"]


def _start(axis: str, done: Sequence[str], wanted: str | None, start: AxisStart | None) -> Line:
    spans: list[Span] = []
    for name, text in ((f"+{axis}", f"+{axis}"), (f"-{axis}", f"−{axis}")):
        sign, style = ("●", "good") if name in done else ("·", "quiet")
        sign, style = ("◎", "accent") if name == wanted else (sign, style)
        spans.append((f"  {text} {sign}", style))
        value = None if start is None else start.up if name[0] == "+" else start.down
        spans.append((f" {number(value, 4):<8}" if value is not None else " " * 9, "quiet"))
    if start is not None and start.bias is not None and start.sensitivity is not None:
        unit = unit_sign(start.unit)
        bias, gain = number(start.bias), number(start.sensitivity, 4)
        spans.append((f" bias {bias} {unit}  sensitivity {gain} {unit} per g", ""))
    elif start is not None and (start.up is not None or start.down is not None):
        spans.append((f" {unit_sign(start.unit)}", "quiet"))
    return tuple(spans)


def rotation_rows(rotation: RotationStatus, width: int, act: Act = Act.ROTATE) -> list[Line]:
    """Angle, rate and range, rotations taken about the axis, what they lack: four rows.

    Where no samples arrive, angle and rate are not known.
    """
    moving = [_angle(rotation, width), _rate(rotation)]
    if act in _NO_SAMPLES:
        moving = [line(" so far  –", "quiet"), line(" rate    –", "quiet")]
    return [*moving, _done(rotation), _wanted(rotation)]


def _angle(rotation: RotationStatus, width: int) -> Line:
    half = max(8, min(30, (width - 44) // 2))
    filled = min(half, round(abs(rotation.angle) / FULL_ANGLE_DEG * half))
    beyond = abs(rotation.angle) > FULL_ANGLE_DEG
    left = right = "·" * half
    if rotation.angle < 0:
        left = "«" + "█" * (half - 1) if beyond else "·" * (half - filled) + "█" * filled
    elif rotation.angle > 0:
        right = "█" * (half - 1) + "»" if beyond else "█" * filled + "·" * (half - filled)
    return (
        (" so far  ", "quiet"),
        (f"{signed_angle(rotation.angle):>5}  ", "strong"),
        (f"▕{left}┃{right}▏", ""),
        (f" {rotation.least:.0f}° to {MAX_CIRCLES} circles count", "quiet"),
    )


def _rate(rotation: RotationStatus) -> Line:
    limit = rotation.range_limit
    words = f"{_whole(rotation.rate)} {rotation.unit}, fastest {_whole(rotation.fastest)}"
    if limit is None:
        source = "scale and range not known"
        if rotation.scaled_by:
            count = plural(rotation.scaled_by, "rotation")
            source = f"scale from {count} about {rotation.axis}, range not known"
        return (" rate    ", "quiet"), (words, ""), (f"   {source}", "quiet")
    share = rotation.fastest / limit
    fast = "▲ too fast: it would clip" if rotation.range_known else "▲ may clip"
    verdict: Span = ("within range", "good") if not rotation.clips else (fast, "warn")
    if round(rotation.fastest) == 0:
        verdict = ("", "")
    usual = "" if rotation.range_known else " (usual)"
    return (
        (" rate    ", "quiet"),
        (f"{words}, range {_whole(limit)}{usual}  ", ""),
        (bar(share, 14) + " ", ""),
        verdict,
    )


def _whole(value: float) -> str:
    return f"{value:.0f}".replace("-0", "0").replace("-", "−")


def _done(rotation: RotationStatus) -> Line:
    angles = " ".join(signed_angle(angle) for angle in rotation.done[-8:])
    head = f" about {rotation.axis} {len(rotation.done)} of {rotation.wanted} taken  "
    return (head, "quiet"), (angles, "strong")


def _wanted(rotation: RotationStatus) -> Line:
    speeds = rotation.speeds >= SPEEDS_WANTED
    some = "" if speeds else f" ({rotation.speeds} so far)"
    return (
        (" wanted  ", "quiet"),
        (f"both senses {_tick(rotation.senses)}", _tone(rotation.senses)),
        (f"   three speeds {_tick(speeds)}{some}", _tone(speeds)),
    )


def _tick(done: bool) -> str:
    return "✓" if done else "✗"


def _tone(done: bool) -> str:
    return "good" if done else ""


def stream_row(
    stream: StreamStatus, noise: str, loosened: float, muted: bool, width: int
) -> tuple[Span, ...]:
    """The stream in one row: rate, lost samples, temperature, noise, problems.

    Temperature and source are left out if they do not fit.
    """
    head: list[Span] = [(" ", "")]
    if not stream.connected:
        head.append(("▲ not connected, ", "bad"))
    else:
        head.append((f"{stream.rate:.1f} Hz, " if stream.rate else "rate not known yet, ", ""))
    head.append((f"{stream.lost} lost", "warn" if stream.lost else ""))
    if stream.malformed:
        head.append((f", {stream.malformed} unreadable", "warn"))
    tail: list[Span] = [("  sound off", "warn")] if muted else []
    if loosened > 1.0:
        tail.append((f"  limits ×{loosened:.0f}", "warn"))
    if noise:
        tail.append((f"  noise {clean(noise)}", ""))
    row = (*head, *tail)
    if stream.temperature is not None:
        warmth: Span = (f", {stream.temperature:.1f} °C".replace("-", "−"), "")
        row = _where_it_fits(row, (*head, warmth, *tail), width)
    return _where_it_fits(row, (*row, (f"  {clean(stream.source)}", "quiet")), width)


def _where_it_fits(row: tuple[Span, ...], longer: tuple[Span, ...], width: int) -> tuple[Span, ...]:
    return longer if width_of(longer) <= width else row
