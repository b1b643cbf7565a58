"""A fit as a calibration file holds it: figures, verdicts, device, place."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from imucal_wizard.core import VERSION
from imucal_wizard.core.description import Description, Location
from imucal_wizard.core.output import without_control_characters
from imucal_wizard.core.quantities import finite_or_none, number, unit_sign
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.parameters import covariance_of
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.model.unknown_shape import UnknownShape
from imucal_wizard.report.calibration_file import (
    CALIBRATION_SCHEMA,
    Calibration,
    Device,
    SavedEffect,
    SavedRung,
    Sensor,
    Value,
)
from imucal_wizard.report.measured import (
    field_means,
    hold_means,
    rotation_increments,
    table_means,
)

if TYPE_CHECKING:  # a fit without a verdict does without their imports
    from imucal_wizard.diagnose.diagnosis import Diagnosis
    from imucal_wizard.diagnose.grade import Limits


def sensor_record(fit: SensorFit) -> Sensor:
    """A sensor's fit as it stands in JSON, without a verdict.

    Args:
        fit: with or without effects.
    """
    effects = []
    where = None if fit.experiment is None else fit.experiment.circumstances
    for term, sizes in zip(fit.terms, fit.sizes, strict=True):
        parameters = term.effect.parameters(fit.sensor)
        effects.append(
            SavedEffect(
                term=term.name,
                sensor=fit.sensor,
                equation=term.effect.equation,
                parameters=[one.name for one in parameters],
                sizes=sizes.tolist(),
                unit=parameters[0].unit,
                variant=term.variant,
                reference_temperature=None
                if where is None
                else finite_or_none(where.reference_temperature),
                reference_time=None if where is None else finite_or_none(where.reference_time),
                reach=term.effect.reach if isinstance(term.effect, UnknownShape) else None,
                splits=True if term.effect.sudden else None,
            )
        )
    repeats, joint = fit.repeatability, covariance_of(fit)
    return Sensor(
        model=list(fit.model),
        method=fit.method,
        frame=fit.frame,
        matrix=fit.matrix.tolist(),
        bias=fit.bias.tolist(),
        bias_unit=fit.bias_unit,
        parameters={
            p.name: Value(p.value, p.unit, p.standard_error, p.carried, p.standard_error_repeats)
            for p in fit.parameters
        },
        unit=fit.unit,
        rms_before=fit.rms_before,
        rms_fitted=fit.rms_fitted,
        rms_held_out=fit.rms_held_out,
        floor=fit.floor,
        floor_fitted=fit.floor_fitted,
        held_out_interval=fit.held_out_interval,
        slow_noise_measured=fit.slow_noise_measured,
        rms_validation=fit.validation_rms,
        repeatability=None if repeats is None else finite_or_none(repeats.rms),
        repeatability_interval=None
        if repeats is None or not np.isfinite(repeats.interval).all()
        else list(repeats.interval),
        repeatability_unit=None if repeats is None else repeats.unit,
        not_determined=list(fit.not_determined),
        usable=not fit.unusable,
        covariance=None if fit.covariance is None else fit.covariance.tolist(),
        parameter_covariance=None if joint is None else joint.tolist(),
        degrees_of_freedom=fit.degrees_of_freedom or None,
        warnings=list(fit.warnings),
        effects=effects,
    )


def from_report(
    report: FitReport,
    source: str,
    created: str,
) -> Calibration:
    """The calibration that a report contains.

    Args:
        report: the fit.
        source: description of the source.
        created: date and time, ISO 8601.
    """
    known = [hold.temperature for hold in report.holds if hold.temperature is not None]
    return Calibration(
        schema=CALIBRATION_SCHEMA,
        program=VERSION,
        created=created,
        source=without_control_characters(source),
        gravity=Value(report.gravity, "m/s^2"),
        temperature=(min(known), max(known)) if known else None,
        holds=len(report.holds),
        rotations=sum(rotation.problem is None for rotation in report.rotations),
        sensors={name: sensor_record(fit) for name, fit in report.sensors.items()},
        warnings=list(report.notes(judged=False)),
        hold_means=hold_means(report),
        rotation_increments=rotation_increments(report),
        field_means=field_means(report),
        table_means=table_means(report),
        place={"gravity": "standard" if report.gravity == STANDARD_GRAVITY else "given"},
    )


def described(
    calibration: Calibration,
    about: Description,
    *,
    stream_format: str = "",
    session: str | None = None,
    measured: str | None = None,
    fingerprint: str | None = None,
) -> Calibration:
    """The calibration with what is known of device and measurement.

    Args:
        calibration: the result; what it says already stays where nothing else is said.
        about: what the user says.
        stream_format: of the readings, or "".
        session: name of the session's file, or None.
        measured: date and time of the measurement, ISO 8601, or None.
        fingerprint: of the bytes that were measured, or None.
    """
    before = calibration.device or Device()
    device = Device(
        about.device or before.name,
        about.serial or before.serial,
        stream_format or before.format,
        before.ranges or _measured_ranges(calibration),
        about.chip or before.chip,
    )
    place = {"name": about.place} if about.place else {}
    return msgspec.structs.replace(
        calibration,
        device=device,
        place=calibration.place | place,
        operator=about.operator or calibration.operator,
        note=about.note or calibration.note,
        session=session or calibration.session,
        measured=measured or calibration.measured,
        fingerprint=fingerprint or calibration.fingerprint,
    )


def located(calibration: Calibration, where: Location) -> Calibration:
    """The calibration whose gravity follows from its place.

    Args:
        calibration: the result.
        where: the place.
    """
    place = {
        "gravity": "normal",
        "latitude": f"{where.latitude:g}",
        "height": f"{where.height:g}",
    }
    return msgspec.structs.replace(calibration, place=calibration.place | place)


def _measured_ranges(calibration: Calibration) -> dict[str, str]:
    """Smallest and largest reading that the calibration rests on, by sensor."""
    readings = {
        "accelerometer": [hold.accelerometer for hold in calibration.hold_means],
        "gyroscope": [
            row for one in calibration.rotation_increments for row in one.readings().tolist()
        ],
        "magnetometer": [one.reading for one in calibration.field_means],
    }
    return {
        name: f"{number(min(map(min, rows)))} to {number(max(map(max, rows)))}"
        f" {unit_sign(calibration.sensors[name].bias_unit)}"
        for name, rows in readings.items()
        if rows and name in calibration.sensors
    }


def sensor_records(
    report: FitReport,
    diagnoses: "Mapping[str, Diagnosis]",
    limits: "Limits | None" = None,
) -> dict[str, Sensor]:
    """Each sensor's fit as it stands in JSON, with its verdict and its grade.

    Args:
        report: the fit.
        diagnoses: of its sensors; empty where none was asked for.
        limits: of use; the usual ones when left out.
    """
    sensors = {name: sensor_record(fit) for name, fit in report.sensors.items()}
    if not diagnoses:
        return sensors
    from imucal_wizard.diagnose.grade import graded

    grades = graded(report, diagnoses, limits)
    for name in sensors.keys() & diagnoses.keys():
        sensors[name] = msgspec.structs.replace(
            sensors[name],
            verdict=str(diagnoses[name].verdict),
            could_be=diagnoses[name].could_be,
            grade=str(grades[name].grade),
            limit=grades[name].limit,
        )
    return sensors


def judged(
    calibration: Calibration,
    report: FitReport,
    diagnoses: "Mapping[str, Diagnosis]",
    limits: "Limits | None" = None,
) -> Calibration:
    """A calibration with the verdicts and grades of its sensors, see ``sensor_records``."""
    return msgspec.structs.replace(
        calibration,
        sensors=sensor_records(report, diagnoses, limits),
        warnings=list(report.notes(judged=bool(diagnoses))),
        ladders={
            name: [
                SavedRung(
                    list(one.model),
                    one.added,
                    one.rms_fitted,
                    one.rms_held_out,
                    one.floor,
                    one.confirmed,
                )
                for one in said.ladder
            ]
            for name, said in diagnoses.items()
            if name in report.sensors
        },
        says={name: said.says for name, said in diagnoses.items() if name in report.sensors},
    )
