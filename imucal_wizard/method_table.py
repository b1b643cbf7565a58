"""The comparison of methods as text and as JSON."""

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from imucal_wizard.calibration import sensor_record
from imucal_wizard.fitting.methods import MethodRow, difference, least_held_out, offset_difference
from imucal_wizard.fitting.verdict import shown
from imucal_wizard.solver.result import FitReport

SCHEMA = "imucal-wizard/compare/1"
BEST = "▸"
"""Stands before the methods with the least error held out."""
_COLUMNS = ("fitted", "held out", "relative", "M off by", "b off by")
_NOTE = (
    f"{BEST} least error held out (to 2 %). Q: Qureshi and Golnaraghi, N: Niespodziany. Errors: of "
    "|corrected| − g over holds; of the gyroscope's closure over rotations (offset: rate at rest); "
    "of |corrected| − field over directions. Relative: rms of the relative error of the magnitude "
    "(N's figure of merit), on what was held out where something was. M and b off by: largest "
    "difference from the first method's matrix, as a share of it, and from its bias."
)


def method_table(rows: Sequence[MethodRow], width: int = 80) -> str:
    """A block for each sensor, the methods with the least error held out marked.

    Nothing stands between the blocks: three sensors fit a terminal of 24 rows.

    Args:
        rows: all methods of all sensors.
        width: columns there are; the numbers take 75.
    """
    lines: list[str] = []
    for sensor in dict.fromkeys(row.sensor for row in rows):
        mine = [row for row in rows if row.sensor == sensor]
        first = next((row for row in mine if row.fit is not None), mine[0])
        lines.append(f"{sensor.upper():20}{''.join(f'{word:>11}' for word in _COLUMNS)}")
        if first.fit is not None and first.fit.rms_before is not None:
            lines.append(f"  {'not calibrated':18}{shown(first.fit, first.fit.rms_before):>11}")
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
    held_out, relative = row.fit.rms_held_out, row.relative_error_held_out or row.relative_error
    cells = [
        shown(row.fit, row.fit.rms_fitted),
        "–" if held_out is None else shown(row.fit, held_out),
        "–" if relative is None else f"{100.0 * relative:.3f} %",
        *_off(row, first),
    ]
    return [f"  {name:18}{''.join(f'{cell:>11}' for cell in cells)}".rstrip()]


def _off(row: MethodRow, first: MethodRow) -> tuple[str, str]:
    """How far matrix and bias are from those of the first method; nothing for itself."""
    matrix, bias = difference(row, first), offset_difference(row, first)
    if row is first or row.fit is None or matrix is None or bias is None:
        return "", ""
    rate = replace(row.fit, unit="rad/s") if row.sensor == "gyroscope" else row.fit
    return f"{100.0 * matrix:.3f} %", shown(rate, bias)


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
