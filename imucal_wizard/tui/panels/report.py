"""A fit as text, tables and plots, for the screens of the result and of the saved file."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from rich.console import Console, ConsoleOptions, Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from imucal_wizard.core.notices import NoticeKind, of_kind
from imucal_wizard.core.quantities import (
    decimals,
    fixed,
    number,
    quantity,
    readable,
    true_minus,
    unit_sign,
    value_and_error,
)
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.grade import Grade, Graded
from imucal_wizard.diagnose.views import ResidualView, views_of
from imucal_wizard.estimate.result import (
    AxisComparison,
    FitReport,
    Parameter,
    SensorFit,
    single_axis_note,
)
from imucal_wizard.report.plot import scatter
from imucal_wizard.report.text import (
    correction_formula,
    errors_text,
    field_lines,
    interval_text,
    parameter_cells,
    second_stage_lines,
)
from imucal_wizard.tui.text import STYLES, Line, by_sign, clean, rich_text, wrapped
from imucal_wizard.tui.widgets.big_text import dots, half_blocks

_ERROR = {"accelerometer": "|a|", "gyroscope": "closure", "magnetometer": "|m|"}
"""The quantity whose error is shown: a magnitude, or the closure of a rotation."""
_EACH = {"gyroscope": "rotation", "magnetometer": "direction"}
_PLOT_ROWS = 8
_SOFT = ("xx", "xy", "xz"), ("", "yy", "yz"), ("", "", "zz")
"""Entries of the symmetric matrix that are shown."""


def fit_summary(
    report: FitReport, diagnoses: Mapping[str, Diagnosis], grades: Mapping[str, Graded]
) -> Group:
    """Grades, verdicts, rejected sensors, errors, plots, iron, gyroscope methods, warnings, holds.

    Args:
        report: the fit.
        diagnoses: of each sensor; empty while they are not known.
        grades: of each sensor, the same.
    """
    notes = report.notes_beside({name: one.says for name, one in diagnoses.items()})
    refused = list(dict.fromkeys(of_kind(notes, NoticeKind.NOT_CALIBRATED)))
    warnings = [text for text in notes if text not in refused]
    for fit in report.sensors.values():
        warnings += [f"{fit.sensor}: {text}" for text in fit.warnings]
    parts: list[RenderableType] = [
        *(part for one in grades.values() for part in grade_parts(one, report, diagnoses)),
        *(verdict_line(one) for one in diagnoses.values()),
        *(_marked("▲", text, "warn") for text in refused),
        "",
        error_table(report, diagnoses),
        "",
    ]  # fmt: skip
    for fit in report.sensors.values():
        parts += [*residual_plot(fit), ""]
    if report.magnetic is not None:
        parts += [*magnetic_parts(report), ""]
    if report.comparison:
        parts += [comparison_table(report.comparison, report.sensors.get("gyroscope")), ""]
    if warnings:
        parts += [*(_marked("▲", text, "warn") for text in dict.fromkeys(warnings)), ""]
    return Group(*parts, *hold_table(report))


def grade_parts(
    graded: Graded, report: FitReport, diagnoses: Mapping[str, Diagnosis]
) -> Iterator[RenderableType]:
    """A sensor's grade in block letters, its errors beside it; below, why it is not good.

    Args:
        graded: the grade.
        report: the fit.
        diagnoses: of each sensor.
    """
    style, sign = _GRADES[graded.grade]
    fit, diagnosis = report.sensors.get(graded.sensor), diagnoses.get(graded.sensor)
    beside = [Text(graded.sensor, "bold")]
    if fit is not None:
        beside[0].append(f", limit {quantity(graded.limit, fit.unit, 2)}", "not bold")
        beside += [Text(part) for part in errors_text(fit).split(", ")]
        if diagnosis is not None and diagnosis.could_be is not None:
            beside.append(Text(f"could be {quantity(diagnosis.could_be, fit.unit)}"))
    word = half_blocks(dots(graded.grade.word) or [])
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True)
    table.add_row(Text("\n".join(word), STYLES[style]), Text("\n").join(beside))
    yield table
    if graded.grade is not Grade.GOOD:
        yield _marked(sign, f"{graded.why}".rstrip(".") + ".", style)


_GRADES = {
    Grade.GOOD: ("good", "✓"),
    Grade.DOUBTFUL: ("warn", "▲"),
    Grade.NOT_USABLE: ("bad", "▲"),
}
"""Style and sign of a grade."""


def way_on(grades: Mapping[str, Graded], *, ended: bool) -> str:
    """The one key for sensors that are not all good, by the worst of them; "" if all are good.

    Args:
        grades: of each sensor.
        ended: the recording has ended, so that nothing more can be measured.
    """
    found = {one.grade for one in grades.values()}
    if Grade.NOT_USABLE not in found:
        return "f: find out more" if Grade.DOUBTFUL in found else ""
    return "The recording has ended: record again" if ended else "b: back, to measure more"


def bench_rows(
    report: FitReport | None, width: int, unsaved: str, without: Sequence[str] = ()
) -> list[Line]:
    """A row for each sensor to whose model the bench has added effects.

    Args:
        report: the fit with them, or None.
        width: columns there are.
        unsaved: the models that no file has, in words; "" if there are none.
        without: the sensors that the file does not have.
    """
    rows: list[Line] = []
    for name, fit in (report.sensors if report is not None else {}).items():
        if fit.terms:
            terms = " + ".join(term.name for term in fit.terms)
            sign, saved, style = "✓", "saved", "good"
            if unsaved:
                sign, saved, style = "▸", "not saved yet", "accent"
            elif name in without:
                sign, saved, style = "▲", "not usable, so not in the file", "bad"
            words = f"{sign} from the bench: {name} + {terms}; {saved}"
            rows += wrapped(words, width, style, indent="  ")
    return rows


def verdict_line(diagnosis: Diagnosis) -> Table:
    """The verdict on a sensor's model."""
    sign, style = ("✓", "good") if diagnosis.settled else ("▲", "warn")
    return _marked(sign, f"{diagnosis.sensor}: {diagnosis.says}", style)


