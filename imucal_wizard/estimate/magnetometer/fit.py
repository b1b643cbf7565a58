"""The magnetometer's calibration: the one fit of its rows, or a published method judged by them."""

from dataclasses import field, replace

import numpy as np

from imucal_wizard.core.directions import farthest_from
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.poses import DIRECTIONS, nearest_pose
from imucal_wizard.core.quantities import plural, quantity, true_minus, unit_sign
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray, Readings, Series, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median, root_mean_square
from imucal_wizard.estimate.ellipsoid.coverage import BINS, centres
from imucal_wizard.estimate.ellipsoid.surface import (
    COLUMNS,
    ROWS,
    locate,
    radius_of,
    symmetric_matrix,
)
from imucal_wizard.estimate.fit import Minimum, fit, minimum, report
from imucal_wizard.estimate.gauge import symmetric
from imucal_wizard.estimate.held_out import HeldOut, held_out
from imucal_wizard.estimate.magnetometer.experiment import MagnetometerExperiment, StillPoses
from imucal_wizard.estimate.magnetometer.field_data import (
    FieldData,
    field_data,
)
from imucal_wizard.estimate.magnetometer.field_disturbances import LeftOut, line_of
from imucal_wizard.estimate.magnetometer.start import NO_ELLIPSOID, FieldStart, field_start
from imucal_wizard.estimate.magnetometer.surroundings import by_current, part_of_current, recorded
from imucal_wizard.estimate.method_data import Estimator, MethodEstimate
from imucal_wizard.estimate.methods import DEFAULTS, method_of
from imucal_wizard.estimate.parameters import converted_covariance, with_errors
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.second_stage.alignment import Alignment
from imucal_wizard.measurement.field_quality import check_field, missing_shell
from imucal_wizard.model.rows.source import Parameters
from imucal_wizard.model.terms import Terms

OFF_CENTRE = 0.3
"""How far from the middle the covered directions have their centre of gravity where one side is
empty: half a sphere has it at 0.5, three quarters at 0.25."""
ENOUGH_COVERED = 70
"""Areas of a hundred beyond which no gap needs a word."""
NOISY_FIELD = 0.03
"""Noise of a sample, as a share of the field, from which on it is worth a word: of the Earth's
field the noisiest chips in use have 0.02."""


@dataclass(frozen=True, eq=False)
class MagnetometerFit:
    """The fit and what belongs to a magnetometer alone.

    Attributes:
        fit: the result, in the sensor's own frame.
        start: the samples, and which of them are undisturbed.
        data: the rows of the fit.
        calm: which samples of a longer stream, of which only some were fitted, were undisturbed,
            shape (m,); None where all were fitted.
    """

    fit: SensorFit
    start: FieldStart
    data: FieldData
    calm: BoolArray | None = field(default=None, repr=False)

    @property
    def magnitude(self) -> float:
        """That corrected readings have: µT, or the reading's unit where det M = 1."""
        named = {one.name: one.value for one in self.fit.parameters}
        return named.get("field", self.data.field)

    @property
    def relative_error(self) -> float:
        """Rms of ``(|corrected| − B)/B`` over directions (N's figure of merit)."""
        return self.fit.rms_fitted / self.magnitude

    @property
    def relative_error_held_out(self) -> float | None:
        """The same on directions left out, or None."""
        out = self.fit.rms_held_out
        return None if out is None else out / self.magnitude

    @property
    def kept(self) -> BoolArray:
        """Which samples were fitted, shape (n,)."""
        return self.data.used

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """Those that were not, and when; sizes in the unit of corrected readings."""
        return self.data.left_out

    @property
    def filled(self) -> FloatArray:
        """Samples in each of the hundred areas of the sphere, shape (100,)."""
        return np.bincount(self.start.areas[self.kept], minlength=BINS).astype(float)

    @property
    def noise(self) -> float:
        """Standard deviation of one sample, from neighbours in time; unit of ``magnitude``."""
        distance = locate(self.start.theta, self.start.cloud.points)[0]
        both = self.start.kept[1:] & self.start.kept[:-1]
        steps = np.diff(distance)[both]
        share = float(np.sqrt(0.5 * np.mean(steps**2))) if len(steps) else 0.0
        return share / radius_of(self.start.theta) * self.magnitude

    @property
    def swings(self) -> float | None:
        """Frequency, Hz, of a swinging field that makes most of ``noise``, see ``line_of``."""
        distance = locate(self.start.theta, self.start.cloud.points)[0]
        time = self.start.series.time
        return line_of(np.where(self.start.kept, distance, 0.0), median(np.diff(time)))

    def aligned(self, alignment: Alignment, poses: StillPoses | None = None) -> SensorFit:
        """The result in the accelerometer's frame, with the dip of still poses as rows."""
        experiment = MagnetometerExperiment(self.data, alignment, poses)
        if self.fit.method == experiment.method:
            return replace(fit(experiment), warnings=self.fit.warnings)
        return replace(
            self.fit,
            experiment=experiment,
            frame=experiment.frame,
            model=(*self.fit.model, "misalignment"),
            matrix=alignment.rotation @ self.fit.matrix,
            parameters=(*self.fit.parameters, *experiment.settled),
            covariance=None,
        )

    @property
    def undisturbed(self) -> BoolArray:
        """Which samples of the whole stream were not disturbed."""
        return self.start.kept if self.calm is None else self.calm


