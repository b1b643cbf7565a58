"""What it costs to ignore an effect: degrees of tilt, per turn, per minute, of heading.

The effect acts during one ordinary session of twenty minutes, in which the device warms by 20 °C,
is held in every direction, turned at 50 to 300 °/s and shaken now and then, in a field of 48 µT
with a dip of 65°, its motors drawing up to 10 A. The base model (bias, scale, non-orthogonality) is
fitted to it as the wizard does, and what the base has not taken in is
the cost. Small errors are assumed, so that they add up linearly.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from imucal_wizard.effects.axis_effect import DEGREE
from imucal_wizard.effects.effect import (
    ACCELEROMETER,
    GYROSCOPE,
    MAGNETOMETER,
    Circumstances,
    Effect,
)
from imucal_wizard.readings import FloatArray
from imucal_wizard.units import STANDARD_GRAVITY

MINUTES = np.array([0.0, 5.0, 10.0, 15.0, 20.0])
WARMTH = np.array([-10.0, -5.0, 0.0, 5.0, 10.0])
SHAKING = np.array([0.0, 0.1, 0.0, 0.2, 0.0])
"""Vibration at these moments, g rms."""
AMPERES = np.array([0.0, 8.0, 2.0, 10.0, 5.0])
FIELD, DIP = 48.0, np.radians(65.0)
"""Flux density, µT, and its angle below the horizon."""
SPEEDS = np.array([-300.0, -150.0, -50.0, 50.0, 150.0, 300.0])
"""Rates of the turns, °/s."""
DIRECTIONS = 60


@dataclass(frozen=True)
class Cost:
    """What is left of an effect after the base model has been fitted.

    Attributes:
        tilt_rms: error of the up direction, degrees; None for a gyroscope.
        tilt_worst: the largest of them.
        turn_rms: error of a full turn at 50 to 300 °/s, degrees; None for an accelerometer.
        turn_worst: the largest of them.
        rest_rms: angle gathered in a minute at rest, degrees.
        heading_rms: error of the heading, degrees; None but for a magnetometer.
        heading_worst: the largest of them.
    """

    tilt_rms: float | None = None
    tilt_worst: float | None = None
    turn_rms: float | None = None
    turn_worst: float | None = None
    rest_rms: float | None = None
    heading_rms: float | None = None
    heading_worst: float | None = None


def cost(effect: Effect, sensor: str, sizes: FloatArray) -> Cost:
    """What this effect with sizes (p,), in shown units, costs who ignores it."""
    prices = {ACCELEROMETER: _tilt, GYROSCOPE: _turn, MAGNETOMETER: _heading}
    return prices[sensor](effect, sizes)


def session_of(sensor: str) -> Circumstances:
    """The ordinary session as this sensor sees it."""
    return turns() if sensor == GYROSCOPE else poses()


def left_by_magnitude(force: FloatArray, error: FloatArray) -> FloatArray:
    """What a fit of ``|x| = g`` leaves of an error of the specific force, shape (n, 3), m/s².

    Such a fit sees only the component along the force; the nine parameters that explain it best
    take part of the other components away and add to them. The same of a field and ``|m| = B``.
    """
    gains = [force[:, k, None] * np.eye(3)[i] for i in range(3) for k in range(i, 3)]
    base = np.stack([*(np.tile(row, (len(force), 1)) for row in np.eye(3)), *gains], axis=2)
    radial = np.einsum("nip,ni->np", base, force)
    taken = np.linalg.lstsq(radial, (error * force).sum(axis=1), rcond=None)[0]
    return np.asarray(error - base @ taken, np.float64)


def left_by_turns(rate: FloatArray, error: FloatArray) -> FloatArray:
    """What a fit of the turns leaves of an error of the rate, shape (n, 3), rad/s.

    The readings at rest, far more exact than turns, decide the bias; the turns the nine gains.
    """
    moving = rate.any(axis=1)
    left = error - error[~moving].mean(axis=0)
    gains = np.linalg.lstsq(rate[moving], left[moving], rcond=None)[0]
    return np.asarray(left - rate @ gains, np.float64)


def _tilt(effect: Effect, sizes: FloatArray) -> Cost:
    c = poses()
    left = left_by_magnitude(c.force, effect.error(ACCELEROMETER, c, sizes))
    up = c.force / np.linalg.norm(c.force, axis=1, keepdims=True)
    across = left - up * (left * up).sum(axis=1, keepdims=True)
    tilt = np.degrees(np.linalg.norm(across, axis=1) / c.gravity)
    return Cost(tilt_rms=_rms(tilt), tilt_worst=float(tilt.max()))


def _turn(effect: Effect, sizes: FloatArray) -> Cost:
    c = turns()
    left = left_by_turns(c.rate, effect.error(GYROSCOPE, c, sizes))
    size, speed = np.linalg.norm(left, axis=1), np.linalg.norm(c.rate, axis=1)
    moving = speed > 0.0
    turn = 360.0 * size[moving] / speed[moving]
    return Cost(
        turn_rms=_rms(turn),
        turn_worst=float(turn.max()),
        rest_rms=60.0 * _rms(size[~moving]) / DEGREE,
    )


def _heading(effect: Effect, sizes: FloatArray) -> Cost:
    c = poses()
    left = left_by_magnitude(c.magnetic, effect.error(MAGNETOMETER, c, sizes))
    east = np.cross(c.magnetic, c.force)
    east /= np.linalg.norm(east, axis=1, keepdims=True)
    turned = np.degrees((left * east).sum(axis=1) / (FIELD * np.cos(DIP)))
    return Cost(heading_rms=_rms(turned), heading_worst=float(np.abs(turned).max()))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@cache
def poses() -> Circumstances:
    """The ordinary session's poses: every direction at every moment."""
    k = np.arange(DIRECTIONS) + 0.5
    z = 1.0 - 2.0 * k / DIRECTIONS
    longitude = np.pi * (1.0 + np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - z**2)
    up = np.stack([ring * np.cos(longitude), ring * np.sin(longitude), z], axis=1)
    return _session(up, np.zeros_like(up))