def error_table(report: FitReport, diagnoses: Mapping[str, Diagnosis]) -> Group:
    """One row per sensor: before, after, held out, noise; and the error on new poses."""
    validated = any(fit.validation_rms is not None for fit in report.sensors.values())
    table, remarks = _table(), list[Text]()
    for name in ("", "before", "", "after", "held out", "noise", *(["new poses"] * validated), ""):
        table.add_column(name, justify="left" if not name else "right", no_wrap=True)
    for fit in report.sensors.values():
        diagnosis = diagnoses.get(fit.sensor)
        missing = diagnosis is not None and not diagnosis.settled
        table.add_row(
            Text(f"{fit.sensor} {_ERROR.get(fit.sensor, '')}", "bold"),
            Text(quantity(fit.rms_before, fit.unit), "dim"),
            "→",
            quantity(fit.rms_fitted, fit.unit),
            Text(quantity(fit.rms_held_out, fit.unit), "bold"),
            Text(quantity(fit.error_and_floor[1], fit.unit), "dim"),
            *(["–" if not fit.validation else quantity(fit.validation_rms, fit.unit)] * validated),
            Text("▲" if missing else "", STYLES["warn"]),
        )
    for name, fit in report.sensors.items():
        limits = interval_text(fit)
        notes = [f"held out, {limits}"] if limits else []
        diagnosis = diagnoses.get(name)
        hidden = "" if diagnosis is None else diagnosis.hidden_note
        notes += [note for note in (hidden, fit.before_note, fit.slow_noise_note) if note]
        if notes:
            remarks.append(Text(f" {name}: {'; '.join(notes)}", "dim"))
    new = [_validation(fit) for fit in report.sensors.values() if fit.validation]
    return Group(table, *remarks, *new)


