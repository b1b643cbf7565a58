"""The panels of the bench as rows: plot, suspects, model, ladder."""

import math

import numpy as np

from imucal_wizard.core.quantities import (
    number,
    plus_minus,
    readable,
    size_with_unit,
    unit_sign,
    with_unit,
)
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.bench import NOTHING, Entry
from imucal_wizard.diagnose.suspects import largest
from imucal_wizard.diagnose.views import ResidualView, point_of
from imucal_wizard.estimate.result import Parameter
from imucal_wizard.model.effect import Effect
from imucal_wizard.report.bench_text import suspect_name, suspect_size
from imucal_wizard.report.plot import scatter
from imucal_wizard.tui.bench.snapshot import BenchSnapshot
from imucal_wizard.tui.text import Line, Span, by_sign, clock, line, wrapped


def picture_rows(
    view: ResidualView, width: int, height: int, cursor: int | None = None
) -> list[Line]:
    """The plot of a view; see ``report.plot.scatter``."""
    rows = scatter(
        view.x, view.y, width, height, x_label=view.x_label, error=view.error, slope=view.slope,
        model=view.model, cursor=cursor,
    )  # fmt: skip
    return [by_sign(row) for row in rows]


def point_row(snapshot: BenchSnapshot, view: ResidualView, place: int) -> Line:
    """Hold, pose, time, residual and raw mean in one row."""
    point = point_of(snapshot.diagnosis.report, view, place)
    left = f"residual {number(float(view.y[place]), 3)} {view.unit}"
    if view.model is not None:
        pair = float(view.y[place]), float(view.model[place])
        left = f"{number(pair[0], 4)}, model {number(pair[1], 4)} {view.unit}"
    cells = " ".join(number(float(value), 4) for value in point.reading)
    what = "read" if point.at_rest or point.unit != "deg/s" else "fastest"
    where = f"{point.name}, {clock(point.time)}"
    read = f"{what} {cells} {unit_sign(point.unit or snapshot.fit.bias_unit)}"
    return (("◆ ", "accent"), (where, "strong"), (f"  {left}  ", ""), (read, "quiet"))


BLIND = "no size"
WIDE_TABLE = 100
"""Columns from which the table has columns for detectable size and similar effects."""


def order(snapshot: BenchSnapshot, *, hidden: bool = False) -> tuple[Entry, ...]:
    """The entries as shown; in alphabetical order while the answer is hidden."""
    by_name = (*sorted(snapshot.entries, key=lambda entry: entry.term), Entry(NOTHING))
    return by_name if hidden else snapshot.entries


def table_rows(
    snapshot: BenchSnapshot, width: int, height: int, chosen: int | None, *, hidden: bool = False
) -> list[Line]:
    """Heading, present errors, the suspects that fit, details of the selected one.

    Args:
        snapshot: of the bench.
        width: columns available.
        height: rows available; at least six.
        chosen: index of the selected suspect.
        hidden: show only the names, so that the user guesses first.
    """
    entries = order(snapshot, hidden=hidden)
    about = [] if chosen is None else about_rows(entries[chosen], width, hidden=hidden)
    about = about[: max(1, height - 5)]
    room = max(2, height - 2 - len(about))
    first = 0 if chosen is None else min(max(0, chosen - room + 1), max(0, len(entries) - room))
    rows = [
        entry_row(snapshot, entry, width, here=first + k == chosen, hidden=hidden)
        for k, entry in enumerate(entries[first : first + room])
    ]
    rows += [line("")] * (room - len(rows))
    return [*head_rows(snapshot, width, hidden=hidden), *rows, *about]


def head_rows(snapshot: BenchSnapshot, width: int, *, hidden: bool = False) -> list[Line]:
    """Column titles, and the present errors."""
    if hidden:
        return [line("  what may be missing", "quiet"), line("")]
    fit = snapshot.fit
    _, unit = readable(fit.unit)
    wide = f"  {'seen from':<12}{'looks like'}" if width >= WIDE_TABLE else ""
    names = f"  {'with it, error would be':<24}{'fitted':>8}{'held out':>9}   "
    return [
        line(f"{names}{'p':<7}{'largest size ± error':<26}{wide}"[:width], "quiet"),
        (
            (f"  {'now':<24}", "quiet"),
            (f"{_in_unit(fit.rms_fitted, fit.unit):>8}", "strong"),
            (f"{_in_unit(fit.rms_held_out, fit.unit):>9}", "strong"),
            (f" {unit}", "quiet"),
        ),
    ]


