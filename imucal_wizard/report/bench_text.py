"""The findings of the bench as plain text; the bench's screen shows the same tables."""

import re
import textwrap
from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.quantities import (
    number,
    plural,
    plus_minus,
    quantity,
    readable,
    true_minus,
    with_unit,
)
from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.diagnose.bench import MIN_FALL_TEXT, Bench, Entry, Rung, entries_of, falls
from imucal_wizard.diagnose.change_text import change_held_out
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.effect_text import seen_from, sizes_text
from imucal_wizard.diagnose.free_curves import shape_of
from imucal_wizard.diagnose.hypotheses import DISTURBED
from imucal_wizard.diagnose.views import noise_word
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.rows.table import ResidualTable

BENCH_COLUMNS = 79
SHOWN_SUSPECTS = 8
LISTED_ROWS = 12
"""Rows of a magnetometer that are listed: those that fit worst."""
DOT_PLOT_COLUMNS = 21
"""Columns of the small plot of a residual, its zero in the middle."""


def bench_text(statements: Sequence[Diagnosis]) -> str:
    """Residuals, suspects, ladder and verdict of every sensor."""
    return "\n\n".join("\n".join(_sensor(one)) for one in statements)


def _sensor(said: Diagnosis) -> list[str]:
    lines = [f"{said.sensor.upper()}  {said.verdict.value.upper()}"]
    if said.bench is not None and said.findings is not None:
        lines[0] += f"  model: {' + '.join(said.bench.fit.model)}"
        lines += ["", *_comparison(said)]
        lines += ["", *_suspects(said, said.bench)]
        rungs = said.bench.ladder
        lines += ["", "LADDER", *ladder_rows(rungs, said.bench.fit.unit, BENCH_COLUMNS)]
        lines += _wrapped(_floors(rungs[-1]), "  ")
    lines += ["", *_wrapped(said.says)]
    if said.next_poses:
        lines += ["", "NEXT POSES"]
        lines += [
            line
            for number, pose in enumerate(said.next_poses, 1)
            for line in _wrapped(pose.why, f"{number:3}  ")
        ]
    return lines


def _comparison(said: Diagnosis) -> list[str]:
    """Measurement minus model, a line per hold or rotation."""
    bench = said.bench
    if bench is None:
        return []
    table, unit = bench.rows, bench.fit.unit
    if not bench.measured.at_rest:
        return _worst_rows(table)
    moving = table.moving & table.judged
    what, rows = ("rotation", moving) if moving.any() else ("hold", ~moving)
    error, number = table.residual, table.index[rows]
    noise = noise_word(table.source_of(int(np.flatnonzero(rows)[0]))[0])
    lines = [f"COMPARE  measurement − model, {what} by {what} (× {noise})"]
    size = float(np.abs(error[rows] / table.floor[rows]).max(initial=1.0))
    for index in distinct(number):
        own = np.flatnonzero(rows)[number == index]
        value = _signed(error[own])
        ratio = _signed(error[own] / table.floor[own]) / np.sqrt(len(own))
        cell = true_minus(f"{quantity(value, unit)} ({ratio:+.1f})")
        lines.append(
            f"  {index + 1:3}  {_direction(said, what, index):8} {cell:22} {_dot(ratio, size)}"
        )
    return lines


def _worst_rows(table: ResidualTable) -> list[str]:
    """Measurement against model of many rows, those that fit worst."""
    ratio, unit = table.residual / table.floor, table.unit
    order = np.argsort(-np.abs(ratio), kind="stable")[:LISTED_ROWS]
    worst = f"the {len(order)} of {len(ratio)} means that fit worst"
    lines = [f"COMPARE  measurement − model, {worst} (× noise)"]
    for row in sorted(order.tolist()):
        cell = true_minus(
            f"{quantity(float(table.residual[row]), str(unit[row]))} ({ratio[row]:+.1f})"
        )
        lines.append(f"  {table.place(row):34} {cell}")
    return lines


def _signed(values: FloatArray) -> float:
    """The value itself, or the length of two components."""
    return float(values[0]) if len(values) == 1 else float(np.linalg.norm(values))


