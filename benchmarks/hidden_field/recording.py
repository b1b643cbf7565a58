"""A session as the program would have it: readings, holds, and what gravity is known to."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.hidden_field.sessions import Session
from benchmarks.hidden_field.strangers import Extra
from imucal_wizard.devices.virtual.hidden import Hidden
from imucal_wizard.devices.virtual.magnetometer import FIELD_RATE, NOISE, STEP
from imucal_wizard.devices.virtual.noise import Noise
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray, Readings, Series
from imucal_wizard.solver.accelerometer import AccelerometerFit
from imucal_wizard.solver.directions import group_directions
from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.field_measuring import field_data
from imucal_wizard.solver.magnetometer.fit import fit_magnetometer
from imucal_wizard.units import STANDARD_GRAVITY

UP_ERROR = 8e-5
"""Of the direction of gravity in a hold, rad: what a virtual accelerometer leaves."""
WARMTH_STEP = 1.0 / 16.0
AMPERE_STEP = 0.01


@dataclass(frozen=True)
class Colour:
    """What the noise is made of.

    Attributes:
        floor: Allan deviation of the bias instability, µT.
        walk: random walk of the bias, µT per square root of minute.
    """

    floor: float = 0.01
    walk: float = 0.0


CONSUMER = Colour()


def record(
    session: Session,
    colour: Colour,
    hidden: Sequence[Hidden],
    rng: np.random.Generator,
    extra: Extra | None = None,
) -> FieldData:
    """What the program knows of a session.

    Args:
        session: what happened.
        colour: the noise.
        hidden: effects.
        rng: chance.
        extra: what is no effect of the catalogue.
    """
    time = session.motion.time
    step = float(rng.uniform(0.3, 0.7) * time[-1]) / 60.0
    noise = _noise(colour, time, rng)
    up = session.up + UP_ERROR * rng.standard_normal(session.up.shape)
    error = noise
    where = session.circumstances(step)
    for one in hidden:
        error = error + one.error(where)
    if extra is not None:
        error = error + extra.error(session, rng)
    exact = session.model.reading(session.motion, error)
    readings = _readings(session, np.round(exact / STEP) * STEP)
    series = readings.magnetometer
    if series is None:
        raise ValueError("the session has no magnetometer")
    found = fit_magnetometer(series, float(np.linalg.norm(session.model.world)))
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    variance = np.full(len(up), UP_ERROR**2)
    # of the accelerometer's fit only the directions are looked at
    gravity = AccelerometerFit(found.fit, up, group_directions(up), variance)
    return field_data(found, readings, _holds(session), gravity)


def _noise(colour: Colour, time: FloatArray, rng: np.random.Generator) -> FloatArray:
    density, floor = np.full(3, NOISE * np.sqrt(2.0 / FIELD_RATE)), np.full(3, colour.floor)
    noise = Noise(rng, FIELD_RATE, density, floor).take(len(time))
    if colour.walk:
        step = colour.walk / np.sqrt(60.0 * FIELD_RATE)
        noise = noise + np.cumsum(step * rng.standard_normal((len(time), 3)), axis=0)
    return noise


def _readings(session: Session, values: FloatArray) -> Readings:
    time = session.motion.time
    warm = np.round(session.temperature / WARMTH_STEP)[:, None] * WARMTH_STEP
    amperes = np.round(session.current / AMPERE_STEP)[:, None] * AMPERE_STEP
    return Readings(
        Series(time, session.motion.specific_force, "m/s^2"),
        magnetometer=Series(time, values, "uT"),
        temperature=Series(time, warm, "degC"),
        current=Series(time, amperes, "A"),
    )


def _holds(session: Session) -> tuple[Hold, ...]:
    return tuple(
        Hold(
            start=float(start),
            end=float(end),
            accelerometer=STANDARD_GRAVITY * up,
            accelerometer_covariance=np.zeros((3, 3)),
            gyroscope=None,
            gyroscope_covariance=None,
            samples=int((end - start) * FIELD_RATE),
        )
        for (start, end), up in zip(session.holds, session.up, strict=True)
    )
