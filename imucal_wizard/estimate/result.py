"""The result of a fit: parameters with uncertainty, errors, and parameters not determined."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING

import numpy as np

from imucal_wizard.core.limits.use import IMPLAUSIBLE_SCALE
from imucal_wizard.core.notices import (
    Notice,
    NoticeKind,
    not_calibrated,
    not_in_verdicts,
    of_kind,
)
from imucal_wizard.core.quantities import number, plural, quantity
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median, root_mean_square
from imucal_wizard.core.units import COUNT
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.terms import Term, Terms, corrected

if TYPE_CHECKING:
    from imucal_wizard.estimate.experiment import Experiment
    from imucal_wizard.estimate.fit import Minimum
    from imucal_wizard.estimate.magnetometer.fit import MagnetometerFit
    from imucal_wizard.estimate.outliers import Outlier
    from imucal_wizard.estimate.repeatability import Repeatability
    from imucal_wizard.estimate.second_stage.found import SecondStage
    from imucal_wizard.model.rows.table import ResidualTable


ANGLES_OF_TRIANGLE = [4, 5, 7]
"""Places of M's xy, xz, yz among the biases and the entries of a triangular M."""
NORMAL_95 = 1.96
"""Standard deviations within which a normal error lies 95 times in 100."""
MIN_SINGLE_AXIS_ERROR = 0.001
"""Relative difference from the vector fit from which a single-axis scale is commented."""


@dataclass(frozen=True)
class Parameter:
    """One number of a model.

    Attributes:
        name: as in the JSON: ``bias_x``, ``sensitivity_x`` and, of the accelerometer, the angles
            ``theta_yz``, ``theta_zy``, ``theta_zx``; of the gyroscope ``cross_xy`` and so on.
        value: in ``unit``.
        standard_error: one standard deviation, with the fit's ``degrees_of_freedom``; None where
            the data leave nothing to judge by.
        unit: unit word.
        carried: False if the data do not determine it, so that it keeps its nominal value.
        standard_error_repeats: the same from the repeats alone, with the fit's
            ``repeatability.freedom``; None where there are none.
    """

    name: str
    value: float
    standard_error: float | None
    unit: str
    carried: bool = True
    standard_error_repeats: float | None = None


@dataclass(frozen=True, eq=False)
class GravityReference:
    """Up in each hold, as measured by a calibrated accelerometer.

    Attributes:
        up: unit vectors, shape (n, 3).
        labels: number of each hold's direction, shape (n,).
        variance: of each component of ``up`` across gravity, rad², shape (n,).
        doubt: change of ``up`` for one standard deviation along each of the k ways in which the
            calibration may be wrong, shape (n, 3, k).
        gain: m/s² per reading unit of the accelerometer, at its largest.
        gravity: m/s².
        undetermined: how many of the k ways, the last, no pose measured: parameters of usual size.
        decided: how many of these, the first, are left to the closures of rotations: how a sum of
            effects that is known is split among them.
        hidden: largest error of ``up`` that an effect does not let readings show, rad, shape (n,);
            empty where there is none. It is a part of ``variance``.
        least: ``variance`` if a hand that holds the device turned it by nothing that is left in the
            means, shape (n,); empty where that is not known.
        noise_alone: the same with the errors that measured noise alone makes, where what the
            accelerometer's model leaves is more; None where it is not.
    """

    up: FloatArray
    labels: IntArray
    variance: FloatArray
    doubt: FloatArray
    gain: float
    gravity: float
    undetermined: int = 0
    decided: int = 0
    hidden: FloatArray = field(default_factory=lambda: np.zeros(0))
    least: FloatArray = field(default_factory=lambda: np.zeros(0))
    noise_alone: "GravityReference | None" = None


