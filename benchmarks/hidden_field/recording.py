"""A session as the program would have it: readings, still poses, and what gravity is known to."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.hidden_field.sessions import Session
from benchmarks.hidden_field.strangers import Extra
from imucal_wizard.core.directions import group_directions
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.magnetometer.experiment import MagnetometerExperiment, StillPoses
from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
from imucal_wizard.estimate.result import GravityReference
from imucal_wizard.simulate.hidden import Hidden
from imucal_wizard.simulate.magnetometer import FIELD_NOISE, FIELD_RATE, FIELD_STEP
from imucal_wizard.simulate.noise import SensorNoise

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
    step: float | None = None,
) -> MagnetometerExperiment:
    """What the program knows of a session.

    Args:
        session: what happened.
        colour: the noise.
        hidden: effects.
        rng: chance.
        extra: what is no effect of the catalogue.
        step: moment of a step, min; by chance if None.
    """
    time = session.motion.time
    step = float(rng.uniform(0.3, 0.7) * time[-1]) / 60.0 if step is None else step
    noise = noise_of(colour, time, rng)
    up = session.up + UP_ERROR * rng.standard_normal(session.up.shape)
    error = noise
    where = session.circumstances(step)
    for one in hidden:
        error = error + one.error(where)
    if extra is not None:
        error = error + extra.error(session, rng)
    exact = session.model.reading(session.motion, error)
    readings = _readings(session, np.round(exact / FIELD_STEP) * FIELD_STEP)
    series = readings.magnetometer
    if series is None:
        raise ValueError("the session has no magnetometer")
    field = float(np.linalg.norm(session.model.world))
    found = fit_magnetometer(series, field, readings=readings)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    variance = np.full(len(up), UP_ERROR**2)
    doubt, labels = np.zeros((len(up), 3, 0)), group_directions(up)
    gravity = GravityReference(up, labels, variance, doubt, 1.0, STANDARD_GRAVITY)
    holds = session.holds
    inside = [series.between(float(start), float(end)).values for start, end in holds]
    poses = StillPoses(
        np.arange(len(holds)),
        holds,
        np.array([values.mean(axis=0) for values in inside]),
        np.array([len(values) for values in inside], float),
        gravity,
        doubt,
    )
    return MagnetometerExperiment(found.data, None, poses)


def noise_of(colour: Colour, time: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Noise of samples at these times, µT, shape (n, 3)."""
    density, floor = np.full(3, FIELD_NOISE * np.sqrt(2.0 / FIELD_RATE)), np.full(3, colour.floor)
    noise = SensorNoise(rng, FIELD_RATE, density, floor).take(len(time))
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