def _validation(fit: SensorFit) -> Text:
    """The residual in each pose of the validation."""
    factor, unit = readable(fit.unit)
    places = decimals(max(abs(error) for error in fit.validation) * factor)
    each = "  ".join(fixed(error * factor, places) for error in fit.validation)
    return Text(f" residuals of the new poses  {each} {unit}", "dim")


class _Plot:
    """A plot of residuals as wide as the page."""

    def __init__(self, view: ResidualView) -> None:
        self._view = view

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        """Draw the residuals by number, with error bars and the band of the noise."""
        view = self._view
        rows = scatter(
            view.x, view.y, options.max_width, _PLOT_ROWS, x_label=view.x_label, error=view.error
        )
        yield rich_text([by_sign(row) for row in rows])


def residual_plot(fit: SensorFit) -> Iterator[RenderableType]:
    """The bench's picture of what is left of each hold or rotation, in the order of measuring."""
    views = () if fit.rows is None or fit.experiment is None else views_of(fit)
    view = next((one for one in views if one.name.endswith("number") and one.model is None), None)
    view = view or _without_rows(fit)
    each = _EACH.get(fit.sensor, "hold")
    head = f"residual of each {each}, {view.unit}  {view.legend}"
    yield Text.assemble((f"{fit.sensor}: ", "bold"), (head, "dim"))
    yield _Plot(view)


def _without_rows(fit: SensorFit) -> ResidualView:
    """The residuals of a method that has no rows, by number."""
    factor, unit = readable(fit.unit)
    values = np.asarray(fit.residuals, np.float64).ravel() * factor
    places = np.flatnonzero(np.isfinite(values))
    label = f"number of the {_EACH.get(fit.sensor, 'hold')}"
    x = np.asarray(places + 1, np.float64)
    return ResidualView("", "", "", label, unit, x, values[places], places, "")


def comparison_table(comparison: Sequence[AxisComparison], fit: SensorFit | None) -> Group:
    """The gyroscope by three methods side by side: corrections ``k`` and biases."""
    table = _table("axis", "rotations", "", "static", "dynamic", "vector")
    for one in comparison:
        table.add_row(
            one.axis, str(one.rotations), "k",
            _with_error(one.static_scale, one.static_scale_error),
            _with_error(one.dynamic_scale, one.dynamic_scale_error),
            _with_error(one.vector_scale, one.vector_scale_error),
        )  # fmt: skip
        table.add_row(
            "", "", "b",
            _with_error(one.static_bias, None),
            _with_error(one.dynamic_bias, one.dynamic_bias_error),
            _with_error(one.vector_bias, None),
        )  # fmt: skip
    unit = f", b in {unit_sign(fit.bias_unit)}" if fit is not None else ""
    head = Text.assemble(
        ("gyroscope by three methods", "bold"), (f"  rate = k · (reading − b){unit}", "dim")
    )
    note = single_axis_note(comparison)
    return Group(head, table, *([Text(note, "dim")] if note else []))


def _with_error(value: float | None, error: float | None) -> str:
    if value is None:
        return "–"
    return " ±".join(value_and_error(value, error)) if error else number(value, 5)


def hold_table(report: FitReport) -> Iterator[RenderableType]:
    """Every hold with its pose and its residual."""
    fit = report.sensors.get("accelerometer")
    if fit is None:
        return
    factor, unit = readable(fit.unit)
    left = np.asarray(fit.residuals, float).ravel() * factor
    out = np.full(len(left), np.nan)
    if fit.held_out is not None:
        out[: len(fit.held_out)] = np.asarray(fit.held_out, float) * factor
    places = decimals(fit.rms_fitted * factor)
    table = _table("#", "pose", "start", "length", "temperature", "left over", "held out", "")
    for i, hold in enumerate(report.holds[: len(left)]):
        table.add_row(
            str(i + 1),
            true_minus(hold.pose or "–"),
            f"{hold.start:.1f} s",
            f"{hold.end - hold.start:.1f} s",
            "–" if hold.temperature is None else f"{hold.temperature:.1f} °C",
            f"{fixed(float(left[i]), places)} {unit}",
            f"{fixed(float(out[i]), places)} {unit}",
            Text("hand-held" if hold.hand_held else "", STYLES["warn"]),
        )
    yield Text("each hold", "bold")
    yield table


