"""Whole sessions under noise that never stops: white, and a bias that wanders by itself.

The noise is the virtual sensor's, drawn sample by sample from the first rest to the last.
"""

from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.measurement.blocks import BlockCutter
from imucal_wizard.measurement.holds import Hold, Rotation, hold_from
from imucal_wizard.simulate.noise import SensorNoise
from tests.estimate.motions import hand_turns
from tests.estimate.truth import EIGHTEEN, Truth, random_triangular, tilted, typical_gyroscope

RATE = 50.0
HOLD = 3.0
MOVED = 2.0
"""Seconds from one pose to the next."""
DENSITY = np.array(3 * [0.15e-3 * STANDARD_GRAVITY] + 3 * [np.radians(0.014)])
"""White noise of a consumer sensor: 150 µg/√Hz, 0.014 °/s/√Hz."""
FLOOR = np.array(3 * [0.03e-3 * STANDARD_GRAVITY] + 3 * [np.radians(0.0015)])
"""Its bias instability: 30 µg, 5 °/h."""


@dataclass(frozen=True, eq=False)
class Session:
    """What was measured, and of what: truth in m/s² and rad/s.

    ``mean_bias`` is that of accelerometer and gyroscope with the mean of its wandering over the
    session, shape (6,).
    """

    accelerometer: Truth
    gyroscope: Truth
    holds: list[Hold]
    rotations: list[Rotation]
    mean_bias: FloatArray


def wandering(turns: int, instability: float, rng: np.random.Generator) -> Session:
    """Eighteen poses, then ``turns`` about each axis between rests.

    Args:
        turns: about each axis.
        instability: of the bias, in units of a consumer sensor's.
        rng: where chance comes from.
    """
    force, rate = random_triangular(rng), typical_gyroscope()
    motions = hand_turns(turns, rng, rate=RATE) if turns else []
    poses = tilted(EIGHTEEN, 1.0, rng)
    seconds = (len(poses) + 2 * len(motions)) * (HOLD + MOVED)
    seconds += sum(len(motion.time) for motion in motions) / RATE
    # the same stream without its white part
    slow = SensorNoise(deepcopy(rng), RATE, 0.0 * DENSITY, instability * FLOOR)
    noise = SensorNoise(rng, RATE, DENSITY, instability * FLOOR).take(int(seconds * RATE))
    count, moved = int(HOLD * RATE), int(MOVED * RATE)

    def rest(first: int, up: FloatArray) -> Hold:
        part = noise[first : first + count]
        time = (first + np.arange(count)) / RATE
        forces = force.readings(STANDARD_GRAVITY * up[None])[0] + part[:, :3]
        rates = rate.bias + part[:, 3:]
        readings = Readings(Series(time, forces, "m/s^2"), Series(time, rates, "rad/s"))
        return hold_from(BlockCutter(RATE).feed(readings))

    holds = [rest(k * (count + moved), up) for k, up in enumerate(poses)]
    rotations, first = [], len(poses) * (count + moved)
    for motion in motions:
        inside = slice(first + count, first + count + len(motion.time))
        before, after = rest(first, motion.up[0]), rest(inside.stop, motion.up[-1])
        rotations.append(
            Rotation(
                before,
                after,
                np.arange(inside.start, inside.stop) / RATE,
                rate.readings(motion.rate) + noise[inside, 3:],
                accelerometer=force.readings(STANDARD_GRAVITY * motion.up) + noise[inside, :3],
            )
        )
        holds += [before, after]
        first = inside.stop + count + moved
    wandered = slow.take(int(holds[-1].end * RATE)).mean(axis=0)
    biases = np.concatenate([force.bias, rate.bias])
    return Session(force, rate, holds, rotations, biases + wandered)
