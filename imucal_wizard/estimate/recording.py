"""The whole fit: a recording, or what the wizard has collected, in, and a report out.

Holds and rotations come from either; ``fit_holds`` makes the fits of accelerometer and gyroscope of
them. What only a magnetometer needs is imported where there is one.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import cast

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.limits.stillness import REST_FACTOR
from imucal_wizard.core.notices import Notice, NoticeKind
from imucal_wizard.core.poses import DIRECTIONS, POSE_TOLERANCE_DEG, nearest_pose
from imucal_wizard.core.quantities import decimals, fixed, plural, quantity
from imucal_wizard.core.readings import BoolArray, FloatArray, Readings, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median, median_of_rows, sphere_centre
from imucal_wizard.core.units import COUNT, STANDARD_GRAVITY
from imucal_wizard.estimate.accelerometer import (
    AccelerometerExperiment,
    accelerometer_experiment,
    check_means,
    with_new_holds,
)
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.fit_warnings import (
    accelerometer_warnings,
    gyroscope_warnings,
    rotation_warnings,
    said_better,
    uncovered_directions,
)
from imucal_wizard.estimate.gyroscope_report import GyroscopeReport, fit_gyroscope
from imucal_wizard.estimate.hold_search import find_holds
from imucal_wizard.estimate.methods import DEFAULTS
from imucal_wizard.estimate.outliers import Outlier
from imucal_wizard.estimate.rest_spectrum import RestSpectrum, rest_spectrum, with_quiet_noise
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.estimate.rounded import (
    Steps,
    resolution_in,
    rounding_warnings,
    steps_in,
    with_rounding,
)
from imucal_wizard.estimate.sway import sways, without_sway
from imucal_wizard.measurement.blocks import rest_in_words
from imucal_wizard.measurement.clipping import axes_without_noise, partly_clipped
from imucal_wizard.measurement.data_quality import inertial_sensors
from imucal_wizard.measurement.holds import Collected, Hold, Rotation
from imucal_wizard.measurement.rounding import in_steps, rounding_step
from imucal_wizard.measurement.segmentation import reduce_recording, rotations_between
from imucal_wizard.model.effect import ACCELEROMETER

MIN_POSITIONS, POSITIONS_APART_DEG = 6, 30.0
"""Readings that may be those of positions, and the angle between one and the next above which they
are: a hand that turns a device at 150 °/s turns it by as much between samples of 5 Hz."""
MIN_RECORDING_SECONDS, MAX_RECORDING_SECONDS = 60.0, 1800.0
"""A calibration by hand hardly takes less than the first, and hardly more than the second."""


@dataclass(frozen=True)
class FitOptions:
    """What the user may choose about a fit.

    Attributes:
        gravity: local gravity, m/s².
        method: the accelerometer's method.
        gyroscope_method: ``vector``, ``static``, ``dynamic`` or ``offset``; which is the result.
        magnetometer_method: ``orthogonal``, ``algebraic``, ``two-step`` or ``numeric``.
        field: magnitude of the local magnetic field, µT, or None when it is not known.
        rates: magnitudes of the constant rates of a rate table that turned the gyroscope, rad/s.
        turns: magnitudes of the angles by which a turntable turned it between rests, rad.
        left_out: spans of time, s, from which no holds and rotations are taken.
    """

    gravity: float = STANDARD_GRAVITY
    method: str = "least_squares"
    gyroscope_method: str = "vector"
    magnetometer_method: str = "orthogonal"
    field: float | None = None
    rates: tuple[float, ...] = ()
    turns: tuple[float, ...] = ()
    left_out: tuple[tuple[float, float], ...] = ()


def fit_readings(readings: Readings, options: FitOptions | None = None) -> FitReport:
    """Find the holds and rotations of a recording and fit every sensor.

    Raises:
        DataError: the recording does not determine a calibration.
    """
    options = options or FitOptions()
    if options.rates or options.turns:
        from imucal_wizard.estimate.rate_table import fit_with_table

        return fit_with_table(readings, options, fit_readings)
    if readings.magnetometer is None:
        return _inertial(readings, options)
    from imucal_wizard.estimate.gravity_and_field import segments
    from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
    from imucal_wizard.estimate.magnetometer.report import with_magnetometer
    from imucal_wizard.estimate.second_stage.report import with_second_stage
    from imucal_wizard.measurement.repeats import repeats_note, without_repeats

    series, gyroscope = without_repeats(readings.magnetometer), readings.gyroscope
    report = with_magnetometer(
        lambda: _inertial(readings, options),
        lambda: fit_magnetometer(series, options.field, options.magnetometer_method, readings),
        series,
        options.gravity,
        readings.warnings,
    )
    on_table = bool(options.left_out)
    turns = [] if gyroscope is None or on_table else segments(report.holds, gyroscope)
    report = with_second_stage(report, series, turns)
    times = len(readings.magnetometer) / len(series) if len(series) else 1.0
    notes = repeats_note("magnetometer", times)
    return replace(report, warnings=(*report.warnings, *notes))


def _inertial(readings: Readings, options: FitOptions) -> FitReport:
    """Accelerometer and gyroscope.

    Raises:
        DataError: the recording does not determine an accelerometer's calibration.
    """
    if not len(readings):
        raise DataError("the recording has no accelerometer")
    try:
        return _found(readings, options)
    except DataError as error:
        if _are_positions(readings.accelerometer.values):
            raise DataError(_POSITIONS) from error
        raise _with_duration(_with_rests(error, readings, options), readings) from error


_POSITIONS = (
    "each line seems to be the mean of one position and not a sample: give the recording of which "
    "the means were taken, with two seconds at rest in each position"
)


def _are_positions(values: FloatArray) -> bool:
    """Whether each reading is taken in another position than the one before, shape (n, 3)."""
    if len(values) < MIN_POSITIONS:
        return False
    centre = sphere_centre(values)
    up = unit_vectors(values if centre is None else values - centre)
    between = np.einsum("ni,ni->n", up[1:], up[:-1])
    return bool(median(between) < np.cos(np.radians(POSITIONS_APART_DEG)))


def _found(readings: Readings, options: FitOptions) -> FitReport:
    holds, resolution, apart = find_holds(_without(readings, options.left_out), options.gravity)
    silent, wrong = _at_ends(holds, resolution, readings)
    # rests in which the gyroscope reads another mean are rests of the accelerometer all the same
    _, wrong_apart = _at_ends(apart, resolution, readings)
    still = [
        replace(hold, gyroscope=None, gyroscope_covariance=None, gyroscope_turn=None, sway=None)
        for hold, out in zip(apart, wrong_apart, strict=True)
        if not out
    ]
    holds = [hold for hold, out in zip(holds, wrong, strict=True) if not out]
    readings, alone = _with_gyroscope_of(holds, readings)
    rotations: list[Rotation] = []
    if readings.gyroscope is not None and len(readings.gyroscope):
        rotations = rotations_between(holds, readings.gyroscope, readings.accelerometer)
    for start, end in options.left_out:
        rotations = [one for one in rotations if one.time[-1] < start or one.time[0] > end]
    rates = {"accelerometer": readings.accelerometer.rate}
    if readings.gyroscope is not None:
        rates["gyroscope"] = readings.gyroscope.rate
    units, steps = _units(readings), (rounding_step(readings.accelerometer.values), resolution[1])
    every = sorted([*holds, *still], key=lambda hold: hold.start)
    _check(every, readings.accelerometer.rate)
    on_table = options.rates or options.turns
    warnings = (
        *readings.warnings,
        *([] if on_table else _apart(apart, holds, readings)),
        *alone,
        *silent,
        *rounding_warnings(every, steps, _in_steps(readings, steps, units)),
    )
    return fit_holds(
        with_rounding(every, steps), rotations, rates, units, options, (), warnings, readings
    )


def _with_gyroscope_of(holds: Sequence[Hold], readings: Readings) -> tuple[Readings, list[Notice]]:
    """The readings, without a gyroscope that no hold has any of; a warning if so."""
    gyroscope = readings.gyroscope
    if gyroscope is None or not len(gyroscope) or any(one.gyroscope is not None for one in holds):
        return readings, []
    text = (
        "the gyroscope is not calibrated: in the rests that the accelerometer shows its samples "
        "are missing, in whole or in part. Record both sensors at once, at an even rate"
    )
    return replace(readings, gyroscope=None), [Notice(text, NoticeKind.NOT_CALIBRATED, "gyroscope")]


def _at_ends(
    holds: Sequence[Hold], resolution: Steps, readings: Readings | None
) -> tuple[list[Notice], BoolArray]:
    """Warnings about holds at the end of the accelerometer's range, and which they are, (h,)."""
    silent, wrong = axes_without_noise(holds, resolution[0])
    if readings is None or not len(readings):
        return silent, wrong
    left = [hold for hold, out in zip(holds, wrong, strict=True) if not out]
    partly, clipped = partly_clipped(left, readings.accelerometer)
    wrong[~wrong] = clipped
    return [*silent, *partly], wrong


