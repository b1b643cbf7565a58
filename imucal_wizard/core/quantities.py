"""Formatting of quantities: the only place that prints a number with its error and unit.

An error (rms, floor, standard error of a result) has three significant digits wherever it is
printed, so that the same figure looks the same in ``fit``, ``bench``, ``compare`` and the wizard. A
value with a standard error has as many decimals as two digits of the error need.

>>> quantity(0.00705, "m/s^2")
'0.719 mg'
>>> quantity(0.00133, "rad")
'0.0762°'
>>> plus_minus(-5.0312, 0.11)
'−5.03 ± 0.11'
"""

import math
from collections.abc import Sequence

from imucal_wizard.core.units import STANDARD_GRAVITY

READABLE: dict[str, tuple[float, str]] = {
    "m/s^2": (1000.0 / STANDARD_GRAVITY, "mg"),
    "rad": (180.0 / math.pi, "°"),
    "rad/s": (180.0 / math.pi, "°/s"),
    "uT": (1.0, "µT"),
}
"""Factor and unit for displaying a small quantity that is stored in SI."""
_SIGNS = {
    "m/s^2": "m/s²",
    "deg/s": "°/s",
    "mdeg/s": "m°/s",
    "degC": "°C",
    "uT": "µT",
    "deg": "°",
    "1": "",
}
UNKNOWN_TEXT = "not known"
"""Text for a quantity without a value."""


def readable(unit: str) -> tuple[float, str]:
    """Factor and symbol of the unit in which a quantity stored in ``unit`` is displayed."""
    return READABLE.get(unit, (1.0, unit_sign(unit)))


def unit_sign(unit: str) -> str:
    """The symbol of a unit: ``m/s^2`` becomes ``m/s²``; a ratio has none."""
    return _SIGNS.get(unit, unit.replace("^2", "²"))


def decimals(value: float, digits: int = 2) -> int:
    """Decimals that show a value with ``digits`` significant digits; 0 if it is not finite.

    Numbers printed side by side use the same number of decimals.
    """
    if not math.isfinite(value) or value == 0:
        return 0
    exponent = int(f"{value:.{digits - 1}e}".partition("e")[2])  # of the rounded value
    return max(0, digits - 1 - exponent)


def true_minus(text: str) -> str:
    """The text with the minus sign that has a digit's width: ``+x-y`` becomes ``+x−y``."""
    return text.replace("-", "−")


def fixed(value: float, places: int) -> str:
    """A number with fixed decimals and a true minus sign; zero has no sign."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:.{places}f}"
    return text.lstrip("-") if not text.strip("-0.") else true_minus(text)


def number(value: float | None, digits: int = 3) -> str:
    """A number with about ``digits`` significant digits; a dash if there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    if not 1e-4 <= abs(value) < 1e6:
        return true_minus(f"{value:.{digits - 1}e}")
    return fixed(value, decimals(value, digits))


def with_unit(text: str, unit: str) -> str:
    """A number with its unit; ``2 × 1e-3`` if the unit is itself a number.

    Args:
        text: the number.
        unit: symbol of the unit.
    """
    if unit == "°":
        return text + unit
    return f"{text} {'× ' if unit[:1].isdigit() else ''}{unit}".rstrip()


def size_with_unit(value: float, unit: str) -> str:
    """A size with two significant digits in its own unit: ``5.1 mg/g²``, ``2 × 1e-3``."""
    return with_unit(number(value, 2), unit)


def quantity(value: float | None, unit: str, digits: int = 3) -> str:
    """A quantity in its display unit: ``0.719 mg``, ``0.0762°``.

    Args:
        value: in ``unit``; None where it is not known.
        unit: SI, µT or counts.
        digits: significant digits.
    """
    if value is None or not math.isfinite(value):
        return UNKNOWN_TEXT
    factor, sign = readable(unit)
    return with_unit(number(value * factor, digits), sign)


def limits_text(limits: tuple[float, float] | None, unit: str) -> str:
    """Two limits of a quantity in its display unit, ``0.121 to 0.188 mg``; "" without any.

    Args:
        limits: the lower and the upper one, in ``unit``.
        unit: SI, µT or counts.
    """
    if limits is None or not all(math.isfinite(one) for one in limits):
        return ""
    factor, sign = readable(unit)
    low, high = (number(one * factor, 2) for one in limits)
    return f"{low} to {with_unit(high, sign)}"


def value_and_error(value: float, error: float) -> tuple[str, str]:
    """A value and its standard error, both with the decimals of two digits of the error."""
    places = min(decimals(error), 12)
    return fixed(value, places), fixed(error, places)


def plus_minus(value: float, error: float | None) -> str:
    """``−5.03 ± 0.11``; only the value with three digits if its error is unknown."""
    if error is None or not math.isfinite(error) or error <= 0.0:
        return number(value)
    return " ± ".join(value_and_error(value, error))


def times_in_words(count: int) -> str:
    """A count in words: ``once``, ``7 times``."""
    return "once" if count == 1 else f"{count} times"


def plural(count: int, word: str) -> str:
    """A count with its noun."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"


def listed(names: Sequence[str], last: str = "and") -> str:
    """Names in words: ``x``, ``x and y``, ``x, y and z``; with ``or`` as the last word, too."""
    return f" {last} ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def capitalized(text: str) -> str:
    """The text with a capital first; the rest of it keeps its own."""
    return text[:1].upper() + text[1:]


def as_sentence(text: str) -> str:
    """The text as a sentence: a capital first, a full stop where it has no other end."""
    return f"{capitalized(text)}{'' if text[-1:] in '.?!' else '.'}"


def finite_or_none(value: float | None) -> float | None:
    """The number for a document; None if it is unknown or infinite."""
    return None if value is None or not math.isfinite(value) else float(value)


def or_nan(value: float | None) -> float:
    """The number for an array; NaN if it is unknown."""
    return math.nan if value is None else value
