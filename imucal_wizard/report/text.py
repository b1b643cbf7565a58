"""A fit as plain text."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from imucal_wizard.core.quantities import (
    decimals,
    fixed,
    limits_text,
    number,
    plural,
    plus_minus,
    quantity,
    true_minus,
    unit_sign,
    value_and_error,
)
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.estimate.result import FitReport, Parameter, SensorFit, single_axis_note

if TYPE_CHECKING:  # those of a verdict, and of a magnetometer, which few recordings have
    from imucal_wizard.diagnose.diagnosis import Diagnosis
    from imucal_wizard.diagnose.grade import Limits
    from imucal_wizard.estimate.magnetometer.fit import MagnetometerFit
    from imucal_wizard.estimate.second_stage.found import Headings, SecondStage
    from imucal_wizard.report.calibration_file import Calibration

TEXT_COLUMNS = 80
MIN_DIP_OF_HEMISPHERE = 10.0
"""Dip, degrees, above which the hemisphere is certain."""
MAX_HEADINGS = 6
"""Headings listed in the text; the JSON has all of them."""


def summary(
    report: FitReport,
    diagnoses: "Mapping[str, Diagnosis] | None" = None,
    limits: "Limits | None" = None,
) -> str:
    """The result in lines of at most 80 columns: the grades, the figures, the verdicts.

    Args:
        report: the fit.
        diagnoses: of the sensors; without them no grade and no verdict is given.
        limits: of use, see ``diagnose.grade``.
    """
    known = diagnoses or {}
    motions = "" if report.on_table and not report.holds else f"{_motions(report)}, "
    lines = [
        *(_grades(report, known, limits) if known else ()),
        _wrapped(
            motions + ", ".join(f"{name} {rate:.4g} Hz" for name, rate in report.rates.items())
        ),
    ]
    for name, fit in report.sensors.items():
        lines += ["", *_sensor(name, fit, known.get(name))]
        if fit.of_table:
            lines += _table_lines(fit)
    if report.magnetic is not None:
        lines += field_lines(report.magnetic, report.sensors["magnetometer"])
    if report.second_stage is not None:
        lines += ["", *second_stage_lines(report.second_stage)]
    if report.comparison:
        lines += ["", *_comparison(report)]
    if notes := report.notes_beside({name: one.says for name, one in known.items()}):
        lines += ["", *(_wrapped(f"! {note}") for note in notes)]
    says = [_wrapped(f"{one.sensor}: {one.says}") for one in known.values()]
    return "\n".join([*lines, "", *says]).rstrip()


def _grades(
    report: FitReport, diagnoses: "Mapping[str, Diagnosis]", limits: "Limits | None"
) -> list[str]:
    """One word for each sensor, its error and the reason of the word."""
    from imucal_wizard.diagnose.grade import graded

    lines = []
    for name, one in graded(report, diagnoses, limits).items():
        fit = report.sensors.get(name)
        error = f"{errors_text(fit)}; " if fit is not None and not fit.unusable else ""
        lines.append(_wrapped(f"{name:<14}{one.grade.word}: {error}{one.why}"))
    return [*lines, ""]


def errors_text(fit: SensorFit) -> str:
    """The error by which a fit is judged, beside the noise."""
    error, floor, of = fit.error_and_floor
    if error is None:
        return "the error is not known"
    return f"{quantity(error, fit.unit)} {of}, noise {quantity(floor, fit.unit)}"


def _motions(report: FitReport) -> str:
    """Number of rotations, and of those about one axis that was level."""
    count, single = len(report.rotations), sum(row.rotations for row in report.comparison)
    about = f" ({single} of them about one level axis)" if single else ""
    return f"{plural(len(report.holds), 'hold')}, {plural(count, 'rotation')}{about}"


def _wrapped(text: str) -> str:
    return textwrap.fill(text, TEXT_COLUMNS, subsequent_indent="  ", break_on_hyphens=False)


def interval_text(fit: SensorFit) -> str:
    """Where the error of new data lies nine times in ten, ``90 %: 0.121 to 0.188 mg``; or "".

    With few data, those left out have a worse fit than new ones: their error may lie above.
    """
    limits, out = fit.held_out_interval, fit.rms_held_out
    above = limits is not None and out is not None and out > limits[1]
    text = limits_text(limits, fit.unit)
    return f"{'new data, ' * above}90 %: {text}" if text else ""


def _sensor(name: str, fit: SensorFit, known: "Diagnosis | None") -> list[str]:
    lines = [f"{name.upper()}  {' + '.join(fit.model)}  ({fit.method})"]
    lines += [f"  {_parameter(parameter, fit)}" for parameter in fit.parameters]
    errors = (fit.rms_before, fit.rms_fitted, fit.rms_held_out, fit.error_and_floor[1])
    before, fitted, held_out, floor = (quantity(error, fit.unit) for error in errors)
    limits = interval_text(fit)
    likely = f" ({limits})" if limits else ""
    text = f"  error: before {before}, fitted {fitted}, held out {held_out}{likely}, noise {floor}"
    hidden = ""
    if known is not None and known.could_be is not None:
        text += f"; could be {quantity(known.could_be, fit.unit)}"
        hidden = known.hidden_note
    if fit.validation_rms is not None:
        text += f", new poses {quantity(fit.validation_rms, fit.unit)}"
    for paragraph in (
        text,
        *(f"  {note}" for note in (hidden, fit.before_note, fit.slow_noise_note) if note),
    ):
        lines += textwrap.wrap(
            paragraph, TEXT_COLUMNS, initial_indent="  ", subsequent_indent="    "
        )
    return lines


def correction_formula(effects: Sequence[str]) -> str:
    """How a reading is corrected, with the names of the effects."""
    return "corrected = M · (reading − b)" + (f" − effects ({', '.join(effects)})" * bool(effects))


def correction_text(calibration: "Calibration") -> str:
    """What corrects the readings, with as many digits as a program needs."""
    lines = []
    for name, one in calibration.sensors.items():
        formula = correction_formula([effect.term for effect in one.effects])
        lines.append(f"{name}: {formula}; b in {unit_sign(one.bias_unit)}")
        lines += [f"  M {'  '.join(f'{value: .9e}' for value in row)}" for row in one.matrix]
        lines.append(f"  b {'  '.join(f'{value: .9e}' for value in one.bias)}")
    return "\n".join(lines)


def _table_lines(fit: SensorFit) -> list[str]:
    """What a rate table did, how well it fits, and what the matrix then means."""
    from imucal_wizard.report.table_document import steps_of_table

    steps = steps_of_table(fit)
    rates = np.array([step.rate for step in steps])
    errors = np.array([step.error / step.seconds for step in steps])
    mountings = len({step.mounting for step in steps})
    low, high = (quantity(float(one), "rad/s") for one in (rates.min(), rates.max()))
    text = (
        f"rate table: {len(steps)} steps of {low} to {high} in {mountings} mountings; they differ "
        f"by {quantity(root_mean_square(errors), 'rad/s', 2)} rms, "
        f"{1e6 * root_mean_square(errors / rates):.0f} ppm of the rate"
    )
    paragraphs = [text]
    if fit.frame == "own":
        paragraphs.append(
            "The matrix is upper triangular, in the gyroscope's own frame: its x axis alone reads "
            "a rate about x, its x and y axes one about y. A table about an unknown axis shows the "
            "scales and the angles between the axes, but neither how the gyroscope lies in its "
            "housing nor a mirrored axis."
        )
    return [
        line
        for one in paragraphs
        for line in textwrap.wrap(
            one, TEXT_COLUMNS, initial_indent="    ", subsequent_indent="    "
        )
    ]


def field_lines(found: "MagnetometerFit", fit: SensorFit) -> list[str]:
    """Magnitude of the field, N's figure of merit, and the covered directions."""
    held_out = found.relative_error_held_out
    out = "" if held_out is None else f", held out {100.0 * held_out:.2f} %"
    error = f"relative error {100.0 * found.relative_error:.2f} %{out}"
    covered = f"{int((found.filled > 0).sum())} of {len(found.filled)} directions covered"
    used = f"{int(found.kept.sum())} of {len(found.kept)} samples used"
    return [f"  field {quantity(found.magnitude, fit.unit)}, {error}", f"  {covered}, {used}"]


