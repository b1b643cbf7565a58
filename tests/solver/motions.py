"""Whole gyroscope experiments with known truth: turns between rests, as the solver takes them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import lay_out
from imucal_wizard.solver.closure import Turns
from imucal_wizard.solver.gains import Nominal, nominal_of
from imucal_wizard.solver.gyroscope import VectorFit, fit_vector
from imucal_wizard.solver.gyroscope_start import Path, start_matrix
from tests.solver.truth import Motion, Truth, even_directions, hold, turn

STARTS = {"x": np.array([0.0, 0.0, 1.0]), "y": np.array([0.0, 0.0, 1.0]), "z": np.eye(3)[0]}
"""Q's figure 2."""


@dataclass(frozen=True, eq=False)
class Experiment:
    """Turns of a gyroscope.

    Attributes:
        turns: as the fit takes them.
        paths: the same with the accelerometer in them.
        stills: mean reading at each rest, shape (n, 3).
        floor: standard deviation of such a mean, shape (3,).
        noise: variance of each component of each closure by noise, rad², shape (m,).
    """

    turns: Turns
    paths: list[Path]
    stills: FloatArray
    floor: FloatArray
    noise: FloatArray

    def fit(self, known: bool = True, nominal: Nominal | None = None) -> VectorFit:
        """The nine-parameter fit from a start that assumes nothing."""
        start = start_matrix(self.turns, self.paths, self.stills.mean(axis=0), known)
        nominal = nominal or nominal_of(start, known)
        return fit_vector(self.turns, self.stills, self.floor, start, nominal, self.noise)

    def only(self, rows: Sequence[int]) -> "Experiment":
        """Some of the rotations."""
        steps = lay_out([self.paths[i].time for i in rows], [self.paths[i].reading for i in rows])
        turns = Turns(steps, self.turns.before[list(rows)], self.turns.after[list(rows)])
        paths = [self.paths[i] for i in rows]
        return replace(self, turns=turns, paths=paths, noise=self.noise[list(rows)])


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
    still_seconds: float = 5.0,
    tilt_sigma: float = 0.0,
) -> Experiment:
    """Readings of these motions, with white noise of ``sigma`` (rad/s) per sample.

    Args:
        motions: the true motions.
        truth: the gyroscope.
        rng: where noise comes from; None for none.
        sigma: noise of a sample, rad/s.
        still_seconds: how long each rest lasts.
        tilt_sigma: noise of each measured up direction, rad.
    """
    chance = rng or np.random.default_rng(0)
    gain = float(np.mean(np.diag(truth.sensitivity)))
    readings = [
        truth.readings(m.rate) + gain * sigma * chance.standard_normal(m.rate.shape)
        for m in motions
    ]
    interval = float(motions[0].time[1] - motions[0].time[0])
    floor = gain * sigma * np.sqrt(interval / still_seconds)
    count = len(motions) + 1
    stills = truth.bias + floor * chance.standard_normal((count, 3))
    ends = np.array([[m.up[0], m.up[-1]] for m in motions])
    ends = ends + tilt_sigma * chance.standard_normal(ends.shape)
    ends /= np.linalg.norm(ends, axis=2)[:, :, None]
    turns = Turns(lay_out([m.time for m in motions], readings), ends[:, 0], ends[:, 1])
    paths = [Path(m.time, y, m.up) for m, y in zip(motions, readings, strict=True)]
    seconds = np.array([m.time[-1] - m.time[0] for m in motions])
    noise = sigma**2 * interval * seconds + 2.0 * tilt_sigma**2
    return Experiment(turns, paths, stills, np.full(3, max(floor, 1e-9 * gain)), noise)


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
        gyroscope: truth, in rad/s.
        rng: where noise comes from.
        force_sigma: noise of a hold's mean, m/s².
        rate_sigma: noise of a sample, rad/s.
    """
    holds: list[Hold] = []
    rotations = []
    for number, motion in enumerate(motions):
        start = 100.0 * number
        interval = float(motion.time[1] - motion.time[0])
        sigma = rate_sigma * np.sqrt(interval / 5.0)
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
                rate + rate_sigma * rng.standard_normal(rate.shape),
                accelerometer=accelerometer.readings(9.80665 * motion.up),
            )
        )
        holds += ends
    return holds, rotations