def entry_row(
    snapshot: BenchSnapshot, entry: Entry, width: int, *, here: bool, hidden: bool = False
) -> Line:
    """One suspect."""
    mark: Span = ("▸ " if here else "  ", "accent")
    name: Span = (f"{suspect_name(entry):<24}", "strong" if here else "")
    if hidden or entry.lacking:
        told = "" if hidden else f"  cannot be seen here: {entry.lacking}"
        return mark, name, (told[: max(0, width - 26)], "quiet")
    unit, room = snapshot.fit.unit, max(0, width - 53)
    falls = _falls(entry)
    spans: list[Span] = [
        mark,
        name,
        (f"{_in_unit(entry.rms_fitted, unit):>8}", ""),
        (f"{_in_unit(entry.rms_held_out, unit):>9}", "good" if falls == "▼" else ""),
        (f" {falls} ", "good" if falls == "▼" else "warn"),
        (f"{p_text(entry):<7}", "strong" if entry.significant else "quiet"),
        (f"{suspect_size(entry, room):<26}"[:room], ""),
    ]
    if width >= WIDE_TABLE:
        spans.append((f"  {_seen_from(entry):<12}{', '.join(_like(entry))}"[: width - 79], "quiet"))
    return tuple(spans)


def p_text(entry: Entry) -> str:
    """The p-value, to the resolution of the simulations."""
    if entry.suspect is None:
        return "base"
    return "<0.003" if entry.suspect.p < 0.003 else f"{entry.suspect.p:.2g}"


def about_rows(entry: Entry, width: int, *, hidden: bool = False) -> list[Line]:
    """Details of the selected suspect."""
    if hidden:
        text = "enter: commit to this one   l: its lesson, with its plot"
        return wrapped(f"  {text}", width, "quiet", indent="  ")
    words = [] if entry.effect is None else [entry.effect.title]
    if entry.suspect is None and entry.effect is None:
        words.append("a term of the base model that every sensor needs")
    elif entry.term == "disturbed":
        words.append("one hold is wrong: somebody touched it. Measure it again")
    if entry.lacking:
        words.append(f"cannot be seen here: {entry.lacking}")
    elif _seen_from(entry) == BLIND:
        words.append("these data cannot show it at any size")
    elif _seen_from(entry):
        words.append(f"these data show it from {_seen_from(entry)}")
    if _like(entry):
        words.append(f"looks the same here as {', '.join(_like(entry))}")
    elif entry.suspect is not None and entry.suspect.candidate is not None:
        words.append("nothing else looks like it here")
    if entry.rms_held_out is not None and _falls(entry) == "▲":
        words.append("▲ the held-out error would not fall")
    return wrapped("  " + "; ".join(words), width, "quiet", indent="  ")


def _in_unit(value: float | None, unit: str) -> str:
    return number(None if value is None else value * readable(unit)[0])


def _falls(entry: Entry) -> str:
    return "▼" if entry.falls else "▲" if entry.rises else " "


def _seen_from(entry: Entry) -> str:
    if entry.suspect is None or entry.suspect.candidate is None:
        return ""
    size = entry.detectable or 0.0
    if not math.isfinite(size):
        return BLIND
    return size_with_unit(size, entry.suspect.candidate.unit)


def _like(entry: Entry) -> tuple[str, ...]:
    return () if entry.suspect is None else entry.suspect.like


_WORDS = {
    "bias": ("b", "reading at zero input"),
    "scale": ("s", "reading per unit of input"),
    "non-orthogonality": ("T", "axes not at right angles"),
    "soft-iron": ("W", "turns the sphere into an ellipsoid"),
}
_FIRST = {
    "bias": ("bias",),
    "scale": ("sensitivity",),
    "non-orthogonality": ("theta", "cross"),
    "soft-iron": ("soft_iron",),
}
_TRUE = {
    "accelerometer": ("f", "true force"),
    "gyroscope": ("w", "true rate"),
    "magnetometer": ("m", "true field"),
}
_MATRICES = (("T", "non-orthogonality"), ("s", "scale"), ("W", "soft-iron"))
SHOWN_SIZES = 3


@dataclass(frozen=True)
class Part:
    """One term of the model.

    Attributes:
        term: its name.
        there: whether it is in the model.
        symbol: in the equation.
        words: its meaning.
        sizes: its sizes with standard errors and unit.
    """

    term: str
    there: bool
    symbol: str
    words: str
    sizes: str


