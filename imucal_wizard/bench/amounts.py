"""Numbers of the bench as people read them: mg, degrees, sizes with their standard errors."""

import numpy as np

from imucal_wizard.bench.suspects import Suspect
from imucal_wizard.effects.effect import Effect
from imucal_wizard.readings import FloatArray
from imucal_wizard.units import ACCELERATION

CLEAR = 3.0
"""Standard errors from which a size is worth naming."""
NAMED = 3
"""So many parameters of one effect are named at most."""


def shown(unit: str, value: float | None) -> str:
    """An error in the unit people read: mg, degrees, degrees per second, µT."""
    if value is None or not np.isfinite(value):
        return "not known"
    if unit == "rad":
        return f"{_short(np.degrees(value))}°"
    if unit == "rad/s":
        return f"{_short(np.degrees(value))} °/s"
    if unit == "uT":
        return f"{_short(value)} µT"
    return f"{_short(value / ACCELERATION['mg'])} mg"


def amount(value: float, unit: str) -> str:
    """A value with its unit; ``2 × 1e-3`` where the unit is a number itself."""
    text = _short(value)
    return f"{text} × {unit}" if unit[:1].isdigit() else f"{text} {unit}"


def sizes_text(effect: Effect, sensor: str, sizes: FloatArray, errors: FloatArray) -> str:
    """The sizes that stand out: ``x 5.1 ± 0.3, z −1.2 ± 0.3 mg/g²``; else the largest.

    Args:
        effect: the effect.
        sensor: whose.
        sizes: shown unit, shape (p,).
        errors: one standard deviation each, NaN where they are not known, shape (p,).
    """
    parameters = effect.parameters(sensor)
    certain = np.abs(sizes) / np.where(errors > 0.0, errors, np.inf)
    order = np.argsort(-np.where(np.isfinite(certain), certain, 0.0), kind="stable")
    clear = [k for k in order[:NAMED] if certain[k] >= CLEAR] or [int(np.argmax(np.abs(sizes)))]
    parts = [f"{parameters[k].name} {_pair(float(sizes[k]), float(errors[k]))}" for k in clear]
    unit = parameters[0].unit
    return f"{', '.join(parts)} {'× ' if unit[:1].isdigit() else ''}{unit}"


def _pair(size: float, error: float) -> str:
    if not np.isfinite(error) or error <= 0.0:
        return _signed(_short(size))
    places = max(int(1 - np.floor(np.log10(error))), 0)
    return f"{_signed(f'{size:.{places}f}')} ± {error:.{places}f}"


def _signed(text: str) -> str:
    return text.replace("-", "−")


def _short(value: float) -> str:
    """Two or three digits that matter, without an exponent where one can do without."""
    size = abs(value)
    if size == 0.0:
        return "0"
    if 1e-4 <= size < 1e5:
        return _signed(f"{value:.{max(int(1 - np.floor(np.log10(size))), 0)}f}")
    return _signed(f"{value:.2g}")


def detectable(one: Suspect) -> float:
    """Smallest size on one axis that these data would show, the worst axis that shows at all."""
    sizes = np.atleast_1d(np.asarray(one.detectable, np.float64))
    seen = sizes[np.isfinite(sizes)]
    return float(seen.max()) if len(seen) else np.inf