def _direction(said: Diagnosis, what: str, index: int) -> str:
    """The pose of a hold, the axis of a rotation that the recording has by itself."""
    report = said.report
    if report is None:
        return ""
    parts = [one.pose for one in report.holds]
    if what != "hold":
        parts = [one.axis for one in report.rotations]
    return true_minus((parts[index] if index < len(parts) else None) or "–")


def _dot(ratio: float, size: float) -> str:
    half = DOT_PLOT_COLUMNS // 2
    place = half + round(half * float(np.clip(ratio / size, -1.0, 1.0)))
    cells = ["·" if column == half else " " for column in range(DOT_PLOT_COLUMNS)]
    cells[place] = "∘"
    return "".join(cells).rstrip()


def _suspects(said: Diagnosis, bench: Bench) -> list[str]:
    """The likeliest suspects, each with its details."""
    if said.findings is None:
        return []
    fit = said.findings.fit
    since = f"  before {' and '.join(said.added)} was added" if said.added else ""
    lines = [f"SUSPECTS{since}", *suspect_head(fit, BENCH_COLUMNS)]
    for place, entry in enumerate(entries_of(bench, said.findings)[:SHOWN_SUSPECTS], 1):
        lines.append(suspect_row(entry, fit, BENCH_COLUMNS, f"{place:<2}"))
        lines += _wrapped(suspect_details(entry, fit, BENCH_COLUMNS), "    ")
    return [*lines, *_would_show(said, bench)]


def _would_show(said: Diagnosis, bench: Bench) -> list[str]:
    """The size from which the plainest effect that is not in the model would have been seen."""
    if not said.settled:
        return []
    suspects = {one.term: one for one in said.suspects if one.term not in bench.fit.model}
    for effect in bench.catalogue:
        one = suspects.get(effect.name)
        if one is None or effect.kind != "orientation":
            continue
        if np.isfinite(one.detectable_on_any_axis):
            return _wrapped(f"{effect.name} would have been {seen_from(one)}", "  ")
    return []


SIZE_COLUMN = 53
"""Columns of a suspect's row left of its size."""


def suspect_head(fit: SensorFit, width: int) -> list[str]:
    """Column titles, and the present errors.

    Args:
        fit: the present model.
        width: columns available.
    """
    titles = f"  {'with it, error would be':<24}{'fitted':>8}{'held out':>9}   {'p':<7}size ± error"
    held_out = with_unit(f"{_in_unit(fit.rms_held_out, fit.unit):>9}", readable(fit.unit)[1])
    return [titles[:width], f"  {'now':<24}{_in_unit(fit.rms_fitted, fit.unit):>8}{held_out}"]


def suspect_row(entry: Entry, fit: SensorFit, width: int, lead: str = "  ") -> str:
    """One suspect: the errors with it, its p-value and its size.

    Args:
        entry: the suspect.
        fit: the present model.
        width: columns available.
        lead: two characters in front of the name.
    """
    row = f"{lead}{suspect_name(entry):<24}"
    if entry.lacking:
        return f"{row}  cannot be seen here"[:width]
    change = "▼" if entry.falls else "▲" if entry.rises else " "
    row += f"{_in_unit(entry.rms_fitted, fit.unit):>8}{_in_unit(entry.rms_held_out, fit.unit):>9}"
    row += f" {change} {_p_text(entry):<7}{suspect_size(entry, fit.sensor, width - SIZE_COLUMN)}"
    return row.rstrip()


