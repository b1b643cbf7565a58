"""The gyroscope with effects: ``w = M (y − b) − ε(w, f, T, t)``, closures and still means.

At each sample of a rotation the force is gravity carried there by the attitude. ``ε`` is taken at
the rates and forces of the point before; it is so small against them that each further point, as
the fit comes to rest, adds two or three digits.

A change δw of the rates turns the carried up direction ``û`` by ``û × ψ``, ``ψ = Cᵀ Σ L ∫δw dt``
(see ``closure``). With ``Σ L ∫ … dt`` written as weights of the samples, the derivative by anything
is one product of these weights with what it does to each sample's rate. The derivative leaves out
what δw does to ε itself and to the coning: some thousandths of it.
"""

from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.attitude import attitudes
from imucal_wizard.solver.closure import LEVI_CIVITA, averaged, between, carry, error_slope
from imucal_wizard.solver.extended.terms import Terms
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.solver.quaternions import matrices, quaternions


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
    return closing_slope(data, point, turned), still


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


def closing_slope(data: TurnData, point: TurnPoint, turned: FloatArray) -> FloatArray:
    """Derivative of the closures from ``Σ L ∫ ∂w dt``, shape (m, 3, p)."""
    psi = np.einsum("mji,mjp->mip", point.ends, turned)
    carried = carry(point.ends, data.before)
    return np.asarray(
        error_slope(carried, data.after, np.einsum("iab,ma,mbp->mip", LEVI_CIVITA, carried, psi))
    )
