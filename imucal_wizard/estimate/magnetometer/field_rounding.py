"""What coarse steps of a magnetometer do to the means of its groups.

The samples of a rest share what rounding does to them. In motion readings pass many steps, and it
averages out, but for the steps at which a reading stays for a while.
"""

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.estimate.magnetometer.pieces import Pieces
from imucal_wizard.measurement.rounding import (
    resolution_of,
    rounding_covariance,
    rounding_variance,
    variance_before_rounding,
)

WHOLE = 0.01
"""Of a step, by which a whole number of steps may be off: readings are printed with few digits."""
MIN_ROUNDING_SHARE = 0.01
"""Variance by rounding over that of a group by noise, below which rounding is no matter."""
PLACE_STEPS = 0.5
"""Steps by which a calibration through rounded rests may be wrong in one direction."""
TURNING_WEIGHT = 1e-6
"""Weight of a direction in a turn against one at rest, in the mean direction of a group: it decides
only where the group has no rest."""


@dataclass(frozen=True, eq=False)
class FieldRounding:
    """Errors of the groups' mean magnitudes by the steps of the readings.

    Attributes:
        step: of the readings on each axis, 0 for none, shape (3,).
        before: variance of single readings at rest before rounding, shape (3,).
        shift: variance of a mean reading of a rest by rounding, shape (3,).
        resting: share of the rest's error in the mean of each piece, shape (p, 3).
        inward: by how much a group's magnitude moves with each axis at rest, shape (k, 3).
        rounded: variance of each group by what its rests share, shape (k,).
        passing: variance of each group by the steps that it passes, of its own, shape (k,).
    """

    step: FloatArray
    before: FloatArray
    shift: FloatArray
    resting: FloatArray
    inward: FloatArray
    rounded: FloatArray
    passing: FloatArray

    def shared(
        self,
        pieces: Pieces,
        magnetic: FloatArray,
        calibration: tuple[FloatArray, FloatArray],
        magnitude: float,
        own: FloatArray,
    ) -> FloatArray:
        """By how much independent errors of variance one move the groups, shape (k, r).

        Args:
            pieces: the pieces.
            magnetic: the corrected field of each, shape (p, 3).
            calibration: M and b, about right.
            magnitude: of the field.
            own: variance of each group without the part that rests share, shape (k,).
        """
        if not (self.rounded > MIN_ROUNDING_SHARE * own).any():
            return np.zeros((len(own), 0))
        there = unit_vectors(magnetic) * (self.resting.T[:, :, None] + TURNING_WEIGHT)
        places = np.moveaxis(unit_vectors(pieces.mean(np.moveaxis(there, 0, 1))), 1, 0)
        return _shared_rounding(places, calibration, magnitude, self.inward, self.before, self.step)


def field_rounding(
    pieces: Pieces, values: FloatArray, scatter: FloatArray, inward: FloatArray
) -> FieldRounding:
    """What the steps of the readings do to each group.

    Args:
        pieces: the pieces.
        values: the readings that they are made of, shape (n, 3).
        scatter: variance of these readings within each group, shape (k, 3).
        inward: by how much a group's magnitude moves with the readings of each axis, shape (k, 3).
    """
    step = _steps(values, scatter)
    before = variance_before_rounding(_noise_at_rest(pieces, values, scatter < step**2), step)
    shift = rounding_variance(before, step)
    near = np.abs(pieces.reading - pieces.spread(pieces.medians(pieces.reading))) < 0.5 * step
    left = _left_by_motion(pieces, step)
    passing = (inward**2 * shift * _of_runs(pieces, ~near * left, step)).sum(axis=1)
    resting = near * left
    at_rest = inward * pieces.mean(resting)
    rounded = (at_rest**2 * shift).sum(axis=1)
    return FieldRounding(step, before, shift, resting, at_rest, rounded, passing)


def _steps(values: FloatArray, scatter: FloatArray) -> FloatArray:
    """Step of the readings on each axis, 0 for none, shape (3,).

    Where most readings change from one pose to the next only, the least change is a step if all
    readings are whole numbers of it apart.
    """
    step = resolution_of(values)
    apart = (values - values[0]) / np.where(step > 0.0, step, 1.0)
    whole = (np.abs(apart - np.round(apart)) < WHOLE).all(axis=0)
    change = np.array([median(axis) for axis in scatter.T]) > (WHOLE * step) ** 2
    return np.where(whole | change, step, 0.0)