@cache
def turns() -> Circumstances:
    """The ordinary session's turns, about the axes and between, each under six gravities; rests."""
    faces = np.vstack([np.eye(3), -np.eye(3)])
    between = np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]) / np.sqrt(2.0)
    axes = np.vstack([np.eye(3), between])
    rates = np.vstack([np.zeros((1, 3)), *(speed * DEGREE * axes for speed in SPEEDS)])
    return _session(np.repeat(faces, len(rates), axis=0), np.tile(rates, (len(faces), 1)))


def _session(up: FloatArray, rate: FloatArray) -> Circumstances:
    """All these directions and rates at each moment of the session, after different poses."""
    moments, n = len(MINUTES), len(up)
    force = STANDARD_GRAVITY * up
    before = np.vstack([np.roll(force, 7 * (moment + 1), axis=0) for moment in range(moments)])
    return Circumstances(
        force=np.tile(force, (moments, 1)),
        rate=np.tile(rate, (moments, 1)),
        temperature=np.repeat(25.0 + WARMTH, n),
        time=np.repeat(60.0 * MINUTES, n),
        previous=before,
        vibration=np.repeat((SHAKING * STANDARD_GRAVITY) ** 2, n),
        magnetic=np.tile(_field(up), (moments, 1)),
        current=np.repeat(AMPERES, n),
    )


def _field(up: FloatArray) -> FloatArray:
    """Field in the body frame, every pose with another heading, µT, shape (n, 3)."""
    first = np.cross(up, np.eye(3)[np.abs(up).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(len(up))[:, None]
    north = np.cos(turn) * first + np.sin(turn) * np.cross(up, first)
    return np.asarray(FIELD * (np.cos(DIP) * north - np.sin(DIP) * up))
