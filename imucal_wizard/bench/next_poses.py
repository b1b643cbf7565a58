"""Which poses would tell two explanations apart, and by how much.

With base columns J, the patterns of the two effects A and B, and noise one, the part of A that
neither the base nor B can imitate is ``(I − P_[J, B]) A``. Its length times the size of A is the
number of standard deviations by which the data tell them apart. Poses are chosen one after the
other, each the one that makes this length grow most.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.effects.effect import ACCELEROMETER, Circumstances, Effect
from imucal_wizard.procedure.poses import DIRECTIONS, NAMED, spoken
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.carried import design

WARMER = 15.0
"""Degrees by which a hand, a lamp or a box warms a device."""
SECONDS_PER_POSE = 15.0
APART = 2.33 + 1.645
"""Standard deviations for one mistake in a hundred and five misses in a hundred."""
ENOUGH = 2.0
"""When an effect of half the size would be told apart, no more poses are asked for; but never one
alone, which nobody could tell from a disturbed hold."""
ALMOST_BLIND = 0.02
"""Growth per pose below which nothing is gained."""


@dataclass(frozen=True, eq=False)
class Explained:
    """One of the explanations to be told apart.

    Attributes:
        effect: the effect.
        variant: its setting.
        size: its estimated size per parameter, shown unit, shape (p,).
    """

    effect: Effect
    variant: float | None
    size: FloatArray


@dataclass(frozen=True, eq=False)
class Proposal:
    """A pose to take next.

    Attributes:
        direction: up in the body frame, unit vector.
        pose: its name; None for a tilt between faces and edges.
        warm: with the device warmed up.
        why: what it is good for, in words.
    """

    direction: FloatArray
    pose: str | None
    warm: bool
    why: str


@dataclass(frozen=True, eq=False)
class Plan:
    """Poses to take, and what they bring.

    Attributes:
        proposals: in their order.
        before: size of the first explanation (in shares of its estimate) needed to tell it from the
            second with the data there are; infinite when no size would do.
        after: the same with these poses.
    """

    proposals: tuple[Proposal, ...]
    before: float
    after: float


def separating_poses(
    first: Explained,
    second: Explained,
    done: Circumstances,
    sigma: FloatArray,
    count: int = 6,
    sensor: str = ACCELEROMETER,
) -> Plan:
    """Poses that tell two explanations of a misfit apart.

    Args:
        first: the likelier explanation.
        second: the other one.
        done: circumstances of the holds there are.
        sigma: noise of these holds, m/s² (a gyroscope's still means: rad/s), shape (n,).
        count: how many poses to propose at most.
        sensor: whose misfit; of a gyroscope the readings at rest are looked at.
    """
    typical = float(np.median(sigma))
    rows = _rows(first, second, done, sigma, sensor)
    length = apart_length(*rows)
    before = size_needed(length)
    proposals: list[Proposal] = []
    while len(proposals) < count and (length < ENOUGH * APART or len(proposals) == 1):
        offers = [
            (
                name,
                warm,
                _rows(first, second, _next(done, name, warm, len(proposals)), typical, sensor),
            )
            for name in NAMED
            for warm in (False, True)
        ]
        grown = [apart_length(*_stacked(rows, offer)) for _, _, offer in offers]
        best = int(np.argmax(grown))
        if grown[best] < (1.0 + ALMOST_BLIND) * length + 1e-9:
            break
        name, warm, offer = offers[best]
        rows, length = _stacked(rows, offer), grown[best]
        proposals.append(_proposal(name, warm, first, second))
    return Plan(tuple(proposals), before, size_needed(length))


def size_needed(length: float) -> float:
    """Shares of an estimate that stand out where all of it does by so many sigma."""
    return APART / length if length > 0.0 else np.inf


def _proposal(name: str, warm: bool, first: Explained, second: Explained) -> Proposal:
    warmed = f", the device {WARMER:.0f} °C warmer" if warm else ""
    where = spoken(name)
    why = f"{where}{warmed}: tells {first.effect.name} from {second.effect.name}"
    return Proposal(NAMED[name], name if name in DIRECTIONS else None, warm, why)


def _next(done: Circumstances, name: str, warm: bool, place: int) -> Circumstances:
    """The circumstances of one more hold in this pose."""
    up = NAMED[name] * done.gravity
    last = float(done.temperature[-1])
    return Circumstances(
        force=up[None],
        rate=np.zeros((1, 3)),
        temperature=np.array([last + WARMER * warm]),
        time=np.array([float(done.time[-1]) + SECONDS_PER_POSE * (place + 1)]),
        previous=done.force[-1:],
        vibration=np.array([float(np.mean(done.vibration))]),
        gravity=done.gravity,
        reference_temperature=done.reference_temperature,
        reference_time=done.reference_time,
    )


_Rows = tuple[FloatArray, FloatArray, FloatArray]


def _rows(
    first: Explained,
    second: Explained,
    where: Circumstances,
    sigma: FloatArray | float,
    sensor: str,
) -> _Rows:
    """Whitened: base columns, the first explanation at its size, the second's columns."""
    noise = np.broadcast_to(sigma, len(where))
    if sensor == ACCELEROMETER:
        up = where.force / np.linalg.norm(where.force, axis=1)[:, None]
        base = design(up)
        own, other = (np.einsum("ni,nip->np", up, _felt(e, where, sensor)) for e in (first, second))
    else:
        base = np.tile(np.eye(3), (len(where), 1))
        own, other = (np.concatenate(_felt(e, where, sensor)) for e in (first, second))
        noise = np.repeat(noise, 3)
    weight = 1.0 / noise[:, None]
    return base * weight, (own @ first.size)[:, None] * weight, other * weight


def _felt(explained: Explained, where: Circumstances, sensor: str) -> FloatArray:
    return np.nan_to_num(explained.effect.columns(sensor, where, explained.variant))


def _stacked(rows: _Rows, more: _Rows) -> _Rows:
    base, own, other = (np.concatenate(pair) for pair in zip(rows, more, strict=True))
    return base, own, other


def apart_length(base: FloatArray, own: FloatArray, other: FloatArray) -> float:
    """Length of what neither the base nor the other explanation can imitate.

    Args:
        base: whitened columns of what is fitted already, shape (n, b).
        own: the first explanation at its size, shape (n, 1).
        other: columns of the second one, shape (n, p).
    """
    both = np.concatenate([base, other], axis=1)
    scale = np.linalg.norm(both, axis=0)
    both = both[:, scale > 0.0] / scale[scale > 0.0]
    left, values, _ = np.linalg.svd(both, full_matrices=False)
    inner = left[:, values > 1e-9 * values[0]]
    rest = own - inner @ (inner.T @ own)
    length = float(np.linalg.norm(rest))
    return length if length > 1e-9 * float(np.linalg.norm(own)) else 0.0
