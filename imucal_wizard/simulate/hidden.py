"""Hidden effects of the virtual sensor: ``TERM:SIZE:AXIS``.

Each effect adds its ``ε`` to the true input on one axis. The tables below have the unit of each
size; the equations are in ``forward``. ``field-gradient`` of the magnetometer is of the room, not
of the sensor.

``AXIS`` is ``x``, ``y`` or ``z``. ``g-sensitivity`` and ``g2-sensitivity`` also accept two letters,
output then input (``xy``: gravity along y acts on the x gyroscope); ``cross-product``,
``anisoelastic`` and ``cubic-cross`` three, output then both factors (``xyz``; ``zxx``: the square
of the force along x changes the gain of z). For these, one letter means ``xx`` and ``xxy``
(``yyz``, ``zzx``), of ``cubic-cross`` ``xyy``. ``clock`` acts on all axes, whichever is named.
``thermal-lag`` is in seconds of a zero that moves by 1 mg/°C, or by 0.01 °/s/°C.
"""

import math
from collections.abc import Iterable

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.simulate import forward
from imucal_wizard.simulate.sensor import DEGREE, MILLI_G

_PPM_G = 1e-6 * STANDARD_GRAVITY


@dataclass(frozen=True)
class HiddenTerm:
    """One row of the table: equation, unit of the size, and that unit in SI."""

    equation: forward.Forward
    unit: str
    si: float
    """Factor from size × equation to m/s², rad/s or µT."""
    letters: int = 1
    """Largest number of letters of the axis."""
    usual: str = "xxy"
    """What one letter means, of three letters and for x."""


ACCELEROMETER_TERMS: dict[str, HiddenTerm] = {
    "second-order": HiddenTerm(forward.second_order, "mg/g²", MILLI_G),
    "asymmetry": HiddenTerm(forward.asymmetry, "mg/g", MILLI_G),
    "odd-quadratic": HiddenTerm(forward.odd_quadratic, "mg/g²", MILLI_G),
    "third-order": HiddenTerm(forward.third_order, "mg/g³", MILLI_G),
    "cross-product": HiddenTerm(forward.cross_product, "mg/g²", MILLI_G, letters=3),
    "cubic-cross": HiddenTerm(forward.cubic_cross, "mg/g³", MILLI_G, letters=3, usual="xyy"),
    "dead-zone": HiddenTerm(forward.dead_zone, "mg", MILLI_G),
    "bias-temperature": HiddenTerm(forward.bias_temperature, "mg/°C", MILLI_G),
    "thermal-lag": HiddenTerm(forward.thermal_lag, "s", MILLI_G),
    "scale-temperature": HiddenTerm(forward.scale_temperature, "ppm/°C", _PPM_G),
    "scale-drift": HiddenTerm(forward.scale_drift, "ppm/min", _PPM_G),
    "scale-step": HiddenTerm(forward.scale_step, "ppm", _PPM_G),
    "warm-up": HiddenTerm(forward.warm_up, "mg", MILLI_G),
    "bias-drift": HiddenTerm(forward.bias_drift, "mg/min", MILLI_G),
    "bias-step": HiddenTerm(forward.bias_step, "mg", MILLI_G),
    "hysteresis": HiddenTerm(forward.hysteresis, "mg/g", MILLI_G),
    "vibration-rectification": HiddenTerm(forward.vibration_rectification, "mg/g²", MILLI_G),
}
GYROSCOPE_TERMS: dict[str, HiddenTerm] = {
    "g-sensitivity": HiddenTerm(forward.g_sensitivity, "°/s/g", DEGREE, letters=2),
    "g2-sensitivity": HiddenTerm(forward.g2_sensitivity, "°/s/g²", DEGREE, letters=2),
    "anisoelastic": HiddenTerm(forward.anisoelastic, "°/s/g²", DEGREE, letters=3),
    "second-order": HiddenTerm(forward.second_order, "ppm/(°/s)", 1e-6 * DEGREE),
    "asymmetry": HiddenTerm(forward.asymmetry, "1e-3", 1e-3 * DEGREE),
    "third-order": HiddenTerm(forward.third_order, "1e-7/(°/s)²", 1e-7 * DEGREE),
    "cross-product": HiddenTerm(forward.cross_product, "1e-5/(°/s)", 1e-5 * DEGREE, letters=3),
    "bias-temperature": HiddenTerm(forward.bias_temperature, "°/s/°C", DEGREE),
    "thermal-lag": HiddenTerm(forward.thermal_lag, "s", 0.01 * DEGREE),
    "scale-temperature": HiddenTerm(forward.scale_temperature, "ppm/°C", 1e-6 * DEGREE),
    "scale-drift": HiddenTerm(forward.scale_drift, "ppm/min", 1e-6 * DEGREE),
    "scale-step": HiddenTerm(forward.scale_step, "ppm", 1e-6 * DEGREE),
    "clock": HiddenTerm(forward.changing_clock, "ppm/min", 1e-6 * DEGREE),
    "axis-delay": HiddenTerm(forward.axis_delay, "ms", 1e-3 * DEGREE),
    "warm-up": HiddenTerm(forward.warm_up, "°/s", DEGREE),
    "bias-drift": HiddenTerm(forward.bias_drift, "°/s/min", DEGREE),
    "bias-step": HiddenTerm(forward.bias_step, "°/s", DEGREE),
    "earth-rate": HiddenTerm(forward.earth_rate, "°/h", DEGREE / 3600.0),
}
MAGNETOMETER_TERMS: dict[str, HiddenTerm] = {
    "misalignment": HiddenTerm(forward.misalignment, "°", DEGREE),
    "bias-temperature": HiddenTerm(forward.bias_temperature, "µT/°C", 1.0),
    "current": HiddenTerm(forward.current, "µT/A", 1.0),
    "bias-drift": HiddenTerm(forward.bias_drift, "µT/min", 1.0),
    "bias-step": HiddenTerm(forward.bias_step, "µT", 1.0),
    "field-gradient": HiddenTerm(forward.field_gradient, "µT/m", 1.0),
}
HIDDEN_TERMS = {
    "accelerometer": ACCELEROMETER_TERMS,
    "gyroscope": GYROSCOPE_TERMS,
    "magnetometer": MAGNETOMETER_TERMS,
}


