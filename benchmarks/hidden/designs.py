"""How a session went: which poses in which order, how well placed, how long, warm and shaky."""

from dataclasses import dataclass, field

import numpy as np

from imucal_wizard.core.poses import CORNERS, EDGES, FACES
from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.simulate.sensor import Thermal

BATCHES = 40
"""Averages per hold, of a tenth to a third of a second, from which the program learns the noise."""
FIRST_REST = 20.0
"""Seconds from switching on to the first pose."""


@dataclass(frozen=True)
class Plan:
    """What a session is drawn from.

    Attributes:
        name: for the tables.
        corners: whether the eight corners are among the poses.
        repeats: how many poses are taken a second time.
        at_end: the repeats come last; else all poses are in an order by chance.
        placing: placement error, standard deviation per axis, degrees; 0 is exact.
        hold: shortest and longest hold, s.
        move: shortest and longest time between holds, s.
        shaken: share of the poses on a shaking support.
        still: vibration of a steady support and of a shaking one, rms, g.
        thermal: temperature of the chip.
    """

    name: str
    corners: bool
    repeats: int
    at_end: bool = False
    placing: float = 3.0
    hold: tuple[float, float] = (4.0, 8.0)
    move: tuple[float, float] = (5.0, 11.0)
    shaken: float = 0.33
    still: tuple[float, float] = (0.01, 0.05)
    thermal: Thermal = field(default_factory=lambda: Thermal(24.0, 5.0, 180.0))


STANDARD = Plan("18", corners=False, repeats=0)
REPEATED = Plan("26+12", corners=True, repeats=12)
EXACT = Plan("18 exact", corners=False, repeats=0, placing=0.0)
LATE = Plan("26+12 late", corners=True, repeats=12, at_end=True, placing=6.0, hold=(3.0, 12.0))
PLANS = {plan.name: plan for plan in (STANDARD, REPEATED, EXACT, LATE)}


@dataclass(frozen=True, eq=False)
class Schedule:
    """One session; n holds.

    Attributes:
        up: true up direction, body frame, shape (n, 3).
        start: s, shape (n,).
        end: s, shape (n,).
        temperature: of the chip, °C, shape (n,).
        vibration: mean square, sum over the axes, g², shape (n,).
        shaken: whether the support was shaking, shape (n,).
    """

    up: FloatArray
    start: FloatArray
    end: FloatArray
    temperature: FloatArray
    vibration: FloatArray
    shaken: BoolArray

    @property
    def middle(self) -> FloatArray:
        """Middle of each hold, s."""
        return np.asarray(0.5 * (self.start + self.end))

    @property
    def previous(self) -> FloatArray:
        """Up direction of the hold before, zero before the first, shape (n, 3)."""
        return np.vstack([np.zeros((1, 3)), self.up[:-1]])


def drawn_schedule(plan: Plan, rng: np.random.Generator) -> Schedule:
    """One session by this plan."""
    up = _placed(_order(plan, rng), plan.placing, rng)
    n = len(up)
    lengths = rng.uniform(*plan.hold, n)
    start = FIRST_REST + np.cumsum(rng.uniform(*plan.move, n) + lengths) - lengths
    shaken = rng.random(n) < plan.shaken
    level = np.where(shaken, plan.still[1], plan.still[0]) * np.exp(rng.normal(0.0, 0.3, n))
    middle = start + 0.5 * lengths
    return Schedule(up, start, start + lengths, plan.thermal.at(middle), level**2, shaken)


def _order(plan: Plan, rng: np.random.Generator) -> FloatArray:
    poses = {**FACES, **EDGES, **(CORNERS if plan.corners else {})}
    once = np.array(list(poses.values()))
    once = once[rng.permutation(len(once))]
    turns = -(-plan.repeats // len(once))
    order = np.concatenate([rng.permutation(len(once)) for _ in range(max(turns, 1))])
    again = once[order[: plan.repeats]]
    if plan.at_end:
        return np.concatenate([once, once[: plan.repeats]])
    both = np.concatenate([once, again])
    return np.asarray(both[rng.permutation(len(both))])


def _placed(up: FloatArray, degrees: float, rng: np.random.Generator) -> FloatArray:
    turn = np.radians(degrees) * rng.standard_normal(up.shape)
    moved = up + np.cross(turn, up)
    return np.asarray(moved / np.linalg.norm(moved, axis=1, keepdims=True))
