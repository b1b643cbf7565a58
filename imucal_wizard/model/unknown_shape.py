"""A smooth free curve of one axis, for an error that no effect of the catalogue makes.

The curve is a Gaussian process with a Matérn covariance (ν = 3/2) of what the axis measures, of a
component of the force, of the time, the temperature or the current (Rasmussen & Williams, Gaussian
Processes for Machine Learning, eq. 4.17). It is written with its values at ``NODES`` (Nyström's
method), freed there from what the base model absorbs: a constant, and of what the axis measures a
straight line. With ``P K P = Σ λ_k q_k q_kᵀ``, P the projection, the k-th column interpolates
``√n q_k`` between the n nodes, so that the curve's mean square over the range is the sum of the
squares of its coefficients, and the k-th coefficient has the prior variance ``s² λ_k / n``. Length
and size s of the process are the setting of the term, chosen by marginal likelihood among
``SETTINGS``.

Nothing here names a cause: a curve is known only up to bias and scale, and only between the poses
that were measured.
"""

import itertools
from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quantities import unit_sign
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DEGREE,
    GYROSCOPE,
    INPUT_OF,
    MAGNETOMETER,
    MILLI_G,
    SENSORS,
    Against,
    Circumstances,
    Effect,
    EffectParameter,
    Size,
    Story,
    warmth,
)

NAME = "unknown-shape"
LENGTHS = (0.1, 0.2, 0.4, 0.8)
"""Over which the curve changes, in halves of its range. A shorter one lies between two poses."""
SIZES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Of the curve before its straight part is taken away, in ``UNIT``: a tactical part's to a bad
one's."""
SETTINGS = tuple(itertools.product(LENGTHS, SIZES))
"""Length and size by the number that a calibration file keeps; new ones go to the end."""
USUAL_SETTING = SETTINGS.index((0.4, 1.0))
NODES: FloatArray = np.linspace(-1.0, 1.0, 21)
"""Places at which the process is written, a shortest length apart."""
TEMPERATURE_REACH = 20.0
"""From the session's mean to the end of the range, °C."""
RATE_REACH = 250.0
"""End of the range of a rate, °/s: the smallest usual range of a gyroscope ends there."""
CURRENT_REACH = {"A": 15.0, "%": 50.0}
"""Half the range of a current or a throttle, which begins at 0."""
UNIT = {
    ACCELEROMETER: Size("mg", MILLI_G, 1.0),
    GYROSCOPE: Size("°/s", DEGREE, 0.03),
    MAGNETOMETER: Size("µT", 1.0, 1.0),
}
"""Shown unit of the curve, and what a size of one is in it: some 20 times what noise makes of a
mean at rest."""
TYPICAL = 3.0
"""What a consumer part's curve may be, in ``UNIT``: as much as its warm-up or its step."""
_MEASURED = {
    ACCELEROMETER: "force along {}",
    GYROSCOPE: "rate about {}",
    MAGNETOMETER: "field along {}",
}


@dataclass(frozen=True)
class Range:
    """What a curve runs over in an experiment.

    Attributes:
        middle: of the range, in ``unit``.
        reach: from there to either end.
        unit: shown.
    """

    middle: float
    reach: float
    unit: str