def _in_steps(readings: Readings, steps: Steps, units: dict[str, str]) -> dict[str, str]:
    """The units of the sensors whose readings come in steps."""
    return {
        sensor: units[sensor]
        for (sensor, series), step in zip(inertial_sensors(readings), steps, strict=False)
        if step is not None and in_steps(series.values, step)
    }


def _apart(rests: Sequence[Hold], holds: Sequence[Hold], readings: Readings) -> list[Notice]:
    """A warning if there are rests in which the gyroscope reads another mean than in the holds."""
    gyroscope, known = readings.gyroscope, [one.gyroscope for one in holds]
    usual = [one for one in known if one is not None]
    means = np.array([one.gyroscope for one in rests if one.gyroscope is not None])
    if not len(means) or gyroscope is None or not usual:
        return []
    most = float(np.abs(means - median_of_rows(np.array(usual))).max())
    count, off = plural(len(rests), "rest"), quantity(most, gyroscope.unit, 2)
    first = f"from {rests[0].start:.1f} to {rests[0].end:.1f} s"
    text = (
        f"in {count} of the accelerometer, the first {first}, the gyroscope's mean is up to {off} "
        "off the mean in the holds, so they are not used for the gyroscope: its bias jumped or "
        "drifted, its readings froze, the sensor was exchanged, or the device turned slowly, in "
        "the hand or on something that turns"
    )
    return [Notice(text, NoticeKind.RESTS_LEFT_OUT, "gyroscope")]


