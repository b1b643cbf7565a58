"""An effect typed as a formula in the bench: ``k*a**2``, or ``x: k1*ay*az; y: k2*T``.

Variables:

============== ===================================================================
ax ay az       true specific force, g
wx wy wz       true angular rate, °/s (0 at rest)
mx my mz       true flux density, µT; counts where the field of a sensor in counts is not known
px py pz       specific force of the hold before, g (0 before the first)
a w m p        force, rate, field, force before on the axis that the formula is applied to
T              temperature minus the session's mean, °C (0 where unknown)
t              time since the session's first sample, s
v              mean square vibration, g²
I              current or throttle, A or %
g              local gravity, g
============== ===================================================================

Every other name is a coefficient to be fitted, in mg (accelerometer), °/s (gyroscope) or the unit
of the field (magnetometer) per unit of what it multiplies; the formula must be linear in them.
Without an axis in front, the formula acts on each axis with coefficients of its own: ``k`` becomes
``k_x``, ``k_y``, ``k_z``. With axes in front, a name stands for the same number wherever it occurs.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quantities import unit_sign
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import ACCELERATION_UNITS
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DEGREE,
    GYROSCOPE,
    MAGNETOMETER,
    MILLI_G,
    Against,
    Circumstances,
    Effect,
    EffectParameter,
    FieldUnit,
    Kind,
    Size,
    Story,
    sensed,
    warmth,
)
from imucal_wizard.model.expression import FUNCTIONS, Expression, Value, parse
from imucal_wizard.model.lesson import session_of

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
"""What a formula may depend on, of a field that is known in µT."""
_NEEDS: Mapping[str, Callable[[Circumstances], str | None]] = {
    "T": requirements.temperatures,
    "t": requirements.duration,
    "w": lambda c: requirements.rotations(GYROSCOPE, c),
    "p": requirements.previous_poses,
    "v": requirements.vibrations,
    "m": requirements.fields,
    "I": requirements.currents,
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
    before = np.nan_to_num(c.previous, nan=0.0) / ACCELERATION_UNITS["g"]
    field = sensed(MAGNETOMETER, c)
    found: dict[str, Value] = {}
    for k, axis in enumerate(AXES):
        found |= {f"a{axis}": force[:, k], f"w{axis}": rate[:, k], f"p{axis}": before[:, k]}
        found[f"m{axis}"] = field[:, k]
    return found | {
        "T": warmth(c),
        "t": c.time,
        "v": np.nan_to_num(c.vibration, nan=0.0) / ACCELERATION_UNITS["g"] ** 2,
        "I": c.current,
        "g": np.float64(c.gravity / ACCELERATION_UNITS["g"]),
    }


def letters_of(names: set[str]) -> set[str]:
    """The first letters of the variables among these names."""
    return {name[0] for name in names if name in VARIABLES}


def missing_data(names: set[str], c: Circumstances) -> str | None:
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
    found = [text for letter, text in _AGAINST.items() if letter in letters]
    return found[0] if found else "input"


_SIZES = {
    ACCELEROMETER: Size("mg", MILLI_G, 3.0),
    GYROSCOPE: Size("°/s", DEGREE, 0.2),
    MAGNETOMETER: Size("µT", 1.0, 0.5),
}
"""Unit of an axis' error, and what a coefficient may do to the reading of a consumer part, rms over
an ordinary session: the prior's width where no data sheet speaks."""
MAX_COEFFICIENTS = 12
_MIN_COLUMN_SIZE = 1e-12


def size_of(sensor: str, unit: FieldUnit) -> Size:
    """The unit of an axis' error, and its usual size."""
    return _SIZES[sensor].of_field(unit)


def variables_in(unit: FieldUnit) -> dict[str, str]:
    """What a formula may depend on, for the bench to show, with a field in this unit."""
    return {name: text.replace("µT", unit_sign(unit.name)) for name, text in VARIABLES.items()}


@dataclass(frozen=True, eq=False)
class Rule:
    """The formula of one axis; coefficients as they are called outside, by their name in it."""

    axis: int
    expression: Expression
    coefficients: Mapping[str, str]

    def value(self, variables: Mapping[str, Value], sizes: Mapping[str, float]) -> Value:
        """``ε`` of the axis, in shown units, for coefficients of these sizes."""
        own = {letter: variables[letter + AXES[self.axis]] for letter in "awmp"}
        inside = {name: np.float64(sizes[out]) for name, out in self.coefficients.items()}
        return self.expression.value({**variables, **own, **inside})


