"""Numbers as they are told: as fine as they are known and no finer, or not at all."""

import math


def decimals(value: float, digits: int = 2) -> int:
    """How many decimals show a value with ``digits`` significant digits; 0 for what is not one.

    Numbers that stand beside one another share them, so that they can be compared at a glance.
    """
    if not math.isfinite(value) or value == 0:
        return 0
    exponent = int(f"{value:.{digits - 1}e}".partition("e")[2])  # of the rounded value
    return max(0, digits - 1 - exponent)


def fixed(value: float, places: int) -> str:
    """A number with this many decimals, a true minus sign, and none before zero."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:.{places}f}"
    return text.lstrip("-") if not text.strip("-0.") else text.replace("-", "−")


def how_often(count: int) -> str:
    """How often: ``once``, ``7 times``."""
    return "once" if count == 1 else f"{count} times"


def measured(value: float, error: float) -> tuple[str, str]:
    """A value and its standard error, both to the error's second digit."""
    places = min(decimals(error), 12)
    return fixed(value, places), fixed(error, places)


def finite(value: float | None) -> float | None:
    """A number for a document, or None where it is unknown or infinite."""
    return None if value is None or not math.isfinite(value) else float(value)