def _parameter(parameter: Parameter, fit: SensorFit) -> str:
    value, error, why = parameter_cells(parameter, fit)
    row = f"{parameter.name:16} {value:>14} {f'{error} ' * bool(error)}{unit_sign(parameter.unit)}"
    return row.rstrip() + (f"  {why}" * bool(why))


def why_nominal(sensor: str, method: str) -> str:
    """Why a parameter that a fit by this method has not determined is nominal."""
    from imucal_wizard.estimate.methods import methods_of

    published = methods_of(sensor).get(method)
    alone = published is not None and published.each_axis_alone
    return f"the {method} method does not fit it" if alone else "not determined by these data"


def parameter_cells(parameter: Parameter, fit: SensorFit) -> tuple[str, str, str]:
    """The value of a parameter, its error with the sign before it, and why it is nominal, or "".

    Args:
        parameter: of the fit.
        fit: whose method may not fit it.
    """
    value = true_minus(f"{parameter.value:.7g}")
    if not parameter.carried:
        return value, "", f"nominal: {why_nominal(fit.sensor, fit.method)}"
    if not parameter.standard_error:
        return value, "± not known", ""
    value, error = value_and_error(parameter.value, parameter.standard_error)
    note = f"± {error}"
    if parameter.standard_error_repeats:
        places = decimals(parameter.standard_error)
        note += f" (repeats ± {fixed(parameter.standard_error_repeats, places)})"
    return value, note, ""