class Course(Effect):
    """``ε_i = f_i(x_i)``: any ``f``, by its values at nodes, straight between them.

    Any shape of the characteristic of an axis is a sum of these columns.

    Args:
        reach: of the nodes to either side, SI.
    """

    name, sensors, kind = "course", SENSORS, "orientation"
    nodes: FloatArray = np.linspace(-1.0, 1.0, 41)

    def __init__(self, reach: float) -> None:
        self.reach = reach

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """The value at each node, SI, one axis after the other."""
        del sensor
        numbers = range(1, len(self.nodes) + 1)
        return tuple(EffectParameter(f"{axis}{k}", "", 1.0) for axis in AXES for k in numbers)

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Shape (n, 3, 3 nodes), nothing on the other two axes of each."""
        own = self.axis_columns(sensor, c, variant)
        each = np.eye(3)[:, :, None] * own[:, :, None, :]
        return np.asarray(each.reshape(len(c), 3, -1))

    def axis_columns(
        self, sensor: str, c: Circumstances, variant: float | None = None
    ) -> FloatArray:
        """Shape (n, 3, nodes)."""
        del variant
        values: FloatArray = getattr(c, INPUT_OF[sensor])
        per_node = 0.5 * (len(self.nodes) - 1)
        apart = (per_node / self.reach * values)[:, :, None] - per_node * self.nodes
        # in place, because new arrays of this size cost more than what is computed
        np.abs(apart, out=apart)
        np.subtract(1.0, apart, out=apart)
        return np.maximum(apart, 0.0, out=apart)


class UnknownShape(Effect):
    """``ε_i = f(u)``: ``f`` a smooth free curve.

    Args:
        axis: 0 to 2.
        against: what ``u`` is: ``input`` for what the axis measures, ``force`` for one component of
            it, ``time``, ``temperature`` or ``current``.
        felt: the component of the force.
    """

    free = True
    order = 900

    def __init__(self, axis: int, against: Against, felt: int | None = None) -> None:
        self.axis, self.against, self.felt = axis, against, felt
        self.letter = AXES[axis]
        self.sensors = _SENSORS.get(against, SENSORS)
        self.kind = "time" if against in _SLOW else "orientation"
        ending = "" if against == "input" else f"-{against}"
        ending += "" if felt is None else f"-{AXES[felt]}"
        self.name = f"{NAME}/{self.letter}{ending}"
        over = "its own input" if against == "input" else self.over(self.sensors[0])
        self.title = f"free curve of {self.letter} over {over}"
        self.equation = f"ε_{self.letter} = f({over}), f smooth"
        self.stories = {sensor: self._story(sensor) for sensor in self.sensors}
        self.units: Mapping[str, Size] = UNIT

    def suited(self, c: Circumstances) -> "UnknownShape":
        """On a magnetometer in the unit of its field."""
        if MAGNETOMETER not in self.sensors or c.field_unit.name == "uT":
            return self
        made = copy(self)
        made.field_unit = c.field_unit
        made.units = {**UNIT, MAGNETOMETER: UNIT[MAGNETOMETER].of_field(c.field_unit)}
        return made

    def over(self, sensor: str) -> str:
        """What it runs over, in words."""
        if self.against == "input":
            return f"the {_MEASURED[sensor].format(self.letter)}"
        return f"the {self.against}" + ("" if self.felt is None else f" along {AXES[self.felt]}")

    def influence(self, sensor: str) -> str:
        """The same as the rows of an experiment name it: ``force-x``, ``time``."""
        words = self.over(sensor).split()[1:]
        return words[0] if len(words) == 1 else f"{words[0]}-{words[-1]}"

    @property
    def parameter(self) -> str:
        """What parameters of effects are called that move the same axis by the same."""
        return self.letter + ("" if self.felt is None else AXES[self.felt])

    @property
    def lines(self) -> int:
        """What the base model absorbs: a constant, and of what is measured a straight line."""
        return 2 if self.against == "input" else 1

    @property
    def absorbed(self) -> str:
        """The same in words."""
        return "bias and scale" if self.lines > 1 else "the bias"

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """``x1``, ``x2`` and so on, the smoothest first."""
        unit, count = self.units[sensor], len(NODES) - self.lines
        typical = replace(unit, typical=TYPICAL * unit.typical)
        return tuple(typical.parameter(f"{self.letter}{k + 1}") for k in range(count))

    def typical(self, sensor: str, variant: float | None = None) -> FloatArray:
        """Prior standard deviation of each coefficient at a setting, shown unit, shape (p,)."""
        length, size = _setting(variant)
        return self.units[sensor].typical * size * _modes(length, self.lines)[1]

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Shape (n, 3, p), nothing on the other two axes."""
        columns = np.zeros((len(c), 3, len(NODES) - self.lines))
        columns[:, self.axis] = self.units[sensor].si * self.shape(self.place(sensor, c), variant)
        return columns

    def shape(self, place: FloatArray, variant: float | None) -> FloatArray:
        """The curve per coefficient at these places of the range −1 to 1, shape (n, p).

        Beyond the range the curve keeps its last value: nothing is known there.
        """
        length, _ = _setting(variant)
        weights, _ = _modes(length, self.lines)
        inside = np.clip(place, -1.0, 1.0)
        straight = inside[:, None] ** np.arange(self.lines)
        return np.asarray(np.hstack([_covariance(inside, NODES, length), straight]) @ weights)

    def place(self, sensor: str, c: Circumstances) -> FloatArray:
        """Where in the range of the curve each row lies, −1 to 1, shape (n,).

        The range of a force is 1 g to either side, of a field its strength, of a rate
        ``RATE_REACH``, of the time the session, of the temperature ``TEMPERATURE_REACH`` about the
        session's mean.
        """
        if self.against == "time":
            return c.time / max(c.reference_time, 1e-9) - 1.0
        if self.against == "temperature":
            return warmth(c) / TEMPERATURE_REACH
        if self.against == "current":
            return c.current / CURRENT_REACH[c.current_unit] - 1.0
        name = "force" if self.felt is not None else INPUT_OF[sensor]
        values: FloatArray = getattr(c, name)
        own = values[:, self.axis if self.felt is None else self.felt]
        if name == "rate":
            return own / (RATE_REACH * DEGREE)
        whole = c.gravity if name == "force" else np.linalg.norm(values, axis=1)
        return np.asarray(own / np.maximum(whole, 1e-12))

    def range(self, sensor: str, c: Circumstances) -> Range:
        """What the places −1 to 1 are in the shown unit."""
        if self.against == "time":
            return Range(c.reference_time / 60.0, c.reference_time / 60.0, "min")
        if self.against == "temperature":
            return Range(c.reference_temperature, TEMPERATURE_REACH, "°C")
        if self.against == "current":
            half = CURRENT_REACH[c.current_unit]
            return Range(half, half, c.current_unit)
        name = "force" if self.felt is not None else INPUT_OF[sensor]
        if name == "rate":
            return Range(0.0, RATE_REACH, "°/s")
        if name == "force":
            return Range(0.0, c.gravity / STANDARD_GRAVITY, "g")
        strength = float(np.linalg.norm(c.magnetic, axis=1).mean())
        return Range(0.0, strength, unit_sign(c.field_unit.name))

    def variants(self, c: Circumstances) -> tuple[float | None, ...]:
        """The numbers of the settings."""
        del c
        return tuple(float(number) for number in range(len(SETTINGS)))

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """What is measured or felt in many directions, a duration, temperatures or currents."""
        if self.against == "input":
            return requirements.inputs(sensor, c)
        return _NEEDS[self.against](c)

    def _story(self, sensor: str) -> Story:
        letter, over = self.letter, self.over(sensor)
        return Story(
            what=f"No effect in the catalogue causes this error. The error of the {letter} axis "
            f"depends on {over} as the curve shows; the curve names no cause. "
            f"{_CAUSES[self.against]}.",
            equation=f"error on {letter} = a smooth curve over {over}. Its correlation length and "
            f"its size are the likeliest of {len(LENGTHS)} lengths and {len(SIZES)} sizes "
            "(marginal likelihood of a Gaussian process).",
            signature=f"Plotted over {over}, the points follow one curve; plotted over any other "
            f"quantity they scatter. The curve is known only up to {self.absorbed}, because the "
            "base model absorbs the straight part. Between two poses far apart the curve is only "
            "a guess.",
            needs=f"Many holds at different values of {over}, close together where the curve is "
            "steep: at least three holds inside a step are needed to show its width.",
            remedy="Look for the cause first: an error of unknown cause may change. Add the term "
            "only if held-out data confirm it, and apply it only inside the measured range; "
            "outside, the curve keeps its last value.",
            confirm=_CONFIRM[self.against],
            source="Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), "
            "chapters 2 and 5.",
        )


