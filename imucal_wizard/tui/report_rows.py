"""A fit in words, numbers and dots: the rows that the result screens show."""

import math
from collections.abc import Sequence

import numpy as np

from imucal_wizard.digits import decimals, fixed, measured
from imucal_wizard.solver.result import AxisComparison, FitReport, SensorFit
from imucal_wizard.tui.magnetic_rows import magnetic_rows
from imucal_wizard.tui.residual_plot import dot_plot
from imucal_wizard.tui.text import (
    Line,
    Span,
    line,
    number,
    signed,
    unit_sign,
    wrapped,
)
from imucal_wizard.units import STANDARD_GRAVITY

SHOWN: dict[str, tuple[float, str]] = {
    "m/s^2": (1000.0 / STANDARD_GRAVITY, "mg"),
    "rad": (180.0 / math.pi, "°"),
    "rad/s": (180.0 / math.pi, "°/s"),
    "uT": (1.0, "µT"),
}
"""Factor and unit in which people read an error."""
_ERROR = {"accelerometer": "|a|", "gyroscope": "closure", "magnetometer": "|m|"}
"""What the error of a sensor is of: the magnitude, or the angle between carried and measured up."""
_NO_RESULT = "is not calibrated"
"""Stands in the warning about a sensor that the data do not carry."""
_GAP = line("")


def shown(value: float | None, unit: str, digits: int = 3) -> str:
    """An error with the unit people read it in; a dash when there is none."""
    if value is None:
        return "–"
    factor, sign = SHOWN.get(unit, (1.0, unit_sign(unit)))
    space = "" if sign == "°" else " "
    return f"{number(value * factor, digits)}{space}{sign}"


def summary_rows(report: FitReport, width: int) -> list[Line]:
    """Verdict, refusals, before → after → held out, plots, iron, three gyroscope methods, holds."""
    rows = [*verdict_rows(report, width), *refusal_rows(report, width), _GAP]
    rows += [*error_rows(report), _GAP]
    for fit in report.sensors.values():
        rows += [*plot_rows(fit, width), _GAP]
    if report.magnetic is not None:
        rows += [*magnetic_rows(report, width), _GAP]
    if report.comparison:
        rows += [*comparison_rows(report.comparison, report.sensors.get("gyroscope")), _GAP]
    rows += warning_rows(report, width)
    return rows + hold_rows(report)


def verdict_rows(report: FitReport, width: int) -> list[Line]:
    """The plain sentences, the most important first."""
    rows: list[Line] = []
    for i, sentence in enumerate(report.verdict):
        rows += wrapped(
            f"{'▸' if i == 0 else ' '} {sentence}", width, "strong" if i == 0 else "", "  "
        )
    return rows


def refusal_rows(report: FitReport, width: int) -> list[Line]:
    """Which sensors have no result, and why: nobody scrolls down to what is not there."""
    rows: list[Line] = []
    for text in _refusals(report):
        rows += wrapped(f"▲ {text}", width, "warn", indent="  ")
    return rows


def _refusals(report: FitReport) -> list[str]:
    return [text for text in dict.fromkeys(report.warnings) if _NO_RESULT in text]


def error_rows(report: FitReport) -> list[Line]:
    """One row per sensor: before, after, held out, validation, noise."""
    validated = any(fit.validation_rms is not None for fit in report.sensors.values())
    last = "new poses" if validated else ""
    head = f"{'':<19}{'before':>9}   {'after':>9} {'held out':>10} {'noise':>10} {last:>10}"
    rows = [line(head, "quiet"), *(_error_row(fit, validated) for fit in report.sensors.values())]
    return rows + [_validation_row(fit) for fit in report.sensors.values() if fit.validation]


def _validation_row(fit: SensorFit) -> Line:
    """The error on each new pose, beside that of the table."""
    factor, unit = SHOWN.get(fit.unit, (1.0, unit_sign(fit.unit)))
    places = decimals(max(abs(error) for error in fit.validation) * factor)
    each = "  ".join(fixed(error * factor, places) for error in fit.validation)
    return line(f" left over on each new pose  {each} {unit}", "quiet")