def _without(readings: Readings, spans: Sequence[tuple[float, float]]) -> Readings:
    """Accelerometer and gyroscope without the samples of some spans of time."""

    def kept(series: Series) -> Series:
        rows = np.ones(len(series), bool)
        for start, end in spans:
            rows &= (series.time < start) | (series.time > end)
        return Series(series.time[rows], series.values[rows], series.unit)

    if not spans:
        return readings
    gyroscope = readings.gyroscope
    return replace(
        readings,
        accelerometer=kept(readings.accelerometer),
        gyroscope=None if gyroscope is None else kept(gyroscope),
    )


def _with_rests(error: DataError, readings: Readings, options: FitOptions) -> DataError:
    """What the gyroscope does in positions that only the accelerometer shows, else the error."""
    gyroscope = readings.gyroscope
    if gyroscope is None or not len(gyroscope):
        return error
    still = _without(readings, options.left_out)
    try:
        holds = _checked_holds(replace(still, gyroscope=None), options.gravity)
    except DataError:
        return error
    with suppress(DataError):
        _checked_holds(still, options.gravity)
        return error  # the gyroscope hides none that a fit needs
    during = [gyroscope.between(hold.start, hold.end).values for hold in holds]
    rates = np.array([one.mean(axis=0) for one in during if len(one)]).reshape(-1, 3)
    if not len(rates):
        return error
    change = quantity(float(np.ptp(rates, axis=0).max()), gyroscope.unit, 2)
    stream, count = reduce_recording(still), plural(len(holds), "hold")
    limit = None if stream is None else stream.noise.limits(REST_FACTOR).rate
    if stream is None or limit is None:
        return error
    if (np.ptp(rates, axis=0) <= np.maximum(limit, stream.least_rate)).all():
        return DataError(
            f"the gyroscope's readings scatter so much in the {count} that the accelerometer shows "
            f"that too few of them count as still, although its mean changes by {change} only: "
            "look for wrong readings and gaps, or leave the gyroscope's columns out",
            settings=error.settings,
        )
    return DataError(
        f"the gyroscope's mean changes by {change} between the {count} that the accelerometer "
        "shows, so that too few of them count as still: its bias jumped or drifted, its high-pass "
        "filter is on, or the device rested hardly a second or turned slowly, by itself or on "
        "something that turns. Record again without that filter on a fixed surface, "
        f"{rest_in_words(readings.accelerometer.rate)} at rest in each position, without "
        "restarting the sensor",
        settings=error.settings,
    )


