"""Whole gyroscope experiments with known truth: turns between rests, as the solver takes them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.gyroscope_fit import gyroscope_minimum
from imucal_wizard.estimate.result import GravityReference, SensorFit
from imucal_wizard.measurement.holds import Hold, Rotation
from tests.estimate.truth import Motion, Truth, even_directions, hold, turn

STARTS = {"x": np.array([0.0, 0.0, 1.0]), "y": np.array([0.0, 0.0, 1.0]), "z": np.eye(3)[0]}
"""Q's figure 2."""


@dataclass(frozen=True, eq=False)
class Turned:
    """Rotations of a gyroscope, with up in the hold before and after each known.

    Attributes:
        holds: two for each rotation.
        rotations: with the accelerometer in them.
        reference: up in each hold, with its errors.
        unit: of the readings.
    """

    holds: list[Hold]
    rotations: list[Rotation]
    reference: GravityReference
    unit: str

    def fit(self) -> SensorFit:
        """The nine gains and the biases from a start that assumes nothing."""
        known = exact_accelerometer(self.reference)
        return fit(gyroscope_minimum(self.holds, self.rotations, known, self.unit).experiment)

    def only(self, rows: Sequence[int]) -> "Turned":
        """Some of the rotations."""
        return replace(self, rotations=[self.rotations[i] for i in rows])


def exact_accelerometer(reference: GravityReference) -> SensorFit:
    """An accelerometer without errors but those that the reference tells."""
    return SensorFit(
        sensor="accelerometer",
        model=(),
        method="known",
        frame="own",
        matrix=np.eye(3),
        bias=np.zeros(3),
        bias_unit="m/s^2",
        parameters=(),
        unit="m/s^2",
        rms_before=0.0,
        rms_fitted=0.0,
        rms_held_out=None,
        floor=None,
        residuals=np.zeros(0),
        reference=reference,
    )


def hand_turns(
    count: int,
    rng: np.random.Generator,
    *,
    axes: str = "xyz",
    wobble: float = 0.05,
    rate: float = 100.0,
) -> list[Motion]:
    """``count`` turns about each axis as a hand makes them: both senses, several speeds."""
    motions = []
    for axis in axes:
        for index in range(count):
            angle = np.radians((90.0, -75.0, 140.0, -165.0, 60.0, -120.0)[index % 6])
            seconds = abs(angle) / np.radians((40.0, 110.0, 200.0)[index % 3]) * 2.2
            vector = angle * np.eye(3)["xyz".index(axis)] + 0.5 * wobble * rng.standard_normal(3)
            swing = wobble * rng.standard_normal(3)
            motions.append(turn(STARTS[axis], vector, seconds=seconds, wobble=swing, rate=rate))
    return motions


def free_turns(count: int, rng: np.random.Generator, *, wobble: float = 0.05) -> list[Motion]:
    """Turns about any axis from any position."""
    motions = []
    for _ in range(count):
        vector = rng.uniform(0.6, 3.0) * even_directions(1, rng)[0]
        swing = wobble * rng.standard_normal(3)
        seconds = float(rng.uniform(1.0, 3.0))
        motions.append(turn(even_directions(1, rng)[0], vector, seconds=seconds, wobble=swing))
    return motions


def experiment(
    motions: Sequence[Motion],
    truth: Truth,
    rng: np.random.Generator | None = None,
    *,
    sigma: float = 0.0,
    tilt_sigma: float = 0.0,
    unit: str = "rad/s",
) -> Turned:
    """Readings of these motions, with white noise of ``sigma`` (rad/s) per sample.

    Args:
        motions: the true motions.
        truth: the gyroscope.
        rng: where noise comes from; None for none.
        sigma: noise of a sample, rad/s.
        tilt_sigma: noise of each measured up direction, rad.
        unit: of the readings.
    """
    chance = rng or np.random.default_rng(0)
    holds, rotations = recorded(
        motions, Truth(np.eye(3), np.zeros(3)), truth, chance, rate_sigma=sigma
    )
    up = np.concatenate([[motion.up[0], motion.up[-1]] for motion in motions])
    up = up + tilt_sigma * chance.standard_normal(up.shape)
    up /= np.linalg.norm(up, axis=1)[:, None]
    count = len(up)
    reference = GravityReference(
        up, np.arange(count), np.full(count, tilt_sigma**2), np.zeros((count, 3, 0)), 1.0, 9.80665
    )
    return Turned(holds, rotations, reference, unit)


def recorded(
    motions: Sequence[Motion],
    accelerometer: Truth,
    gyroscope: Truth,
    rng: np.random.Generator,
    *,
    force_sigma: float = 0.0,
    rate_sigma: float = 0.0,
) -> tuple[list[Hold], list[Rotation]]:
    """The same as holds and rotations, for the fit of a whole recording.

    Args:
        motions: the true motions.
        accelerometer: truth, in m/s².
        gyroscope: truth.
        rng: where noise comes from.
        force_sigma: noise of a hold's mean, m/s².
        rate_sigma: noise of a sample, rad/s.
    """
    holds: list[Hold] = []
    rotations = []
    for number, motion in enumerate(motions):
        start = 100.0 * number
        interval = float(motion.time[1] - motion.time[0])
        gain = float(np.mean(np.diag(gyroscope.sensitivity))) or 1.0
        sigma = abs(gain) * rate_sigma * np.sqrt(interval / 5.0)
        ends = []
        for up, at in ((motion.up[0], start), (motion.up[-1], start + 50.0)):
            force = accelerometer.readings(9.80665 * up[None])[0]
            ends.append(
                hold(
                    force + force_sigma * rng.standard_normal(3),
                    at,
                    5.0,
                    gyroscope.bias + sigma * rng.standard_normal(3),
                    force_sigma,
                    sigma,
                )
            )
        rate = gyroscope.readings(motion.rate)
        rotations.append(
            Rotation(
                ends[0],
                ends[1],
                start + 6.0 + motion.time,
                rate + abs(gain) * rate_sigma * rng.standard_normal(rate.shape),
                accelerometer=accelerometer.readings(9.80665 * motion.up),
            )
        )
        holds += ends
    return holds, rotations
