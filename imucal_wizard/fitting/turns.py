"""The usable rotations of a recording, with all that the gyroscope's fit needs of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.fitting.rounded import rate_shift
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.readings import ENDLESS, FloatArray, IntArray
from imucal_wizard.solver.accelerometer import AccelerometerFit
from imucal_wizard.solver.attitude import advancing, lay_out
from imucal_wizard.solver.closure import Turns
from imucal_wizard.solver.gyroscope_start import Path
from imucal_wizard.solver.noise import has_rate, hold_noise
from imucal_wizard.solver.rest import rest_of
from imucal_wizard.solver.slow_noise import slow_rate

FEWEST_SAMPLES = 3
UNSTEADY = 9.0
"""Noise of a closure, as a variance, over that of most, from which on it is worth a word."""


@dataclass(frozen=True, eq=False)
class Bench:
    """The usable rotations with all that belongs to them.

    Attributes:
        turns: the rotations, ready to be closed.
        usable: which of all rotations they are.
        stills: the gyroscope's mean in each hold, shape (n, 3).
        still_floor: standard deviation of such a mean by noise alone, shape (3,).
        density: variance × time of the gyroscope per axis, reading units² s, shape (3,).
        holds: all holds.
        before: which of them each rotation starts from, shape (m,).
        after: which of them it ends in, shape (m,).
        direction_variance: of the mean up direction in each hold, rad², shape (n,).
        slow: variance by which slow noise shifts the mean of all stills, shape (3,).
    """

    turns: Turns
    usable: tuple[int, ...]
    stills: FloatArray
    still_floor: FloatArray
    density: FloatArray
    holds: tuple[Hold, ...]
    before: IntArray
    after: IntArray
    direction_variance: FloatArray
    slow: FloatArray

    def noise(self, matrix: FloatArray) -> FloatArray:
        """Variance of each component of each closure by noise alone, rad², shape (m,).

        Angle random walk, and the directions at both ends: how well the mean of a hold is known,
        and how far the device was from it when the turn began, where a hand did not rest.

        Args:
            matrix: M, rad/s per reading.
        """
        steps = self.turns.steps
        durations = np.add.reduceat(steps.dt, steps.offsets[:-1])
        per_second = float(((matrix**2) @ self.density).mean())
        ends = self.direction_variance + rest_of(self.holds, matrix).end
        return np.asarray(per_second * durations + ends[self.before] + ends[self.after])

    def unsteady(self, matrix: FloatArray) -> int:
        """How many rotations begin or end where the device was far from being at rest."""
        noise = self.noise(matrix)
        return int((noise > UNSTEADY * np.median(noise)).sum())


def examined(rotations: Sequence[Rotation]) -> list[Rotation]:
    """The rotations, with the problem named of those that cannot be integrated."""
    return [replace(one, problem=one.problem or _problem(one)) for one in rotations]


def _problem(rotation: Rotation) -> str | None:
    if len(rotation.time) < FEWEST_SAMPLES or advancing(rotation.time).sum() < FEWEST_SAMPLES:
        return "no gyroscope samples in it"
    if not (np.abs(rotation.rate) < ENDLESS).all() or not np.isfinite(rotation.time).all():
        return "its gyroscope samples are not all numbers"
    force = rotation.accelerometer
    if force is not None and not (np.abs(force) < ENDLESS).all():
        return "its accelerometer samples are not all numbers"
    return None


def make_bench(
    holds: Sequence[Hold], rotations: Sequence[Rotation], accelerometer: AccelerometerFit
) -> Bench | None:
    """The usable ones of examined rotations; None without any, or without a still mean."""
    places = {id(hold): index for index, hold in enumerate(holds)}
    usable = tuple(i for i, rotation in enumerate(rotations) if rotation.problem is None)
    resting = [hold for hold in holds if has_rate(hold)]
    stills = np.array([hold.gyroscope for hold in resting])
    if not usable or not len(stills):
        return None
    density = hold_noise(holds).gyroscope_density
    density = np.zeros(3) if density is None else density
    duration = float(np.median([hold.end - hold.start for hold in holds]))
    turned = [rotations[i] for i in usable]
    # a shift that all still means have in common weighs like so many independent ones of its size
    common = len(stills) * rate_shift(holds, turned)
    before = np.array([places[id(rotation.before)] for rotation in turned])
    after = np.array([places[id(rotation.after)] for rotation in turned])
    return Bench(
        _turns(turned, before, after, accelerometer),
        usable,
        stills,
        np.sqrt(density / duration + common),
        density,
        tuple(holds),
        before,
        after,
        accelerometer.direction_variance,
        slow_rate(resting),
    )


def _turns(
    rotations: Sequence[Rotation],
    before: IntArray,
    after: IntArray,
    accelerometer: AccelerometerFit,
) -> Turns:
    up, doubt = accelerometer.up, accelerometer.up_doubt
    return Turns(
        lay_out([rotation.time for rotation in rotations], [r.rate for r in rotations]),
        up[before],
        up[after],
        None if doubt is None else doubt[before],
        None if doubt is None else doubt[after],
    )


def paths(rotations: Sequence[Rotation], accelerometer: AccelerometerFit) -> list[Path]:
    """The rotations with the accelerometer in them; none when it was not kept."""
    fit = accelerometer.fit
    found = []
    for rotation in rotations:
        if rotation.accelerometer is None:
            return []
        keep = advancing(rotation.time)
        force = (rotation.accelerometer[keep] - fit.bias) @ fit.matrix.T
        length = np.linalg.norm(force, axis=1)[:, None]
        up = force / np.maximum(length, 1e-9 * max(float(length.max()), 1e-300))
        found.append(Path(rotation.time[keep], rotation.rate[keep], up))
    return found