def _checked_holds(readings: Readings, gravity: float) -> list[Hold]:
    """The holds of a recording.

    Raises:
        DataError: no fit can begin from them.
    """
    holds = find_holds(readings, gravity)[0]
    _check(holds, readings.accelerometer.rate)
    return holds


def _check(holds: Sequence[Hold], rate: float) -> None:
    check_means(np.array([hold.accelerometer for hold in holds]).reshape(-1, 3), rate)


def _with_duration(error: DataError, readings: Readings) -> DataError:
    """The error of a recording that is refused, with its duration if that is implausible."""
    time = readings.accelerometer.time
    seconds, rate = float(time[-1] - time[0]), readings.accelerometer.rate
    if MIN_RECORDING_SECONDS <= seconds <= MAX_RECORDING_SECONDS:
        return error
    other = "longer" if seconds < MIN_RECORDING_SECONDS else "less"
    lasts = fixed(seconds, decimals(seconds, 3))
    return DataError(
        f"{error}. By its times the recording lasts {lasts} s at {rate:.4g} Hz: if it took "
        f"{other}, correct the sampling rate or the unit of the times",
        settings=error.settings,
    )


def fit_collected(
    collected: Collected,
    units: dict[str, str],
    rate: float,
    options: FitOptions | None = None,
    warnings: tuple[str, ...] = (),
    readings: Readings | None = None,
) -> FitReport:
    """Fit what the wizard has collected.

    Args:
        collected: holds and rotations; the magnetometer with the times of its step.
        units: unit of accelerometer and gyroscope; a sensor that is not there is left out.
        rate: samples per second of these two.
        options: gravity and methods.
        warnings: what the stream's reader noticed.
        readings: all samples, where they are at hand: they show slow noise in a long rest and what
            the sensor's filter passes.

    Raises:
        DataError: neither the holds nor the magnetometer's samples determine a calibration.
    """
    options = options or FitOptions()
    warnings = (*warnings, *_left_out(collected))
    if collected.magnetometer is None or not len(collected.magnetometer):
        return _held(collected, units, rate, options, warnings, readings)
    from imucal_wizard.estimate.gravity_and_field import segments_of
    from imucal_wizard.estimate.magnetometer.report import fit_during, with_magnetometer
    from imucal_wizard.estimate.second_stage.report import with_second_stage
    from imucal_wizard.measurement.repeats import repeats_note, without_repeats

    series = without_repeats(collected.magnetometer)
    warnings = (*warnings, *repeats_note("magnetometer", len(collected.magnetometer) / len(series)))
    report = with_magnetometer(
        lambda: _held(collected, units, rate, options, warnings, readings),
        lambda: fit_during(
            collected.field_spans, series, options.field, options.magnetometer_method, readings
        ),
        series,
        options.gravity,
        warnings,
    )
    return with_second_stage(report, series, segments_of(report.rotations, report.holds))