def suspect_details(entry: Entry, fit: SensorFit, width: int) -> str:
    """What a suspect is, from which sizes on it is seen and named, and what has nearly its pattern.

    Args:
        entry: the suspect.
        fit: the present model.
        width: of the table, which shows the sizes if there is room.
    """
    words, table = [] if entry.effect is None else [entry.effect.title], fit.rows
    if entry.suspect is not None and entry.suspect.hold is not None and table is not None:
        row = table.first_row(entry.suspect.hold)
        words.append(f"{table.place(row)}: only this one would be wrong; measure it again to check")
    elif entry.suspect is None and entry.effect is None:
        words.append("a term of the base model that every sensor needs")
    if entry.lacking:
        return "; ".join([*words, f"cannot be seen here: {entry.lacking}"])
    sizes = suspect_size(entry, fit.sensor)
    if sizes != suspect_size(entry, fit.sensor, width - SIZE_COLUMN):
        words.append(sizes)
    suspect = entry.suspect
    if entry.effect is not None and entry.effect.free:
        shape = None if suspect is None else shape_of(fit, suspect.term, (suspect,))
        words += [] if shape is None else [shape.words(), shape.unknown]
    elif suspect is not None and suspect.candidate is not None:
        words.append(seen_from(suspect))
        if suspect.like:
            others = ", ".join(suspect.like)
            words.append(
                f"nearly the same pattern here as {others}: only a large size tells them apart"
            )
    if entry.closures is not None:
        now, then = (quantity(one, "rad") for one in entry.closures)
        words.append(f"gyroscope's closure with this: {now} → {then}")
    if entry.rises:
        words.append(_not_falling(entry, fit))
    return "; ".join(words)


def _not_falling(entry: Entry, fit: SensorFit) -> str:
    """That the error in the column held out would not fall, and which one would."""
    trial, measured = None if entry.suspect is None else entry.suspect.trial, fit.experiment
    if trial is not None and measured is not None:
        change = change_held_out(measured, fit, trial)
        if change.alone and falls(fit.held_out_in_noise, trial.held_out_in_noise):
            return (
                f"▲ the error on {measured.left_out} left out would not fall, that on {change.of} "
                f"would: from {change.before} to {change.after}"
            )
    return "▲ the held-out error would not fall"


def suspect_name(entry: Entry) -> str:
    """The suspect's name; a disturbed hold with its number."""
    if entry.term == DISTURBED and entry.suspect is not None:
        hold, table = entry.suspect.hold, entry.suspect.misfit.table
        if hold is None:
            return "a disturbed hold"
        source, row = table.source_of(table.first_row(hold))
        return f"disturbed (#{source.item(row) + 1})"
    return entry.term


_SUM = re.compile(r"\w+(?: \+ \w+)+ (\S+ ± [^\s,]+)")
"""Of ``sizes_text``: sizes that only their sum is known of."""


def suspect_size(entry: Entry, sensor: str, room: int = 99) -> str:
    """The parameters that stand out ± their standard errors, with the unit.

    If room is short it is the first one, and nothing where that does not fit either.
    """
    suspect = entry.suspect
    if suspect is None or suspect.trial is None or entry.effect is None:
        return ""
    trial = suspect.trial
    sizes = sizes_text(entry.effect, sensor, trial.size, trial.standard_error, trial.covariance)
    if len(sizes) > room and (joined := _SUM.match(sizes)):
        sizes = with_unit(f"sum {joined[1]}", entry.effect.parameters(sensor)[0].unit)
    elif len(sizes) > room and suspect.candidate is not None and not entry.effect.free:
        k = suspect.largest
        value = plus_minus(float(trial.size[k]), float(trial.standard_error[k]))
        parameter = entry.effect.parameters(sensor)[k]
        sizes = with_unit(f"{parameter.name} {value}", parameter.unit)
    return sizes if len(sizes) <= room else ""


def _in_unit(value: float | None, unit: str) -> str:
    return number(None if value is None else value * readable(unit)[0])


def _p_text(entry: Entry) -> str:
    """The p-value; the simulations of noise resolve no smaller one."""
    if entry.suspect is None:
        return "base"
    return "<0.003" if entry.suspect.p < 0.003 else f"{entry.suspect.p:.2g}"


MAX_BAR_RATIO = 12.0
"""The longest bar over the present error; longer bars are cut and end in an arrow."""
_EIGHTHS = " ▏▎▍▌▋▊▉"
_NAME = 28
"""Columns of a model's name."""