def _error_row(fit: SensorFit, validated: bool) -> Line:
    missing = fit.floor is not None and (fit.rms_held_out or fit.rms_fitted) > 3.0 * fit.floor
    new = shown(fit.validation_rms, fit.unit, 2) if validated else ""
    noise = "±" + shown(fit.floor, fit.unit, 2) if fit.floor is not None else "–"
    return (
        (f"{fit.sensor} {_ERROR.get(fit.sensor, ''):<7}"[:19].ljust(19), "strong"),
        (f"{shown(fit.rms_before, fit.unit):>9} → ", "quiet"),
        (f"{shown(fit.rms_fitted, fit.unit, 2):>9}", ""),
        (f" {shown(fit.rms_held_out, fit.unit, 2):>10}", "warn" if missing else "good"),
        (f" {noise:>10}", "quiet"),
        (f" {new:>10}" if validated else "", "strong"),
        (" ▲" if missing else "", "warn"),
    )


def plot_rows(fit: SensorFit, width: int) -> list[Line]:
    """The residual of each hold or rotation, with the band that noise makes."""
    factor, unit = SHOWN.get(fit.unit, (1.0, unit_sign(fit.unit)))
    each = {"gyroscope": "rotation", "magnetometer": "direction"}.get(fit.sensor, "hold")
    noise = "" if fit.floor is None else f", ┈ = noise ±{shown(fit.floor, fit.unit, 2)}"
    head: Line = (
        (f"{fit.sensor}: ", "strong"),
        (f"what is left of each {each}, {unit}{noise}", "quiet"),
    )
    floor = None if fit.floor is None else fit.floor * factor
    return [head, *dot_plot(np.asarray(fit.residuals, float).ravel() * factor, floor, width)]


def comparison_rows(comparison: Sequence[AxisComparison], fit: SensorFit | None) -> list[Line]:
    """The gyroscope by three methods side by side: corrections ``k`` and biases."""
    unit = unit_sign(fit.bias_unit) if fit is not None else ""
    rows: list[Line] = [
        (
            ("gyroscope by three methods", "strong"),
            ("  corrected rate = k · (reading − bias)", "quiet"),
        ),
        line(f"axis turns   {'static':<19}{'dynamic':<19}{'nine parameters':<19}", "quiet"),
    ]
    for one in comparison:
        scales = (
            _with_error(one.static_scale, one.static_scale_error),
            _with_error(one.dynamic_scale, one.dynamic_scale_error),
            _with_error(one.vector_scale, one.vector_scale_error),
        )
        biases = (
            _with_error(one.static_bias, None),
            _with_error(one.dynamic_bias, one.dynamic_bias_error),
            _with_error(one.vector_bias, None),
        )
        rows.append(_three(f" {one.axis}  {one.rotations:>3}  k   ", scales))
        rows.append(_three("         b   ", biases, unit))
    return rows


def _three(head: str, texts: tuple[str, str, str], unit: str = "") -> Line:
    cells: list[Span] = [(f"{text:<18} ", "") for text in texts]
    return ((f"{head:<13}", "quiet"), *cells, (unit, "quiet"))


def _with_error(value: float | None, error: float | None) -> str:
    if value is None:
        return "–"
    return number(value, 5) if not error else " ±".join(measured(value, error))


def hold_rows(report: FitReport) -> list[Line]:
    """Every hold with its pose and what is left of it."""
    fit = report.sensors.get("accelerometer")
    if fit is None:
        return []
    rows = [
        line("each hold", "strong"),
        line("    #  pose     start     length  temperature   left over    held out", "quiet"),
    ]
    factor, unit = SHOWN.get(fit.unit, (1.0, unit_sign(fit.unit)))
    left = np.asarray(fit.residuals, float).ravel() * factor
    out = None if fit.held_out is None else np.asarray(fit.held_out, float) * factor
    places = decimals(fit.rms_fitted * factor)
    for i, hold in enumerate(report.holds[: len(left)]):
        warm = "–" if hold.temperature is None else f"{hold.temperature:.1f} °C"
        held = fixed(float(out[i]), places) if out is not None and i < len(out) else "–"
        span = f" {hold.start:>7.1f} s {hold.end - hold.start:>6.1f} s  {warm:>11}"
        errors = f"  {fixed(float(left[i]), places):>10}  {held:>10} {unit}"
        words = f"{i + 1:>5}  {signed(hold.pose or '–'):<8}{span}{errors}"
        rows.append(((words, ""), ("  hand-held" if hold.hand_held else "", "warn")))
    return rows


def warning_rows(report: FitReport, width: int) -> list[Line]:
    """What else the user must know, each once."""
    texts = [text for text in report.warnings if _NO_RESULT not in text]
    for fit in report.sensors.values():
        texts += [f"{fit.sensor}: {text}" for text in fit.warnings]
    rows: list[Line] = []
    for text in dict.fromkeys(texts):
        rows += wrapped(f"▲ {text}", width, "warn", indent="  ")
    return [*rows, _GAP] if rows else []
