"""One fit of the accelerometer: the data, the model chosen for them, and how to solve it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.poses import FACES, POSE_TOLERANCE_DEG
from imucal_wizard.readings import ENDLESS, BoolArray, FloatArray, IntArray
from imucal_wizard.solver.by_ellipsoid import ELLIPSOID_METHODS, all_or_no_angles, by_ellipsoid
from imucal_wizard.solver.carried import Carried, decide
from imucal_wizard.solver.directions import group_directions, unit_vectors
from imucal_wizard.solver.least_squares import Solution, least_squares
from imucal_wizard.solver.magnitude import Problem, corrected, make_problem, triangle
from imucal_wizard.solver.newton import newton
from imucal_wizard.solver.noise import hold_noise
from imucal_wizard.solver.start import sphere

ANGLE_XZ = 5
"""Place of ``M_xz``, the one entry in which two angles meet."""
ROUNDS = 10


@dataclass(frozen=True, eq=False)
class Task:
    """A fit to be made.

    Attributes:
        problem: the mean readings of the holds.
        start: parameters to start from, shape (9,).
        carried: the model.
        labels: number of each hold's direction, shape (n,).
        weights: square root of each hold's weight, shape (n,).
        method: ``least_squares``, ``newton``, or one of the ellipsoid methods.
    """

    problem: Problem
    start: FloatArray
    carried: Carried
    labels: IntArray
    weights: FloatArray
    method: str

    def solve(self, keep: BoolArray | None = None, start: FloatArray | None = None) -> Solution:
        """Fit all points, or those kept.

        Where the angle between x and z is left at zero but the other two are not, ``M_xz`` is their
        product and not zero (Q, eq. 8); it is then set and the rest fitted again.
        """
        solution = self._solve(keep, self.start if start is None else start)
        for _ in range(ROUNDS):
            nominal = solution.theta.copy()
            nominal[ANGLE_XZ] = nominal[4] * nominal[7] / nominal[6]
            bent = abs(nominal[ANGLE_XZ] - solution.theta[ANGLE_XZ])
            if ANGLE_XZ in self.carried.places or bent < 1e-12:
                break
            again = self._solve(keep, nominal)
            solution = replace(again, iterations=solution.iterations + again.iterations)
        return solution

    def _solve(self, keep: BoolArray | None, begin: FloatArray) -> Solution:
        points, weights = self.problem.points, self.weights
        if keep is not None:
            points, weights = points[keep], weights[keep]
        if self.method in ELLIPSOID_METHODS:
            return by_ellipsoid(self.method, points, self.carried.places)
        if self.method == "newton":
            return newton(points, begin, self.carried.basis)
        return least_squares(points, begin, self.carried.basis, weights)

    def leaders(self, theta: FloatArray) -> FloatArray:
        """One up direction for each distinct direction, shape (d, 3)."""
        return _leaders(up_directions(theta, self.problem.points), self.labels)


def make_task(holds: Sequence[Hold], gravity: float, method: str) -> Task:
    """The fit of these holds, with the model they carry.

    Raises:
        DataError: they do not carry a calibration.
    """
    means = np.array([hold.accelerometer for hold in holds], float).reshape(-1, 3)
    check_means(means)
    problem = make_problem(means, gravity)
    start = sphere(problem)
    if triangle(start)[0, 0] <= 0.0:
        raise DataError("the still positions do not lie around one centre: check the columns")
    up = up_directions(start, problem.points)
    labels = group_directions(up)
    noise = float(np.sqrt(hold_noise(holds).accelerometer.mean())) / problem.span
    carried = decide(_leaders(up, labels), noise)
    if method in ELLIPSOID_METHODS:
        carried = all_or_no_angles(carried)
    return Task(problem, start, carried, labels, np.ones(len(means)), method)


FLAT = 0.02
"""Extent of the readings in one direction, relative to the largest, that is none: 1° of tilt."""


def check_means(means: FloatArray) -> None:
    """Refuse holds from which no fit can begin.

    Raises:
        DataError: too few, not numbers, or an axis that is dead.
    """
    if len(means) < 4:
        raise DataError(
            f"{len(means)} still position{'s' * (len(means) != 1)} found; at least six are needed. "
            "Hold the device still for two seconds with each of its six faces up"
        )
    if not (np.abs(means) < ENDLESS).all():
        raise DataError("the accelerometer's readings are not all numbers: check the columns")
    spread = np.ptp(means, axis=0)
    if spread.max() <= 1e-12 * np.abs(means).max():
        raise DataError("the accelerometer always reads the same: it is dead or not connected")
    if (spread < FLAT * spread.max()).any():
        dead = ", ".join(a for a, s in zip("xyz", spread, strict=True) if s < FLAT * spread.max())
        raise DataError(
            f"accelerometer axis {dead} hardly changes between the positions: turn the device so "
            "that it points up and down, and check the axis if you did"
        )
    extent = np.linalg.svd(means - means.mean(axis=0), compute_uv=False)
    if extent[-1] < FLAT * extent[0]:
        raise DataError(
            "the still positions lie in one plane: some direction never sees gravity. Hold the "
            "device still with each of its six faces up"
        )


def face_rows(up: FloatArray) -> dict[str, list[int]]:
    """Which holds have each face on top, by up direction; faces without any are left out."""
    found = {}
    for name, direction in FACES.items():
        rows = np.flatnonzero(up @ direction > np.cos(np.radians(POSE_TOLERANCE_DEG)))
        if len(rows):
            found[name] = rows.tolist()
    return found


def up_directions(theta: FloatArray, points: FloatArray) -> FloatArray:
    """Unit up vector of each point, shape (n, 3).

    Raises:
        DataError: a reading is no direction at all.
    """
    vectors = corrected(theta, points)
    lengths = np.linalg.norm(vectors, axis=1)
    if not (lengths > 1e-6).all():
        raise DataError(
            "a still position reads no gravity at all: its readings are the centre of all others. "
            "Check the columns, and measure that position again"
        )
    return np.asarray(vectors / lengths[:, None])


def _leaders(up: FloatArray, labels: IntArray) -> FloatArray:
    """The middle of each direction's holds, shape (d, 3), so that no single hold decides."""
    sums = np.zeros((int(labels.max()) + 1, 3))
    np.add.at(sums, labels, up)
    return unit_vectors(sums)
