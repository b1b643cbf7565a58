"""The fit of a recording's magnetometer, added to the report of the other sensors."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.notices import not_calibrated
from imucal_wizard.core.quantities import capitalized
from imucal_wizard.core.readings import BoolArray, Readings, Series
from imucal_wizard.core.statistics import median, robust_deviation
from imucal_wizard.estimate.ellipsoid.coverage import bin_of
from imucal_wizard.estimate.magnetometer.field_disturbances import (
    FEWEST_IN_BLOCK,
    find_disturbances,
)
from imucal_wizard.estimate.magnetometer.fit import MagnetometerFit, fit_magnetometer
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.measurement.field_quality import check_readings, check_saturation, stuck_samples
from imucal_wizard.measurement.rounding import resolution_of, rounding_shift

Fit = Callable[[], MagnetometerFit]
"""Fits the magnetometer, or raises a ``DataError`` that says why it cannot."""


def with_magnetometer(
    inertial: Callable[[], FitReport],
    magnetic: Fit,
    series: Series,
    gravity: float,
    warnings: tuple[str, ...],
) -> FitReport:
    """The report of the other sensors with the magnetometer's fit in it.

    A recording in which the device only tumbles carries no accelerometer; its magnetometer is
    calibrated all the same, and the other way round.

    Args:
        inertial: makes the report of the other sensors.
        magnetic: fits the magnetometer.
        series: all its readings, in the order of time.
        gravity: of a report without an accelerometer, m/s².
        warnings: what the reader noticed, for such a report.

    Raises:
        DataError: neither can be calibrated.
    """
    found, why = _tried(magnetic)
    try:
        report = inertial()
    except DataError as error:
        if found is None:
            raise DataError(f"{error}. {capitalized(why)}") from error
        notes = (*warnings, not_calibrated("accelerometer", error))
        report = FitReport(gravity, {}, (), (), {}, warnings=notes)
    return added(report, series, found, why)


def fit_during(
    spans: Sequence[tuple[float, float]],
    series: Series,
    field: float | None,
    method: str,
    readings: Readings | None = None,
) -> MagnetometerFit:
    """The magnetometer by the samples of its own step.

    There the device is turned in one place, away from iron; what comes before may have been
    measured beside a computer. The samples at rest serve the second stage, and are judged by this
    calibration.

    Args:
        spans: sample times at which the step began and ended, s.
        series: all readings, in the order of time.
        field: magnitude of the local field, µT, or None.
        method: ``orthogonal``, ``algebraic``, ``two-step`` or ``numeric``.
        readings: all samples of the session, for temperature and current.

    Raises:
        DataError: the step was left out, or the samples do not determine a calibration.
    """
    if not spans:
        check_readings(series.values)
        raise DataError("its step was left out")
    found = fit_magnetometer(samples_during(spans, series), field, method, readings)
    _check_saturation(found, samples_during(((spans[0][0], spans[-1][1]),), series))
    return classify_unfitted(found, series, _within(spans, series))


def _check_saturation(found: MagnetometerFit, step: Series) -> None:
    """An axis at its end is off the others, and so may have been left out as a disturbance.

    Raises:
        DataError: an axis is saturated.
    """
    stuck = stuck_samples(step.values)
    if stuck:
        length = np.linalg.norm((step.values - found.fit.bias) @ found.fit.matrix.T, axis=1)
        gain = found.magnitude / found.start.radius
        check_saturation(stuck, length - found.magnitude, gain * resolution_of(step.values))


def samples_during(spans: Sequence[tuple[float, float]], series: Series) -> Series:
    """The samples within spans of time, ends included."""
    rows = _within(spans, series)
    return Series(series.time[rows], series.values[rows], series.unit)


def _within(spans: Sequence[tuple[float, float]], series: Series) -> BoolArray:
    rows = np.zeros(len(series), bool)
    for start, end in spans:
        rows |= (series.time >= start) & (series.time <= end)
    return rows


def _tried(magnetic: Fit) -> tuple[MagnetometerFit | None, str]:
    try:
        return magnetic(), ""
    except DataError as error:
        return None, not_calibrated("magnetometer", error)


def _rate(series: Series) -> float:
    """Mean rate: a slow sensor in the lines of a faster one has steps of two lengths."""
    length = float(series.time[-1] - series.time[0]) if len(series) > 1 else 0.0
    return (len(series) - 1) / length if length > 0.0 else 0.0


def added(
    report: FitReport, series: Series, found: MagnetometerFit | None, why: str = ""
) -> FitReport:
    """A report with the magnetometer's fit, or with the reason why there is none."""
    rates = {**report.rates, "magnetometer": _rate(series)}
    if found is None:
        return replace(report, rates=rates, warnings=(*report.warnings, why))
    return replace(
        report,
        rates=rates,
        sensors={**report.sensors, "magnetometer": found.fit},
        magnetic=found,
        warnings=tuple(dict.fromkeys((*report.warnings, *found.fit.warnings))),
    )


EXACT_SHARE = 1e-9
"""Scatter below which readings are exact, as a share of the field."""


def classify_unfitted(found: MagnetometerFit, series: Series, fitted: BoolArray) -> MagnetometerFit:
    """The fit of some samples, which says of the others, too, whether they were disturbed.

    The field may be another one there: what counts is that it is the same all the while.

    Args:
        found: by the samples fitted.
        series: all readings, in the order of time.
        fitted: which of them were fitted, shape (n,).
    """
    calm = np.zeros(len(series), bool)
    calm[fitted] = found.kept
    others = ~fitted
    if others.sum() > FEWEST_IN_BLOCK:
        corrected = (series.values[others] - found.fit.bias) @ found.fit.matrix.T
        length = np.linalg.norm(corrected, axis=1)
        usual = median(length)
        distance = length / usual - 1.0
        areas = bin_of((corrected / length[:, None]).T)
        sigma = max(robust_deviation(distance), EXACT_SHARE)
        gain = float(np.cbrt(abs(np.linalg.det(found.fit.matrix))))
        shift = rounding_shift(sigma, resolution_of(series.values[others]) * gain / usual)
        calm[others] = find_disturbances(distance, series.time[others], areas, sigma, shift)[0]
    return replace(found, calm=calm)
