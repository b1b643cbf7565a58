"""The table of parameters: every one with its standard error and unit, and how to apply them."""

import numpy as np

from imucal_wizard.digits import decimals, fixed, measured
from imucal_wizard.solver.result import FitReport, Parameter, SensorFit
from imucal_wizard.tui.text import Line, line, number, unit_sign, wrapped

_GAP = line("")


def parameter_rows(report: FitReport, width: int) -> list[Line]:
    """Every parameter with its standard error and unit, and how to apply them."""
    rows: list[Line] = []
    for fit in report.sensors.values():
        terms = " + ".join(fit.model)
        rows += [((fit.sensor, "strong"), (f"   {terms}, method {fit.method}", "quiet"))]
        rows += [_parameter(parameter) for parameter in fit.parameters]
        rows += [_GAP, *_apply(fit), _GAP]
    return [cut for row in rows for cut in _fitting(row, width)]


def _fitting(row: Line, width: int) -> list[Line]:
    if sum(len(text) for text, _ in row) <= width:
        return [row]
    return wrapped("".join(text for text, _ in row), width, row[0][1], indent="    ")


def _parameter(parameter: Parameter) -> Line:
    value, error = number(parameter.value, 6), ""
    if parameter.standard_error:
        value, error = measured(parameter.value, parameter.standard_error)
    repeats = parameter.standard_error_repeats
    if error and repeats:
        error += f" (repeats ± {fixed(repeats, decimals(parameter.standard_error or 0.0))})"
    value, spread = f"{value:>13}", f"{'± ' + error if error else '':<12}"
    return (
        (f"  {parameter.name:<24}", ""),
        (value, "strong"),
        (f" {spread} {unit_sign(parameter.unit)}", ""),
        ("" if parameter.carried else " ▲ not carried", "warn"),
    )


def _apply(fit: SensorFit) -> list[Line]:
    head = f"  corrected = M · (reading − b)   columns of M, then b in {unit_sign(fit.bias_unit)}"
    rows = [line(head, "quiet")]
    for matrix_row, bias in zip(np.asarray(fit.matrix), np.asarray(fit.bias), strict=True):
        cells = "".join(f"{number(float(value), 7):>14}" for value in matrix_row)
        rows.append(line(f"  {cells}  {number(float(bias), 7):>14}"))
    return rows
