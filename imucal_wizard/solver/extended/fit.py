"""One road to every fit with effects, whatever the sensor."""

from collections.abc import Sequence

from imucal_wizard.errors import DataError
from imucal_wizard.readings import Readings
from imucal_wizard.solver.extended.accelerometer import fit_accelerometer_with
from imucal_wizard.solver.extended.field_data import FIELD_BASE, FieldData
from imucal_wizard.solver.extended.field_measuring import field_data
from imucal_wizard.solver.extended.gyroscope import fit_gyroscope_with
from imucal_wizard.solver.extended.hold_data import BASE, HoldData, hold_data
from imucal_wizard.solver.extended.magnetometer import fit_magnetometer_with
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.terms import Term
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.solver.extended.turn_measuring import turn_data
from imucal_wizard.solver.result import FitReport

Measured = HoldData | TurnData | FieldData
"""All that is known of one sensor."""


def measured_accelerometer(report: FitReport, readings: Readings | None = None) -> HoldData:
    """What is known of the accelerometer of a recording that has been fitted.

    Args:
        report: its plain fit.
        readings: the recording, for the session's beginning and the vibration.

    Raises:
        DataError: it could not be fitted, or the holds do not carry a calibration.
    """
    if "accelerometer" not in report.sensors:
        raise DataError("there is no fitted accelerometer to go on from")
    unit = report.sensors["accelerometer"].bias_unit
    return hold_data(report.holds, report.gravity, unit, readings)


def measured_gyroscope(
    report: FitReport, accelerometer: Extended, readings: Readings | None = None
) -> TurnData:
    """What is known of the gyroscope, with gravity as the accelerometer's fit sees it.

    Args:
        report: the plain fit of the recording.
        accelerometer: its accelerometer, with all the effects that it turned out to have.
        readings: the recording, for the session's beginning and the temperature.

    Raises:
        DataError: there is no gyroscope, or it could not be fitted.
    """
    if "gyroscope" not in report.sensors or accelerometer.accelerometer is None:
        raise DataError("there is no fitted gyroscope to go on from")
    return turn_data(
        report.holds,
        report.rotations,
        accelerometer.accelerometer,
        report.sensors["gyroscope"],
        report.gravity,
        readings,
    )


def measured_magnetometer(
    report: FitReport, readings: Readings, accelerometer: Extended | None = None
) -> FieldData:
    """What is known of the magnetometer of a recording that has been fitted.

    Args:
        report: its plain fit.
        readings: the recording.
        accelerometer: its accelerometer where that is complete; gravity shows the dip.

    Raises:
        DataError: there is no magnetometer, or it could not be fitted.
    """
    if report.magnetic is None:
        raise DataError("there is no fitted magnetometer to go on from")
    passed = None if accelerometer is None else accelerometer.accelerometer
    holds = report.holds if passed is not None else ()
    return field_data(report.magnetic, readings, holds, passed, report.gravity, report.second_stage)


def whole_base(measured: Measured) -> tuple[str, ...]:
    """All terms of the base model of the sensor that was measured."""
    return FIELD_BASE if isinstance(measured, FieldData) else BASE


def fit_with(
    measured: Measured, terms: Sequence[Term] = (), base: Sequence[str] | None = None
) -> Extended:
    """The MAP fit of the base terms and effects asked for.

    Args:
        measured: see ``measured_accelerometer`` and its neighbours.
        terms: the effects.
        base: terms of the base model that are fitted; all of them when not given.

    Raises:
        DataError: the data do not carry it, or it does not converge.
        UsageError: a term or an effect that this sensor does not have.
    """
    base = whole_base(measured) if base is None else base
    if isinstance(measured, HoldData):
        return fit_accelerometer_with(measured, terms, base)
    if isinstance(measured, FieldData):
        return fit_magnetometer_with(measured, terms, base)
    return fit_gyroscope_with(measured, terms, base)
