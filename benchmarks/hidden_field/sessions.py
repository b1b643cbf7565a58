"""One session of a virtual magnetometer: what the hand did, what was warm, what current flowed."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose
from imucal_wizard.simulate.forward import TrueCircumstances
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.magnetometer import FIELD_RATE, TrueField
from imucal_wizard.simulate.motion import Motion
from imucal_wizard.simulate.noise import RandomStream, generator
from imucal_wizard.simulate.samples import VirtualLoad
from imucal_wizard.simulate.scripts import perform_circles, pose_names
from imucal_wizard.simulate.sensor import Thermal

STILL = 0.01
"""Rate under which the device rests, rad/s."""
SHORTEST = 3.0
"""Seconds of a hold."""


@dataclass(frozen=True)
class Plan:
    """What a session is made of.

    Attributes:
        name: for the tables.
        poses: set of still poses.
        before: circles before the poses, too; they come last in any case.
        hold: seconds per pose.
        thermal: temperature of the chip.
    """

    name: str
    poses: str
    before: bool
    hold: float
    thermal: Thermal = field(default_factory=lambda: Thermal(24.0, 5.0, 180.0))


STANDARD = Plan("18 poses, circles", "18", before=False, hold=5.0)
REPEATED = Plan("circles, 26+12 poses, circles", "26+repeats", before=True, hold=5.0)
PLANS = {"standard": STANDARD, "repeated": REPEATED}


@dataclass(frozen=True, eq=False)
class Session:
    """One session at the magnetometer's samples; n samples, h holds.

    Attributes:
        motion: what truly happened.
        seen: true field in the magnetometer's own axes, µT, shape (n, 3).
        model: the sensor, mounted straight.
        temperature: °C, shape (n,).
        current: A, shape (n,).
        holds: first and last time of each, s, shape (h, 2).
        up: at each hold, body frame, shape (h, 3).
    """

    motion: Motion
    seen: FloatArray
    model: TrueField
    temperature: FloatArray
    current: FloatArray
    holds: FloatArray
    up: FloatArray

    def circumstances(self, step: float) -> TrueCircumstances:
        """What the forward equations need; ``step`` in minutes."""
        motion, count = self.motion, len(self.seen)
        return TrueCircumstances(
            motion.specific_force / STANDARD_GRAVITY,
            np.degrees(motion.rate),
            self.temperature,
            motion.time / 60.0,
            motion.previous,
            np.zeros((count, 3)),
            motion.attitude,
            self.seen,
            step,
            current=self.current,
        )


def _script(plan: Plan, rng: np.random.Generator) -> Iterator[Action]:
    names = pose_names(plan.poses, rng)
    first = perform_circles(1.0) if plan.before else iter(())
    poses = (one for name in names for one in (PlacePose(name), LieStill(plan.hold)))
    return itertools.chain([LieStill(5.0)], first, poses, perform_circles(1.0))


@lru_cache(maxsize=2)
def session_of(plan: Plan, seed: int) -> Session:
    """The session of a seed."""
    hand = VirtualHand(FIELD_RATE, seed)
    hand.perform(_script(plan, generator(seed, RandomStream.POSES)))
    parts = []
    while count := hand.remaining(4096):
        parts.append(hand.advance(count))
    names = [one.name for one in fields(Motion)]
    motion = Motion(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
    model = replace(TrueField.drawn(seed), misalignment=np.zeros(3))
    holds = _holds(motion)
    middle = np.searchsorted(motion.time, holds.mean(axis=1))
    up = motion.specific_force[middle]
    return Session(
        motion,
        model.seen(motion),
        model,
        plan.thermal.at(motion.time),
        VirtualLoad(seed).at(motion.time),
        holds,
        up / np.linalg.norm(up, axis=1, keepdims=True),
    )


def _holds(motion: Motion) -> FloatArray:
    still = np.linalg.norm(motion.rate, axis=1) < STILL
    edges = np.diff(np.concatenate([[0], still.astype(int), [0]]))
    first, past = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)
    times = np.column_stack([motion.time[first], motion.time[past - 1]])
    return np.asarray(times[times[:, 1] - times[:, 0] > SHORTEST])
