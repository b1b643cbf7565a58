"""Holds of an accelerometer that is known exactly: ``y = S (x + ε(x)) + b + noise``."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.core.poses import DIRECTIONS
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.terms import Term, Terms

G = STANDARD_GRAVITY
MATRIX = np.array([[1.012, 0.004, -0.008], [0.0, 0.987, 0.011], [0.0, 0.0, 1.004]])
BIAS = np.array([0.31, -0.22, 0.48])
SECONDS = 10.0
SAMPLES = 1000
CORNERS = 26
"""How many of the named directions there are: six faces, twelve edges, eight corners."""


@dataclass(frozen=True)
class Session:
    """How the holds were made."""

    up: FloatArray
    temperature: FloatArray
    vibration: FloatArray


def session(seed: int = 0, directions: int = CORNERS, repeats: int = 12) -> Session:
    """Named poses a little off, some repeated, in random order; warm and shaky by turns."""
    rng = np.random.default_rng(seed)
    named = np.array(list(DIRECTIONS.values()))[:directions]
    up = np.concatenate([named, named[rng.permutation(len(named))[:repeats]]])
    order = rng.permutation(len(up))
    while (np.diff(order % len(named)) == 0).any():  # no pose comes twice in a row
        order = rng.permutation(len(up))
    up = up[order] + rng.normal(0.0, 0.03, (len(up), 3))
    up /= np.linalg.norm(up, axis=1)[:, None]
    # two courses that look neither like time nor like one another
    temperature = 25.0 + 8.0 * np.sin(np.arange(len(up)) * 2.1)
    vibration = 0.02 * (1.0 + (np.arange(len(up)) % 3 == 1))
    return Session(up, temperature, vibration)


def circumstances(made: Session) -> Circumstances:
    """What is true of the holds."""
    force = G * made.up
    return Circumstances(
        force=force,
        rate=np.zeros_like(force),
        temperature=made.temperature,
        time=(SECONDS + 2.0) * np.arange(float(len(force))) + 0.5 * SECONDS,
        previous=np.vstack([np.full((1, 3), np.nan), force[:-1]]),
        vibration=made.vibration,
        gravity=G,
    )


def holds(
    made: Session,
    terms: Sequence[Term] = (),
    sizes: FloatArray | None = None,
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
) -> list[Hold]:
    """The holds with their averages; ``noise`` is the standard deviation of an average, m/s²."""
    known = circumstances(made)
    together = Terms("accelerometer", terms)
    true = G * made.up + together.columns(known) @ (np.zeros(0) if sizes is None else sizes)
    readings = true @ np.linalg.inv(MATRIX).T + BIAS
    if rng is not None:
        readings = readings + rng.normal(0.0, noise, readings.shape)
    return [
        Hold(
            start=float(time - 0.5 * SECONDS),
            end=float(time + 0.5 * SECONDS),
            accelerometer=reading,
            accelerometer_covariance=np.eye(3) * noise**2,
            gyroscope=None,
            gyroscope_covariance=None,
            samples=SAMPLES,
            temperature=float(degrees),
        )
        for time, reading, degrees in zip(known.time, readings, made.temperature, strict=True)
    ]
