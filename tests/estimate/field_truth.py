"""A magnetometer in the Earth's field, turned by hand: N's own result as truth (figure 7).

Nothing here is the fit's: attitudes are SciPy's rotations, the sensor is N's forward model
``S_p = W S + V₀`` (eq. 1) with W the inverse of the matrix printed in figure 7.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.readings import FloatArray, Series

MAGNITUDE = 438.1713
"""S of figures 6 and 7, counts; 43.8 µT at the MAG3110's 0.1 µT per count."""
OFFSET = np.array([884.7, -1135.1, -303.2])
"""V₀ of figure 7, counts."""
CORRECTION = np.array(
    [[0.9619, 0.0568, -0.0142], [0.0568, 1.0013, 0.0113], [-0.0142, 0.0113, 1.0463]]
)
"""W⁻¹ of figure 7."""
NOISE = 4.0
"""Counts rms: 0.4 µT, the MAG3110's datasheet at 80 samples per second."""
TEN_BITS = 20_000.0 / 1024.0
"""Counts of one step where ±1000 µT are converted to ten bits."""
RATE = 80.0
DIP = 66.0
"""Degrees below the horizon, central Europe."""

FACES = (
    Attitude.identity(),
    Attitude.from_euler("x", 180, degrees=True),
    Attitude.from_euler("x", 90, degrees=True),
    Attitude.from_euler("x", -90, degrees=True),
    Attitude.from_euler("y", 90, degrees=True),
    Attitude.from_euler("y", -90, degrees=True),
)
"""The device lying on each of its six faces."""


@dataclass(frozen=True, eq=False)
class Turned:
    """A recording and what made it.

    Attributes:
        series: the readings.
        field: the true field in the body's axes, in counts, shape (n, 3).
    """

    series: Series
    field: FloatArray


def six_circles(
    rng: np.random.Generator,
    seconds: float = 20.0,
    *,
    dip: float = DIP,
    wobble: float = 6.0,
    share: float = 1.0,
    faces: tuple[int, ...] = (0, 1, 2, 3, 4, 5),
) -> FloatArray:
    """Unit field in the body's axes while a hand turns the device on a table (N, VI-A).

    Args:
        rng: chance.
        seconds: for each circle.
        dip: of the field, degrees.
        wobble: how far the hand tilts the device, degrees.
        share: of each circle, 1 for the whole of it.
        faces: on which faces it lies.
    """
    north = np.array([np.cos(np.radians(dip)), 0.0, -np.sin(np.radians(dip))])
    parts = []
    for face in faces:
        time = np.arange(round(seconds * RATE)) / RATE
        pace = 1.0 + 0.3 * np.sin(2.0 * np.pi * time / rng.uniform(5.0, 9.0))
        turn = 2.0 * np.pi * share * np.cumsum(pace) / pace.sum() + rng.uniform(0.0, 2.0 * np.pi)
        tilt = [
            wobble * np.sin(2.0 * np.pi * time / rng.uniform(2.0, 6.0) + rng.uniform(0, 6))
            for _ in range(2)
        ]
        body = (
            Attitude.from_euler("z", turn[:, None])
            * Attitude.from_euler("xy", np.column_stack(tilt), degrees=True)
            * FACES[face]
        )
        parts.append(body.inv().apply(north))
    return np.concatenate(parts)


def tumbling(rng: np.random.Generator, samples: int) -> FloatArray:
    """Unit field in the body's axes while a hand tumbles the device, shape (samples, 3).

    The axis of turning wanders, so that after a minute all directions have been visited.
    """
    time = np.arange(samples) / RATE
    rate = np.column_stack(
        [
            sum(np.sin(2.0 * np.pi * f * time + rng.uniform(0, 6.3)) for f in frequencies)
            for frequencies in rng.uniform(0.02, 0.35, (3, 4))
        ]
    )
    steps = Attitude.from_rotvec(rate[1:] / RATE)
    first = Attitude.random(1, random_state=int(rng.integers(2**31)))
    body, length = Attitude.concatenate([first, steps]), 1
    while length < samples:  # each attitude is the product of all steps before it
        further = body[:-length] * body[length:]
        body, length = Attitude.concatenate([body[:length], further]), 2 * length
    north = np.array([np.cos(np.radians(DIP)), 0.0, -np.sin(np.radians(DIP))])
    return np.asarray(body.inv().apply(north))


def all_over(rng: np.random.Generator, samples: int) -> FloatArray:
    """Unit vectors in every direction alike, in no order, shape (samples, 3)."""
    vectors = rng.standard_normal((samples, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


def recorded(
    directions: FloatArray,
    rng: np.random.Generator,
    *,
    noise: float = NOISE,
    step: float = 1.0,
    extra: FloatArray | float = 0.0,
    scale: float = 1.0,
    unit: str = "count",
    rate: float = RATE,
) -> Turned:
    """What N's sensor puts out.

    Args:
        directions: unit field in the body's axes, shape (n, 3).
        rng: chance.
        noise: counts rms.
        step: counts of one step of the converter; 0 for none.
        extra: a disturbance of the field, counts, shape (n, 3).
        scale: reading unit per count: 0.1 for µT.
        unit: of the readings.
        rate: samples a second.
    """
    field = MAGNITUDE * directions
    distortion = np.linalg.inv(CORRECTION)
    readings = (field + extra) @ distortion.T + OFFSET
    readings += noise * rng.standard_normal(readings.shape)
    if step:
        readings = np.round(readings / step) * step
    time = np.arange(len(readings)) / rate
    return Turned(Series(time, readings * scale, unit), field)


def true_parameters() -> dict[str, float]:
    """Figure 7 in the gauge ``det M = 1``."""
    size = float(np.linalg.det(CORRECTION)) ** (1.0 / 3.0)
    values = {f"bias_{axis}": float(v) for axis, v in zip("xyz", OFFSET, strict=True)}
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        values[f"soft_iron_{'xyz'[i]}{'xyz'[j]}"] = float(CORRECTION[i, j] / size)
    values["field"] = MAGNITUDE / size
    return values