def equation_rows(snapshot: BenchSnapshot, width: int) -> list[Line]:
    """The model as an equation, in symbols and in words."""
    symbol, words = _TRUE.get(snapshot.sensor, ("x", "true value"))
    base = snapshot.fit.base
    matrix = [letter for letter, term in _MATRICES if term in base]
    symbols = "·".join([*matrix, "(y − b)" if "bias" in base else "y"])
    said = "reading − bias" if "bias" in base else "reading"
    said = f"({said})" if matrix and "bias" in base else said
    said = " × ".join([*(["matrix"] if matrix else []), said])
    for term in snapshot.fit.terms:
        symbols += " − ε" + _index(snapshot, term.name)
        said += f" − {term.name}"
    formula, told = f"{symbol} = {symbols}", f"{words} = {said}"
    if len(formula) + len(told) + 3 <= width:
        return [((formula, "strong"), (f"   {told}", "quiet"))]
    return [line(formula, "strong"), *wrapped(told, width, "quiet", "  ")]


def _index(snapshot: BenchSnapshot, term: str) -> str:
    return "₁₂₃₄₅₆₇₈₉"[[one.name for one in snapshot.fit.terms].index(term) % 9]


def parts_of_model(snapshot: BenchSnapshot) -> list[Part]:
    """The terms of the base, in the model or not, then the effects in the order of adding."""
    parts = []
    for name in snapshot.whole:
        symbol, words = _WORDS[name]
        there = name in snapshot.fit.base
        told = _base_sizes(snapshot, name) if there else "left out: enter puts it back"
        parts.append(Part(name, there, symbol, words, told))
    for k, (term, sizes, errors) in enumerate(
        zip(snapshot.fit.terms, snapshot.fit.sizes, snapshot.fit.size_errors, strict=True)
    ):
        symbol = "ε" + "₁₂₃₄₅₆₇₈₉"[k % 9]
        words = term.effect.equation.replace("ε", symbol, 1)
        told = effect_sizes(term.effect, snapshot.sensor, sizes, errors)
        parts.append(Part(term.name, True, symbol, words, told))
    return parts


def stack_rows(snapshot: BenchSnapshot, width: int, chosen: int | None) -> list[list[Line]]:
    """The terms, each with name, meaning and sizes."""
    groups: list[list[Line]] = []
    for k, part in enumerate(parts_of_model(snapshot)):
        here = k == chosen
        sign = "✓" if part.there else "·"
        name: Line = (
            ("▸" if here else " ", "accent"),
            (f" {sign} ", "good" if part.there else "quiet"),
            (f"{part.term:<18}", "strong" if here or part.there else "quiet"),
            (f" {part.symbol:<2} ", "key"),
            (f"{part.words}"[: max(0, width - 26)], "quiet"),
        )
        sizes = wrapped(f"   {part.sizes}", width, "" if part.there else "quiet", "   ")
        groups.append([name, *sizes])
    return groups


def effect_sizes(effect: Effect, sensor: str, sizes: FloatArray, errors: FloatArray) -> str:
    """Sizes with standard errors and unit, those that stand out first: ``x −5.03 ± 0.11 …``."""
    parameters = effect.parameters(sensor)
    safe = np.where(errors > 0.0, errors, np.inf)
    order = np.argsort(-np.nan_to_num(np.abs(sizes) / safe), kind="stable")
    order = np.sort(order[:SHOWN_SIZES]) if len(order) > SHOWN_SIZES else np.arange(len(order))
    if len(sizes) > SHOWN_SIZES and largest(sizes, errors) not in order:
        order[0] = largest(sizes, errors)
    pairs = [f"{parameters[k].name} {plus_minus(sizes[k], errors[k])}" for k in order]
    more = "" if len(sizes) <= SHOWN_SIZES else f"  and {len(sizes) - SHOWN_SIZES} smaller"
    return with_unit("  ".join(pairs), parameters[0].unit) + more


def _base_sizes(snapshot: BenchSnapshot, term: str) -> str:
    own = [p for p in snapshot.fit.parameters if p.name.startswith(_FIRST[term]) and p.carried]
    if not own:
        return "these data do not determine it"
    shown = [_in_words(parameter) for parameter in own]
    first = max(range(len(own)), key=lambda k: abs(shown[k][1]))
    if len(own) <= SHOWN_SIZES:
        return (
            "  ".join(f"{name} {plus_minus(v, e)}" for name, v, e, _ in shown) + f"  {shown[0][3]}"
        )
    name, value, error, unit = shown[first]
    return f"{len(own)} numbers, the largest {name} {plus_minus(value, error)} {unit}"


def _in_words(parameter: Parameter) -> tuple[str, float, float | None, str]:
    """Name of the axis, value, standard error and unit, in the units that people use."""
    kind, _, axis = parameter.name.rpartition("_")
    value, error, unit = parameter.value, parameter.standard_error, parameter.unit
    factor, shown = readable(unit)
    if kind == "sensitivity" and unit in ("", "1"):
        value, factor, shown = value - 1.0, 100.0, "%"
    return axis, value * factor, None if error is None else error * factor, shown


