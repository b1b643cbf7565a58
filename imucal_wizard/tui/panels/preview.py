"""The preview of a source: values, units, rate, losses, magnitude of gravity, decimals."""

import math
from typing import TYPE_CHECKING

from imucal_wizard.core.limits.stillness import MIN_USUAL_RATE
from imucal_wizard.core.quantities import decimals, fixed, number, plural, unit_sign
from imucal_wizard.core.units import COUNT
from imucal_wizard.tui.text import Line, Span, known_as, line, wrapped

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.run.snapshot import StreamStatus

_LINE_ROWS = 3
_WELCOME = (
    (
        "This program leads you through the calibration of accelerometer, gyroscope and "
        "magnetometer. Gravity and the Earth's field are the references."
    ),
    (
        "The steps are: settle, six faces, more poses, rotations, and circles for a magnetometer. "
        "They take about ten minutes and follow one another by themselves; your hands stay on the "
        "device."
    ),
    "No device? Open the virtual IMU: the first source in the list.",
    "Samples are on the disk within a second. You can quit at any time and continue later.",
)

_RECHECK = (
    "The recheck tells whether a device still agrees with its calibration: GO or NO-GO.",
    (
        "Put the device down for 5 s, then hold each face up for two seconds (longer below "
        f"{MIN_USUAL_RATE:.0f} samples/s), in any order, and rotate it in between. This takes "
        "about a minute."
    ),
    "Select the device that was calibrated.",
)


def welcome_rows(width: int, recheck: bool = False) -> list[Line]:
    """The introduction to a calibration or a recheck, shown while no source is open."""
    texts = _RECHECK if recheck else _WELCOME
    return [row for text in texts for row in (*wrapped(text, max(30, width)), line(""))]


def startable(stream: "StreamStatus") -> bool:
    """Whether samples arrive with known columns and units."""
    return bool(stream.samples) and not stream.needs and not interrupted(stream)


def can_be_entered(stream: "StreamStatus") -> bool:
    """Whether the user can enter what the stream does not state."""
    from imucal_wizard.acquire.resolve import NEEDS_ACCELEROMETER

    return stream.needs != NEEDS_ACCELEROMETER


def interrupted(stream: "StreamStatus") -> str:
    """Why no samples arrive, or ""; before the start, the end of a source is a lost link."""
    from imucal_wizard.guide.instruction import interruption

    missing = interruption(stream.flow(ended=False))
    return "" if missing is None else missing[1].lower()


def state_span(stream: "StreamStatus", name: str) -> Span:
    """The state of an open source in one row; ``preview_rows`` says what to do."""
    if stream.busy:
        return f"{name}: {stream.problem}", "strong"
    if missing := interrupted(stream):
        return f"▲ {name}: {missing}", "bad"
    if not can_be_entered(stream):
        return f"▲ {name}: no accelerometer", "bad"
    if stream.needs:
        return f"▲ not known: {', '.join(stream.needs)}.   c: choose", "warn"
    if stream.unwritten:
        return f"▲ {name}: the session is not being saved", "bad"
    if stream.samples:
        return f"{name}: is this what you expect?   enter starts", "strong"
    if stream.problem:
        return f"▲ {name}: no samples", "bad"
    return f"{name}: waiting for samples …", "strong"


def preview_rows(stream: "StreamStatus", width: int, device: str = "") -> list[Line]:
    """The newest values of the stream, with units, rate, losses, gravity and decimals.

    Where no samples arrive, only the problem and the newest line.

    Args:
        stream: its newest state.
        width: columns.
        device: what the history calls the device, or "".
    """
    width = max(30, width)
    rows = [line(stream.source or "source", "strong")]
    if device and device != stream.source:
        rows += wrapped(f"device: {device}", width, "quiet", indent="  ")
    if stream.line and not stream.samples:
        newest = wrapped(f"newest line: {stream.line}", width, "quiet", indent="  ")
        rows += [line(""), *newest[:_LINE_ROWS]]
    missing = bool(interrupted(stream))
    if stream.samples and not missing:
        rows += _arriving(stream, width)
    in_state = stream.busy or (bool(stream.needs) and not missing)
    if stream.problem and not in_state:
        rows += [line(""), *wrapped(f"▲ {stream.problem}", width, "bad", indent="  ")]
    for warning in () if missing else stream.warnings[:-4:-1]:  # the newest may push others out
        rows += wrapped(f"▲ {warning}", width, "warn", indent="  ")
    return rows


def _arriving(stream: "StreamStatus", width: int) -> list[Line]:
    """What the samples say of the device."""
    rows = [*_state(stream), line("")]
    rows += _values("acceleration", stream.accelerometer, stream.accelerometer_unit)
    rows += _values("angular rate", stream.gyroscope, stream.gyroscope_unit)
    rows += _values("field", stream.magnetometer, stream.magnetometer_unit)
    if stream.temperature is not None:
        rows.append(_pair("temperature", f"{stream.temperature:.1f} °C"))
    rows += _gravity(stream, width)
    return rows + _digits(stream, width)


def _state(stream: "StreamStatus") -> list[Line]:
    rate = f"{stream.rate:.1f} Hz" if stream.rate else "measuring the rate …"
    spoken = f"{stream.format}, " if stream.format else ""  # a recording has no wire format
    text = f"{spoken}{rate}, {stream.samples} samples, "
    lost = (f"{stream.lost} lost", "warn" if stream.lost else "good")
    rows: list[Line] = [((text, ""), lost)]
    if stream.malformed:
        rows.append(line(f"{stream.malformed} lines unreadable", "warn"))
    return rows


def _values(name: str, values: tuple[float, float, float] | None, unit: str) -> list[Line]:
    if values is None:
        return [_pair(name, "none", "quiet")]
    known, factor = known_as(unit)
    shown = [factor * value for value in values]
    places = decimals(max(1.0, *(abs(value) for value in shown if math.isfinite(value))), 4)
    places = 0 if known == COUNT else places
    numbers = " ".join(
        f"{axis} {fixed(value, places)}" for axis, value in zip("xyz", shown, strict=True)
    )
    return [_pair(name, f"{numbers} {unit_sign(known)}")]


def _pair(name: str, text: str, style: str = "") -> Line:
    return (f"{name:<13}", "quiet"), (text, style)


def _gravity(stream: "StreamStatus", width: int) -> list[Line]:
    if stream.gravity is None:
        return []
    size = f"{number(stream.gravity, 4)} {unit_sign(stream.accelerometer_unit)}"
    if stream.gravity_right is None:
        note = wrapped("the fit determines the scale", width, "quiet", indent="  ")
        return [_pair("gravity", size), *note]
    if stream.gravity_right:
        return [_pair("gravity", f"{size}  ✓ plausible", "good")]
    advice = "▲ at rest it should be near 9.81 m/s²: is the device moving, or the unit wrong?"
    return [_pair("gravity", size, "warn"), *wrapped(advice, width, "warn", indent="  ")]


def _digits(stream: "StreamStatus", width: int) -> list[Line]:
    if stream.digits is None:
        return []
    words = plural(stream.digits, "decimal") if stream.digits else "whole numbers"
    rows = [_pair("printed", words)]
    if stream.few_digits:
        advice = "▲ few decimals hide the noise: print more, for instance Serial.print(x, 5)"
        rows += wrapped(advice, width, "warn", indent="  ")
    return rows