def ladder_rows(
    ladder: Sequence[Rung], unit: str, width: int, height: int | None = None
) -> list[str]:
    """One row per model with both errors as numbers and bars, then the noise alone.

    Args:
        ladder: the models, the first one first.
        unit: of the errors.
        width: columns available.
        height: rows available; the oldest models are left out.
    """
    last, (factor, shown) = ladder[-1], readable(unit)
    noise = last.floor_fitted, last.floor
    errors = [e for one in ladder for e in (one.rms_fitted, one.rms_held_out) if e is not None]
    present = max(last.rms_fitted, last.rms_held_out or 0.0, *(one or 0.0 for one in noise))
    top = min(max(errors), MAX_BAR_RATIO * present) or 1.0
    room = max(4, (width - _NAME - 2 - 2 * 9) // 2)

    def row(lead: str, name: str, *errors: float | None) -> str:
        cells = [f"{lead}{name:<{_NAME}.{_NAME}}"]
        for error in errors:
            value = "–" if error is None else number(error * factor, 3)
            bar = "" if error is None else blocks(error, top, room)
            cells.append(f"{value:>8} {bar:<{room}}")
        return "".join(cells).rstrip()

    rows: list[str] = []
    for place, one in enumerate(ladder):
        lead = "▸ " if one is last else "  "
        rows.append(row(lead, _step_name(ladder, place), one.rms_fitted, one.rms_held_out))
        if one.confirmed is False:
            rows.append(f"    ▲ {_refuted_by(ladder[place - 1], one)}")
    if height is not None:
        rows = rows[-max(1, height - 2) :]
    head = f"  {'error, ' + shown:<{_NAME}}{'fitted':>8} {'':<{room}}{'held out':>8}"
    return [head[:width], *rows, row("  ", "noise alone", *noise)]


def _refuted_by(below: Rung, above: Rung) -> str:
    """What is said of a model that data held out do not confirm."""
    if falls(below.held_out_in_noise, above.held_out_in_noise):
        return "the early part of the session does not predict the late part better"
    if falls(below.rms_held_out, above.rms_held_out):
        return f"in units of the noise, the held-out error did not fall by {MIN_FALL_TEXT}"
    now, then = below.rms_held_out, above.rms_held_out
    rose = now is not None and then is not None and then >= now
    only = "only the fitted error fell, " if rose and above.rms_fitted < below.rms_fitted else ""
    return f"{only}the held-out error did not fall by {MIN_FALL_TEXT}"


def _step_name(ladder: Sequence[Rung], place: int) -> str:
    """The change of a rung: ``+ second-order``, ``− scale``, or the first model."""
    rung = ladder[place]
    if place == 0:
        return " ".join(rung.model).replace("non-orthogonality", "non-orth.") or "nothing"
    if rung.added is not None:
        return f"+ {rung.added}"
    gone = [term for term in ladder[place - 1].model if term not in rung.model]
    return f"− {', '.join(gone)}"


def blocks(value: float, top: float, width: int) -> str:
    """A bar of ``value``, if ``top`` fills ``width``; a cut bar ends in an arrow."""
    if value > 1.001 * top:
        return "█" * (width - 1) + "»"
    eighths = round(8.0 * width * value / top)
    return ("█" * (eighths // 8) + _EIGHTHS[eighths % 8]).rstrip() or "▏"


def _floors(rung: Rung) -> str:
    floors = rung.floors
    rounding = "not known"
    if floors.rounding is not None:
        dithered = ", averaged out by the noise" if floors.dithered else ""
        rounding = f"{quantity(floors.rounding, floors.unit)}{dithered}"
    repeats, found = "none (no direction was held twice)", floors.repeats
    if found is not None:
        word = "within the noise" if found.repeatable else "more than the noise"
        rms = quantity(found.rms, found.unit)
        repeats = f"{rms} ({plural(found.freedom, 'degree')} of freedom), {word}"
    place = "within directions" if floors.unit == "uT" else "at rest: within holds"
    within = quantity(floors.within, floors.unit)
    if floors.slow:
        within += f"; slow, from hold to hold {quantity(floors.slow, floors.unit)}"
    return f"{place} {within}; repeats {repeats}; rounding {rounding}"


def _wrapped(text: str, lead: str = "") -> list[str]:
    blank = " " * len(lead)
    return textwrap.wrap(text, BENCH_COLUMNS, initial_indent=lead, subsequent_indent=blank) or [
        lead
    ]
