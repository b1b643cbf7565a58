"""What a magnetometer's fit says beyond the others: hard iron, soft iron, field, second stage."""

from imucal_wizard.digits import measured
from imucal_wizard.second_stage_text import second_stage_lines
from imucal_wizard.solver.result import FitReport, Parameter, SensorFit
from imucal_wizard.summary import field_lines
from imucal_wizard.tui.text import Line, Span, line, number, unit_sign, wrapped

_SOFT = ("xx", "xy", "xz"), ("", "yy", "yz"), ("", "", "zz")
"""Entries of the symmetric matrix; the others are the same by symmetry."""


def magnetic_rows(report: FitReport, width: int) -> list[Line]:
    """Hard and soft iron with standard errors, the field, and what the sensors say of each other.

    Args:
        report: with a magnetometer's fit.
        width: columns there are.
    """
    found = report.magnetic
    if found is None:
        return []
    rows: list[Line] = [*iron_rows(found.fit)]
    for text in field_lines(found, found.fit):
        rows += wrapped(text, width, "quiet", indent="    ")
    if report.second_stage is None:
        return rows
    head, *others = second_stage_lines(report.second_stage)
    rows += [line(""), line(head, "strong")]
    for text in others:
        inside = " " * (len(text) - len(text.lstrip()))
        rows += [
            ((inside, ""), *row) for row in wrapped(text.strip(), width - len(inside), "", "  ")
        ]
    return rows


def iron_rows(fit: SensorFit) -> list[Line]:
    """Hard iron in a row, soft iron as the upper half of its matrix."""
    known = {parameter.name: parameter for parameter in fit.parameters}
    hard = [_cell(known.get(f"bias_{axis}"), axis) for axis in "xyz"]
    soft = [
        [_cell(known.get(f"soft_iron_{name}"), name) if name else ("", "") for name in names]
        for names in _SOFT
    ]
    wide = max(len(text) for row in (hard, *soft) for text, _ in row) + 1
    head: Line = (
        ("magnetometer: ", "strong"),
        ("iron that turns with it; corrected = soft · (reading − hard)", "quiet"),
    )
    rows: list[Line] = [
        head,
        (*_in_columns("hard", hard, wide), (unit_sign(fit.bias_unit), "quiet")),
    ]
    return rows + [_in_columns("" if i else "soft", row, wide) for i, row in enumerate(soft)]


def _in_columns(label: str, cells: list[Span], wide: int) -> Line:
    """Cells below one another, a blank between two however many digits they have."""
    return ((f"{label:<5}", "quiet"), *((text.ljust(wide), style) for text, style in cells))


def _cell(parameter: Parameter | None, name: str) -> Span:
    """A value with its standard error; a dot where the data do not carry it."""
    if parameter is None:
        return "", ""
    if not parameter.carried:
        return f"{name} ·", "quiet"
    if not parameter.standard_error:
        return f"{name} {number(parameter.value, 5)}", ""
    value, error = measured(parameter.value, parameter.standard_error)
    return f"{name} {value} ±{error}", ""
