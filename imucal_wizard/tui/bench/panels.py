"""The panels of the bench as rows: plot, suspects, model, ladder."""

import re

from imucal_wizard.core.quantities import number, plus_minus, readable, unit_sign, with_unit
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.bench import NOTHING_MISSING, Entry
from imucal_wizard.diagnose.effect_text import MAX_NAMED_PARAMETERS, leading_sizes_text
from imucal_wizard.diagnose.views import ResidualView, point_of
from imucal_wizard.estimate.result import Parameter
from imucal_wizard.report.bench_text import (
    ladder_rows,
    suspect_details,
    suspect_head,
    suspect_name,
    suspect_row,
)
from imucal_wizard.report.plot import scatter
from imucal_wizard.tui.bench.snapshot import BenchSnapshot
from imucal_wizard.tui.text import Line, by_sign, clock, line, width_of, wrapped


def picture_rows(
    view: ResidualView, width: int, height: int, cursor: int | None = None
) -> list[Line]:
    """The plot of a view; see ``report.plot.scatter``."""
    rows = scatter(
        view.x, view.y, width, height, x_label=view.x_label, error=view.error, slope=view.slope,
        model=view.model, predicted=view.predicted, cursor=cursor,
    )  # fmt: skip
    return [by_sign(row) for row in rows]


def view_head(view: ResidualView, width: int) -> list[Line]:
    """Title and legend of a view, in one row if they fit."""
    title = f"{view.title}, {view.unit}" if view.slope is None else view.title
    first: Line = ((f"{view.part}: ", "strong"), (title, ""))
    legend = (f"  {view.legend}", "quiet")
    return [(*first, legend)] if width_of((*first, legend)) <= width else [first, (legend,)]


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


def order(snapshot: BenchSnapshot, *, hidden: bool = False) -> tuple[Entry, ...]:
    """The entries as shown; in alphabetical order while the answer is hidden."""
    by_name = (*sorted(snapshot.entries, key=lambda entry: entry.term), Entry(NOTHING_MISSING))
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
    entries, fit = order(snapshot, hidden=hidden), snapshot.fit
    head, details = suspect_head(fit, width), ""
    if chosen is not None:
        details = suspect_details(entries[chosen], fit, width)
    if hidden:
        head, details = ["  what may be missing", ""], "enter: commit to this one   l: its lesson"
    about = wrapped(f"  {details}", width, "quiet", indent="  ") if details else []
    about = about[: max(1, height - 5)]
    room = max(2, height - 2 - len(about))
    first = 0 if chosen is None else min(max(0, chosen - room + 1), max(0, len(entries) - room))
    rows = []
    for k, entry in enumerate(entries[first : first + room], first):
        lead = "▸ " if k == chosen else "  "
        row = f"{lead}{suspect_name(entry)}" if hidden else suspect_row(entry, fit, width, lead)
        rows.append(by_sign(row, "strong" if k == chosen else "quiet" if entry.lacking else ""))
    rows += [line("")] * (room - len(rows))
    return [line(head[0], "quiet"), line(head[1], "strong"), *rows, *about]


def ladder_lines(snapshot: BenchSnapshot, width: int, height: int | None = None) -> list[Line]:
    """The ladder; see ``report.bench_text.ladder_rows``."""
    rows = ladder_rows(snapshot.ladder, snapshot.fit.unit, width, height)
    styles = {0: "quiet", len(rows) - 1: "quiet"}
    return [by_sign(row, styles.get(k, "")) for k, row in enumerate(rows)]


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
    formula, spoken = f"{symbol} = {symbols}", f"{words} = {said}"
    if len(formula) + len(spoken) + 3 <= width:
        return [((formula, "strong"), (f"   {spoken}", "quiet"))]
    return [line(formula, "strong"), *wrapped(spoken, width, "quiet", "  ")]


def _index(snapshot: BenchSnapshot, term: str) -> str:
    return "₁₂₃₄₅₆₇₈₉"[[one.name for one in snapshot.fit.terms].index(term) % 9]


def parts_of_model(snapshot: BenchSnapshot) -> list[Part]:
    """The terms of the base, in the model or not, then the effects in the order of adding."""
    parts = []
    for name in snapshot.whole:
        symbol, words = _WORDS[name]
        there = name in snapshot.fit.base
        shown = _base_sizes(snapshot, name) if there else "left out: enter puts it back"
        parts.append(Part(name, there, symbol, words, shown))
    for k, (term, sizes, errors) in enumerate(
        zip(snapshot.fit.terms, snapshot.fit.sizes, snapshot.fit.size_errors, strict=True)
    ):
        symbol = "ε" + "₁₂₃₄₅₆₇₈₉"[k % 9]
        words = term.effect.equation.replace("ε", symbol, 1)
        shown = leading_sizes_text(term.effect, snapshot.sensor, sizes, errors)
        parts.append(Part(term.name, True, symbol, words, shown))
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


def _base_sizes(snapshot: BenchSnapshot, term: str) -> str:
    own = [p for p in snapshot.fit.parameters if p.name.startswith(_FIRST[term]) and p.carried]
    if not own:
        return "these data do not determine it"
    shown = [_in_words(parameter) for parameter in own]
    first = max(range(len(own)), key=lambda k: abs(shown[k][1]))
    if len(own) <= MAX_NAMED_PARAMETERS:
        return (
            "  ".join(f"{name} {plus_minus(v, e)}" for name, v, e, _ in shown) + f"  {shown[0][3]}"
        )
    name, value, error, unit = shown[first]
    largest = with_unit(f"{name} {plus_minus(value, error)}", unit)
    return f"{len(own)} numbers, the largest {largest}"


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


_MARKS = {"good": "✓", "warn": "▲", "accent": "▸"}


def verdict_rows(snapshot: BenchSnapshot, width: int, height: int) -> list[Line]:
    """The verdict in the rows available: its first sentences if not all of it fits."""
    style, words, more = snapshot.style, snapshot.diagnosis.says, "  … (n shows the rest)"
    mark = f" {_MARKS.get(style, '▸')} "

    def rows(text: str) -> list[Line]:
        return wrapped(mark + text, width, style, indent="   ")

    if len(rows(words)) <= height:
        return rows(words)
    for end in reversed([found.start() for found in re.finditer(r"(?<=[.?!]) ", words)]):
        first = rows(words[:end])
        if len(first) <= height and width_of(first[-1]) + len(more) <= width:
            return [*first[:-1], (*first[-1], (more, "key"))]
    cut = "".join(text for text, _ in rows(words)[max(0, height - 1)])
    cut = cut[: width - len(more)].rsplit(" ", 1)[0]
    return [*rows(words)[: max(0, height - 1)], ((cut, style), (more, "key"))][: max(0, height)]
