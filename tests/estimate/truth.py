"""Data whose truth is known, made with none of the solver's formulas.

Attitudes and their rates come from SciPy's rotations and from differences of them; readings are
``y = S x + b``, written out.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.poses import CORNERS, EDGES, FACES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.measurement.holds import Hold

EIGHTEEN = np.array([*FACES.values(), *EDGES.values()])
TWENTY_SIX = np.array([*EIGHTEEN, *CORNERS.values()])
SIX = np.array([*FACES.values()])


@dataclass(frozen=True, eq=False)
class Truth:
    """A sensor: ``y = S x + b``.

    Attributes:
        sensitivity: S, reading per SI.
        bias: b, reading.
    """

    sensitivity: FloatArray
    bias: FloatArray

    @property
    def matrix(self) -> FloatArray:
        """``M = S⁻¹``."""
        return np.asarray(np.linalg.inv(self.sensitivity))

    def readings(self, inputs: FloatArray) -> FloatArray:
        """Readings of inputs, shape (n, 3)."""
        return np.asarray(inputs @ self.sensitivity.T + self.bias)


def typical_accelerometer() -> Truth:
    """Errors of a consumer sensor, in m/s²."""
    sensitivity = np.array([[1.02, -0.013, 0.019], [0.0, 0.985, 0.007], [0.0, 0.0, 1.011]])
    return Truth(sensitivity, np.array([0.31, -0.44, 0.22]))


def typical_gyroscope() -> Truth:
    """Errors of a consumer sensor, in rad/s."""
    sensitivity = np.array([[0.985, 0.011, -0.008], [-0.006, 1.017, 0.013], [0.015, 0.004, 1.009]])
    return Truth(sensitivity, np.array([0.011, -0.007, 0.004]))


def in_counts(truth: Truth, gain: float) -> Truth:
    """The same sensor in raw counts around 32768."""
    return Truth(truth.sensitivity * gain, truth.bias * gain + 32768.0)


def random_triangular(rng: np.random.Generator) -> Truth:
    """Scales within 5 %, angles within 2°, bias within 60 mg."""
    matrix = np.diag(rng.uniform(0.95, 1.05, 3))
    matrix[np.triu_indices(3, 1)] = rng.uniform(-0.035, 0.035, 3)
    return Truth(np.asarray(np.linalg.inv(matrix), float), rng.uniform(-0.6, 0.6, 3))


def hold(
    reading: FloatArray,
    start: float,
    seconds: float = 2.0,
    gyroscope: FloatArray | None = None,
    sigma: float = 0.0,
    gyroscope_sigma: float = 0.0,
) -> Hold:
    """A still period with this mean, whose average has these standard deviations."""
    return Hold(
        start=start,
        end=start + seconds,
        accelerometer=np.asarray(reading, float),
        accelerometer_covariance=sigma**2 * np.eye(3),
        gyroscope=gyroscope,
        gyroscope_covariance=None if gyroscope is None else gyroscope_sigma**2 * np.eye(3),
        samples=round(100 * seconds),
    )


def holds_of(
    truth: Truth,
    up: FloatArray,
    *,
    gravity: float = STANDARD_GRAVITY,
    noise: FloatArray | float = 0.0,
    sigma: float = 0.0,
) -> list[Hold]:
    """One hold for each up direction, with this error of each mean reading."""
    up = up / np.linalg.norm(up, axis=1)[:, None]
    readings = truth.readings(gravity * up) + noise
    return [hold(reading, 10.0 * i, sigma=sigma) for i, reading in enumerate(readings)]


def tilted(up: FloatArray, degrees: float, rng: np.random.Generator) -> FloatArray:
    """Directions as a hand holds them: each missed by about so much."""
    missed = up + np.radians(degrees) * rng.standard_normal(up.shape)
    return np.asarray(missed / np.linalg.norm(missed, axis=1)[:, None])


def even_directions(count: int, rng: np.random.Generator) -> FloatArray:
    """Random directions, uniform over the sphere."""
    vectors = rng.standard_normal((count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


def smooth_step(s: FloatArray) -> FloatArray:
    """From 0 to 1 between s = 0 and 1, at rest (to the third derivative) on either side."""
    s = np.clip(s, 0.0, 1.0)
    return np.asarray(s**4 * (35.0 - 84.0 * s + 70.0 * s**2 - 20.0 * s**3))


@dataclass(frozen=True, eq=False)
class Motion:
    """A true motion from rest to rest.

    Attributes:
        time: s, shape (n,).
        rate: body rate, rad/s, shape (n, 3).
        up: up in the body frame, shape (n, 3).
    """

    time: FloatArray
    rate: FloatArray
    up: FloatArray


def turn(
    before: FloatArray,
    vector: FloatArray,
    *,
    seconds: float = 2.0,
    rate: float = 100.0,
    wobble: FloatArray | None = None,
    rest: float = 0.1,
    start: float = 0.0,
) -> Motion:
    """A turn by a rotation vector (rad, body frame), with a wobble that begins and ends at zero.

    The attitude is ``exp(a(t)) exp(c(t))``; its rate is the fourth-order difference of attitudes
    an instant apart.
    """
    time = np.arange(-rest, seconds + rest, 1.0 / rate)
    swing = np.zeros(3) if wobble is None else wobble

    def attitude(at: FloatArray) -> Attitude:
        s = np.clip(at / seconds, 0.0, 1.0)
        bump = smooth_step(s) * smooth_step(1.0 - s)
        swung = np.outer(bump * np.sin(7.0 * s), swing) + np.outer(bump, np.roll(swing, 1))
        whole = Attitude.from_rotvec(np.outer(smooth_step(s), vector))
        return whole * Attitude.from_rotvec(swung)

    here, instant = attitude(time), 1e-3
    near, far = (
        (here.inv() * attitude(time + step * instant)).as_rotvec()
        - (here.inv() * attitude(time - step * instant)).as_rotvec()
        for step in (1, 2)
    )
    body_rate = (8.0 * near - far) / (12.0 * instant)
    return Motion(start + time, body_rate, here.inv().apply(before))
