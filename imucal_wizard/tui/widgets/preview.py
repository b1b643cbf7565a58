"""What arrives from a source, decoded: values, units, rate, losses, the size of gravity, digits."""

import math
from typing import TYPE_CHECKING

from imucal_wizard.digits import decimals, fixed
from imucal_wizard.tui.text import Line, known_as, line, number, unit_sign, wrapped
from imucal_wizard.tui.widgets.lines import Lines
from imucal_wizard.units import STANDARD_GRAVITY

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.live.snapshot import StreamStatus

_NEAR = 0.15
"""A gravity within 15 % of what it should be is a matter of calibration, not of units."""
_FEW_DIGITS = 3
_LINE_ROWS = 3
_WELCOME = (
    (
        "This program leads you through the calibration of accelerometer, gyroscope and "
        "magnetometer. Gravity and the Earth's field are the references."
    ),
    (
        "Settle, six faces up, 18 poses, some rotations, circles for a magnetometer: about ten "
        "minutes. It goes on by itself; your hands stay on the device."
    ),
    "No device at hand? Press enter: the virtual IMU needs none.",
    "What is measured is written down at once. You can leave at any time and go on later.",
)


class Preview(Lines):
    """The stream in a few rows of words and numbers."""

    def welcome(self) -> None:
        """What this is all about, while nothing is open."""
        width = max(30, self.size.width or 44)
        rows: list[Line] = []
        for text in _WELCOME:
            rows += [*wrapped(text, width), line("")]
        self.show(rows)

    def complain(self, problem: str) -> None:
        """Why there is nothing to show, and what to do."""
        width = max(30, self.size.width)
        self.show(wrapped(f"▲ {problem}", width, "bad", indent="  "))

    def tell(self, stream: "StreamStatus") -> None:
        """Show the newest values."""
        width = max(30, self.size.width)
        rows = [line(stream.source or "source", "strong"), *self._state(stream)]
        if stream.line and not stream.samples:
            newest = wrapped(f"newest line: {stream.line}", width, "quiet", indent="  ")
            rows += [line(""), *newest[:_LINE_ROWS]]
        rows.append(line(""))
        rows += self._values("acceleration", stream.accelerometer, stream.accelerometer_unit)
        rows += self._values("turn rate", stream.gyroscope, stream.gyroscope_unit)
        rows += self._values("field", stream.magnetometer, stream.magnetometer_unit)
        if stream.temperature is not None:
            rows.append(_pair("temperature", f"{stream.temperature:.1f} °C"))
        rows += _gravity(stream, width)
        rows += _digits(stream, width)
        if stream.problem:
            rows += [line(""), *wrapped(f"▲ {stream.problem}", width, "bad", indent="  ")]
        for warning in stream.warnings[-3:]:
            rows += wrapped(f"▲ {warning}", width, "warn", indent="  ")
        self.show(rows)

    @staticmethod
    def _state(stream: "StreamStatus") -> list[Line]:
        if not stream.samples:
            return [line("waiting for the first sample …", "quiet")]
        rate = f"{stream.rate:.1f} Hz" if stream.rate else "measuring the rate …"
        spoken = f"{stream.format}, " if stream.format else ""  # a recording is no stream of bytes
        text = f"{spoken}{rate}, {stream.samples} samples, "
        lost = (f"{stream.lost} lost", "warn" if stream.lost else "good")
        rows: list[Line] = [((text, ""), lost)]
        if stream.malformed:
            rows.append(line(f"{stream.malformed} lines unreadable", "warn"))
        return rows

    @staticmethod
    def _values(name: str, values: tuple[float, float, float] | None, unit: str) -> list[Line]:
        if values is None:
            return [_pair(name, "none", "quiet")]
        known, factor = known_as(unit)
        shown = [factor * value for value in values]
        places = decimals(max(1.0, *(abs(value) for value in shown if math.isfinite(value))), 4)
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
    if stream.accelerometer_unit == "count":
        return [_pair("gravity", f"{size}; the fit finds the scale")]
    if math.isclose(stream.gravity, STANDARD_GRAVITY, rel_tol=_NEAR):
        return [_pair("gravity", f"{size}  ✓ right at rest", "good")]
    advice = "▲ at rest it should be near 9.81 m/s²: is it moving, or is the unit wrong?"
    return [_pair("gravity", size, "warn"), *wrapped(advice, width, "warn", indent="  ")]


def _digits(stream: "StreamStatus", width: int) -> list[Line]:
    if stream.digits is None:
        return []
    rows = [_pair("printed", f"{stream.digits} decimals")]
    if stream.digits < _FEW_DIGITS and stream.accelerometer_unit != "count":
        advice = "▲ few decimals hide the noise: print more, for instance Serial.print(x, 5)"
        rows += wrapped(advice, width, "warn", indent="  ")
    return rows
