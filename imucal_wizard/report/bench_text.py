"""The findings of the bench as plain text."""

import textwrap
from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.quantities import (
    plus_minus,
    quantity,
    size_with_unit,
    true_minus,
    with_unit,
)
from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.diagnose.bench import Bench, Entry, Rung
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.hypotheses import DISTURBED
from imucal_wizard.diagnose.suspects import Suspect
from imucal_wizard.diagnose.verdict_text import sizes_text
from imucal_wizard.model.rows.table import ResidualTable

BENCH_COLUMNS = 79
BAR = 22
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
        lines += ["", *_ladder(said.bench)]
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
    lines = [f"COMPARE  measurement − model, {what} by {what} (× noise)"]
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
    """Measurement against model of a magnetometer, the rows that fit worst."""
    ratio = table.residual / table.floor
    order = np.argsort(-np.abs(ratio), kind="stable")[:LISTED_ROWS]
    worst = f"the {len(order)} means of {len(ratio)} that fit worst"
    lines = [f"COMPARE  measurement − model, {worst} (× noise)"]
    for row in sorted(order.tolist()):
        cell = true_minus(f"{quantity(float(table.residual[row]), 'uT')} ({ratio[row]:+.1f})")
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
    """The ranked suspects, each with the error after adding it."""
    unit = bench.fit.unit
    if said.findings is None:
        return []
    now = quantity(said.findings.fit.rms_held_out, unit)
    lines = [f"SUSPECTS  held out now {now}, would be:"]
    for number, one in enumerate(said.findings.suspects[:SHOWN_SUSPECTS], 1):
        lines += _suspect(bench, unit, number, one)
    return [*lines, *_would_show(said, bench)]


def _would_show(said: Diagnosis, bench: Bench) -> list[str]:
    """The size from which the plainest effect that is not in the model would have been seen."""
    if not said.settled:
        return []
    suspects = {one.term: one for one in said.suspects}
    for effect in bench.catalogue:
        if effect.name in suspects and effect.kind == "orientation":
            size = suspects[effect.name].detectable_on_any_axis
            unit = effect.parameters(bench.sensor)[0].unit
            if np.isfinite(size):
                shown = size_with_unit(size, unit)
                return [f"  {effect.name} would have shown from {shown} on"]
    return []


def _suspect(bench: Bench, unit: str, number: int, one: Suspect) -> list[str]:
    p = "p < 0.001" if one.p < 0.001 else f"p {one.p:.3f}"
    if one.trial is None or one.candidate is None:
        row = int(np.flatnonzero(bench.rows.index == one.hold)[0])
        return [f"  {number}  disturbed: {bench.rows.place(row)}   {p}"]
    after = quantity(one.trial.rms_held_out, unit)
    effect = next(effect for effect in bench.catalogue if effect.name == one.term)
    size = sizes_text(effect, bench.sensor, one.trial.size, one.trial.standard_error)
    seen = one.detectable_on_any_axis
    least = size_with_unit(seen, one.candidate.unit) if np.isfinite(seen) else "no size"
    like = f"; looks like {', '.join(one.like)}" if one.like else ""
    return [
        f"  {number}  {one.term:24} {after:10} {p}",
        *_wrapped(f"{size}; seen from {least}{like}", "       "),
    ]


def suspect_name(entry: Entry) -> str:
    """The suspect's name; a disturbed hold with its number."""
    if entry.term == DISTURBED and entry.suspect is not None:
        hold = entry.suspect.hold
        return "a disturbed hold" if hold is None else f"disturbed (#{hold + 1})"
    return entry.term


def suspect_size(entry: Entry, room: int = 99) -> str:
    """The parameter that stands out most ± its standard error; its unit if there is room."""
    suspect = entry.suspect
    if suspect is None or suspect.trial is None or suspect.candidate is None:
        return ""
    k, trial = suspect.largest, suspect.trial
    name, unit = suspect.candidate.names[k], suspect.candidate.unit
    size = f"{name} {plus_minus(float(trial.size[k]), float(trial.standard_error[k]))}"
    return with_unit(size, unit) if len(with_unit(size, unit)) <= room else size[:room]


def _ladder(bench: Bench) -> list[str]:
    """The models so far with their errors: fitted, held out, floor."""
    unit = bench.fit.unit
    last, steps = bench.ladder[-1], []
    for rung in bench.ladder:
        name = " + ".join(rung.model) if rung.added is None else f"+ {rung.added}"
        steps.append((name or "nothing", rung.rms_fitted, rung.rms_held_out))
    if last.floor_fitted is not None:
        steps.append(("noise", last.floor_fitted, last.floor))
    longest = max(*(fitted if out is None else out for _, fitted, out in steps), 1e-300)
    lines = ["LADDER  fitted, held out"]
    for name, fitted, out in steps:
        bar = _bar((fitted if out is None else out) / longest)
        lines.append(f"  {name:34}{quantity(fitted, unit):>9} {quantity(out, unit):>9} {bar}")
    return [*lines, *_wrapped(_floors(last), "  ")]


def _bar(share: float) -> str:
    return "█" * max(round(BAR * share), 1)


def _floors(rung: Rung) -> str:
    floors = rung.floors
    rounding = "not known"
    if floors.rounding is not None:
        dithered = ", averaged away by the noise" if floors.dithered else ""
        rounding = f"{quantity(floors.rounding, floors.unit)}{dithered}"
    repeats, found = "no direction was held twice", floors.repeats
    if found is not None:
        word = "as good as that" if found.repeatable else "worse than that"
        rms = quantity(found.rms, found.unit)
        repeats = f"{rms} ({found.freedom} degrees of freedom), {word}"
    place = "within directions" if floors.unit == "uT" else "at rest: within holds"
    return f"{place} {quantity(floors.within, floors.unit)}; repeats {repeats}; rounding {rounding}"


def _wrapped(text: str, lead: str = "") -> list[str]:
    blank = " " * len(lead)
    return textwrap.wrap(text, BENCH_COLUMNS, initial_indent=lead, subsequent_indent=blank) or [
        lead
    ]
