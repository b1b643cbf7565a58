"""Directions all over the sphere, and circumstances in which only they matter."""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.model.effect import Circumstances


def full_sphere(n: int = 4000) -> FloatArray:
    """Unit vectors on a Fibonacci lattice, as good as uniform, shape (n, 3)."""
    k = np.arange(n) + 0.5
    z = 1.0 - 2.0 * k / n
    turn = np.pi * (1.0 + np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - z**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)


def at_rest(
    up: FloatArray,
    *,
    rate: FloatArray | None = None,
    temperature: FloatArray | None = None,
    vibration: FloatArray | None = None,
) -> Circumstances:
    """Holds with these up directions, one a minute, at rest and 25 °C unless told otherwise."""
    n = len(up)
    force = STANDARD_GRAVITY * up
    return Circumstances(
        force=force,
        rate=np.zeros((n, 3)) if rate is None else rate,
        temperature=np.full(n, 25.0) if temperature is None else temperature,
        time=60.0 * np.arange(n, dtype=np.float64),
        previous=np.vstack([np.full((1, 3), np.nan), force[:-1]]),
        vibration=np.zeros(n) if vibration is None else vibration,
    )