class FormulaEffect(Effect):
    """``ε_i = Σ_j k_j · φ_ij(circumstances)`` with ``φ`` as typed."""

    def __init__(
        self, text: str, sensor: str, name: str = "formula", unit: FieldUnit | None = None
    ) -> None:
        """Read and try a formula.

        Args:
            text: as described at the head of this module.
            sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
            name: under which the bench lists it.
            unit: of a magnetic field; None for µT.

        Raises:
            UsageError: it cannot be read, is not allowed, not linear, or has no value somewhere.
        """
        self.name = name
        self.sensors = (sensor,)
        self.field_unit = FieldUnit() if unit is None else unit
        self.title = "your own formula"
        self.equation = text.strip()
        self._rules = _rules(text)
        used = {name for rule in self._rules for name in rule.expression.names}
        self.kind = kind_of(used)
        self.against = against_of(used)
        self.stories = {sensor: _story(self.equation, used, self.field_unit)}
        self._used = used
        self._names = tuple(dict.fromkeys(n for r in self._rules for n in r.coefficients.values()))
        self._check(sensor)
        self._parameters = self._scaled(sensor)

    def suited(self, c: Circumstances) -> "FormulaEffect":
        """The same in the unit of the field."""
        if c.field_unit == self.field_unit:
            return self
        return FormulaEffect(self.equation, self.sensors[0], self.name, c.field_unit)

    def _session(self, sensor: str) -> Circumstances:
        """An ordinary session in the unit of the field."""
        c = session_of(sensor)
        return replace(c, magnetic=self.field_unit.size * c.magnetic, field_unit=self.field_unit)

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """The coefficients, in the order in which they are typed."""
        del sensor
        return self._parameters

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """As typed; shape (n, 3, p); not finite where the formula has no value."""
        del variant
        variables = variables_of(c)
        si = _SIZES[sensor].si
        units = np.eye(len(self._names))
        return si * np.stack([self._error(c, variables, unit) for unit in units], axis=2)

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """What the variables in it need."""
        del sensor
        return missing_data(self._used, c)

    def _error(
        self, c: Circumstances, variables: Mapping[str, Value], sizes: FloatArray
    ) -> FloatArray:
        named = dict(zip(self._names, map(float, sizes), strict=True))
        error = np.zeros((len(c), 3))
        for rule in self._rules:
            error[:, rule.axis] += rule.value(variables, named)
        return error

    def _check(self, sensor: str) -> None:
        """Linear in the coefficients: nothing at 0, and any mixture is the sum of its parts."""
        c = self._session(sensor)
        variables, p = variables_of(c), len(self._names)
        mixture = np.asarray(1.0 + 0.37 * np.arange(p), np.float64)
        coefficients = [mixture, np.zeros(p), -2.0 * mixture, *np.diag(mixture)]
        mixed, rest, doubled, *each = (self._error(c, variables, one) for one in coefficients)
        if not np.isfinite([mixed, rest, doubled, *each]).all():
            raise UsageError(
                f"formula {self.equation!r}: has no finite value somewhere; guard against division "
                "by 0, roots and logarithms of what is negative"
            )
        parts = sum(each)
        scale = 1e-9 * max(1.0, float(np.abs(mixed).max()))
        if max(np.abs(x).max() for x in (rest, mixed - parts, doubled + 2.0 * mixed)) > scale:
            raise UsageError(
                f"formula {self.equation!r}: must be a sum of terms with one coefficient each, as "
                "in k1*ax**2 + k2*T; a number takes the place of what is not to be fitted"
            )

    def _scaled(self, sensor: str) -> tuple[EffectParameter, ...]:
        """Coefficients with a prior wide enough for a consumer part."""
        own = size_of(sensor, self.field_unit)
        columns = self.columns(sensor, self._session(sensor)) / own.si
        largest = np.abs(columns).max(axis=(0, 1))
        for name, size in zip(self._names, largest, strict=True):
            if not _MIN_COLUMN_SIZE < size < 1.0 / _MIN_COLUMN_SIZE:
                raise UsageError(
                    f"formula {self.equation!r}: what {name} multiplies reaches {size:.3g} in an "
                    "ordinary session; choose a factor that brings it near 1"
                )
        sizes = np.sqrt((columns**2).sum(axis=1).mean(axis=0))
        return tuple(
            EffectParameter(name, own.unit, float(own.typical / size))
            for name, size in zip(self._names, sizes, strict=True)
        )


def _story(text: str, used: set[str], unit: FieldUnit) -> Story:
    depends = [f"{name} ({words})" for name, words in variables_in(unit).items() if name in used]
    return Story(
        what="This is a formula of your own; the program knows no physical cause for it.",
        equation=text,
        signature="Draw the residuals over what it depends on: "
        + (", ".join(depends) or "nothing at all, it is a bias")
        + ".",
        needs="Data in which these quantities vary independently of one another.",
    )


def _rules(text: str) -> tuple[Rule, ...]:
    parts = [part for part in text.split(";") if part.strip()]
    if not parts:
        raise UsageError("the formula is empty; write like k*a**2 or x: k*ay*az")
    if len(parts) == 1 and ":" not in parts[0]:
        rules = [_rule(parts[0], axis, f"_{AXES[axis]}") for axis in range(3)]
    else:
        rules = [_axis_rule(part) for part in parts]
    names = {name for rule in rules for name in rule.coefficients.values()}
    if not 1 <= len(names) <= MAX_COEFFICIENTS:
        raise UsageError(
            f"formula {text.strip()!r}: {len(names)} coefficients; write 1 to {MAX_COEFFICIENTS} "
            f"names beside the variables {', '.join(VARIABLES)}"
        )
    return tuple(rules)


def _axis_rule(part: str) -> Rule:
    axis, found, formula = part.partition(":")
    if not found or axis.strip() not in tuple(AXES):
        raise UsageError(f"formula {part.strip()!r}: write x:, y: or z: in front of each part")
    return _rule(formula, AXES.index(axis.strip()), "")


def _rule(text: str, axis: int, ending: str) -> Rule:
    expression = parse(text)
    names = [name for name in expression.names if name not in VARIABLES]
    for name in names:
        if name in FUNCTIONS:
            raise UsageError(f"formula {text.strip()!r}: {name} is a function; write {name}(…)")
    return Rule(axis, expression, {name: name + ending for name in names})
