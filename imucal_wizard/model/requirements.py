"""What effects need of the data: each check returns what is lacking, or None."""

from collections.abc import Callable
from functools import partial

import numpy as np

from imucal_wizard.core.directions import SAME_DIRECTION
from imucal_wizard.model.effect import DEGREE, GYROSCOPE, INPUT_OF, Circumstances

FELT_IN_MOTION = (GYROSCOPE,)
"""Sensors whose input is there only while the device rotates."""
MIN_TEMPERATURE_SWING = 0.5
"""Temperatures closer than this are one temperature, °C."""
MIN_ROTATION_RATE = 1.0 * DEGREE
"""Rates under this are rest, rad/s."""
MIN_SESSION_SECONDS = 60.0
"""A session under a minute says nothing of what is slow, s."""
MIN_VIBRATION_RATIO = 1.5
"""The shakiest row must have this many times the vibration of the quietest."""


def temperatures(c: Circumstances) -> str | None:
    """Whether the temperature is known and not always the same."""
    known = c.temperature[np.isfinite(c.temperature)]
    if len(known) == 0:
        return "no temperature was recorded; send the chip's temperature along with the readings"
    if float(np.ptp(known)) < MIN_TEMPERATURE_SWING:
        return (
            f"only one temperature, {known.mean():.1f} °C; take some poses again warmer or colder"
        )
    return None


def currents(c: Circumstances) -> str | None:
    """Whether the current or the throttle is known all the time and changes."""
    known = c.current[np.isfinite(c.current)]
    if len(known) == 0:
        return "no current was recorded; add a column current[A] or throttle[%] to the readings"
    if len(known) < len(c):
        return (
            f"the current was recorded for {len(known)} of {len(c)} means only; record it from "
            "the beginning to the end"
        )
    if not float(np.ptp(known)) > 0.0:
        return (
            f"only one current, {known.mean():.3g} {c.current_unit}; record each direction with "
            "the motors on and off"
        )
    return None


def fields(c: Circumstances) -> str | None:
    """Whether the magnetic field is known."""
    if not np.isfinite(c.magnetic).all():
        return "these readings have no magnetic field; the effect is one of a magnetometer"
    return None


def duration(c: Circumstances) -> str | None:
    """Whether the session is long enough for anything slow."""
    if len(c) == 0 or float(np.ptp(c.time)) < MIN_SESSION_SECONDS:
        return "the session is shorter than a minute; repeat the first poses later"
    return None


def rotations(sensor: str, c: Circumstances) -> str | None:
    """Whether a gyroscope was turned at all; an accelerometer needs no turning."""
    if sensor in FELT_IN_MOTION and not (np.abs(c.rate) > MIN_ROTATION_RATE).any():
        return "these data contain no rotation; rotate the device between still poses"
    return None


def both_senses(sensor: str, c: Circumstances) -> str | None:
    """Whether some axis of a gyroscope was turned in both senses."""
    missing = rotations(sensor, c)
    if missing or sensor not in FELT_IN_MOTION:
        return missing
    left = (c.rate > MIN_ROTATION_RATE).any(axis=0)
    right = (c.rate < -MIN_ROTATION_RATE).any(axis=0)
    if not (left & right).any():
        return "every axis was turned in one sense only; rotate in the other sense too"
    return None


def directions(c: Circumstances) -> str | None:
    """Whether gravity was felt from more than one side."""
    if len(c) and not c.force.any():
        return "no force is known; record the accelerometer along with the rates, in m/s² or g"
    up = c.force / np.maximum(np.linalg.norm(c.force, axis=1, keepdims=True), 1e-12)
    if len(up) == 0 or float((up @ up[0]).min()) > np.cos(SAME_DIRECTION):
        return "gravity comes from one side only; hold the device still in several poses"
    return None


def inputs(sensor: str, c: Circumstances) -> str | None:
    """Whether what the sensor measures took many values."""
    checks: dict[str, Callable[[Circumstances], str | None]] = {
        "force": directions,
        "rate": partial(rotations, sensor),
        "magnetic": fields,
    }
    return checks[INPUT_OF[sensor]](c)


def previous_poses(c: Circumstances) -> str | None:
    """Whether the pose before is known of two holds at least, and is not always the same."""
    known = c.previous[np.isfinite(c.previous).all(axis=1)]
    if len(known) < 2 or float(np.ptp(known, axis=0).max()) < 0.1 * c.gravity:
        return "no pose was reached from different sides; take the same poses in another order"
    return None


def vibrations(c: Circumstances) -> str | None:
    """Whether some poses were shakier than others."""
    known = c.vibration[np.isfinite(c.vibration)]
    if len(known) < 2 or float(known.max()) <= MIN_VIBRATION_RATIO * float(known.min()):
        return "all poses were equally quiet; take some again on a vibrating support"
    return None


def holds(sensor: str, c: Circumstances, least: int) -> str | None:
    """Whether there are enough holds; those of a gyroscope come with samples in motion."""
    count, still = len(c), int((~c.rate.any(axis=1)).sum())
    if sensor in FELT_IN_MOTION and still:  # a rate table may never rest
        count = still
    return f"only {count} holds; at least {least} are needed" if count < least else None