def _setting(variant: float | None) -> tuple[float, float]:
    """Length and size of a setting."""
    return SETTINGS[USUAL_SETTING if variant is None else int(variant)]


def _covariance(a: FloatArray, b: FloatArray, length: float) -> FloatArray:
    """Matérn's with ν = 3/2 between places, shape (a, b)."""
    apart = np.sqrt(3.0) * np.abs(a[:, None] - b) / length
    return np.asarray((1.0 + apart) * np.exp(-apart))


@cache
def _modes(length: float, lines: int) -> tuple[FloatArray, FloatArray]:
    """What the covariances with the nodes and the straight part are multiplied by, and the prior.

    Returns:
        Shape (nodes + lines, p), and the standard deviations of the coefficients at a size of one,
        shape (p,).
    """
    count = len(NODES)
    kernel = _covariance(NODES, NODES, length)
    straight = NODES[:, None] ** np.arange(lines)
    fitted = np.linalg.pinv(straight)
    across = np.eye(count) - straight @ fitted
    values, vectors = np.linalg.eigh(across @ kernel @ across)
    order = np.argsort(-values)[: count - lines]
    # before the projection a mode's values at the nodes are those of K q: its interpolation
    # between them is k(u)ᵀ q, less the line that its values at the nodes have
    raw = vectors[:, order]
    scale = np.sqrt(count) / values[order]
    weights = np.vstack([raw, -fitted @ kernel @ raw]) * scale
    return weights, np.sqrt(values[order] / count)


