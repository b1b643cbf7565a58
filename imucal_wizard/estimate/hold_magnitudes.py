"""Mean readings of holds, by which a published method of the accelerometer is made and judged."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.directions import mean_directions
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.poses import FACES, POSE_TOLERANCE_DEG
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.estimate.accelerometer import (
    ENTRY_OF,
    PARAMETERS,
    PLACES,
    AccelerometerExperiment,
    accelerometer_experiment,
)
from imucal_wizard.estimate.fit import nominal_columns
from imucal_wizard.estimate.gauge import triangular
from imucal_wizard.estimate.held_out import groups_by_size
from imucal_wizard.estimate.magnitude import (
    Problem,
    in_triangle,
    make_problem,
    residuals,
    sphere,
    triangle,
)
from imucal_wizard.estimate.method_data import Estimator, MethodEstimate
from imucal_wizard.estimate.methods import method_of
from imucal_wizard.estimate.parameters import converted_covariance, with_errors
from imucal_wizard.estimate.result import GravityReference, SensorFit
from imucal_wizard.estimate.split import principal_steps
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.model.identifiability import EDGES_OF, amplification, basis_of
from imucal_wizard.model.rows.gravity_magnitude import MagnitudeRows
from imucal_wizard.model.rows.source import ENTRIES, Parameters
from imucal_wizard.model.terms import Terms

NEEDS_ALL = "needs all of these positions, so none could be left out to check it"
SLOPE_STEP = 1e-3
"""Change of a reading, in units of gravity, by which the derivative of a method is taken."""
MAX_AMPLIFICATION = 42.0
"""Of a hold's noise by the other directions, beyond which the error of one left out shows only
the gap that it leaves: usual noise (1 mg) would then pass for a usual bias (42 mg)."""


def fit_by_method(holds: Sequence[Hold], gravity: float, unit: str, method: str) -> SensorFit:
    """The accelerometer by a published method.

    Args:
        holds: still periods.
        gravity: local gravity, m/s².
        unit: of the readings, ``m/s^2`` or ``count``.
        method: one of ``estimate.methods``.

    Raises:
        DataError: the holds do not determine a calibration by this method.
        UsageError: no method of that name.
    """
    published = method_of("accelerometer", method)
    experiment = accelerometer_experiment(holds, gravity, unit)
    problem = make_problem(experiment.source.reading, gravity)
    identified = experiment.identified
    if not set(PLACES["scale"]) <= set(identified.places):
        raise DataError(
            "the still positions do not determine a scale for each axis, which this method needs: "
            "hold the device still with each of its six faces up, or use least_squares"
        )
    free, reason = identified.places, identified.reason
    angles = set(PLACES["non-orthogonality"])
    if angles & set(free) and not angles <= set(free):
        # all off-diagonal terms or none (N, VII-A)
        free = (*PLACES["bias"], *PLACES["scale"])
        between = "; ".join(EDGES_OF[place] for place in PLACES["non-orthogonality"])
        reason = (
            "these holds do not determine all angles, and this method fits all or none: the "
            f"angles are zero. Add holds with the edges between these faces on top: {between}"
        )
    return published.run(HoldMagnitudes(experiment, problem, free, reason))


@dataclass(frozen=True, eq=False)
class HoldMagnitudes:
    """See ``method_data.Magnitudes``.

    Attributes:
        experiment: the same holds as rows.
        problem: their means, dimensionless.
        free: which of b and M's xx, xy, xz, yy, yz, zz are fitted.
        reason: why not all of them, in one sentence, or "".
    """

    experiment: AccelerometerExperiment
    problem: Problem
    free: tuple[int, ...]
    reason: str

    @property
    def points(self) -> FloatArray:
        """Dimensionless mean readings, shape (n, 3)."""
        return self.problem.points

    @property
    def cross(self) -> bool:
        """Whether the angles are fitted."""
        return set(PLACES["non-orthogonality"]) <= set(self.free)

    @property
    def start(self) -> FloatArray:
        """The sphere nearest to the points."""
        return sphere(self.problem)

    @property
    def faces(self) -> dict[str, IntArray]:
        """Holds with each face on top; faces without any are left out."""
        found = {}
        for name, direction in FACES.items():
            up = self.experiment.up @ direction
            rows = np.flatnonzero(up > np.cos(np.radians(POSE_TOLERANCE_DEG)))
            if len(rows):
                found[name] = rows
        return found

    def without_angles(self, reason: str) -> "HoldMagnitudes":
        """The same with bias and scale alone free."""
        return replace(self, free=(*PLACES["bias"], *PLACES["scale"]), reason=reason)

    def judged(self, method: str, estimate: Estimator, biased: bool = False) -> SensorFit:
        """The result of a method; its standard errors follow from what noise of each hold does."""
        experiment, points = self.experiment, self.points
        gravity, every = self.problem.magnitude, np.arange(len(points))
        labels = experiment.source.labels.group

        def theta_of(points: FloatArray, rows: IntArray) -> FloatArray:
            found: MethodEstimate = estimate(points, rows)
            return np.concatenate([found.bias, in_triangle(triangular(found.matrix)[1])])

        # the parameters by this method, and the errors that they leave
        found, theta = estimate(points, every), theta_of(points, every)
        matrix, bias = self.problem.matrix_and_bias(theta)
        rows = experiment.source.at(Parameters(matrix, bias), Terms(experiment.sensor, ()))
        before = experiment.before()
        nominal = (experiment.source.reading - before.bias) @ before.matrix.T
        out, why = self._held_out(method, labels, lambda kept: theta_of(points, kept))

        # their covariance: the errors of the holds through the method's own derivative
        pull = self._pull(theta, lambda moved: theta_of(moved, every))
        unused = tuple(np.flatnonzero(~pull.any(axis=0)).tolist())
        used = np.delete(rows.residual, unused)
        floor, floor_fitted = self._floors(rows, pull)
        freedom = len(used) - len(self.free)
        variance = float(used @ used) / freedom if freedom > 0 else None
        covariance = whole = with_nominal = None
        if variance is not None and not biased:
            whole = np.zeros((ENTRIES, ENTRIES))
            whole[np.ix_(ENTRY_OF, ENTRY_OF)] = variance * pull @ pull.T
            modes = self._nominal_modes(rows, Parameters(matrix, bias), pull)
            if found.each_axis_alone:
                modes = modes[:, : modes.shape[1] // 2]
            common = np.zeros((ENTRIES, experiment.common_errors.shape[1]))
            common[list(ENTRY_OF)] = pull @ experiment.common_errors
            modes = np.concatenate([modes, common], axis=1)
            with_nominal = whole + modes @ modes.T
            covariance = with_nominal[np.ix_(ENTRY_OF, ENTRY_OF)]

        reference = self._reference(rows, variance, whole, pull)
        entries = Parameters(matrix, bias).entries

        def named(entries: FloatArray) -> dict[str, float]:
            return experiment.named(entries[:9].reshape(3, 3), entries[9:])

        dropped = [*experiment.directions(experiment.base_terms).dropped]
        dropped += [] if self.cross else PARAMETERS["non-orthogonality"]
        return SensorFit(
            sensor=experiment.sensor,
            model=("bias", "scale", *(("non-orthogonality",) if self.cross else ())),
            method=method,
            frame=experiment.frame,
            matrix=matrix,
            bias=bias,
            bias_unit=experiment.unit,
            parameters=with_errors(
                named,
                entries,
                with_nominal,
                experiment.unit_of,
                tuple(dict.fromkeys(dropped)),
            ),
            unit=experiment.error_unit,
            rms_before=root_mean_square(np.linalg.norm(nominal, axis=1) - gravity),
            rms_fitted=root_mean_square(rows.residual),
            rms_held_out=None if out is None else root_mean_square(out) * gravity,
            floor=None if out is None else floor,
            floor_fitted=floor_fitted,
            residuals=rows.residual,
            held_out=None if out is None else out * gravity,
            covariance=covariance,
            parameter_covariance=None
            if with_nominal is None
            else converted_covariance(named, entries, with_nominal),
            iterations=found.iterations,
            warnings=(self.reason,) if self.reason else (),
            degrees_of_freedom=max(freedom, 0),
            unused=unused,
            not_held_out=why,
            reference=reference,
            experiment=experiment,
        )

    def _reference(
        self,
        rows: MagnitudeRows,
        variance: float | None,
        covariance: FloatArray | None,
        pull: FloatArray,
    ) -> GravityReference:
        """Up in each hold; what is left beyond the measured noise counts as tilt.

        Args:
            rows: of the holds.
            variance: that the method leaves, (m/s²)²; None where nothing is left over.
            covariance: of M and b by it, shape (12, 12); None where it is not known.
            pull: see ``_pull``.
        """
        columns = rows.up_columns()[:, :, :ENTRIES]

        def referred(covariance: FloatArray | None, excess: float) -> GravityReference:
            doubt = np.zeros((len(columns), 3, 0))
            if covariance is not None:
                doubt = columns @ principal_steps(covariance)
            return self.experiment.referred(rows.direction, doubt, excess, basis_of(self.free))

        excess = max((variance or 0.0) - float(rows.own.mean()), 0.0)
        known = referred(covariance, excess)
        if not excess:
            return known
        alone = None
        if covariance is not None:
            alone = np.zeros((ENTRIES, ENTRIES))
            alone[np.ix_(ENTRY_OF, ENTRY_OF)] = pull * rows.own @ pull.T
        return replace(known, noise_alone=referred(alone, 0.0))

    def _nominal_modes(
        self, rows: MagnitudeRows, calibration: Parameters, pull: FloatArray
    ) -> FloatArray:
        """Errors of M and b by what the method leaves nominal, see ``Minimum.nominal_modes``."""
        left, none = self.experiment.left_by(self.free), Terms(self.experiment.sensor, ())
        shown = nominal_columns(self.experiment, [rows], calibration, none, left)
        modes = np.zeros((ENTRIES, shown.shape[1]))
        modes[list(ENTRY_OF)] = pull @ shown
        modes[:, : left.shape[1]] += left
        return modes

    def _floors(self, rows: MagnitudeRows, pull: FloatArray) -> tuple[float, float]:
        """Rms held out and fitted that measured noise makes, m/s², through the method's derivative.

        An error of a hold stays in it but for what the fit takes up; with the direction left out,
        as in least squares, ``(1 − H)⁻¹`` times what is then left.
        """
        kept = np.eye(len(rows.own)) + rows.base_columns()[:, list(ENTRY_OF)] @ pull
        slow = rows.loading()
        noise = np.diag(np.sqrt(rows.own))
        fitted = kept @ (noise if slow is None else np.column_stack([noise, slow.weight]))
        out = fitted.copy()
        for places in groups_by_size(self.experiment.source.labels.group):
            own = kept[places[:, :, None], places[:, None, :]]
            out[places] = np.linalg.pinv(own) @ fitted[places]
        held_out, of_fit = (root_mean_square(np.linalg.norm(one, axis=1)) for one in (out, fitted))
        return held_out, of_fit

    def _pull(self, theta: FloatArray, method: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """By how much an error of the magnitude of each hold moves each parameter, shape (9, n).

        In units of the parameters per m/s².
        """
        outward = np.linalg.solve(triangle(theta), self.experiment.up.T).T
        pull = np.empty((len(theta), len(outward)))
        for row, step in enumerate(SLOPE_STEP * outward):
            ahead, behind = self.points.copy(), self.points.copy()
            ahead[row] += step
            behind[row] -= step
            pull[:, row] = (method(ahead) - method(behind)) / (2.0 * SLOPE_STEP)
        scale = np.full(9, self.problem.magnitude / self.problem.span)
        scale[:3] = self.problem.span
        return np.asarray(pull * scale[:, None] / self.problem.magnitude)

    def _held_out(
        self, method: str, labels: IntArray, solve: Callable[[IntArray], FloatArray]
    ) -> tuple[FloatArray | None, str]:
        """Error of each hold under the method without the hold's direction, dimensionless."""
        up = mean_directions(self.experiment.up, labels)
        basis, errors = basis_of(self.free), np.empty(len(labels))
        for label in range(len(up)):
            kept = np.flatnonzero(labels != label)
            others = np.delete(up, label, axis=0)
            try:
                if amplification(others, basis).max() > MAX_AMPLIFICATION:
                    return None, f"the {method} method {NEEDS_ALL}"
                theta = solve(kept)
            except DataError:
                return None, f"the {method} method {NEEDS_ALL}"
            errors[labels == label] = residuals(theta, self.points[labels == label])
        return errors, ""
