"""What the bench found, as text for a terminal that is not the app's."""

import textwrap
from collections.abc import Sequence

import numpy as np

from imucal_wizard.bench.amounts import amount, detectable, shown, sizes_text
from imucal_wizard.bench.field_text import field_rows, place_of
from imucal_wizard.bench.ladder import Rung, noise_of
from imucal_wizard.bench.says import says
from imucal_wizard.bench.session import Bench
from imucal_wizard.bench.statement import Statement
from imucal_wizard.bench.suspects import Suspect
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.field_data import FieldData

WIDTH = 79
BAR = 22
SHOWN_SUSPECTS = 8
PLOT = 21
"""Columns of the small plot of a residual, its zero in the middle."""


def bench_text(statements: Sequence[Statement]) -> str:
    """Comparison, suspects, ladder and verdict of every sensor."""
    return "\n\n".join("\n".join(_sensor(one)) for one in statements)


def _sensor(said: Statement) -> list[str]:
    lines = [f"{said.sensor.upper()}  {said.verdict.value.upper()}"]
    if said.bench is not None and said.findings is not None:
        lines[0] += f"  model: {' + '.join(said.bench.fit.model)}"
        lines += ["", *_comparison(said)]
        lines += ["", *_suspects(said, said.bench)]
        lines += ["", *_ladder(said.bench)]
    lines += ["", *_wrapped(says(said))]
    if said.advice.poses:
        lines += ["", "NEXT POSES"]
        lines += [
            line
            for number, pose in enumerate(said.advice.poses, 1)
            for line in _wrapped(pose.why, f"{number:3}  ")
        ]
    return lines


def _comparison(said: Statement) -> list[str]:
    """Measurement against model, a line per hold or rotation."""
    bench = said.bench
    if bench is None:
        return []
    if isinstance(bench.measured, FieldData):
        return field_rows(bench, bench.measured)
    linear, unit = bench.fit.linear, bench.fit.fit.unit
    moving = np.array([row.kind == "rotation" for row in linear.rows])
    what, rows = ("rotation", moving) if moving.any() else ("hold", ~moving)
    error = linear.residual * linear.sigma
    number = np.array([row.index for row in linear.rows])[rows]
    lines = [f"COMPARE  measurement − model, {what} by {what} (× noise)"]
    size = float(np.abs(error[rows] / linear.floor[rows]).max(initial=1.0))
    for index in np.unique(number):
        own = np.flatnonzero(rows)[number == index]
        value = _signed(error[own])
        ratio = _signed(error[own] / linear.floor[own]) / np.sqrt(len(own))
        cell = f"{shown(unit, value)} ({ratio:+.1f})".replace("-", "−")
        lines.append(
            f"  {index + 1:3}  {_direction(said, what, index):8} {cell:22} {_dot(ratio, size)}"
        )
    return lines


def _signed(values: FloatArray) -> float:
    """The value itself, or the length of two components."""
    return float(values[0]) if len(values) == 1 else float(np.linalg.norm(values))


def _direction(said: Statement, what: str, index: int) -> str:
    """The pose of a hold, the axis of a rotation."""
    report = said.report
    if report is None:
        return ""
    found = report.holds[index].pose if what == "hold" else report.rotations[index].axis
    return (found or "–").replace("-", "−")


def _dot(ratio: float, size: float) -> str:
    half = PLOT // 2
    place = half + round(half * float(np.clip(ratio / size, -1.0, 1.0)))
    cells = ["·" if column == half else " " for column in range(PLOT)]
    cells[place] = "∘"
    return "".join(cells).rstrip()


def _suspects(said: Statement, bench: Bench) -> list[str]:
    """Ranked, with what adding each would do."""
    unit = bench.fit.fit.unit
    if said.findings is None:
        return []
    now = shown(unit, said.findings.fit.rms_held_out)
    lines = [f"SUSPECTS  held out now {now}, would be:"]
    for number, one in enumerate(said.findings.suspects[:SHOWN_SUSPECTS], 1):
        lines += _suspect(bench, unit, number, one)
    return lines


def _suspect(bench: Bench, unit: str, number: int, one: Suspect) -> list[str]:
    p = "p < 0.001" if one.p < 0.001 else f"p {one.p:.3f}"
    if one.trial is None or one.candidate is None:
        return [f"  {number}  a disturbed {_place(bench, one.hold or 0)}   {p}"]
    after = shown(unit, one.trial.rms_held_out)
    effect = next(effect for effect in bench.catalogue if effect.name == one.term)
    size = sizes_text(effect, bench.sensor, one.trial.size, one.trial.standard_error)
    seen = detectable(one)
    least = amount(seen, one.candidate.unit) if np.isfinite(seen) else "no size"
    like = f"; looks like {', '.join(one.like)}" if one.like else ""
    return [
        f"  {number}  {one.term:24} {after:10} {p}",
        *_wrapped(f"{size}; seen from {least}{like}", "       "),
    ]


def _place(bench: Bench, row: int) -> str:
    """What is accused of being disturbed."""
    data = bench.measured
    return place_of(data, row) if isinstance(data, FieldData) else f"hold (#{row + 1})"


def _ladder(bench: Bench) -> list[str]:
    """The models so far with their errors: fitted, held out, floor."""
    unit = bench.fit.fit.unit
    errors = [rung.rms_held_out or rung.rms_fitted for rung in bench.ladder]
    longest = max(*errors, noise_of(bench.ladder), 1e-300)
    lines = ["LADDER  fitted, held out"]
    for rung, error in zip(bench.ladder, errors, strict=True):
        name = " + ".join(rung.model) if rung.added is None else f"+ {rung.added}"
        bar = _bar(error / longest)
        cells = f"{shown(unit, rung.rms_fitted):>9} {shown(unit, rung.rms_held_out):>9}"
        lines.append(f"  {name or 'nothing':34}{cells} {bar}")
    floor = noise_of(bench.ladder)
    lines.append(f"  {'noise':34}{'':9} {shown(unit, floor):>9} {_bar(floor / longest)}")
    return [*lines, *_wrapped(_floors(bench.ladder[-1]), "  ")]


def _bar(share: float) -> str:
    return "█" * max(round(BAR * share), 1)


def _floors(rung: Rung) -> str:
    floors = rung.floors
    rounding = "not known"
    if floors.rounding is not None:
        dithered = ", averaged away by the noise" if floors.dithered else ""
        rounding = f"{shown(floors.unit, floors.rounding)}{dithered}"
    repeats = "no direction was held twice"
    if floors.repeats is not None:
        word = "as good as that" if floors.repeatable else "worse than that"
        repeats = (
            f"{shown(floors.unit, floors.repeats)} ({floors.freedom} degrees of freedom), {word}"
        )
    place = "within directions" if floors.unit == "uT" else "at rest: within holds"
    return f"{place} {shown(floors.unit, floors.within)}; repeats {repeats}; rounding {rounding}"


def _wrapped(text: str, lead: str = "") -> list[str]:
    blank = " " * len(lead)
    return textwrap.wrap(text, WIDTH, initial_indent=lead, subsequent_indent=blank) or [lead]
