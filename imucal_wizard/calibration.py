"""The calibration on disk: unit-carrying, versioned JSON that reads back to the same numbers."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from imucal_wizard import __version__
from imucal_wizard.calibration_effects import SavedEffect, apply_effects, saved_effects
from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.errors import RecordingError, UsageError
from imucal_wizard.output import harmless
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.result import FitReport, SensorFit

SCHEMA = "imucal-wizard/calibration/1"


class Value(msgspec.Struct, frozen=True, forbid_unknown_fields=False):
    """A number with its unit and standard error."""

    value: float
    unit: str
    standard_error: float | None = None
    carried: bool = True
    standard_error_repeats: float | None = None


class Sensor(msgspec.Struct, frozen=True):
    """One sensor: ``corrected = matrix · (reading − bias)``, in SI.

    ``matrix`` is SI per reading unit, ``bias`` is in ``bias_unit``, the errors are in ``unit``.
    With ``effects``, which the bench has found, ``corrected`` is that less their error.
    """

    model: list[str]
    method: str
    frame: str
    matrix: list[list[float]]
    bias: list[float]
    bias_unit: str
    parameters: dict[str, Value]
    unit: str
    rms_before: float | None
    rms_fitted: float
    rms_held_out: float | None
    floor: float | None = None
    rms_validation: float | None = None
    covariance: list[list[float]] | None = None
    warnings: list[str] = []
    effects: list[SavedEffect] = []

    def apply(self, readings: FloatArray, where: Circumstances | None = None) -> FloatArray:
        """Corrected vectors, SI, shape (n, 3).

        Args:
            readings: in ``bias_unit``, shape (n, 3).
            where: circumstances of each reading, for effects that follow more than the reading.

        Raises:
            UsageError: an effect is not known here, or follows what was not given.
        """
        matrix, bias = np.array(self.matrix), np.array(self.bias)
        if self.effects:
            return apply_effects(self.effects, (matrix, bias), readings, where)
        return np.asarray((readings - bias) @ matrix.T)


class Calibration(msgspec.Struct, frozen=True):
    """A result on disk.

    Attributes:
        schema: names this format and its version.
        program: version of the program that wrote it.
        created: date and time, ISO 8601 with offset.
        source: what was calibrated, in words.
        gravity: local gravity used.
        temperature: lowest and highest during the measurement, °C, or None.
        holds: how many still positions it rests on.
        rotations: how many rotations.
        sensors: the calibration of each sensor.
        warnings: what the user must know.
    """

    schema: str
    program: str
    created: str
    source: str
    gravity: Value
    temperature: tuple[float, float] | None
    holds: int
    rotations: int
    sensors: dict[str, Sensor]
    warnings: list[str] = []


def sensor_record(fit: SensorFit) -> Sensor:
    """One sensor's fit as it stands in JSON."""
    covariance = None if fit.covariance is None else fit.covariance.tolist()
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
        rms_validation=fit.validation_rms,
        covariance=covariance,
        warnings=list(fit.warnings),
    )


def with_effects(plain: SensorFit, model: Extended, where: Circumstances) -> Sensor:
    """A sensor with the effects that the bench has added to its model.

    Args:
        plain: its fit without them, for what the bench does not ask of.
        model: its fit with them.
        where: the circumstances that this was fitted under.
    """
    record = sensor_record(replace(model.fit, warnings=plain.warnings))
    return msgspec.structs.replace(record, effects=saved_effects(model, where))


def from_report(
    report: FitReport,
    source: str,
    created: str,
    models: Mapping[str, tuple[Extended, Circumstances]] | None = None,
) -> Calibration:
    """The calibration that a report contains.

    Args:
        report: the fit.
        source: what was calibrated, in words.
        created: date and time, ISO 8601.
        models: of sensors that the bench has added effects to, with their circumstances.
    """
    sensors = {name: sensor_record(fit) for name, fit in report.sensors.items()}
    for name, (model, where) in (models or {}).items():
        sensors[name] = with_effects(report.sensors[name], model, where)
    known = [hold.temperature for hold in report.holds if hold.temperature is not None]
    return Calibration(
        schema=SCHEMA,
        program=__version__,
        created=created,
        source=harmless(source),
        gravity=Value(report.gravity, "m/s^2"),
        temperature=(min(known), max(known)) if known else None,
        holds=len(report.holds),
        rotations=sum(rotation.problem is None for rotation in report.rotations),
        sensors=sensors,
        warnings=list(report.warnings),
    )


def encode(document: object) -> bytes:
    """JSON with indentation, numbers so that they read back to the same bits."""
    return msgspec.json.format(msgspec.json.encode(document), indent=1) + b"\n"


def save(calibration: Calibration, path: Path) -> Path:
    """Write a calibration whole or not at all.

    Raises:
        UsageError: the place cannot be written.
    """
    draft = path.with_name(path.name + ".part")
    try:
        draft.write_bytes(encode(calibration))
        draft.replace(path)
    except OSError as error:
        raise UsageError(
            f"the calibration cannot be written to {path}: {error.strerror or error}. "
            "Choose another place with --save"
        ) from error
    return path


def says_the_same(path: Path, calibration: Calibration) -> bool:
    """Whether a file holds this calibration, whenever it was made."""
    try:
        found = load(path)
    except RecordingError:
        return False
    return encode(msgspec.structs.replace(found, created=calibration.created)) == encode(
        calibration
    )


def load(path: Path) -> Calibration:
    """Read a calibration back.

    Raises:
        RecordingError: the file is missing, is no calibration, or of another version.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror or error}") from error
    try:
        loose: Any = msgspec.json.decode(data)
    except msgspec.DecodeError as error:
        raise RecordingError(f"{path} is not JSON ({error}): give a saved calibration") from error
    schema = loose.get("schema") if isinstance(loose, dict) else None
    if schema != SCHEMA:
        raise RecordingError(
            f"{path} says {schema!r} where {SCHEMA!r} is expected: it is no calibration that this "
            "version reads"
        )
    try:
        return msgspec.json.decode(data, type=Calibration)
    except msgspec.ValidationError as error:
        raise RecordingError(f"{path} is damaged: {error}") from error