def magnetic_parts(report: FitReport) -> Iterator[RenderableType]:
    """Hard and soft iron with standard errors, the field, and the alignment of the sensors."""
    if report.magnetic is None:
        return
    fit = report.sensors["magnetometer"]
    known = {parameter.name: parameter for parameter in fit.parameters}
    yield Text.assemble(
        ("magnetometer: ", "bold"),
        ("iron that turns with it; corrected = soft · (reading − hard)", "dim"),
    )
    table = Table.grid(padding=(0, 1))
    hard = [_iron(known.get(f"bias_{axis}"), axis) for axis in "xyz"]
    table.add_row(Text("hard", "dim"), *hard, Text(unit_sign(fit.bias_unit), "dim"))
    for i, names in enumerate(_SOFT):
        cells = [_iron(known.get(f"soft_iron_{name}"), name) if name else "" for name in names]
        table.add_row(Text("" if i else "soft", "dim"), *cells)
    yield table
    yield Text("\n".join(field_lines(report.magnetic, fit)), "dim")
    if report.second_stage is None:
        return
    head, *others = second_stage_lines(report.second_stage)
    yield Text(f"\n{head}", "bold")
    for text in others:
        yield Padding(Text(text.strip()), (0, 0, 0, len(text) - len(text.lstrip())))


def _iron(parameter: Parameter | None, name: str) -> str:
    """A value with its standard error; a dot if the data do not determine it."""
    if parameter is None:
        return ""
    if not parameter.carried:
        return f"{name} ·"
    return f"{name} {_with_error(parameter.value, parameter.standard_error)}"


def parameter_table(report: FitReport) -> Group:
    """Every parameter with its standard error and unit, and how to apply them."""
    parts: list[RenderableType] = []
    for fit in report.sensors.values():
        model = f"   {' + '.join(fit.model)}, method {fit.method}"
        table = Table.grid(padding=(0, 1))
        table.add_column(min_width=24, no_wrap=True)
        table.add_column(justify="right", no_wrap=True)
        for parameter in fit.parameters:
            value, error, why = parameter_cells(parameter, fit)
            nominal = (f" ▲ {why}" * bool(why), STYLES["warn"])
            unit = f"{error} {unit_sign(parameter.unit)}".strip()
            table.add_row(f"  {parameter.name}", Text(value, "bold"), Text.assemble(unit, nominal))
        parts += [Text.assemble((fit.sensor, "bold"), (model, "dim")), table, "", _applied(fit), ""]
    return Group(*parts)


def _applied(fit: SensorFit) -> Group:
    formula = correction_formula([term.name for term in fit.terms])
    head = f"  {formula}   rows of M, then b in {unit_sign(fit.bias_unit)}"
    table = Table.grid(padding=(0, 2))
    for values in np.column_stack([np.asarray(fit.matrix), np.asarray(fit.bias)]).tolist():
        table.add_row("", *(Text(number(value, 7), justify="right") for value in values))
    return Group(Text(head, "dim"), table)


def _table(*columns: str) -> Table:
    """A table without lines; numbers to the right."""
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim", pad_edge=False)
    for name in columns:
        words = name in ("", "axis", "pose")
        table.add_column(name, justify="left" if words else "right", no_wrap=True)
    return table


def _marked(sign: str, text: str, style: str) -> Table:
    """A sentence after a sign; wrapped rows are aligned with the sentence."""
    table = Table.grid(padding=(0, 1))
    table.add_row(Text(sign, STYLES[style]), Text(clean(text), STYLES[style]))
    return table
