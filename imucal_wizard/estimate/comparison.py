"""Every method of every sensor on one recording, side by side: both papers' and our own."""

from collections.abc import Callable, Sequence

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.gyroscope_report import fit_gyroscope
from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
from imucal_wizard.estimate.methods import DEFAULTS, MethodNames, methods_of
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.estimate.rest_spectrum import RestSpectrum, rest_spectrum
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.measurement.repeats import without_repeats

EQUAL_ERROR_RATIO = 1.02
"""Errors whose ratio is less than this are the same."""


@dataclass(frozen=True, eq=False)
class MethodRow:
    """One method's result.

    Attributes:
        sensor: which sensor.
        method: its name.
        paper: ``Q``, ``N``, or "" for our own.
        fit: the result, or None.
        relative_error: rms of the relative error of the magnitude (N's figure of merit), or None.
        relative_error_held_out: the same on directions left out.
        why: why there is no result.
    """

    sensor: str
    method: str
    paper: str
    fit: SensorFit | None
    relative_error: float | None = None
    relative_error_held_out: float | None = None
    why: str = ""


def method_rows(
    report: FitReport, gyroscope: str | None, series: Series | None, field: float | None
) -> tuple[MethodRow, ...]:
    """A row for each method of each sensor, on the holds and rotations of a report.

    Args:
        report: the default fit.
        gyroscope: unit of the gyroscope's readings, or None without one.
        series: the magnetometer's readings that its calibration is made of, or None.
        field: magnitude of the local field, µT, or None.
    """
    rows: list[MethodRow] = []
    if "accelerometer" in report.sensors:
        unit = report.sensors["accelerometer"].bias_unit
        rows += [
            _row(report, "accelerometer", name, _accelerometer(report, unit, name), report.gravity)
            for name in MethodNames("accelerometer")
        ]
        if gyroscope is not None:
            rows += _gyroscopes(report, _default_accelerometer(report, unit), gyroscope)
    if series is not None:
        series = without_repeats(series)
        rows += [_magnetometer(report, series, field, name) for name in MethodNames("magnetometer")]
    return tuple(rows)


def _gyroscopes(report: FitReport, reference: SensorFit, unit: str) -> list[MethodRow]:
    both = report.sensors.get("gyroscope")
    readings = None if both is None or both.experiment is None else both.experiment.readings
    known = readings, rest_spectrum(readings, report.holds)
    rows = [
        _row(report, "gyroscope", name, _gyroscope(report, reference, unit, name, *known))
        for name in MethodNames("gyroscope")
    ]
    if both is not None and both.method not in MethodNames("gyroscope"):
        rows.append(MethodRow("gyroscope", both.method, "", both))
    return rows


def _default_accelerometer(report: FitReport, unit: str) -> SensorFit:
    """The default fit, which the report has unless another method was asked for."""
    fit = report.sensors["accelerometer"]
    if fit.method == DEFAULTS["accelerometer"]:
        return fit
    return fit_accelerometer(report.holds, report.gravity, unit)


Fit = Callable[[], SensorFit]


def _paper(sensor: str, name: str) -> str:
    found = methods_of(sensor).get(name)
    return "" if found is None else found.paper


def _row(
    report: FitReport, sensor: str, name: str, make: Fit, size: float | None = None
) -> MethodRow:
    """The row of a method; where the report has its result, that one."""
    paper, known = _paper(sensor, name), report.sensors.get(sensor)
    try:
        fit = known if known is not None and known.method == name else make()
    except DataError as error:
        return MethodRow(sensor, name, paper, None, why=str(error))
    if size is None:
        return MethodRow(sensor, name, paper, fit)
    out = None if fit.rms_held_out is None else fit.rms_held_out / size
    return MethodRow(sensor, name, paper, fit, fit.rms_fitted / size, out)


def _accelerometer(report: FitReport, unit: str, name: str) -> Fit:
    return lambda: fit_accelerometer(report.holds, report.gravity, unit, name)


def _gyroscope(
    report: FitReport,
    reference: SensorFit,
    unit: str,
    name: str,
    readings: Readings | None,
    spectrum: RestSpectrum | None,
) -> Fit:
    def make() -> SensorFit:
        args = report.holds, report.rotations, reference, unit, name, readings, spectrum
        found = fit_gyroscope(*args)
        if found.fit is None:
            raise DataError("; ".join(found.warnings))
        return found.fit

    return make


def _magnetometer(report: FitReport, series: Series, field: float | None, name: str) -> MethodRow:
    """The row of a method, in the frame of the report."""
    paper, known, stage = _paper("magnetometer", name), report.magnetic, report.second_stage
    try:
        found = known
        if found is None or found.fit.method != name:
            readings = None if known is None else known.data.readings
            found = fit_magnetometer(series, field, name, readings)
        fit = found.fit
        if found is known:
            fit = report.sensors["magnetometer"]
        elif stage is not None:
            fit = found.aligned(stage.alignment)
    except DataError as error:
        return MethodRow("magnetometer", name, paper, None, why=str(error))
    errors = found.relative_error, found.relative_error_held_out
    return MethodRow("magnetometer", name, paper, fit, *errors)


def difference(row: MethodRow, first: MethodRow) -> float | None:
    """By how much a method's matrix differs from the first one's, as a share (largest entry).

    All methods of a sensor give it in one frame and for one magnitude, and leave at its nominal
    value what they do not fit.
    """
    if row.fit is None or first.fit is None:
        return None
    size = float(np.abs(first.fit.matrix).max())
    return float(np.abs(row.fit.matrix - first.fit.matrix).max()) / size


def offset_difference(row: MethodRow, first: MethodRow) -> float | None:
    """The largest corrected reading that is left where the first method would give zero.

    In the unit of corrected readings, so that sensors in counts are told in the same one.
    """
    if row.fit is None or first.fit is None:
        return None
    return float(np.abs(first.fit.matrix @ (row.fit.bias - first.fit.bias)).max())


def least_held_out(rows: Sequence[MethodRow]) -> tuple[MethodRow, ...]:
    """The methods of a sensor with the least error held out, and those as good as them.

    Methods whose error is another one (the gyroscope's offset: a rate) do not compete.
    """
    unit = next((row.fit.unit for row in rows if row.fit is not None), "")
    known = [
        (row.fit.rms_held_out, row)
        for row in rows
        if row.fit is not None and row.fit.unit == unit and row.fit.rms_held_out is not None
    ]
    least = min((error for error, _ in known), default=0.0)
    return tuple(row for error, row in known if error <= EQUAL_ERROR_RATIO * least)