def worse_than_none(
    sensor: str,
    bias_unit: str,
    unit: str,
    before: float | None,
    fitted: float,
    held_out: float | None,
    freedom: int | None = None,
    parameters: int = 0,
    interval: tuple[float, float] | None = None,
) -> str:
    """Why a calibration is not usable, in one sentence with what to do; "" if it is.

    It is not if its error on data held out is larger than that of readings that are not calibrated.
    Raw counts are no readings without a calibration.

    Args:
        sensor: its name.
        bias_unit: unit of the readings.
        unit: of the errors.
        before: rms error before the calibration.
        fitted: of the data fitted, which counts where nothing could be held out.
        held_out: of data held out.
        freedom: degrees of freedom of the fit, where nothing could be held out: few of them may
            leave little although the parameters are wrong. None tells nothing.
        parameters: how many were fitted.
        interval: 90 % interval of ``held_out``.
    """
    error = fitted if held_out is None else held_out
    if held_out is None and freedom:
        # the limit of a new error, 95 %, in terms of an rms
        spread = math.sqrt((freedom + 2.0 * parameters) / freedom)
        error = error * spread * quantile(0.95, freedom) / NORMAL_95
    if bias_unit == COUNT or before is None or error <= before:
        return ""
    if held_out is None:
        return (
            f"the {sensor}'s calibration may be worse than none: {quantity(fitted, unit)} fitted "
            f"with {plural(freedom or 0, 'degree')} of freedom, {quantity(before, unit)} without "
            "it. Do not apply it; measure more positions and rotations"
        )
    said, likely, advice = "is", "", "do not apply it; measure again"
    if interval is not None and interval[0] <= before:
        said, advice = "may be", "do not apply it; measure more positions and rotations"
        likely = f" (90 %: {quantity(interval[0], unit)} to {quantity(interval[1], unit)})"
    errors = (
        f"{quantity(error, unit)} on data held out{likely}, {quantity(before, unit)} without it"
    )
    return f"the {sensor}'s calibration {said} worse than none: {errors}; {advice}"


def usual_scale(matrix: FloatArray) -> tuple[float, FloatArray, IntArray]:
    """Usual scale (true over read) of the axes, that of each, and those that differ from it.

    Args:
        matrix: M, of readings in the unit of the input, shape (3, 3).
    """
    sizes = np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
    usual = median(sizes)
    odd = np.flatnonzero(np.abs(np.log(sizes / usual)) > IMPLAUSIBLE_SCALE)
    return usual if len(odd) else root_mean_square(sizes), sizes, odd


def impossible_scale(matrix: FloatArray) -> float | None:
    """A scale (true over read) that no sensor has: the usual one, else that of the worst axis.

    None without such.

    Args:
        matrix: M, of readings in the unit of the input, shape (3, 3).
    """
    usual, sizes, _ = usual_scale(matrix)
    if abs(np.log(usual)) > IMPLAUSIBLE_SCALE:
        return usual
    far = np.abs(np.log(sizes))
    return float(sizes[far.argmax()]) if far.max() > IMPLAUSIBLE_SCALE else None


def unchecked_scale(
    unit: str, bias_unit: str, matrix: FloatArray, freedom: int | None, held_out: float | None
) -> str:
    """Why a gyroscope's fit that no rotation checks is not usable, or "".

    Rotations that only just determine the gains give them exactly, also where a turn more or less
    or a cross-axis gain that was left at its nominal value makes them absurd.

    Args:
        unit: of the errors: ``rad`` of a gyroscope's.
        bias_unit: unit of the readings.
        matrix: M.
        freedom: degrees of freedom of the fit.
        held_out: rms error of data held out.
    """
    if unit != "rad" or bias_unit == COUNT or freedom or held_out is not None:
        return ""
    worst, what = impossible_scale(matrix), "rotate about each axis in both senses between still"
    if worst is None:
        return (
            "no rotation is left to check the gyroscope's fit, so nothing shows whether it is "
            f"better than none: {what} positions"
        )
    return (
        "no rotation is left to check the gyroscope's fit, which gives a scale of about "
        f"{number(worst, 2)} that no sensor has: do not apply it; {what} positions, or correct the "
        "unit"
    )


def uncalibrated(bias_unit: str) -> str:
    """By what readings are corrected for the error before a calibration, in words."""
    if bias_unit == COUNT:
        return "one common scale and a bias fitted to these readings, since counts have no unit"
    return "the nominal conversion alone, without any calibration"


def beyond_limit(error: float, could_be: float | None, limit: float, unit: str) -> str:
    """Why the errors of a calibration are not within the limit of use; "" if they are.

    Args:
        error: on data held out; on the data fitted where none could be held out.
        could_be: error by effects that the data do not show, or None.
        limit: of use.
        unit: of the three.
    """
    words = quantity(limit, unit, 2)
    if error > limit:
        return f"the error is above the limit of use, {words}"
    if could_be is not None and could_be > limit:
        return f"these data cannot exclude errors above the limit of use, {words}"
    return ""


