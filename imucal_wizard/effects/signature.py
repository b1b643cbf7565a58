"""The picture of an effect: what it leaves in the residuals of an ordinary session."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.effects.axis_effect import AXES, DEGREE, MILLI_G, sensed
from imucal_wizard.effects.cost import left_by_magnitude, left_by_turns, session_of
from imucal_wizard.effects.effect import (
    ACCELEROMETER,
    GYROSCOPE,
    MAGNETOMETER,
    Circumstances,
    Effect,
)
from imucal_wizard.readings import FloatArray
from imucal_wizard.units import ACCELERATION

UNSEEN = 1e-6
"""Share of an error in the magnitude, below which the magnitude does not show it."""


@dataclass(frozen=True, eq=False)
class Picture:
    """Points to draw, in the order of ``x``.

    Attributes:
        x: what the effect depends on, shape (n,).
        y: residual after the base model has been fitted, mg, °/s or µT, shape (n,).
        x_label: with its unit.
        y_label: with its unit.
    """

    x: FloatArray
    y: FloatArray
    x_label: str
    y_label: str


def picture(
    effect: Effect, sensor: str, sizes: FloatArray | None = None, variant: float | None = None
) -> Picture:
    """The residuals that this effect leaves.

    Args:
        effect: any.
        sensor: ``accelerometer`` (residual of the magnitude), ``gyroscope`` (of the rate, on the
            axis that the first parameter moves most) or ``magnetometer`` (of the magnitude; where
            that shows nothing, of the component along gravity).
        sizes: in shown units, shape (p,); a consumer part's on the first parameter when not given.
        variant: one of the effect's variants.
    """
    c = session_of(sensor)
    if sizes is None:
        parameters = effect.parameters(sensor)
        sizes = parameters[0].typical * np.eye(len(parameters))[0]
    error = effect.error(sensor, c, sizes, variant)
    axis = int(np.argmax((error**2).sum(axis=0)))
    if sensor == ACCELEROMETER:
        left = left_by_magnitude(c.force, error)
        y = (left * c.force).sum(axis=1) / (c.gravity * MILLI_G)
        y_label = "|a| − g, mg"
    elif sensor == GYROSCOPE:
        y = left_by_turns(c.rate, error)[:, axis] / DEGREE
        y_label = f"rate about {AXES[axis]}, °/s"
    else:
        y, y_label = _of_field(c, error)
    x, x_label = abscissa(effect, sensor, c, _input_axis(effect, sensor, axis))
    order = np.argsort(x, kind="stable")
    return Picture(x[order], np.asarray(y[order], np.float64), x_label, y_label)


def _of_field(c: Circumstances, error: FloatArray) -> tuple[FloatArray, str]:
    left = left_by_magnitude(c.magnetic, error)
    size = np.linalg.norm(c.magnetic, axis=1)
    along = (left * c.magnetic).sum(axis=1) / size
    if np.abs(along).max() > UNSEEN * np.abs(error).max():
        return np.asarray(along), "|m| − B, µT"
    return (left * c.force).sum(axis=1) / c.gravity, "m along up, µT"


def abscissa(effect: Effect, sensor: str, c: Circumstances, axis: int) -> tuple[FloatArray, str]:
    """What the residuals of this effect are drawn over, shape (n,), and its label."""
    letter, g = AXES[axis], ACCELERATION["g"]
    if effect.against == "temperature":
        return c.temperature, "temperature, °C"
    if effect.against == "time":
        return c.time / 60.0, "time, min"
    if effect.against == "vibration":
        return c.vibration / g**2, "mean square vibration, g²"
    if effect.against == "previous":
        return c.previous[:, axis] / g, f"force along {letter} in the hold before, g"
    if effect.against == "current":
        return c.current, f"current, {c.current_unit}"
    if sensor == MAGNETOMETER:
        return c.magnetic[:, axis], f"field along {letter}, µT"
    if effect.against == "force" or sensor == ACCELEROMETER:
        return c.force[:, axis] / g, f"force along {letter}, g"
    return sensed(sensor, c)[:, axis], f"rate about {letter}, °/s"


def _input_axis(effect: Effect, sensor: str, output: int) -> int:
    """The last axis in the first parameter's name: what moves it; else the output axis."""
    name = effect.parameters(sensor)[0].name
    return AXES.index(name[-1]) if name and set(name) <= set(AXES) else output
