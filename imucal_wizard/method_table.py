"""The comparison of methods as text and as JSON."""

import textwrap
from collections.abc import Sequence
from typing import Any

from imucal_wizard.calibration import sensor_record
from imucal_wizard.fitting.methods import MethodRow, difference, least_held_out
from imucal_wizard.fitting.verdict import shown
from imucal_wizard.solver.result import FitReport

SCHEMA = "imucal-wizard/compare/1"
BEST = "▸"
"""Stands before the methods with the least error held out."""
_HEAD = {
    "accelerometer": "|corrected| − g over holds",
    "gyroscope": "carried against measured gravity over rotations; offset: rate at rest",
    "magnetometer": "|corrected| − field over directions",
}
_NOTE = (
    f"{BEST} least error held out (to 2 %). Q: Qureshi and Golnaraghi, N: Niespodziany. Relative: "
    "rms of the relative error of the magnitude (N's figure of merit), on what was held out where "
    "something was. M off by: largest difference from the first method's matrix, as a share of it."
)


def method_table(rows: Sequence[MethodRow], width: int = 80) -> str:
    """A block for each sensor, the methods with the least error held out marked.

    Args:
        rows: all methods of all sensors.
        width: columns there are; the numbers take 75.
    """
    lines: list[str] = []
    for sensor in dict.fromkeys(row.sensor for row in rows):
        mine = [row for row in rows if row.sensor == sensor]
        first = next((row for row in mine if row.fit is not None), mine[0])
        lines += ["", sensor.upper()] if lines else [sensor.upper()]
        lines += textwrap.wrap(f"  error: {_HEAD[sensor]}", width, subsequent_indent="    ")
        heads = "".join(f"{word:>11}" for word in ("before", "fitted", "held out"))
        lines.append(f"  {'method':18}{heads}{'relative':>11}{'M off by':>11}")
        best = least_held_out(mine)
        for row in mine:
            mark = BEST if row in best else " "
            text, *others = _row(row, first, width)
            lines += [mark + text[1:], *others]
    return "\n".join([*lines, "", *textwrap.wrap(_NOTE, width)])


def _row(row: MethodRow, first: MethodRow, width: int) -> list[str]:
    name = f"{row.method} {f'({row.paper})' if row.paper else ''}".rstrip()
    if row.fit is None:
        text = f"  {name:18}no result: {row.why}"
        return textwrap.wrap(text, width, subsequent_indent=" " * 20)
    fit = row.fit
    relative = row.relative_error_held_out or row.relative_error
    off = difference(row, first)
    cells = [
        f"{'–' if value is None else shown(fit, value):>11}"
        for value in (fit.rms_before, fit.rms_fitted, fit.rms_held_out)
    ]
    share = "–" if relative is None else f"{100.0 * relative:.3f} %"
    differs = "" if not off else f"{100.0 * off:.3f} %"
    return [f"  {name:18}{''.join(cells)}{share:>11}{differs:>11}".rstrip()]


def failure_document(reason: str, warnings: Sequence[str]) -> dict[str, Any]:
    """What ``--json`` says when the data carry nothing that could be compared."""
    return {
        "schema": SCHEMA,
        "error": reason,
        "rate": {},
        "warnings": [*warnings, reason],
        "sensors": {},
    }


def methods_document(report: FitReport, rows: Sequence[MethodRow]) -> dict[str, Any]:
    """The same for scripts: per sensor a list of methods, each with its whole result."""
    sensors: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        sensors.setdefault(row.sensor, []).append(
            {
                "method": row.method,
                "paper": row.paper or None,
                "result": None if row.fit is None else sensor_record(row.fit),
                "relative_error": row.relative_error,
                "relative_error_held_out": row.relative_error_held_out,
                "why": row.why or None,
            }
        )
    return {
        "schema": SCHEMA,
        "rate": report.rates,
        "warnings": list(report.warnings),
        "sensors": sensors,
    }