@dataclass(frozen=True, eq=False)
class SensorFit:
    """The calibration of one sensor: ``corrected = matrix · (reading − bias)``.

    Attributes:
        sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
        model: terms of the model (``bias``, ``scale``, ``non-orthogonality`` …).
        method: name of the method.
        frame: ``own`` or ``accelerometer``.
        matrix: ``M``, SI per reading unit, shape (3, 3).
        bias: ``b``, reading unit, shape (3,).
        bias_unit: the reading's unit.
        parameters: all parameters, determined or not.
        unit: unit of the errors below: ``m/s^2`` or ``rad``; of the magnetometer ``uT``, or its
            reading's unit where the field's size is not known.
        rms_before: error before the calibration, see ``uncalibrated``; None where there is none.
        rms_fitted: error on the data fitted.
        rms_held_out: error on directions or rotations left out one at a time; None where none can
            be left out.
        held_out_in_noise: the same of all rows that judge a model, rests of a gyroscope among them,
            each in units of its measured noise; None where it is not known.
        held_out_interval: between which the rms of new holds or rotations lies nine times in ten;
            None where none can be left out.
        floor: rms held out of a complete model by measured noise alone; None where none can be left
            out or the noise is not known.
        floor_fitted: the same of the fitted rms.
        residuals: error of each hold or rotation, in ``unit``; of the magnetometer the mean error
            of each direction.
        held_out: error of each when it is left out, or None.
        covariance: by the residual, or None; of the three biases and M's six entries xx, xy, xz,
            yy, yz, zz (accelerometer, magnetometer), or of M's nine entries by rows and the biases
            (gyroscope). An entry that stays nominal has its usual size, with what it does to those
            fitted; that of a magnetometer by a method of the papers, none.
        parameter_covariance: of all parameters, of a method of the papers; None where it has none,
            and of a fit, see ``parameters.covariance_of``.
        iterations: how many the method took.
        validation_rms: error on holds the fit has not seen, or None.
        validation: the error of each of them, in ``unit``; empty without any.
        warnings: what the user must know about this sensor.
        degrees_of_freedom: of the residual behind the standard errors. An interval that is to hold
            the truth 95 times in 100 reaches ``quantile(0.95, degrees_of_freedom)`` of
            ``distributions`` times the standard error to either side; 1.96 only where there are
            many.
        repeatability: how far the same pose differs from one visit to the next: what no model of
            the pose can explain; None where no pose was repeated.
        slow_noise_measured: whether repeated poses, a long rest or long holds show how slow noise
            moves the biases, which is otherwise estimated from the residuals; None where that is
            not asked.
        suspects: which of the residuals stand out from all others: to be measured again.
        unused: which of the residuals are of holds that the method does not look at, so that they
            are held out as they are.
        not_held_out: why there is no ``rms_held_out``, in words; "" where there is.
        base: terms of the base model that were asked for.
        terms: the effects.
        sizes: of each effect, shown units.
        size_errors: standard errors of the sizes; NaN where nothing is left over to judge by.
        size_covariance: of all sizes one after the other, shape (p, p), or None.
        rows: the residual table; None of a method of the papers.
        rms_late: error of the later part of the session under the fit of the earlier part; None
            where the earlier part does not determine the model.
        late_in_noise: the same of all rows that judge a model, each in units of its noise.
        late_by_noise: whether it is no larger than measured noise makes it.
        reference: of an accelerometer, up in each hold.
        experiment: the rows that were fitted, for a fit of the same data with other terms.
        outlier: the hold or rotation that does not fit with all others, if one stands out.
        minimum: where the fit has arrived, for one step further; None of a method of the papers.
    """

    sensor: str
    model: tuple[str, ...]
    method: str
    frame: str
    matrix: FloatArray
    bias: FloatArray
    bias_unit: str
    parameters: tuple[Parameter, ...]
    unit: str
    rms_before: float | None
    rms_fitted: float
    rms_held_out: float | None
    floor: float | None
    residuals: FloatArray
    held_out: FloatArray | None = None
    covariance: FloatArray | None = None
    parameter_covariance: FloatArray | None = None
    iterations: int = 0
    validation_rms: float | None = None
    warnings: tuple[str, ...] = ()
    degrees_of_freedom: int = 0
    repeatability: "Repeatability | None" = None
    slow_noise_measured: bool | None = None
    suspects: tuple[int, ...] = ()
    unused: tuple[int, ...] = ()
    not_held_out: str = ""
    validation: tuple[float, ...] = ()
    floor_fitted: float | None = None
    held_out_interval: tuple[float, float] | None = None
    base: tuple[str, ...] = ()
    terms: tuple[Term, ...] = ()
    sizes: tuple[FloatArray, ...] = ()
    size_errors: tuple[FloatArray, ...] = ()
    size_covariance: FloatArray | None = None
    rows: "ResidualTable | None" = None
    rms_late: float | None = None
    held_out_in_noise: float | None = None
    late_in_noise: float | None = None
    late_by_noise: bool = False
    reference: GravityReference | None = None
    experiment: "Experiment | None" = None
    outlier: "Outlier | None" = None
    minimum: "Minimum[Experiment] | None" = None

    @property
    def before_note(self) -> str:
        """What ``rms_before`` is where there is no nominal conversion, or ""."""
        if self.bias_unit != COUNT or self.rms_before is None:
            return ""
        return f"“before” uses {uncalibrated(self.bias_unit)}"

    @property
    def error_and_floor(self) -> tuple[float | None, float | None, str]:
        """The error by which it is judged, its floor and its name.

        That is the error held out, or the fitted one where nothing could be held out. A fit with
        as many parameters as data leaves nothing to judge it by.
        """
        if self.rms_held_out is not None:
            return self.rms_held_out, self.floor, "held out"
        if self.degrees_of_freedom == 0:
            return None, None, ""
        return self.rms_fitted, self.floor_fitted, "fitted"

    @property
    def slow_noise_note(self) -> str:
        """What the errors of the biases rest on where slow noise was not measured, or ""."""
        if self.slow_noise_measured is not False:
            return ""
        if self.experiment is None:
            return "slow noise of the biases was not measured"
        return f"{self.experiment.unmeasured_slow_noise}: {self.experiment.shows_slow_noise}"

    @property
    def unusable(self) -> str:
        """Why applying it is worse than not applying it, in one sentence; "" if it is not."""
        errors = self.rms_before, self.rms_fitted, self.rms_held_out
        fitted = sum(one.carried for one in self.parameters)
        freedom, likely = self.degrees_of_freedom, self.held_out_interval
        worse = worse_than_none(
            self.sensor, self.bias_unit, self.unit, *errors, freedom, fitted, likely
        )
        return worse or self.unchecked

    @property
    def met_exactly(self) -> bool:
        """Whether nothing is left over by which the data could contradict the fit."""
        return not self.degrees_of_freedom and self.rms_held_out is None

    @property
    def unchecked(self) -> str:
        """See ``unchecked_scale``."""
        freedom, held_out = self.degrees_of_freedom, self.rms_held_out
        return unchecked_scale(self.unit, self.bias_unit, self.matrix, freedom, held_out)

    @property
    def of_table(self) -> bool:
        """Whether steps of a rate table are among its rows."""
        return self.rows is not None and any(one.kind == "table" for one in self.rows.sources)

    @property
    def not_determined(self) -> tuple[str, ...]:
        """Names of the parameters that the data do not determine."""
        return tuple(one.name for one in self.parameters if not one.carried)

    @property
    def fitted_entries(self) -> BoolArray:
        """Which of the numbers of ``covariance`` are fitted and not nominal, shape (n,)."""
        if self.minimum is None:
            known = np.diag(np.asarray(self.covariance)) > 0.0
            # a method fits all angles of a triangular M or none
            if not all(one.carried for one in self.parameters if one.name.startswith("theta")):
                known[ANGLES_OF_TRIANGLE] = False
            return np.asarray(known)
        entries = list(self.minimum.experiment.covariance_entries)
        return np.asarray(self.minimum.directions.columns[entries].any(axis=1))

    def correct(self, readings: FloatArray, circumstances: Circumstances) -> FloatArray:
        """Readings corrected, SI, shape (n, 3); see ``corrected``."""
        terms = Terms(self.sensor, self.terms)
        sizes = np.concatenate([np.zeros(0), *self.sizes])
        return corrected((self.matrix, self.bias), terms, sizes, readings, circumstances)