def fit_magnetometer(
    series: Series,
    field: float | None = None,
    method: str = DEFAULTS["magnetometer"],
    readings: Readings | None = None,
) -> MagnetometerFit:
    """Fit ``|M (y − b)| = B``, M symmetric, to the samples of a turned device.

    Args:
        series: readings in the order of time, ``uT`` or ``count``, each once.
        field: magnitude of the local field, µT; without it ``det M = 1``.
        method: ``orthogonal``, or one of ``estimate.methods``.
        readings: the recording, for temperature, current and the session's beginning.

    Raises:
        DataError: the readings do not determine a calibration; the message says why.
        UsageError: no method of that name.
    """
    published = None if method == DEFAULTS["magnetometer"] else method_of("magnetometer", method)
    current = recorded(series.time, readings)[:, 1]
    part = part_of_current(current, by_current(series.values, current))
    start = field_start(series, part)
    warning = check_field(start.radius, series.unit, field)
    try:
        with np.errstate(all="ignore"):
            arrived = _arrived(field_data(start, field, readings))
            data = arrived.experiment.data
            if published is None:
                found = report(arrived)
                if not data.known:
                    found = replace(found, covariance=_covariance_at_unit_determinant(found))
            else:
                found = published.run(FieldMagnitudes(start, arrived.experiment, held_out(arrived)))
    except np.linalg.LinAlgError:
        raise missing_shell(series.values) or DataError(NO_ELLIPSOID) from None
    if not np.isfinite([*found.matrix.flat, *found.bias, *found.residuals]).all():
        raise DataError(NO_ELLIPSOID)
    if not np.linalg.eigvalsh(found.matrix)[0] > 0.0:
        raise DataError(NO_ELLIPSOID)
    result = MagnetometerFit(found, start, data)
    notes = (warning, start.model.reason, *_warnings(result))
    return replace(result, fit=replace(found, warnings=tuple(note for note in notes if note)))


def _arrived(data: FieldData) -> Minimum[MagnetometerExperiment]:
    """The fit without effects, of an unknown field at the magnitude by which ``det M = 1``."""
    found = minimum(MagnetometerExperiment(data))
    refined = found.experiment.refined(found)
    if refined is not found.experiment:
        found = minimum(refined)
    return found if data.known else minimum(refined.at_unit_determinant(found.calibration))


def _covariance_at_unit_determinant(found: SensorFit) -> FloatArray | None:
    """Covariance of b and M's six entries where ``det M = 1``, shape (9, 9).

    M then moves by ``δM − M tr(M⁻¹δM)/3`` where it would move by δM at a fixed magnitude.
    """
    if found.covariance is None:
        return None
    change = np.eye(9)
    inverse = np.linalg.inv(found.matrix)[ROWS, COLUMNS]
    twice = np.where(np.equal(ROWS, COLUMNS), 1.0, 2.0)
    change[3:, 3:] -= np.outer(found.matrix[ROWS, COLUMNS], inverse * twice) / 3.0
    return np.asarray(change @ found.covariance @ change.T)


def _size(data: FieldData, matrix: FloatArray) -> float:
    """By what M is divided: of an unknown field the determinant is 1."""
    return 1.0 if data.known else float(np.cbrt(np.linalg.det(matrix)))


