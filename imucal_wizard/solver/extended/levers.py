"""What an effect does to closures and still means, at all samples or at as many as are needed."""

import itertools
from dataclasses import dataclass

import numpy as np

from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.readings import FloatArray, IntArray
from imucal_wizard.solver.extended.terms import Term, columns_of
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.solver.extended.turn_model import TurnPoint, closing_slope

COARSE = 1.0 / 30.0
"""A hand does nothing faster than this, s."""


@dataclass(frozen=True, eq=False)
class Levers:
    """How rates at some moments turn the closures.

    Attributes:
        weights: of the moments' rates, s, shape (3, k, 3).
        offsets: first moment of each rotation, and k, shape (m + 1,).
        motion: circumstances of the moments.
    """

    weights: FloatArray
    offsets: IntArray
    motion: Circumstances


def levers(data: TurnData, point: TurnPoint) -> Levers:
    """At every sample."""
    return Levers(point.weights, data.samples.offsets, point.motion(data))


def coarse_levers(data: TurnData, point: TurnPoint) -> Levers:
    """At some 30 moments a second, what lies between them being taken as straight.

    Enough for the derivative by an effect that is not in the model yet, at a fraction of the cost.
    """
    samples = data.samples
    every = max(int(np.round(COARSE / max(float(np.median(samples.dt)), 1e-9))), 1)
    nodes, offsets = [], [0]
    for first, past in itertools.pairwise(samples.offsets.tolist()):
        own = np.append(np.arange(first, past - 1, every), past - 1)
        nodes.append(own)
        offsets.append(offsets[-1] + len(own))
    chosen = np.concatenate(nodes)
    left = np.searchsorted(chosen, np.arange(len(samples.time)), side="right") - 1
    right = np.minimum(left + 1, len(chosen) - 1)
    length = np.maximum(samples.time[chosen[right]] - samples.time[chosen[left]], 1e-12)
    share = np.where(chosen[left] == np.arange(len(left)), 0.0, 1.0)
    share *= (samples.time - samples.time[chosen[left]]) / length
    ahead = np.add.reduceat(share[:, None] * point.weights, chosen, axis=1)
    weights = np.add.reduceat((1.0 - share[:, None]) * point.weights, chosen, axis=1)
    weights[:, 1:] += ahead[:, :-1]
    return Levers(weights, np.array(offsets), point.motion(data).select(chosen))


def effect_columns(
    data: TurnData, point: TurnPoint, term: Term, lever: Levers
) -> tuple[FloatArray, FloatArray]:
    """Derivative by an effect's sizes: of the closures (m, 3, p), of the still means (h, 3, p)."""
    moving = columns_of(term, "gyroscope", lever.motion)
    count = moving.shape[2]
    turned = np.empty((len(data), 3, count))
    for index in range(len(data)):
        part = slice(int(lever.offsets[index]), int(lever.offsets[index + 1]))
        own = lever.weights[:, part].reshape(3, -1)
        turned[index] = -own @ moving[part].reshape(-1, count)
    return closing_slope(data, point, turned), -columns_of(term, "gyroscope", data.circumstances)
