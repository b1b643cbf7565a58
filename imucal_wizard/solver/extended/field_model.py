"""The magnetometer with effects: magnitude of each group, dip of each still pose.

``x = M (y − b) − ε(x)`` with M symmetric, in the magnetometer's own axes. A group's row is the mean
of ``|x| − B``; a still pose's is ``B (u·x/|x| − s)``, u being up and ``s = −sin(dip)`` one number
for the place. The noise of the field moves the one along the field, the other across it, so that
both rows of the same samples are independent.
"""

from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.effects.effect import Effect
from imucal_wizard.ellipsoid.shape import TRIANGLE
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.result import corrected
from imucal_wizard.solver.extended.terms import Term, Terms, columns_of

SENSOR = "magnetometer"


@dataclass(frozen=True, eq=False)
class FieldPoint:
    """A calibration and what it makes of the readings.

    Attributes:
        matrix: M, µT per reading, shape (3, 3).
        bias: b, reading, shape (3,).
        level: s, in units of the field.
        sizes: of the effects, shape (p,).
        turning: corrected field of the pieces, µT, shape (q, 3).
        still: corrected mean field of the still poses, µT, shape (h, 3).
        residual: of the groups, then of the still poses, µT, shape (k + h,).
    """

    matrix: FloatArray
    bias: FloatArray
    level: float
    sizes: FloatArray
    turning: FloatArray
    still: FloatArray
    residual: FloatArray


def point_at(
    data: FieldData,
    terms: Terms,
    matrix: FloatArray,
    bias: FloatArray,
    sizes: FloatArray,
    level: float | None = None,
) -> FieldPoint:
    """The residuals of a calibration; the level that fits best where none is given."""
    calibration, each = (matrix, bias), terms.split(sizes)
    args = (SENSOR, calibration, terms.terms, each)
    turning = corrected(*args, data.pieces.reading, data.samples)
    still = corrected(*args, data.dips.reading, data.still)
    size = np.linalg.norm(turning, axis=1) + data.pieces.extra
    sine = (data.dips.up * _unit(still)).sum(axis=1)
    level = (float(sine.mean()) if len(sine) else 0.0) if level is None else level
    residual = np.concatenate([data.pieces.mean(size) - data.field, data.field * (sine - level)])
    return FieldPoint(matrix, bias, level, sizes, turning, still, residual)


@dataclass(frozen=True, eq=False)
class Levers:
    """How the rows move with a change of the corrected field: of pieces (q, 3), of poses (h, 3)."""

    turning: FloatArray
    still: FloatArray


def levers(data: FieldData, point: FieldPoint) -> Levers:
    """Along the field for a magnitude, across it and towards up for a dip."""
    still = _unit(point.still)
    sine = (data.dips.up * still).sum(axis=1)[:, None]
    size = np.maximum(np.linalg.norm(point.still, axis=1), 1e-12)[:, None]
    return Levers(_unit(point.turning), data.field * (data.dips.up - sine * still) / size)


def rows_of(data: FieldData, lever: Levers, pieces: FloatArray, still: FloatArray) -> FloatArray:
    """Rows from changes of the field of the pieces (q, 3, p) and of the poses (h, 3, p)."""
    first = data.pieces.mean(np.einsum("qi,qip->qp", lever.turning, pieces))
    return np.concatenate([first, np.einsum("hi,hip->hp", lever.still, still)])


def shown(data: FieldData, lever: Levers) -> FloatArray:
    """How much of an error of each axis the rows show, shape (k + h, 3)."""
    return np.concatenate([data.pieces.mean(lever.turning), lever.still])


def base_columns(data: FieldData, point: FieldPoint, lever: Levers) -> FloatArray:
    """Derivative of the rows by b, in µT, and M's six entries, times the gain, (k + h, 9)."""

    def moved(readings: FloatArray) -> FloatArray:
        offset = data.gain * (readings - point.bias)
        out = np.zeros((len(readings), 3, 9))
        out[:, :, :3] = -point.matrix / data.gain
        for place, (i, j) in enumerate(TRIANGLE, 3):
            out[:, i, place] = offset[:, j]
            out[:, j, place] = offset[:, i]
        return out

    return rows_of(data, lever, moved(data.pieces.reading), moved(data.dips.reading))


def effect_columns(
    data: FieldData, point: FieldPoint, lever: Levers, effect: Effect, variant: float | None
) -> FloatArray:
    """Derivative of the rows by the sizes of an effect, shown units, shape (k + h, p)."""
    term = Term(effect, variant)
    pieces = columns_of(term, SENSOR, replace(data.samples, magnetic=point.turning))
    still = columns_of(term, SENSOR, replace(data.still, magnetic=point.still))
    return -rows_of(data, lever, pieces, still)


def place_columns(data: FieldData, point: FieldPoint) -> FloatArray:
    """Derivative by the level, in µT, and by each doubt about up, shape (k + h, 1 + d)."""
    count = len(data)
    doubts = np.einsum("hi,hid->hd", _unit(point.still), data.dips.doubt)
    out = np.zeros((count + len(data.dips), 1 + doubts.shape[1]))
    out[count:, 0] = -1.0
    out[count:, 1:] = data.field * doubts
    return out if len(data.dips) else np.zeros((count, 0))


def _unit(vectors: FloatArray) -> FloatArray:
    size = np.maximum(np.linalg.norm(vectors, axis=-1), 1e-12)
    return np.asarray(vectors / size[..., None])
