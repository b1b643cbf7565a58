"""A fit as text for a terminal that is not the app's: one screen, plain characters."""

import textwrap

from imucal_wizard.digits import decimals
from imucal_wizard.fitting.verdict import shown
from imucal_wizard.second_stage_text import second_stage_lines
from imucal_wizard.solver.accelerometer import SIX
from imucal_wizard.solver.magnetometer.report import MagnetometerFit
from imucal_wizard.solver.result import FitReport, Parameter, SensorFit

_WIDTH = 80
_LACKING = "these data do not carry it"


def summary(report: FitReport) -> str:
    """What was found, in lines of at most 80 columns."""
    lines = [
        _wrapped(
            f"{len(report.holds)} holds, {_motions(report)}, "
            + ", ".join(f"{name} {rate:.4g} Hz" for name, rate in report.rates.items())
        ),
    ]
    for name, fit in report.sensors.items():
        lines += ["", *_sensor(name, fit)]
        if name == "magnetometer" and report.magnetic is not None:
            lines += field_lines(report.magnetic, fit)
    if report.second_stage is not None:
        lines += ["", *second_stage_lines(report.second_stage)]
    if report.comparison:
        lines += ["", *_comparison(report)]
    if report.warnings:
        lines += ["", *(_wrapped(f"! {warning}") for warning in report.warnings)]
    return "\n".join([*lines, "", *map(_wrapped, report.verdict)])


def _motions(report: FitReport) -> str:
    """The motions between two holds; the later table counts those about one axis alone."""
    count, single = len(report.rotations), sum(row.rotations for row in report.comparison)
    about = f" ({single} of them about one axis)" if single else ""
    return f"{count} rotations{about}"


def _wrapped(text: str) -> str:
    return textwrap.fill(text, _WIDTH, subsequent_indent="  ", break_on_hyphens=False)


def _sensor(name: str, fit: SensorFit) -> list[str]:
    lines = [f"{name.upper()}  {' + '.join(fit.model)}  ({fit.method})"]
    lines += [f"  {_parameter(parameter, fit.method)}" for parameter in fit.parameters]
    lines.append(
        f"  error: before {shown(fit, fit.rms_before)}, fitted {shown(fit, fit.rms_fitted)}, "
        f"held out {shown(fit, fit.rms_held_out)}, noise {shown(fit, fit.floor)}"
    )
    return lines


def field_lines(found: MagnetometerFit, fit: SensorFit) -> list[str]:
    """The field's size, N's figure of merit, and how much of the sphere was seen."""
    held_out = found.relative_error_held_out
    out = "" if held_out is None else f", held out {100.0 * held_out:.2f} %"
    error = f"relative error {100.0 * found.relative_error:.2f} %{out}"
    covered = f"{int((found.filled > 0).sum())} of {len(found.filled)} directions covered"
    used = f"{int(found.kept.sum())} of {len(found.kept)} samples used"
    return [f"  field {shown(fit, found.magnitude)}, {error}", f"  {covered}, {used}"]


def _parameter(parameter: Parameter, method: str) -> str:
    value = f"{parameter.value:.7g}"
    unit = "" if parameter.unit == "1" else parameter.unit
    if not parameter.carried:
        why = f"the {method} method does not fit it" if method == SIX else _LACKING
        return f"{parameter.name:16} {value:>14} {unit}".rstrip() + f"  nominal: {why}"
    if not parameter.standard_error:
        note = "± not known"
    else:
        places = min(12, decimals(parameter.standard_error))
        value = f"{parameter.value:.{places}f}"
        note = f"± {parameter.standard_error:.{places}f}"
        if parameter.standard_error_repeats:
            note += f" (repeats ± {parameter.standard_error_repeats:.{places}f})"
    return f"{parameter.name:16} {value:>14} {note} {unit}".rstrip()


def _comparison(report: FitReport) -> list[str]:
    lines = ["GYROSCOPE SCALE by three methods (correction, rad/s per reading)"]
    lines.append("  axis  turns   static          dynamic         vector")
    for row in report.comparison:
        cells = [
            "-" if value is None else f"{value:#.6g}"
            for value in (row.static_scale, row.dynamic_scale, row.vector_scale)
        ]
        row_text = "".join(f"{cell:16}" for cell in cells)
        lines.append(f"  {row.axis:4}  {row.rotations:5}   {row_text}".rstrip())
    return lines
