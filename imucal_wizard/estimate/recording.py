"""The whole fit: a recording, or what the wizard has collected, in, and a report out.

What only a magnetometer needs is imported where there is one.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.estimate.hold_search import find_holds
from imucal_wizard.estimate.inertial import FitOptions, fit_holds
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.estimate.rounded import rounding_warnings, steps_in, with_rounding
from imucal_wizard.measurement.clipping import axes_without_noise
from imucal_wizard.measurement.holds import Collected, Rotation
from imucal_wizard.measurement.segmentation import rotations_between

MIN_RECORDING_SECONDS, MAX_RECORDING_SECONDS = 60.0, 1800.0
"""A calibration by hand hardly takes less than the first, and hardly more than the second."""

__all__ = ["FitOptions", "fit_collected", "fit_readings"]


def fit_readings(readings: Readings, options: FitOptions | None = None) -> FitReport:
    """Find the holds and rotations of a recording and fit every sensor.

    Raises:
        DataError: the recording does not carry a calibration.
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
    from imucal_wizard.measurement.field_quality import repeats_note, without_repeats

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
    notes = repeats_note(readings.magnetometer, series)
    return replace(report, warnings=(*report.warnings, *notes))


def _inertial(readings: Readings, options: FitOptions) -> FitReport:
    """Accelerometer and gyroscope.

    Raises:
        DataError: the recording does not carry an accelerometer's calibration.
    """
    if not len(readings):
        raise DataError("the recording has no accelerometer")
    try:
        return _found(readings, options)
    except DataError as error:
        raise _with_duration(error, readings) from error


def _found(readings: Readings, options: FitOptions) -> FitReport:
    holds, steps = find_holds(_without(readings, options.left_out), options.gravity)
    rotations: list[Rotation] = []
    if readings.gyroscope is not None and len(readings.gyroscope):
        rotations = rotations_between(holds, readings.gyroscope, readings.accelerometer)
    for start, end in options.left_out:
        rotations = [one for one in rotations if one.time[-1] < start or one.time[0] > end]
    rates = {"accelerometer": readings.accelerometer.rate}
    if readings.gyroscope is not None:
        rates["gyroscope"] = readings.gyroscope.rate
    units = _units(readings)
    warnings = (*readings.warnings, *rounding_warnings(holds, steps, units))
    return fit_holds(
        with_rounding(holds, steps), rotations, rates, units, options, (), warnings, readings
    )


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


def _with_duration(error: DataError, readings: Readings) -> DataError:
    """The error of a recording that is refused, with its duration if that is implausible."""
    time = readings.accelerometer.time
    seconds, rate = float(time[-1] - time[0]), readings.accelerometer.rate
    if MIN_RECORDING_SECONDS <= seconds <= MAX_RECORDING_SECONDS:
        return error
    other = "longer" if seconds < MIN_RECORDING_SECONDS else "less"
    return DataError(
        f"{error}. By its times the recording lasts {seconds:.3g} s at {rate:.4g} Hz: if it took "
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
        DataError: neither the holds nor the magnetometer's samples carry a calibration.
    """
    options = options or FitOptions()
    warnings = (*warnings, *_left_out(collected))
    if collected.magnetometer is None or not len(collected.magnetometer):
        return _held(collected, units, rate, options, warnings, readings)
    from imucal_wizard.estimate.gravity_and_field import segments_of
    from imucal_wizard.estimate.magnetometer.report import fit_during, with_magnetometer
    from imucal_wizard.estimate.second_stage.report import with_second_stage
    from imucal_wizard.measurement.field_quality import repeats_note, without_repeats

    series = without_repeats(collected.magnetometer)
    warnings = (*warnings, *repeats_note(collected.magnetometer, series))
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
        DataError: the holds do not carry a calibration.
    """
    steps = steps_in(collected)
    return fit_holds(
        with_rounding(collected.holds, steps),
        collected.rotations,
        dict.fromkeys(units, rate),
        units,
        options,
        collected.validation,
        (
            *warnings,
            *axes_without_noise(collected.holds, steps[0]),
            *rounding_warnings(collected.holds, steps, units),
        ),
        readings,
    )


def _units(readings: Readings) -> dict[str, str]:
    units = {"accelerometer": readings.accelerometer.unit}
    if readings.gyroscope is not None:
        units["gyroscope"] = readings.gyroscope.unit
    return units