def model_rows(
    snapshot: BenchSnapshot, width: int, height: int, chosen: int | None = None
) -> list[Line]:
    """Equation and terms, scrolled to the selected term."""
    head = equation_rows(snapshot, width)
    groups = stack_rows(snapshot, width, chosen)
    upto = [row for group in groups[: (chosen or 0) + 1] for row in group]
    first = max(0, len(head) + len(upto) - height) if chosen is not None else 0
    return [*head, *[row for group in groups for row in group][first:]]


_EIGHTHS = " ▏▎▍▌▋▊▉"
MAX_BAR_RATIO = 12.0
"""The longest bar over the present error; longer bars are cut and end in an arrow."""
_NAME = 22


def ladder_rows(snapshot: BenchSnapshot, width: int, height: int | None = None) -> list[Line]:
    """One row per model, then the floor.

    Args:
        snapshot: of the bench.
        width: columns available.
        height: rows available; the oldest models are left out.
    """
    unit = snapshot.fit.unit
    factor, shown = readable(unit)
    rungs, last = snapshot.ladder, snapshot.ladder[-1]
    errors = [e for rung in rungs for e in (rung.rms_fitted, rung.rms_held_out) if e is not None]
    noise = last.floor_fitted, last.floor
    present = max(last.rms_fitted, last.rms_held_out or 0.0, *(one or 0.0 for one in noise))
    top = min(max(errors), MAX_BAR_RATIO * present) or 1.0
    room = max(4, (width - _NAME - 2 - 2 * 9) // 2)
    rows: list[Line] = []
    for place in range(len(rungs)):
        rows.append(_rung(snapshot, place, factor, top, room))
        if snapshot.refuted(place):
            rows.append(line("    ▲ only the fitted error fell: u takes it back", "warn"))
    if height is not None:
        rows = rows[-max(1, height - 2) :]
    head = f"  {'error, ' + shown:<{_NAME}}{'fitted':>8} {'':<{room}}{'held out':>8}"
    foot: Span = (f"  {'noise alone':<{_NAME}}", "quiet")
    bars = _bars(noise, ("quiet", "quiet", "quiet"), factor, top, room)
    return [line(head[:width], "quiet"), *rows, (foot, *bars)]


def _rung(snapshot: BenchSnapshot, place: int, factor: float, top: float, room: int) -> Line:
    """One model with both errors, as numbers and as bars of at most ``room`` columns."""
    rung, last = snapshot.ladder[place], place == len(snapshot.ladder) - 1
    style = "strong" if last else ""
    return (
        ("▸ " if last else "  ", "accent"),
        (f"{step_name(snapshot, place):<{_NAME}.{_NAME}}", style),
        *_bars((rung.rms_fitted, rung.rms_held_out), (style, "quiet", "accent"), factor, top, room),
    )


def _bars(
    errors: tuple[float | None, float | None],
    styles: tuple[str, str, str],
    factor: float,
    top: float,
    room: int,
) -> Line:
    """An error fitted and one held out, each as a number and as a bar.

    Args:
        errors: both, None where there is none.
        styles: of the numbers, of the first bar and of the second.
        factor: shown unit per unit of the errors.
        top: error whose bar fills the room.
        room: columns of a bar.
    """
    spans: list[Span] = []
    for error, style in zip(errors, styles[1:], strict=True):
        text = "–" if error is None else number(error * factor, 3)
        bar = "" if error is None else blocks(error, top, room)
        spans += [(f"{text:>8} ", styles[0]), (f"{bar:<{room}}", style)]
    return tuple(spans)


def step_name(snapshot: BenchSnapshot, place: int) -> str:
    """The change of a rung: ``+ second-order``, ``− scale``, or the first model."""
    rung = snapshot.ladder[place]
    if place == 0:
        full = len(rung.model) == 3
        return "bias scale non-orth." if full else " ".join(rung.model) or "nothing"
    if rung.added is not None:
        return f"+ {rung.added}"
    gone = [term for term in snapshot.ladder[place - 1].model if term not in rung.model]
    return f"− {', '.join(gone)}"


def blocks(value: float, top: float, width: int) -> str:
    """A bar of ``value``, if ``top`` fills ``width``; a cut bar ends in an arrow."""
    if value > 1.001 * top:
        return "█" * (width - 1) + "»"
    eighths = round(8.0 * width * value / top)
    return ("█" * (eighths // 8) + _EIGHTHS[eighths % 8]).rstrip() or "▏"
