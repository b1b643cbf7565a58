"""The forward equations of the hidden effects, one small function each.

Quantities are in the units in which effects are quoted: g for specific force, °/s for rate, µT for
flux density, A, °C, minutes. Each function returns ``ε`` per unit of its size, following the terms
of the model equations in IEEE 1293 (accelerometer) and IEEE 1431 (gyroscope).
"""

from collections.abc import Callable
from dataclasses import field

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.simulate import attitude

REFERENCE_TEMPERATURE = 25.0
"""Temperature at which thermal effects vanish, °C."""
WARM_UP_TIME = 3.0
"""Default time constant of the warm-up, minutes."""
ARM = np.array([0.05, -0.04, 0.06])
"""Position of the magnetometer relative to the centre of rotation, body frame, m."""
STEP_TIME = 1.5
"""Default time of a step of bias or scale, minutes."""


@dataclass(frozen=True, eq=False)
class TrueCircumstances:
    """The quantities on which an effect may depend, at the sample times, in the units of the sizes.

    Attributes:
        force: true specific force, g, shape (n, 3).
        rate: true angular rate, °/s, shape (n, 3).
        temperature: °C, shape (n,).
        minutes: time since power-on, shape (n,).
        previous: up direction of the pose before, shape (n, 3).
        vibration: acceleration of the device in the world, g, shape (n, 3).
        attitude: body to world, shape (n, 4).
        sensed: specific force, rate, or flux density, as measured by this sensor.
        step: time of a step of bias or scale, minutes.
        settling: time constant of the warm-up, minutes.
        current: current of the motors, A, shape (n,).
        warming: rate of change of the temperature, °C/s, shape (n,).
        change: change of the rate over the sampling interval before, °/s², shape (n, 3).
    """

    force: FloatArray
    rate: FloatArray
    temperature: FloatArray
    minutes: FloatArray
    previous: FloatArray
    vibration: FloatArray
    attitude: FloatArray
    sensed: FloatArray
    step: float = STEP_TIME
    settling: float = WARM_UP_TIME
    current: FloatArray = field(default_factory=lambda: np.zeros(0))
    warming: FloatArray = field(default_factory=lambda: np.zeros(0))
    change: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))


Forward = Callable[[TrueCircumstances, tuple[int, ...]], FloatArray]
"""From circumstances and axes (output first) to ``ε`` per unit of size: on the output axis, shape
(n,), or on all three axes, shape (n, 3)."""


def second_order(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K a_i²``."""
    return c.sensed[:, axes[0]] ** 2


def asymmetry(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K |a_i|``."""
    return np.abs(c.sensed[:, axes[0]])


def odd_quadratic(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K a_i |a_i|``."""
    return c.sensed[:, axes[0]] * np.abs(c.sensed[:, axes[0]])


def third_order(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K a_i³``."""
    return c.sensed[:, axes[0]] ** 3


def cubic_cross(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K a_i a_j a_k``, not all of the three alike."""
    return np.asarray(c.sensed[:, list(axes)].prod(axis=1), np.float64)


def dead_zone(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``−sign(a_i)``; forces within the zone are left as they are, poses hardly meet it."""
    return -np.sign(c.sensed[:, axes[0]])


def cross_product(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K a_j a_k``."""
    return c.sensed[:, axes[1]] * c.sensed[:, axes[2]]


def bias_temperature(c: TrueCircumstances, _: tuple[int, ...]) -> FloatArray:
    """``K (T − T₀)``."""
    return c.temperature - REFERENCE_TEMPERATURE


def thermal_lag(c: TrueCircumstances, _: tuple[int, ...]) -> FloatArray:
    """``−K dT/dt``: the temperature of a moment ago."""
    return -c.warming


def scale_temperature(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K (T − T₀) a_i``."""
    return (c.temperature - REFERENCE_TEMPERATURE) * c.sensed[:, axes[0]]


def scale_drift(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K t a_i``: a gain that changes by the minute."""
    return c.minutes * c.sensed[:, axes[0]]


def scale_step(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K a_i from the step on``."""
    return np.where(c.minutes >= c.step, c.sensed[:, axes[0]], 0.0)


def changing_clock(c: TrueCircumstances, _: tuple[int, ...]) -> FloatArray:
    """``K t w``: seconds that become longer; shape (n, 3)."""
    return np.asarray(c.minutes[:, None] * c.sensed)


def axis_delay(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``−K dw_i/dt``: the rate of a moment ago."""
    return -c.change[:, axes[0]]


def warm_up(c: TrueCircumstances, _: tuple[int, ...]) -> FloatArray:
    """``K exp(−t/τ)``."""
    return np.exp(-c.minutes / c.settling)


def bias_drift(c: TrueCircumstances, _: tuple[int, ...]) -> FloatArray:
    """``K t``."""
    return c.minutes


def bias_step(c: TrueCircumstances, _: tuple[int, ...]) -> FloatArray:
    """``K from the step on``."""
    return (c.minutes >= c.step).astype(float)


def hysteresis(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K u_i of the pose before``."""
    return c.previous[:, axes[0]]


def vibration_rectification(c: TrueCircumstances, _: tuple[int, ...]) -> FloatArray:
    """``K |vibration|²``."""
    return np.asarray((c.vibration**2).sum(-1), np.float64)


def g_sensitivity(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K f_j``."""
    return c.force[:, axes[1]]


def g2_sensitivity(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K f_j²``."""
    return c.force[:, axes[1]] ** 2


def anisoelastic(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K f_j f_k``."""
    return c.force[:, axes[1]] * c.force[:, axes[2]]


def earth_rate(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """``K`` about a world axis (x north, z up) in the body frame; shape (n, 3)."""
    return attitude.to_body(c.attitude, np.eye(3)[axes[0]])


def current(c: TrueCircumstances, _: tuple[int, ...]) -> FloatArray:
    """``K I``."""
    return c.current


def misalignment(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """The change of the field by a small rotation about one axis; shape (n, 3)."""
    second, third = (axes[0] + 1) % 3, (axes[0] + 2) % 3
    error = np.zeros_like(c.sensed)
    error[:, second] = c.sensed[:, third]
    error[:, third] = -c.sensed[:, second]
    return error


def field_gradient(c: TrueCircumstances, axes: tuple[int, ...]) -> FloatArray:
    """The difference of a non-uniform field at the position of the magnetometer; shape (n, 3).

    One of the three off-diagonal gradients of a field without curl or divergence, per metre.
    """
    place = attitude.to_world(c.attitude, np.broadcast_to(ARM, (len(c.attitude), 3)))
    first, second = axes[0], (axes[0] + 1) % 3
    there = np.zeros_like(place)
    there[:, first], there[:, second] = place[:, second], place[:, first]
    return attitude.to_body(c.attitude, there)