@dataclass(frozen=True, eq=False)
class FieldMagnitudes:
    """Samples of the field, as a published method takes them (see ``method_data.Magnitudes``).

    A method uses all samples alike, as printed; its errors are those of the rows of the fit.

    Attributes:
        field_start: the samples, and what is known of them.
        experiment: the rows.
        left_out: what noise makes of these rows with each direction left out; None where the others
            do not determine the model.
    """

    field_start: FieldStart
    experiment: MagnetometerExperiment
    left_out: HeldOut | None

    @property
    def points(self) -> FloatArray:
        """Dimensionless samples, shape (n, 3)."""
        return np.ascontiguousarray(self.field_start.cloud.points.T)

    @property
    def free(self) -> tuple[int, ...]:
        """Parameters that these directions determine."""
        return self.field_start.model.places

    @property
    def cross(self) -> bool:
        """Whether the off-diagonal soft iron is among them."""
        return self.field_start.model.cross

    @property
    def start(self) -> FloatArray:
        """The robust ellipsoid."""
        return self.field_start.theta

    def judged(self, method: str, estimate: Estimator, biased: bool = False) -> SensorFit:
        """The result of a method, with each direction of the rows left out in turn.

        Its standard errors are those of the delete-a-group jackknife over the directions, in which
        the errors of a biased method show too.
        """
        del biased
        experiment, cloud, points = self.experiment, self.field_start.cloud, self.points
        data, source = experiment.data, experiment.magnitude
        label = source.labels.group
        of_sample = np.where(data.group_of < 0, -1, label[data.group_of])

        def calibration(rows: IntArray) -> tuple[Parameters, MethodEstimate]:
            one = estimate(points, rows)
            matrix = symmetric(one.matrix)[1] * (data.field / cloud.span)
            return Parameters(matrix, cloud.centre + cloud.span * one.bias), one

        def errors(one: Parameters) -> FloatArray:
            return source.at(one, Terms(experiment.sensor, ())).residual / _size(data, one.matrix)

        whole, found = calibration(np.arange(len(points)))
        residual, out = errors(whole), np.empty(len(label))
        moved = []
        for group in distinct(label):
            other = calibration(np.flatnonzero(of_sample != group))[0]
            out[label == group] = errors(other)[label == group]
            moved.append(_entries(other) - _entries(whole))
        deviations, count = np.array(moved), len(moved)
        covariance = (count - 1.0) / count * deviations.T @ deviations
        theta = _entries(whole)

        def named(theta: FloatArray) -> dict[str, float]:
            return experiment.named(symmetric_matrix(theta), theta[:3])

        return SensorFit(
            sensor=experiment.sensor,
            model=data.model.terms,
            method=method,
            frame="own",
            matrix=whole.matrix / _size(data, whole.matrix),
            bias=whole.bias,
            bias_unit=data.unit,
            parameters=with_errors(
                named,
                theta,
                covariance,
                experiment.unit_of,
                data.model.dropped,
            ),
            unit=data.error_unit,
            rms_before=root_mean_square(errors(experiment.before())),
            rms_fitted=root_mean_square(residual),
            rms_held_out=root_mean_square(out),
            floor=None if self.left_out is None else self.left_out.floor,
            floor_fitted=None if self.left_out is None else self.left_out.floor_fitted,
            residuals=residual,
            held_out=out,
            covariance=covariance,
            parameter_covariance=converted_covariance(named, theta, covariance),
            iterations=found.iterations,
            degrees_of_freedom=count - 1,
            experiment=experiment,
        )


def _entries(one: Parameters) -> FloatArray:
    """B and M's six entries, shape (9,)."""
    return np.concatenate([one.bias, one.matrix[ROWS, COLUMNS]])


def _warnings(found: MagnetometerFit) -> list[str]:
    """What the user must know of the samples."""
    unit, notes = found.fit.unit, []
    verb = "left out"
    if found.fit.method != DEFAULTS["magnetometer"]:
        verb = "not judged, but used as the method says"
    passed = [run for run in found.left_out if not run.single]
    if passed:
        longest = max(passed, key=lambda run: run.samples)
        when = f"from {longest.start:.1f} to {longest.end:.1f} s"
        often = when if len(passed) == 1 else f"{len(passed)} times, the longest {when}"
        size = f"{max(run.size for run in passed):.3g} {unit_sign(unit)}"
        notes.append(
            f"the field was disturbed {often}, its magnitude by up to {size}: "
            f"{plural(sum(run.samples for run in passed), 'sample')} {verb}. "
            "Iron, a magnet or a current was near, or the magnetometer's axes are read at "
            "different times while the device turns"
        )
    for run in found.left_out:
        if run.single:
            lie = "lies" if run.samples == 1 else "lie"
            notes.append(
                f"{plural(run.samples, 'single sample')} of the magnetometer {lie} up to "
                f"{run.size:.3g} {unit_sign(unit)} off the others: {verb}"
            )
    covered = found.filled > 0
    off = float(np.linalg.norm(centres()[covered].mean(axis=0)))
    seen = int(covered.sum())
    if not found.start.model.reason and seen < ENOUGH_COVERED and off > OFF_CENTRE:
        side = nearest_pose(farthest_from(centres()[covered])[0], DIRECTIONS, 180.0) or ""
        notes.append(
            f"{seen} of {BINS} directions are covered and one side is empty, that of "
            f"{true_minus(side)}: the error there is extrapolated. Turn the device to the faces "
            "that are missing"
        )
    noise, size_of_field = found.noise, found.magnitude
    if noise > NOISY_FIELD * size_of_field:
        share = f"{quantity(noise, unit)} ({100.0 * noise / size_of_field:.0f} % of the field)"
        swings = found.swings
        if swings is None:
            notes.append(
                f"the magnetometer's noise is large: {share} from one sample to the next, at no "
                "single frequency: turn it longer, which averages the noise"
            )
        else:
            notes.append(
                f"the field swings by {share} from one sample to the next, as sampled at "
                f"{swings:.3g} Hz: is there a loudspeaker, a motor or the mains beside it? Measure "
                "elsewhere once"
            )
    return notes