@dataclass(frozen=True)
class AxisComparison:
    """One line of Q's table III: one axis by the three gyroscope methods.

    Scales are corrections ``k`` (SI per reading); sensitivities are their reciprocals. None where a
    method could not be used.
    """

    axis: str
    rotations: int
    static_bias: float | None = None
    static_scale: float | None = None
    static_scale_error: float | None = None
    dynamic_bias: float | None = None
    dynamic_bias_error: float | None = None
    dynamic_scale: float | None = None
    dynamic_scale_error: float | None = None
    vector_bias: float | None = None
    vector_scale: float | None = None
    vector_scale_error: float | None = None


def single_axis_note(comparison: Sequence[AxisComparison]) -> str:
    """Why single-axis scales differ from the vector fit's; "" if none differs by 0.1 %."""
    off = beyond = unknown = 0.0
    for row in comparison:
        for scale, error in (
            (row.static_scale, row.static_scale_error),
            (row.dynamic_scale, row.dynamic_scale_error),
        ):
            if scale is None or not row.vector_scale:
                continue
            one = abs(scale / row.vector_scale - 1.0)
            off = max(off, one)
            if error is None:
                unknown = max(unknown, one)
            elif one > NORMAL_95 * abs(error / row.vector_scale):
                beyond = max(beyond, one)
    if off < MIN_SINGLE_AXIS_ERROR:
        return ""
    if beyond < MIN_SINGLE_AXIS_ERROR:
        chance = "their standard errors are as large"
        if unknown >= MIN_SINGLE_AXIS_ERROR:
            chance = "too few rotations show whether that is chance"
        return f"Static and dynamic differ from vector by up to {100.0 * off:.2g} %: {chance}."
    certain = "Static and dynamic are off"
    if off > beyond:
        differ = f"Static and dynamic differ from vector by up to {100.0 * off:.2g} %"
        certain = f"{differ}; where that is more than their standard errors make, they are off"
    return (
        f"{certain} by up to {100.0 * beyond:.2g} %: they treat each rotation as one about a "
        "single axis and ignore cross axes and tilt, which the vector method models. Static also "
        "takes the rate of the rest before each rotation for the bias."
    )