def _left_out(collected: Collected) -> list[str]:
    """What the wizard has left out of the magnetometer's step, and why."""
    return [
        f"from {start:.1f} to {end:.1f} s {reason}: these samples are left out"
        for start, end, reason in collected.field_left_out
    ]


def _held(
    collected: Collected,
    units: dict[str, str],
    rate: float,
    options: FitOptions,
    warnings: tuple[str, ...],
    readings: Readings | None,
) -> FitReport:
    """Accelerometer and gyroscope by the holds and rotations that the wizard has collected.

    Raises:
        DataError: the holds do not determine a calibration.
    """
    resolution = resolution_in(collected)
    steps = steps_in(collected, resolution, readings)
    silent, wrong = _at_ends(collected.holds, resolution, readings)
    holds = [hold for hold, out in zip(collected.holds, wrong, strict=True) if not out]
    gone = {hold.start for hold, out in zip(collected.holds, wrong, strict=True) if out}
    return fit_holds(
        with_rounding(holds, steps),
        [one for one in collected.rotations if not {one.before.start, one.after.start} & gone],
        dict.fromkeys(units, rate),
        units,
        options,
        collected.validation,
        (
            *warnings,
            *silent,
            *rounding_warnings(holds, steps, units),
        ),
        readings,
    )


def _units(readings: Readings) -> dict[str, str]:
    units = {"accelerometer": readings.accelerometer.unit}
    if readings.gyroscope is not None:
        units["gyroscope"] = readings.gyroscope.unit
    return units


def fit_holds(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    rates: dict[str, float],
    units: dict[str, str],
    options: FitOptions,
    validation: Sequence[Hold],
    warnings: tuple[str, ...],
    readings: Readings | None = None,
) -> FitReport:
    """Fit accelerometer and gyroscope.

    Args:
        holds: still periods, in the order of time.
        rotations: motions between neighbouring ones.
        rates: samples per second of each sensor.
        units: of the readings by sensor; a sensor that is not there is left out.
        options: gravity and methods.
        validation: holds that the fit must not see.
        warnings: what is known already.
        readings: what the holds were found in, where it is at hand.

    Raises:
        DataError: the holds do not determine a calibration.
    """
    spectrum = rest_spectrum(readings, holds) if "gyroscope" in units else None
    least = None if spectrum is None else spectrum.least

    def fitted(size: float | None) -> FitReport:
        """The fit if one unit of the gyroscope's readings is so many rad/s."""
        every = [*holds, *validation]
        every = every if size is None else without_sway(every, readings, size, least)
        of_fit, of_validation = every[: len(holds)], every[len(holds) :]
        args = of_fit, rotations, rates, units, options, of_validation, warnings, readings
        return _fit_holds(*args, spectrum)

    if units.get("gyroscope") != COUNT:
        return fitted(1.0)
    report = fitted(None)
    gyroscope = report.sensors.get("gyroscope")
    size = 0.0 if gyroscope is None else float(np.cbrt(abs(np.linalg.det(gyroscope.matrix))))
    return fitted(size) if sways(holds, without_sway(holds, readings, size, least)) else report


