"""A whole session with known truth: a device turned between rests, three sensors, two clocks.

Attitudes are SciPy's; rates are differences of them. Nothing here is the fit's.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.readings import FloatArray, Readings, Series
from tests.estimate.field_truth import CORRECTION, NOISE, OFFSET
from tests.estimate.truth import Truth, smooth_step, typical_accelerometer, typical_gyroscope

GRAVITY = 9.80665
HOLD = 3.0
TURN = 1.6


@dataclass(frozen=True, eq=False)
class Session:
    """What is true of a simulated session.

    Attributes:
        dip: of the field, degrees below the horizon.
        magnitude: of the field, µT.
        misalignment: rotation from the magnetometer's frame to the accelerometer's, rotation
            vector, rad.
        clock: the magnetometer's clock minus the accelerometer's, s.
        rate: of accelerometer and gyroscope, Hz.
        field_rate: of the magnetometer, Hz.
        jitter: of the magnetometer's sampling, as a share of its interval.
        gyroscope: the gyroscope's truth.
        gyroscope_noise: rad/s per sample.
        vertical: share of the turns that are about the vertical.
        holds: how many rests.
        field_turn: rotation of the field about the vertical in mid-session, rad.
    """

    dip: float = 66.0
    magnitude: float = 43.8
    misalignment: FloatArray = field(default_factory=lambda: np.array([0.02, -0.03, 0.05]))
    clock: float = 0.035
    rate: float = 200.0
    field_rate: float = 80.0
    jitter: float = 0.05
    gyroscope: Truth = field(default_factory=typical_gyroscope)
    gyroscope_noise: float = 2e-3
    vertical: float = 0.3
    holds: int = 40
    field_turn: float = 0.0

    def readings(self, seed: int = 0) -> Readings:
        """The recording."""
        rng = np.random.default_rng(seed)
        poses = self.poses(rng)
        end = self.holds * HOLD + (self.holds - 1) * TURN
        time = np.arange(0.0, end, 1.0 / self.rate)
        body = attitude(poses, time)
        instant = 1e-4
        ahead, behind = attitude(poses, time + instant), attitude(poses, time - instant)
        rate = (behind.inv() * ahead).as_rotvec() / (2.0 * instant)
        force = body.inv().apply([0.0, 0.0, GRAVITY])
        accelerometer = typical_accelerometer().readings(force)
        accelerometer += 0.01 * rng.standard_normal(accelerometer.shape)
        gyroscope = self.gyroscope.readings(rate)
        gyroscope += self.gyroscope_noise * rng.standard_normal(gyroscope.shape)
        return Readings(
            Series(time, accelerometer, "m/s^2"),
            Series(time, gyroscope, "rad/s"),
            self._magnetometer(poses, end, rng),
        )

    def poses(self, rng: np.random.Generator) -> Attitude:
        """Attitudes held: each turned from the last about a body axis, or about the vertical."""
        poses = [Attitude.random(random_state=int(rng.integers(2**31)))]
        for index in range(self.holds - 1):
            angle = rng.uniform(0.7, 2.4) * rng.choice((-1.0, 1.0))
            if rng.random() < self.vertical:
                poses.append(Attitude.from_rotvec([0.0, 0.0, angle]) * poses[-1])
            else:
                axis = np.eye(3)[index % 3] + 0.3 * rng.standard_normal(3)
                axis /= np.linalg.norm(axis)
                poses.append(poses[-1] * Attitude.from_rotvec(angle * axis))
        return Attitude.concatenate(poses)

    def _magnetometer(self, poses: Attitude, end: float, rng: np.random.Generator) -> Series:
        count = int(end * self.field_rate)
        time = (np.arange(count) + self.jitter * rng.standard_normal(count)) / self.field_rate
        time = np.sort(np.clip(time, 0.0, end))
        dip = np.radians(self.dip)
        world = self.magnitude * np.array([0.0, np.cos(dip), -np.sin(dip)])
        own = Attitude.from_rotvec(self.misalignment)
        late = time > self.holds // 2 * (HOLD + TURN) - 0.5 * TURN
        turned = Attitude.from_rotvec(np.outer(self.field_turn * late, [0.0, 0.0, 1.0]))
        seen = own.inv().apply(attitude(poses, time).inv().apply(turned.apply(world)))
        distortion = np.linalg.inv(CORRECTION)
        readings = seen @ distortion.T + 0.1 * OFFSET
        readings += 0.1 * NOISE * rng.standard_normal(readings.shape)
        return Series(time + self.clock, np.round(readings, 1), "uT")


def attitude(poses: Attitude, time: FloatArray) -> Attitude:
    """Attitude (body to world) at each time: rests of HOLD s, smooth turns of TURN s between."""
    period = HOLD + TURN
    index = np.clip((time // period).astype(int), 0, len(poses) - 2)
    share = smooth_step((time - index * period - HOLD) / TURN)
    turn = (poses[index].inv() * poses[index + 1]).as_rotvec()
    return poses[index] * Attitude.from_rotvec(turn * share[:, None])