_SLOW = ("time", "temperature", "current")
_SENSORS: Mapping[Against, tuple[str, ...]] = {"force": (GYROSCOPE,), "current": (MAGNETOMETER,)}
_NEEDS = {
    "force": requirements.directions,
    "time": requirements.duration,
    "temperature": requirements.temperatures,
    "current": requirements.currents,
}
_CAUSES: Mapping[Against, str] = {
    "input": "Possible causes are a converter with missing codes, a mass that sticks or rubs, and "
    "electronics that switch between ranges",
    "force": "Possible causes are a mass that sticks or rubs, and a strained package",
    "time": "Possible causes are a loose board or connector, an unstable supply, and a heat "
    "source nearby that switches on and off",
    "temperature": "Possible causes are glue or a package that yields at one temperature, and a "
    "compensation table inside the chip with a jump between two entries",
    "current": "Possible causes are several leads that share the current unevenly, iron beside "
    "them that saturates, and a motor whose magnets rotate",
}
_POSES = (
    "Measure again with poses between those of the steepest part. A property of the sensor gives "
    "the same curve on another day."
)
_CONFIRM: Mapping[Against, str] = {
    "input": _POSES,
    "force": _POSES,
    "time": "Leave the device untouched in one pose for as long as the session lasted. If the "
    "curve appears again at the same time after power-on, its cause is in the sensor; if it "
    "appears at another time, its cause is in the surroundings.",
    "temperature": "Leave the device untouched in one pose, warm it slowly and let it cool again. "
    "A property of the sensor gives the same curve while the device warms and while it cools.",
    "current": "Leave the device untouched in one pose and raise the current slowly: the reading "
    "follows the same curve.",
}
_INFLUENCES: tuple[tuple[Against, int | None], ...] = (
    ("input", None),
    *(("force", felt) for felt in range(len(AXES))),
    ("time", None),
    ("temperature", None),
    ("current", None),
)
FREE_CURVES = tuple(
    UnknownShape(axis, against, felt) for against, felt in _INFLUENCES for axis in range(len(AXES))
)
"""One of each axis against each influence."""