def _fit_holds(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    rates: dict[str, float],
    units: dict[str, str],
    options: FitOptions,
    validation: Sequence[Hold],
    warnings: tuple[str, ...],
    readings: Readings | None,
    spectrum: RestSpectrum | None,
) -> FitReport:
    """The same of holds without their sway, with the spectrum of the gyroscope in them."""
    accelerometer = fit_accelerometer(
        holds, options.gravity, units["accelerometer"], options.method, readings
    )
    assert accelerometer.reference is not None  # noqa: S101 (narrows the type)
    named = with_quiet_noise(_with_poses(holds, accelerometer.reference.up), spectrum)
    rotations = [_between(rotation, named) for rotation in rotations]
    odd: dict[str, str] = {}
    if accelerometer.outlier is not None:
        hold = named[accelerometer.outlier.index]
        pose = f" ({hold.pose})" if hold.pose else ""
        place = f"the hold from {hold.start:.1f} to {hold.end:.1f} s{pose}"
        odd["accelerometer"] = _stands_out(place, accelerometer.outlier)
    up = accelerometer.reference.up
    if validation:
        experiment = cast("AccelerometerExperiment", accelerometer.experiment)
        means = experiment.without_settling(np.array([hold.accelerometer for hold in validation]))
        means = (means - accelerometer.bias) @ accelerometer.matrix.T
        accelerometer = with_new_holds(accelerometer, means, options.gravity)
        up = np.concatenate([up, unit_vectors(means)])
    sensors = {"accelerometer": accelerometer}
    notes = [*warnings, *accelerometer_warnings(accelerometer, named), *uncovered_directions(up)]
    gyroscope: GyroscopeReport | None = None
    if "gyroscope" in units:
        args = named, rotations, accelerometer, units["gyroscope"], options.gyroscope_method
        gyroscope = fit_gyroscope(*args, readings, spectrum)
        rotations = list(gyroscope.rotations)
        notes += rotation_warnings(rotations)
        if gyroscope.fit is not None:
            sensors["gyroscope"] = gyroscope.fit
            notes += gyroscope_warnings(gyroscope, units["gyroscope"], rates["gyroscope"])
        notes += gyroscope.warnings
        if gyroscope.outlier is not None:
            bad = rotations[gyroscope.outlier.index]
            place = f"the rotation from {bad.time[0]:.1f} to {bad.time[-1]:.1f} s"
            odd["gyroscope"] = _stands_out(place, gyroscope.outlier)
    notes = [note for note in notes if not said_better(note, notes)]
    return FitReport(
        gravity=options.gravity,
        rates=rates,
        holds=tuple(named),
        rotations=tuple(rotations),
        sensors=sensors,
        comparison=() if gyroscope is None else gyroscope.comparison,
        angles=() if gyroscope is None else gyroscope.angles,
        warnings=tuple(dict.fromkeys(note for note in notes if note)),
        outlier_notes=odd,
        validation=tuple(validation),
    )


def fit_accelerometer(
    holds: Sequence[Hold],
    gravity: float,
    unit: str,
    method: str = DEFAULTS[ACCELEROMETER],
    readings: Readings | None = None,
) -> SensorFit:
    """The calibration of these holds without effects.

    Args:
        holds: still periods, in the order of time.
        gravity: local gravity, m/s².
        unit: of the readings, ``m/s^2`` or ``count``.
        method: the default, or one of ``estimate.methods``.
        readings: what the holds were found in, for the effects that are fitted to them later.

    Raises:
        DataError: the holds do not determine a calibration.
        UsageError: no method of that name.
    """
    if method == DEFAULTS[ACCELEROMETER]:
        return fit(accelerometer_experiment(holds, gravity, unit, readings))
    from imucal_wizard.estimate.hold_magnitudes import fit_by_method

    return fit_by_method(holds, gravity, unit, method)


def _with_poses(holds: Sequence[Hold], directions: FloatArray) -> list[Hold]:
    """The holds with the pose each was in, by the calibrated direction."""
    return [
        replace(hold, pose=nearest_pose(up, DIRECTIONS, POSE_TOLERANCE_DEG))
        for hold, up in zip(holds, directions, strict=True)
    ]


def _between(rotation: Rotation, holds: Sequence[Hold]) -> Rotation:
    """The rotation with its holds replaced by the named ones of the same times."""
    places = {(hold.start, hold.end): hold for hold in holds}
    before = places.get((rotation.before.start, rotation.before.end))
    after = places.get((rotation.after.start, rotation.after.end))
    if before is None or after is None:
        return replace(rotation, problem=rotation.problem or "a hold at its end was not kept")
    return replace(rotation, before=before, after=after)


def _stands_out(place: str, outlier: Outlier) -> str:
    return (
        f"{place} does not agree with the others: its error is {outlier.ratio:.0f} times theirs. "
        "Measure it again"
    )