@dataclass(frozen=True)
class Hidden:
    """One hidden effect.

    Attributes:
        sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
        term: name of the effect.
        size: size in the unit of the tables below.
        axes: axes, the output axis first.
    """

    sensor: str
    term: str
    size: float
    axes: tuple[int, ...]

    @property
    def unit(self) -> str:
        """Unit of the size."""
        return HIDDEN_TERMS[self.sensor][self.term].unit

    @property
    def letters(self) -> str:
        """The axes as they are written: ``x``, ``xy``."""
        return "".join("xyz"[axis] for axis in self.axes)

    def error(self, circumstances: forward.TrueCircumstances) -> FloatArray:
        """``ε`` on the three axes, m/s², rad/s or µT, shape (n, 3)."""
        term = HIDDEN_TERMS[self.sensor][self.term]
        value = self.size * term.si * term.equation(circumstances, self.axes)
        if value.ndim == 2:
            return value
        error = np.zeros((len(value), 3))
        error[:, self.axes[0]] = value
        return error


def needs_shaking(effects: Iterable[Hidden]) -> bool:
    """Whether one of the effects appears only on a vibrating support."""
    return any(effect.term == "vibration-rectification" for effect in effects)


def draws_current(effects: Iterable[Hidden]) -> bool:
    """Whether one of the effects appears only with running motors."""
    return any(effect.term == "current" for effect in effects)


def check_sensors(effects: Iterable[Hidden], *, magnetometer: bool) -> None:
    """Refuse effects of a missing magnetometer.

    Raises:
        UsageError: there is such an effect.
    """
    if not magnetometer and any(effect.sensor == "magnetometer" for effect in effects):
        raise UsageError(
            "an effect of the magnetometer needs a device with one", settings=("magnetometer",)
        )


def parse_hidden(text: str) -> Hidden:
    """Parse ``TERM:SIZE:AXIS``; for other sensors ``gyroscope/TERM:SIZE:AXIS``.

    Raises:
        UsageError: another form, an unknown term, a size that is not a number, or a wrong axis.
    """
    parts = text.strip().split(":")
    if len(parts) != 3:
        raise UsageError(
            f"hidden effect {text!r}: write TERM:SIZE:AXIS, for instance second-order:3:x"
        )
    sensor, _, term = parts[0].rpartition("/")
    sensor = sensor or "accelerometer"
    if sensor not in HIDDEN_TERMS:
        raise UsageError(
            f"hidden effect {text!r}: {sensor!r} is not a sensor; write gyroscope/TERM"
        )
    if term not in HIDDEN_TERMS[sensor]:
        raise UsageError(f"hidden effect {text!r}: {_unknown(sensor, term)}")
    return Hidden(
        sensor, term, _size(text, parts[1]), _axes(text, parts[2], HIDDEN_TERMS[sensor][term])
    )


def _unknown(sensor: str, term: str) -> str:
    others = [name for name, table in HIDDEN_TERMS.items() if term in table]
    if len(others) == 1 and others != ["accelerometer"]:
        return f"{term} is an effect of the {others[0]}; write {others[0]}/{term}"
    return f"the {sensor} has no effect {term!r}; it has {', '.join(HIDDEN_TERMS[sensor])}"


def _size(text: str, word: str) -> float:
    try:
        size = float(word)
    except ValueError:
        size = math.nan
    if not math.isfinite(size):
        raise UsageError(f"hidden effect {text!r}: the size {word!r} is not a number")
    return size


def _axes(text: str, word: str, term: HiddenTerm) -> tuple[int, ...]:
    if len(word) not in (1, term.letters) or not set(word) <= set("xyz"):
        more = {1: "", 2: ", or output and input as in xy", 3: ", or output and factors as in xyz"}
        raise UsageError(f"hidden effect {text!r}: the axis is x, y or z{more[term.letters]}")
    axes = tuple("xyz".index(letter) for letter in word)
    if len(axes) == term.letters:
        return axes
    first = axes[0]
    if term.letters == 2:
        return first, first
    return tuple((first + "xyz".index(letter)) % 3 for letter in term.usual)
