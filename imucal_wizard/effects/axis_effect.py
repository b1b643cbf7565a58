"""Effects with one parameter per axis, and the units in which effects are quoted."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from imucal_wizard.effects.effect import (
    ACCELEROMETER,
    MAGNETOMETER,
    Circumstances,
    Effect,
    EffectParameter,
    Grades,
)
from imucal_wizard.readings import FloatArray
from imucal_wizard.units import ACCELERATION, RATE

MILLI_G = ACCELERATION["mg"]
DEGREE = RATE["deg/s"]
PPM = 1e-6
AXES = "xyz"


def sensed(sensor: str, c: Circumstances) -> FloatArray:
    """The true input of the sensor in the unit of data sheets: g, °/s or µT, shape (n, 3)."""
    if sensor == ACCELEROMETER:
        return c.force / ACCELERATION["g"]
    if sensor == MAGNETOMETER:
        return c.magnetic
    return c.rate / DEGREE


def warmth(c: Circumstances) -> FloatArray:
    """Temperature from the session's mean, °C, shape (n,); 0 where it is unknown."""
    return np.nan_to_num(c.temperature - c.reference_temperature, nan=0.0)


@dataclass(frozen=True)
class Size:
    """How large an effect is on one sensor.

    Attributes:
        unit: shown unit of its parameters.
        si: m/s², rad/s or µT per shown unit and unit of what it multiplies.
        typical: of a consumer part, the prior's standard deviation, in ``unit``.
        grades: realistic magnitudes by sensor grade, in ``unit``.
        chosen: grades whose range is a typical choice and stands in no data sheet.
    """

    unit: str
    si: float
    typical: float
    grades: Grades = field(default_factory=dict)
    chosen: tuple[str, ...] = ()

    def parameter(self, name: str) -> EffectParameter:
        """A parameter of this size."""
        return EffectParameter(name, self.unit, self.typical, self.grades, self.chosen)


class AxisEffect(Effect):
    """An effect whose parameter ``K_i`` moves axis ``i`` only: ``ε_i = K_i · shape_i``."""

    sizes: Mapping[str, Size]

    @abstractmethod
    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """What ``K_i`` multiplies on each axis, in data sheet units, shape (n, 3)."""

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """``x``, ``y``, ``z``."""
        return tuple(self.sizes[sensor].parameter(axis) for axis in AXES)

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Shape (n, 3, 3), diagonal in output axis and parameter."""
        return self.sizes[sensor].si * self.shape(sensor, c, variant)[:, :, None] * np.eye(3)


class BiasEffect(AxisEffect):
    """An effect that moves the zero of all three axes by the same course: ``ε_i = K_i · s``."""

    @abstractmethod
    def course(self, c: Circumstances, variant: float | None) -> FloatArray:
        """``s``, in data sheet units, shape (n,)."""

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """The course on each axis."""
        del sensor
        return np.repeat(self.course(c, variant)[:, None], 3, axis=1)
