"""The gyroscope with effects: ``w = M (y − b) − ε(w, f, T, t)``, closures and still means.

At each sample of a rotation the force is gravity carried there by the attitude. ``ε`` is taken at
the rates and forces of the point before; it is so small against them that each further point, as
the fit comes to rest, adds two or three digits.

A change δw of the rates turns the carried up direction ``û`` by ``û × ψ``, ``ψ = Cᵀ Σ L ∫δw dt``
(see ``closure``). With ``Σ L ∫ … dt`` written as weights of the samples, the derivative by anything
is one product of these weights with what it does to each sample's rate. The derivative leaves out
what δw does to ε itself and to the coning: some thousandths of it.
"""

import itertools
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import IntArray, attitudes, matrices, quaternions
from imucal_wizard.solver.closure import LEVI_CIVITA, averaged, between, carry, error_slope
from imucal_wizard.solver.extended.terms import Term, Terms, columns_of
from imucal_wizard.solver.extended.turn_data import TurnData

COARSE = 1.0 / 30.0
"""A hand does nothing faster than this, s."""


@dataclass(frozen=True, eq=False)
class TurnPoint:
    """One calibration.

    Attributes:
        matrix: M, shape (3, 3).
        bias: b, shape (3,).
        sizes: of the effects, shape (p,).
        rate: corrected rate of each sample, rad/s, shape (n, 3).
        force: specific force at each sample, m/s², shape (n, 3).
        ends: rotation from the hold before to the hold after, shape (m, 3, 3).
        closure: closure error of each rotation, rad, shape (m, 3).
        still: corrected mean rate of each hold, which should be zero, rad/s, shape (h, 3).
        weights: ``Σ L ∫ … dt`` as weights of the samples, s, shape (3, n, 3).
    """

    matrix: FloatArray
    bias: FloatArray
    sizes: FloatArray
    rate: FloatArray
    force: FloatArray
    ends: FloatArray
    closure: FloatArray
    still: FloatArray
    weights: FloatArray

    def motion(self, data: TurnData) -> Circumstances:
        """The circumstances of the samples at this point."""
        return replace(data.motion, rate=self.rate, force=self.force)


def point_at(
    data: TurnData,
    terms: Terms,
    matrix: FloatArray,
    bias: FloatArray,
    sizes: FloatArray,
    near: TurnPoint | None = None,
) -> TurnPoint:
    """Closures and still means at one calibration.

    Args:
        data: the measurements.
        terms: the effects.
        matrix: M.
        bias: b.
        sizes: of the effects.
        near: a point whose rates and forces the effects are taken at.
    """
    samples = data.samples
    rate = (samples.reading - bias) @ matrix.T
    still = (data.stills - bias) @ matrix.T
    if len(terms):
        motion = data.motion if near is None else near.motion(data)
        rate = rate - terms.columns(motion) @ sizes
        still = still - terms.columns(data.circumstances) @ sizes
    before, after = attitudes(quaternions(samples.turned(rate)), samples.step_offsets)
    ends = np.moveaxis(matrices(after[:, samples.step_offsets[1:] - 1]), -1, 0)
    turned = matrices(samples.at_samples(before, after))
    up = np.einsum("ijn,ni->nj", turned, data.before[samples.rotation])
    weights = samples.spread(averaged(before, after)).reshape(3, 3, -1)
    return TurnPoint(
        matrix=matrix,
        bias=bias,
        sizes=sizes,
        rate=rate,
        force=data.gravity * up,
        ends=ends,
        closure=between(carry(ends, data.before), data.after),
        still=still,
        weights=np.ascontiguousarray(np.moveaxis(weights, 1, 2)),
    )


def settled_point(
    data: TurnData, terms: Terms, matrix: FloatArray, bias: FloatArray, sizes: FloatArray
) -> TurnPoint:
    """The same with the effects at this point's own rates and forces."""
    point = point_at(data, terms, matrix, bias, sizes)
    for _ in range(4 if len(terms) else 0):
        point = point_at(data, terms, matrix, bias, sizes, point)
    return point


def base_columns(data: TurnData, point: TurnPoint) -> tuple[FloatArray, FloatArray]:
    """Derivative by M's nine entries and the biases: of closures (m, 3, 12), of stills (h, 3, 12).

    ``∂w/∂M_ij = e_i (y − b)_j`` and ``∂w/∂b = −M``.
    """
    samples = data.samples
    offset = samples.reading - point.bias
    turned = np.empty((len(data), 3, 12))
    for index in range(len(data)):
        part = slice(int(samples.offsets[index]), int(samples.offsets[index + 1]))
        lever = point.weights[:, part]
        turned[index, :, :9] = (np.swapaxes(lever, 1, 2) @ offset[part]).reshape(3, 9)
        turned[index, :, 9:] = -lever.sum(axis=1) @ point.matrix
    still = np.zeros((len(data.stills), 3, 12))
    for axis in range(3):
        still[:, axis, 3 * axis : 3 * axis + 3] = data.stills - point.bias
    still[:, :, 9:] = -point.matrix
    return _closing(data, point, turned), still


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
    return _closing(data, point, turned), -columns_of(term, "gyroscope", data.circumstances)


def doubt_columns(data: TurnData, point: TurnPoint) -> FloatArray:
    """Change of the closures with each doubt about the accelerometer, shape (m, 3, k)."""
    before, after = data.before_doubt, data.after_doubt
    carried = carry(point.ends, data.before)
    moved = np.einsum("mji,mjk->mik", point.ends, before)
    # the error runs from the carried to the measured direction: it falls with the one, and moves
    # with the other as the other way round
    return np.asarray(
        error_slope(carried, data.after, moved) - error_slope(data.after, carried, after)
    )


def _closing(data: TurnData, point: TurnPoint, turned: FloatArray) -> FloatArray:
    """Derivative of the closures from ``Σ L ∫ ∂w dt``, shape (m, 3, p)."""
    psi = np.einsum("mji,mjp->mip", point.ends, turned)
    carried = carry(point.ends, data.before)
    return np.asarray(
        error_slope(carried, data.after, np.einsum("iab,ma,mbp->mip", LEVI_CIVITA, carried, psi))
    )
