"""The model: an equation in words and symbols, and the stack of its terms with their sizes."""

import math
from dataclasses import dataclass

import numpy as np

from imucal_wizard.effects.effect import Effect
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.result import Parameter
from imucal_wizard.tui.bench.entries import largest
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.report_rows import SHOWN
from imucal_wizard.tui.text import Line, line, number, unit_sign, wrapped

_WORDS = {
    "bias": ("b", "its reading when there is nothing"),
    "scale": ("s", "its reading per unit"),
    "non-orthogonality": ("T", "axes not at right angles"),
    "soft-iron": ("W", "bends the sphere to an ellipsoid"),
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
    """One line of the stack.

    Attributes:
        term: its name.
        there: whether it is in the model.
        symbol: in the equation.
        words: what it means.
        sizes: its sizes with standard errors and unit, in words.
    """

    term: str
    there: bool
    symbol: str
    words: str
    sizes: str


def equation_rows(sight: Sight, width: int) -> list[Line]:
    """The model as an equation, in symbols and in words."""
    symbol, words = _TRUE.get(sight.sensor, ("x", "true value"))
    base = sight.fit.base
    matrix = [letter for letter, term in _MATRICES if term in base]
    symbols = "·".join([*matrix, "(y − b)" if "bias" in base else "y"])
    said = "reading − bias" if "bias" in base else "reading"
    said = f"({said})" if matrix and "bias" in base else said
    said = " × ".join([*(["matrix"] if matrix else []), said])
    for term in sight.fit.terms:
        symbols += " − ε" + _index(sight, term.name)
        said += f" − {term.name}"
    formula, told = f"{symbol} = {symbols}", f"{words} = {said}"
    if len(formula) + len(told) + 3 <= width:
        return [((formula, "strong"), (f"   {told}", "quiet"))]
    return [line(formula, "strong"), *wrapped(told, width, "quiet", "  ")]


def _index(sight: Sight, term: str) -> str:
    return "₁₂₃₄₅₆₇₈₉"[[one.name for one in sight.fit.terms].index(term) % 9]


def parts_of_model(sight: Sight) -> list[Part]:
    """The base, in or out, then the effects, in the order in which they were added."""
    parts = []
    for name in sight.whole:
        symbol, words = _WORDS[name]
        there = name in sight.fit.base
        told = _base_sizes(sight, name) if there else "left out: enter puts it back"
        parts.append(Part(name, there, symbol, words, told))
    for k, (term, sizes, errors) in enumerate(
        zip(sight.fit.terms, sight.fit.sizes, sight.fit.errors, strict=True)
    ):
        symbol = "ε" + "₁₂₃₄₅₆₇₈₉"[k % 9]
        words = term.effect.equation.replace("ε", symbol, 1)
        told = effect_sizes(term.effect, sight.sensor, sizes, errors)
        parts.append(Part(term.name, True, symbol, words, told))
    return parts


def stack_rows(sight: Sight, width: int, chosen: int | None) -> list[list[Line]]:
    """The stack of terms, each with name, meaning and sizes."""
    groups: list[list[Line]] = []
    for k, part in enumerate(parts_of_model(sight)):
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
    pairs = [f"{parameters[k].name} {pair(sizes[k], errors[k])}" for k in order]
    more = "" if len(sizes) <= SHOWN_SIZES else f"  and {len(sizes) - SHOWN_SIZES} smaller"
    return "  ".join(pairs) + "  " + unit_words(parameters[0].unit) + more


def unit_words(unit: str) -> str:
    """A shown unit; ``× 1e-3`` where the unit is a number itself."""
    return f"× {unit}" if unit[:1].isdigit() else unit


def pair(value: float, error: float | None) -> str:
    """``−5.03 ± 0.11``: as many decimals as the standard error has a meaning for."""
    if error is None or not math.isfinite(error) or error <= 0.0:
        return number(float(value), 3)
    places = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{places}f} ± {error:.{places}f}".replace("-", "−")


def _base_sizes(sight: Sight, term: str) -> str:
    own = [p for p in sight.fit.fit.parameters if p.name.startswith(_FIRST[term]) and p.carried]
    if not own:
        return "these data do not carry it"
    shown = [_in_words(parameter) for parameter in own]
    first = max(range(len(own)), key=lambda k: abs(shown[k][1]))
    if len(own) <= SHOWN_SIZES:
        return "  ".join(f"{name} {pair(v, e)}" for name, v, e, _ in shown) + f"  {shown[0][3]}"
    name, value, error, unit = shown[first]
    return f"{len(own)} numbers, the largest {name} {pair(value, error)} {unit}"


def _in_words(parameter: Parameter) -> tuple[str, float, float | None, str]:
    """Name of the axis, value, standard error and unit, as people read them."""
    kind, _, axis = parameter.name.rpartition("_")
    value, error, unit = parameter.value, parameter.standard_error, parameter.unit
    factor, shown = SHOWN.get(unit, (1.0, unit_sign(unit)))
    if kind == "sensitivity" and unit in ("", "1"):
        value, factor, shown = value - 1.0, 100.0, "%"
    return axis, value * factor, None if error is None else error * factor, shown


def model_rows(sight: Sight, width: int, height: int, chosen: int | None = None) -> list[Line]:
    """Equation and stack; the stack is moved up so that the chosen term is seen."""
    head = equation_rows(sight, width)
    groups = stack_rows(sight, width, chosen)
    upto = [row for group in groups[: (chosen or 0) + 1] for row in group]
    first = max(0, len(head) + len(upto) - height) if chosen is not None else 0
    return [*head, *[row for group in groups for row in group][first:]]
