"""The magnetometer of a recording, beside whatever the accelerometer and gyroscope gave."""

from collections.abc import Callable
from dataclasses import replace

from imucal_wizard.errors import DataError
from imucal_wizard.fitting.verdict import verdict
from imucal_wizard.readings import Series
from imucal_wizard.solver.magnetometer.fit import fit_magnetometer
from imucal_wizard.solver.magnetometer.report import MagnetometerFit
from imucal_wizard.solver.result import FitReport


def with_magnetometer(
    inertial: Callable[[], FitReport],
    series: Series,
    field: float | None,
    method: str,
    gravity: float,
    warnings: tuple[str, ...],
) -> FitReport:
    """The report of the other sensors with the magnetometer's fit in it.

    A recording in which the device only tumbles carries no accelerometer; its magnetometer is
    calibrated all the same, and the other way round.

    Args:
        inertial: makes the report of the other sensors.
        series: the magnetometer's readings, in the order of time.
        field: magnitude of the local field, µT, or None.
        method: ``orthogonal``, ``algebraic``, ``two-step`` or ``numeric``.
        gravity: of a report without an accelerometer, m/s².
        warnings: what the reader noticed, for such a report.

    Raises:
        DataError: neither can be calibrated.
    """
    found, why = _fit(series, field, method)
    try:
        report = inertial()
    except DataError as error:
        if found is None:
            raise DataError(f"{error}. {why}") from error
        notes = (*warnings, f"the accelerometer is not calibrated: {error}")
        report = FitReport(gravity, {}, (), (), {}, warnings=notes)
    return added(report, series, found, why)


def _fit(series: Series, field: float | None, method: str) -> tuple[MagnetometerFit | None, str]:
    try:
        return fit_magnetometer(series, field, method), ""
    except DataError as error:
        return None, f"the magnetometer is not calibrated: {error}"


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
        report = replace(report, rates=rates, warnings=(*report.warnings, why))
        return replace(report, verdict=verdict(report))
    report = replace(
        report,
        rates=rates,
        sensors={**report.sensors, "magnetometer": found.fit},
        magnetic=found,
        warnings=tuple(dict.fromkeys((*report.warnings, *found.fit.warnings))),
    )
    return replace(report, verdict=verdict(report))