@dataclass(frozen=True, eq=False)
class FitReport:
    """Everything a fit found; the result screen, the JSON and the saved file all show this.

    Attributes:
        gravity: local gravity used, m/s².
        rates: samples per second of each sensor.
        holds: the holds found, in time order.
        rotations: the rotations found, in time order; those with a ``problem`` were not fitted.
        angles: angle turned in each rotation, rad, signed about its axis where it has one; None
            where it is not known.
        sensors: the fit of each sensor by name.
        comparison: the gyroscope's three methods side by side.
        warnings: what the user must know.
        outlier_notes: of each sensor the hold or rotation that does not fit with the others, in
            words. A verdict, which weighs every other explanation too, replaces them.
        magnetic: what a magnetometer's fit says beyond the others, or None without one.
        second_stage: alignment and clocks of the sensors, or None.
        validation: holds that the fits have not seen.
    """

    gravity: float
    rates: dict[str, float]
    holds: tuple[Hold, ...]
    rotations: tuple[Rotation, ...]
    sensors: dict[str, SensorFit]
    comparison: tuple[AxisComparison, ...] = ()
    angles: tuple[float | None, ...] = ()
    warnings: tuple[str, ...] = field(default=())
    magnetic: "MagnetometerFit | None" = None
    second_stage: "SecondStage | None" = None
    outlier_notes: dict[str, str] = field(default_factory=dict)
    validation: tuple[Hold, ...] = ()

    @property
    def on_table(self) -> bool:
        """Whether a rate table calibrated the gyroscope, which needs no accelerometer."""
        fit = self.sensors.get("gyroscope")
        return fit is not None and fit.frame == "own"

    def warned(self, sensor: str, *kinds: NoticeKind) -> list[Notice]:
        """The warnings about a sensor of these kinds."""
        return of_kind(self.warnings, *kinds, sensor=sensor)

    def why_not(self, sensor: str) -> Notice:
        """Why a sensor has no calibration."""
        reasons = self.warned(sensor, NoticeKind.NOT_CALIBRATED)
        return reasons[0] if reasons else not_calibrated(sensor, "these data do not determine it")

    def notes(self, *, judged: bool) -> tuple[str, ...]:
        """What the user must know beside the verdicts, or where there are none."""
        worse = tuple(fit.unusable for fit in self.sensors.values() if fit.unusable)
        notes = (*worse, *self.warnings)
        return notes if judged else (*notes, *self.outlier_notes.values())

    def notes_beside(self, verdicts: Mapping[str, str]) -> tuple[str, ...]:
        """The notes for a place that shows the verdicts, too, without what these say.

        Args:
            verdicts: in sentences, by sensor.
        """
        return tuple(not_in_verdicts(self.notes(judged=bool(verdicts)), verdicts))