def _comparison(report: FitReport) -> list[str]:
    lines = ["GYROSCOPE SCALE by three methods (correction, rad/s per reading)"]
    lines.append("  axis  rotations  static          dynamic         vector")
    for row in report.comparison:
        cells = [
            number(value, 6) for value in (row.static_scale, row.dynamic_scale, row.vector_scale)
        ]
        row_text = "".join(f"{cell:16}" for cell in cells)
        lines.append(f"  {row.axis:4}  {row.rotations:9}  {row_text}".rstrip())
    note = single_axis_note(report.comparison)
    return lines + [f"  {line}" for line in textwrap.wrap(note, TEXT_COLUMNS - 2)]


def second_stage_lines(stage: "SecondStage") -> list[str]:
    """Alignment, clocks, gyroscope, headings; lines of at most 80 columns."""
    alignment = stage.alignment
    dip, doubt, rms = np.degrees([alignment.dip, alignment.dip_error, alignment.rms])
    used = int(alignment.used.sum())
    where = f"equal in {plural(used, 'hold')} to {rms:.2f}° rms"
    lines = [
        "SECOND STAGE  alignment of the sensors to one another",
        f"  dip {plus_minus(dip, doubt)}°, {where}",
    ]
    if alignment.axes:
        lines.append(f"  the magnetometer's axes: {alignment.axes}")
    if abs(dip) > MIN_DIP_OF_HEMISPHERE:
        sign, there = ("positive", "south") if dip > 0.0 else ("negative", "north")
        # m and −m fit gravity and every rotation equally: only the user knows the hemisphere
        text = f"  {sign} dip: if you are {there} of the magnetic equator, an axis is mirrored"
        lines.append(text)
        if alignment.axes and alignment.mirrored:
            lines.append(f"    and the axes are these instead: {alignment.mirrored}")
    left = len(alignment.used) - used
    if left:
        do, were, them = ("does", "was", "it") if left == 1 else ("do", "were", "them")
        lines.append(
            f"  {plural(left, 'hold')} {do} not fit and {were} left out (iron near {them}?)"
        )
    if stage.clock is not None:
        late = plus_minus(1e3 * stage.clock.seconds, 1e3 * stage.clock.standard_error)
        late = f"+{late}" if stage.clock.seconds > 0.0 else late
        lines.append(f"  the magnetometer's clock is {late} ms off the gyroscope's")
    lines += _gyroscope(stage) + _headings(stage.headings)
    return lines + [f"  {note}" for note in stage.notes]


def _gyroscope(stage: "SecondStage") -> list[str]:
    added = stage.added
    if added is None:
        return []
    before, after = np.degrees([added.heading_before, added.heading_after])
    tilt = np.degrees([added.tilt_before, added.tilt_after])
    lines = [
        f"  gyroscope over {added.turns} rotations, also about the vertical, held out:",
        f"    closure about the vertical {before:.3f}° by gravity alone, {after:.3f}° by both",
        f"    closure across it          {tilt[0]:.3f}° by gravity alone, {tilt[1]:.3f}° by both",
    ]
    if added.standard_errors is not None:
        share = 100.0 * added.standard_errors
        lines.append(f"    standard errors of its gains: {share:.0f} % of those by gravity alone")
    return lines


def _headings(headings: "Headings") -> list[str]:
    """Rms over all holds, and the first few headings."""
    change, expected = heading_summary(headings)
    if not np.isfinite(change):
        return []
    lines = [
        "  heading of the x axis, tilt-compensated, before and after the calibration:",
        f"    they differ by {np.degrees(change):.1f}° rms, error left {np.degrees(expected):.2f}°",
    ]
    seen = np.flatnonzero(np.isfinite(headings.after) & np.isfinite(headings.before))
    for index in seen[:MAX_HEADINGS]:
        before, after, error = np.degrees(
            [headings.before[index], headings.after[index], headings.error[index]]
        )
        lines.append(
            f"    hold {headings.hold[index] + 1:3}: before {before % 360.0:6.1f}°, after "
            f"{after % 360.0:6.1f} ± {error:.2f}°"
        )
    return lines


def heading_summary(headings: "Headings") -> tuple[float, float]:
    """Rms change of heading by the calibration, and rms of the error expected after it, rad."""
    from imucal_wizard.estimate.second_stage.heading import turned

    change = turned(headings.after, headings.before)
    seen = np.isfinite(change)
    if not seen.any():
        return float("nan"), float("nan")
    return (
        root_mean_square(change[seen]),
        root_mean_square(headings.error[seen]),
    )