def _noise_at_rest(pieces: Pieces, values: FloatArray, still: BoolArray) -> FloatArray:
    """Variance of single readings of each axis in the groups in which it is still, shape (3,).

    A hand moves a coarse axis by less than a step while its readings still change: that is no noise
    that would carry them from one step to the next. Infinite where no group is still.
    """
    out = np.full(3, np.inf)
    for axis in np.flatnonzero(still.any(axis=0)):
        variance, freedom = pieces.noise(values[:, axis])
        weight = freedom * still[:, axis]
        out[axis] = weight @ variance / max(float(weight.sum()), 1.0)
    return out


def _left_by_motion(pieces: Pieces, step: FloatArray) -> FloatArray:
    """Share of the error by rounding that the mean of each piece has, shape (p, 3): 1 at rest.

    A reading that passes a whole step while a piece lasts has none left in its mean.
    """
    change = np.abs(np.diff(pieces.reading, axis=0)) / np.where(step > 0.0, step, np.inf)
    end = np.full((1, 3), np.inf)
    # a reading that goes on by a whole step at one end of a piece may have stood still until then
    passed = np.minimum(np.concatenate([end, change]), np.concatenate([change, end]))
    return np.asarray(np.sinc(np.minimum(passed, 1.0)))


def _of_runs(pieces: Pieces, left: FloatArray, step: FloatArray) -> FloatArray:
    """Variance of a group's mean by rounding, over that of a reading, shape (k, 3).

    Pieces that follow one another at one step share their error; those at other steps have others.

    Args:
        pieces: the pieces.
        left: share of the error that the mean of each has, shape (p, 3).
        step: of the readings, shape (3,).
    """
    out = np.zeros((len(pieces.offsets) - 1, 3))
    of_group = np.repeat(np.arange(len(out)), np.diff(pieces.offsets))
    for axis in range(3):
        begins = np.append(True, np.abs(np.diff(pieces.reading[:, axis])) > 0.5 * step[axis])
        begins[pieces.offsets[:-1]] = True
        starts = np.flatnonzero(begins)
        runs = np.add.reduceat(left[:, axis] * pieces.count, starts)
        out[:, axis] = np.bincount(of_group[starts], runs**2, len(out))
    return out / pieces.samples[:, None] ** 2


def _shared_rounding(
    places: FloatArray,
    calibration: tuple[FloatArray, FloatArray],
    magnitude: float,
    inward: FloatArray,
    before: FloatArray,
    step: FloatArray,
) -> FloatArray:
    """By how much independent errors of variance one, by rounding, move the groups, shape (k, r).

    Where between two steps a rest reads, the direction of the field says: at a face, the shift of a
    reading does not move it. So the visits to a face have their shift in common.

    Args:
        places: direction of the field while each axis rests in each group, shape (3, k, 3).
        calibration: M and b, about right.
        magnitude: of the field.
        inward: by how much a group moves with the readings of each axis at rest, shape (k, 3).
        before: variance of the readings before rounding, shape (3,).
        step: of the readings, shape (3,).
    """
    matrix, bias = calibration
    inverse = np.linalg.inv(matrix)
    shift = rounding_variance(before, step)
    shared = np.zeros((len(inward), len(inward)))
    for axis in np.flatnonzero(shift):
        seen = places[axis]
        # a shift of the readings moves the direction, and with it the place, across the field only
        across = np.eye(3)[axis] - (seen @ inverse[axis])[:, None] * (seen @ matrix)
        moved = across**2 @ shift
        turned = ((seen[:, None] - seen) ** 2).sum(axis=2)
        place = bias[axis] + magnitude * seen @ inverse[axis]
        # rests in one orientation are moved alike
        error = np.sqrt(moved)
        length = magnitude * np.linalg.norm(inverse[axis])
        alike = np.exp(-0.5 * (2.0 * np.pi * length / step[axis]) ** 2 * turned)
        doubt = np.add.outer(error**2, error**2) - 2.0 * np.outer(error, error) * alike
        doubt += (PLACE_STEPS * step[axis]) ** 2 * turned
        apart = np.subtract.outer(place, place)
        common = rounding_covariance(before[axis], step[axis], apart, doubt)
        np.fill_diagonal(common, shift[axis])
        shared += np.outer(inward[:, axis], inward[:, axis]) * common
    values, vectors = np.linalg.eigh(shared)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
