"""What a typed formula may depend on, in the units of data sheets."""

from collections.abc import Callable, Mapping

import numpy as np

from imucal_wizard.effects import lacks
from imucal_wizard.effects.axis_effect import AXES, sensed, warmth
from imucal_wizard.effects.effect import (
    ACCELEROMETER,
    GYROSCOPE,
    MAGNETOMETER,
    Against,
    Circumstances,
    Kind,
)
from imucal_wizard.effects.expression import Value
from imucal_wizard.units import ACCELERATION

VARIABLES: Mapping[str, str] = {
    **{f"a{axis}": f"specific force along {axis}, g" for axis in AXES},
    **{f"w{axis}": f"rate about {axis}, °/s" for axis in AXES},
    **{f"m{axis}": f"flux density along {axis}, µT" for axis in AXES},
    **{f"p{axis}": f"specific force along {axis} in the hold before, g" for axis in AXES},
    "a": "specific force on the axis itself, g",
    "w": "rate about the axis itself, °/s",
    "m": "flux density on the axis itself, µT",
    "p": "specific force on the axis itself in the hold before, g",
    "T": "temperature minus the session's mean, °C",
    "t": "time since the session's first sample, s",
    "v": "mean square vibration, g²",
    "I": "current, A, or throttle, %",
    "g": "local gravity, g",
}
"""What a formula may depend on, for the bench to show."""
_NEEDS: Mapping[str, Callable[[Circumstances], str | None]] = {
    "T": lacks.temperatures,
    "t": lacks.duration,
    "w": lambda c: lacks.turns(GYROSCOPE, c),
    "p": lacks.previous_poses,
    "v": lacks.vibrations,
    "m": lacks.fields,
    "I": lacks.currents,
}
"""What must vary in the data, by the first letter of a variable."""
_AGAINST: Mapping[str, Against] = {
    "T": "temperature",
    "t": "time",
    "v": "vibration",
    "p": "previous",
    "I": "current",
    "m": "input",
    "w": "input",
    "a": "force",
}


def variables_of(c: Circumstances) -> dict[str, Value]:
    """What a formula may depend on, in data sheet units, each of shape (n,)."""
    force, rate = sensed(ACCELEROMETER, c), sensed(GYROSCOPE, c)
    before = np.nan_to_num(c.previous, nan=0.0) / ACCELERATION["g"]
    field = sensed(MAGNETOMETER, c)
    found: dict[str, Value] = {}
    for k, axis in enumerate(AXES):
        found |= {f"a{axis}": force[:, k], f"w{axis}": rate[:, k], f"p{axis}": before[:, k]}
        found[f"m{axis}"] = field[:, k]
    return found | {
        "T": warmth(c),
        "t": c.time,
        "v": np.nan_to_num(c.vibration, nan=0.0) / ACCELERATION["g"] ** 2,
        "I": c.current,
        "g": np.float64(c.gravity / ACCELERATION["g"]),
    }


def letters_of(names: set[str]) -> set[str]:
    """The first letters of the variables among these names."""
    return {name[0] for name in names if name in VARIABLES}


def missing(names: set[str], c: Circumstances) -> str | None:
    """What the data lack of what these variables need; None where nothing is lacking."""
    letters = letters_of(names)
    found = (need(c) for letter, need in _NEEDS.items() if letter in letters)
    return next((text for text in found if text), None)


def kind_of(names: set[str]) -> Kind:
    """What an effect of these variables follows."""
    letters = letters_of(names)
    if letters & {"t", "T", "I"}:
        return "time"
    return "hold" if letters & {"p", "v"} else "orientation"


def against_of(names: set[str]) -> Against:
    """What to draw the residuals of such an effect over."""
    letters = letters_of(names)
    found = [told for letter, told in _AGAINST.items() if letter in letters]
    return found[0] if found else "input"
