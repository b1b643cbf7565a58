"""The calibration on disk: versioned JSON with units that reads back to the same numbers.

``load(path)["accelerometer"].apply(readings)`` corrects readings with what the file holds; nothing
else is needed. The same ``Sensor`` record is the sensor's part of the JSON of ``fit`` and the
result of ``calibrate`` in Python, so that all of them give the same figures.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from imucal_wizard.core.errors import DataError, RecordingError, UsageError
from imucal_wizard.core.input import read_schema
from imucal_wizard.core.output import encode_json, write_atomically
from imucal_wizard.core.quantities import or_nan
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import is_covariance
from imucal_wizard.core.units import COUNT, SI_UNIT
from imucal_wizard.estimate.result import unchecked_scale, worse_than_none
from imucal_wizard.model.catalogue import builtin_effects, effect
from imucal_wizard.model.effect import INPUT_OF, Circumstances, Effect
from imucal_wizard.model.terms import Term, Terms, corrected
from imucal_wizard.model.unknown_shape import UnknownShape
from imucal_wizard.report.measured import (
    FieldMean,
    HoldMeans,
    RotationIncrements,
    TableMeans,
    wrong_measurements,
)
from imucal_wizard.report.proof import contradiction, lacks_temperature

CALIBRATION_SCHEMA = "imucal-wizard/calibration/1"
COVARIANCE_ENTRIES = {"accelerometer": 9, "gyroscope": 12}
"""Numbers in bias and matrix that ``Sensor.covariance`` is of: an accelerometer's matrix has no
entries below its diagonal."""


class Value(msgspec.Struct, frozen=True):
    """A number with its unit and standard error.

    Attributes:
        value: in ``unit``.
        unit: unit word.
        standard_error: one standard deviation, or None if the data give no estimate of it.
        carried: False if the data cannot determine it, so that it has its nominal value.
        standard_error_repeats: from the repeated poses alone, or None.
    """

    value: float
    unit: str
    standard_error: float | None = None
    carried: bool = True
    standard_error_repeats: float | None = None


class SavedEffect(msgspec.Struct, frozen=True):
    """One effect: ``x = matrix · (reading − bias) − ε(x)`` with ``ε = Σ size · shape``.

    Attributes:
        term: its name.
        sensor: its sensor.
        equation: as it is written, sizes in ``unit``.
        parameters: names of the sizes.
        sizes: in ``unit``.
        unit: of the first size.
        variant: value of its non-linear parameter.
        reference_temperature: °C at which an effect of the temperature is zero.
        reference_time: s after the session's first sample at which a drift is zero.
        reach: of a free curve, see ``UnknownShape``; None for the usual one.
        splits: whether a step inside a hold counts for the part of the hold after it; None in older
            files, whose holds are before or after it as a whole, and for other effects.
    """

    term: str
    sensor: str
    equation: str
    parameters: list[str]
    sizes: list[float]
    unit: str
    variant: float | None = None
    reference_temperature: float | None = None
    reference_time: float | None = None
    reach: float | None = None
    splits: bool | None = None

    def known(self, own: Sequence[Effect] = ()) -> Term:
        """The effect itself.

        Args:
            own: the user's own effects.

        Raises:
            UsageError: it is in neither the catalogue nor ``own``, or has sizes in another unit.
        """
        try:
            found = effect(self.term, own)
        except UsageError as error:
            raise UsageError(
                f"the calibration of the {self.sensor} has the effect {self.term!r}, which is none "
                "of this program: give the file that defines it, or calibrate without it",
                settings=("effects",),
            ) from error
        units = found.stored_units(self.sensor)
        if self.unit not in units:
            raise UsageError(
                f"the calibration of the {self.sensor} has the effect {self.term!r} in "
                f"{self.unit!r}, and this program has it in {' or '.join(units)}: calibrate again"
            )
        if isinstance(found, UnknownShape):
            found = found.reaching(self.reach)
        return Term(found, self.variant)


class AsFound(msgspec.Struct, frozen=True):
    """How large the error was before this calibration.

    Attributes:
        error: rms of these readings, corrected by the calibration before; in the sensor's ``unit``.
        by: name of that calibration's file.
        created: its date, ISO 8601.
    """

    error: float
    by: str
    created: str


class SavedRung(msgspec.Struct, frozen=True):
    """One model on the way to that of the file, with its errors in the sensor's ``unit``.

    Attributes:
        model: its terms.
        added: the term that was added to the model before, or None.
        rms_fitted: error on the data fitted.
        rms_held_out: error on data held out, or None.
        floor: that a complete model would have there by measured noise, or None.
        confirmed: whether data held out agree that the added term is real, or None.
    """

    model: list[str]
    added: str | None
    rms_fitted: float
    rms_held_out: float | None
    floor: float | None
    confirmed: bool | None = None


class Sensor(msgspec.Struct, frozen=True):
    """One sensor: ``corrected = matrix · (reading − bias)``, in SI.

    Attributes:
        model: terms.
        method: name of the method.
        frame: ``own`` or ``accelerometer``.
        matrix: SI per reading unit, 3×3.
        bias: in ``bias_unit``.
        bias_unit: unit of the readings.
        parameters: every parameter by name.
        unit: of the errors below.
        rms_before: error with the nominal conversion only; of counts, with one common scale and a
            bias fitted to these readings; or None.
        rms_fitted: error on the data fitted.
        rms_held_out: error on directions or rotations left out one at a time, or None.
        held_out_interval: between which the rms of new holds or rotations lies nine times in ten,
            or None.
        slow_noise_measured: whether repeats, a long rest or long holds show how slow noise moves
            the biases; None of a sensor of which that is not asked.
        floor: ``rms_held_out`` that a complete model would have by measured noise, or None.
        floor_fitted: the same of ``rms_fitted``, or None.
        could_be: error without noise that is exceeded with a probability of 5 % in a random
            direction, given these data and how often and how large sensors have each known effect;
            None without a verdict.
        rms_validation: error on poses taken after the fit, or None.
        repeatability: scatter of the visits to one pose, rms (of the gyroscope: of its rates at
            rest), or None where no pose was repeated or the method does not show it.
        repeatability_interval: 90 % interval of ``repeatability``, or None.
        repeatability_unit: of both, or None.
        not_determined: parameters that the data cannot determine.
        verdict: of the bench on this model; None if it was not asked for.
        grade: ``good``, ``doubtful`` or ``not-usable``; None without a verdict.
        limit: of use, which the grade was given for, in ``unit``; None without a grade.
        usable: whether applying it is better than not, on data held out; None in older files.
        covariance: of the biases and the entries of the matrix, or None.
        parameter_covariance: of all ``parameters`` in their order, sizes of effects included; zeros
            for those that the data do not determine; None where there are no standard errors.
        degrees_of_freedom: of the standard errors; None in older files.
        warnings: what the user must know.
        effects: of the model; ``corrected`` is then the formula above minus their error.
        as_found: by the calibration before; None where the device has none that applies, so that
            ``rms_before`` contains it.
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
    floor_fitted: float | None = None
    held_out_interval: tuple[float, float] | None = None
    slow_noise_measured: bool | None = None
    could_be: float | None = None
    rms_validation: float | None = None
    repeatability: float | None = None
    repeatability_interval: list[float] | None = None
    repeatability_unit: str | None = None
    not_determined: list[str] = []
    verdict: str | None = None
    grade: str | None = None
    limit: float | None = None
    usable: bool | None = None
    covariance: list[list[float]] | None = None
    parameter_covariance: list[list[float]] | None = None
    degrees_of_freedom: int | None = None
    warnings: list[str] = []
    effects: list[SavedEffect] = []
    as_found: AsFound | None = None

    @property
    def error_as_found(self) -> float | None:
        """Error by the calibration before, else ``rms_before``."""
        return self.rms_before if self.as_found is None else self.as_found.error

    @property
    def error_as_left(self) -> float:
        """Error on data held out; on the data fitted where none could be held out."""
        return self.rms_fitted if self.rms_held_out is None else self.rms_held_out

    def unusable(self, name: str) -> str:
        """Why applying it is worse than not applying it, in one sentence; "" if it is not.

        Args:
            name: of the sensor.
        """
        errors = self.rms_before, self.rms_fitted, self.rms_held_out
        fitted = len(self.parameters) - len(self.not_determined)
        freedom, likely = self.degrees_of_freedom, self.held_out_interval
        worse = worse_than_none(name, self.bias_unit, self.unit, *errors, freedom, fitted, likely)
        matrix = np.array(self.matrix)
        return worse or unchecked_scale(
            self.unit, self.bias_unit, matrix, freedom, self.rms_held_out
        )

    def apply(
        self, readings: FloatArray, where: Circumstances | None = None, own: Sequence[Effect] = ()
    ) -> FloatArray:
        """Corrected vectors, SI, shape (n, 3).

        With effects ``x = M (y − b) − ε(x)`` is solved by fixed-point iteration.

        Args:
            readings: y, in ``bias_unit``, shape (n, 3).
            where: circumstances of each reading, for effects of more than the reading.
            own: the user's own effects that the model has.

        Raises:
            UsageError: an effect is not known, or depends on circumstances that are not given.
        """
        matrix, bias = np.array(self.matrix), np.array(self.bias)
        if not self.effects:
            return np.asarray((readings - bias) @ matrix.T)
        first = self.effects[0]
        terms = [one.known(own) for one in self.effects]
        where = replace(
            _readings_alone(first.sensor, terms, len(readings)) if where is None else where,
            reference_temperature=or_nan(first.reference_temperature),
            reference_time=or_nan(first.reference_time),
        )
        sizes = np.concatenate([one.sizes for one in self.effects])
        return corrected((matrix, bias), Terms(first.sensor, terms), sizes, readings, where)


def _readings_alone(sensor: str, terms: Sequence[Term], count: int) -> Circumstances:
    """Circumstances in which only the reading is known."""
    alone = ("input", INPUT_OF[sensor])
    for term in terms:
        if term.effect.against not in alone:
            raise UsageError(
                f"{term.name} depends on the {term.effect.against}: give the circumstances of each "
                "reading too"
            )
    unknown, nothing = np.full(count, np.nan), np.zeros((count, 3))
    return Circumstances(nothing, nothing, unknown, np.zeros(count), nothing, np.zeros(count))


class Device(msgspec.Struct, frozen=True):
    """What was calibrated, as far as it is known.

    Attributes:
        name: given by the user.
        serial: serial number.
        format: of its readings.
        ranges: smallest and largest reading of the measurement, by sensor.
        chip: kind of chip.
    """

    name: str | None = None
    serial: str | None = None
    format: str | None = None
    ranges: dict[str, str] = {}
    chip: str | None = None


class Calibration(msgspec.Struct, frozen=True):
    """A result on disk; ``calibration["accelerometer"]`` is one of its sensors.

    Attributes:
        schema: names this format and its version.
        program: version of the program that wrote it.
        created: date and time, ISO 8601 with offset.
        source: description of the source.
        gravity: local gravity used.
        temperature: lowest and highest during the measurement, °C, or None.
        holds: number of holds.
        rotations: number of rotations.
        sensors: the calibration of each sensor.
        warnings: what the user must know.
        hold_means: readings of the holds; empty in files of version 0.1.
        rotation_increments: readings of the rotations between them.
        field_means: readings of the magnetometer.
        table_means: readings of a gyroscope that a rate table alone calibrated.
        device: what was calibrated, or None.
        place: where the gravity comes from, and the name of the place if it was given.
        operator: who measured, or None.
        note: or None.
        measured: date and time of the measurement, ISO 8601; None where it is not known.
        session: name of the session's file, or None.
        fingerprint: of the bytes that were measured (``session_salvage.fingerprint``), or None.
        ladders: of each sensor that was diagnosed the models up to that of the file.
        says: of each such sensor the verdict in sentences.
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
    hold_means: list[HoldMeans] = []
    rotation_increments: list[RotationIncrements] = []
    field_means: list[FieldMean] = []
    table_means: list[TableMeans] = []
    device: Device | None = None
    place: dict[str, str] = {}
    operator: str | None = None
    note: str | None = None
    measured: str | None = None
    session: str | None = None
    fingerprint: str | None = None
    ladders: dict[str, list[SavedRung]] = {}
    says: dict[str, str] = {}

    @property
    def date(self) -> str:
        """Date and time of the measurement or, where it is not known, of the file, ISO 8601."""
        return self.measured or self.created

    @property
    def made_by(self) -> str:
        """Program and date, as a comment in any language: no sign in it can end a comment."""
        return re.sub(r"[^\w .,:+-]", " ", f"imucal-wizard {self.program}, {self.created}")

    @property
    def serial(self) -> str:
        """Serial number of the device, or ""."""
        return "" if self.device is None else self.device.serial or ""

    @property
    def device_name(self) -> str:
        """Name of the device, else its serial number, or ""."""
        return "" if self.device is None else self.device.name or self.serial

    def __getitem__(self, sensor: str) -> Sensor:
        """The calibration of a sensor.

        Raises:
            KeyError: it is not calibrated.
        """
        return self.sensors[sensor]

    def __iter__(self) -> Iterator[str]:
        """Names of the calibrated sensors."""
        return iter(self.sensors)

    def save(self, path: str | Path, *, force: bool = False) -> Path:
        """Write the usable sensors to a file; an error leaves no partial file.

        Args:
            path: the file.
            force: write the sensors that are not usable, too.

        Raises:
            DataError: no sensor is usable; nothing is written.
            UsageError: the place cannot be written.
        """
        write_atomically(Path(path), encode_json(self if force else self.usable_part()))
        return Path(path)

    @property
    def unusable(self) -> dict[str, str]:
        """Why, by sensor, calibrations are not usable, in one sentence each."""
        return {name: why for name, one in self.sensors.items() if (why := one.unusable(name))}

    def usable_part(self) -> "Calibration":
        """The calibration without the sensors that are not usable.

        Raises:
            DataError: none is usable.
        """
        left_out = self.unusable
        if not left_out:
            return self
        kept = {name: one for name, one in self.sensors.items() if name not in left_out}
        if not kept:
            raise DataError("; ".join(left_out.values()), settings=("force",))
        holds = self.hold_means if "accelerometer" in kept else []
        turned = bool(holds) and "gyroscope" in kept  # a rotation goes from hold to hold
        measured = {
            "hold_means": holds,
            "rotation_increments": self.rotation_increments if turned else [],
            "table_means": self.table_means if "gyroscope" in kept else [],
            "field_means": self.field_means if "magnetometer" in kept else [],
        }
        return msgspec.structs.replace(self, sensors=kept, **measured)

    def means(self) -> FloatArray:
        """Mean readings of the accelerometer in the holds, shape (n, 3)."""
        return np.array([hold.accelerometer for hold in self.hold_means]).reshape(-1, 3)

    def circumstances(self) -> Circumstances | None:
        """Circumstances of the holds, as far as the file has them; None without holds."""
        if not self.hold_means:
            return None
        sensor, holds = self["accelerometer"], self.hold_means
        force = (self.means() - np.array(sensor.bias)) @ np.array(sensor.matrix).T
        previous = np.concatenate([np.full((1, 3), np.nan), force[:-1]])
        for row, hold in enumerate(holds):
            if hold.time is not None:  # not a file of version 0.1
                known = hold.previous is not None
                previous[row] = self.gravity.value * np.array(hold.previous) if known else np.nan
        return Circumstances(
            force=force,
            rate=np.zeros_like(force),
            temperature=np.array([or_nan(hold.temperature) for hold in holds]),
            time=np.array([self._time(hold) for hold in holds]),
            previous=previous,
            vibration=np.array([hold.vibration or 0.0 for hold in holds]),
            seconds=np.array([self.splits_holds * (hold.end - hold.start) for hold in holds]),
            gravity=self.gravity.value,
        )

    @property
    def splits_holds(self) -> bool:
        """Whether a step counts for a part of the hold in which it happens, see ``SavedEffect``."""
        steps = {one.name for one in builtin_effects() if one.sudden}
        every = (one for sensor in self.sensors.values() for one in sensor.effects)
        return not any(one.splits is None and one.term in steps for one in every)

    def _time(self, hold: HoldMeans) -> float:
        """Middle of a hold, s after the session's first sample (version 0.1: the first hold's)."""
        if hold.time is not None:
            return hold.time
        return 0.5 * (hold.start + hold.end) - self.hold_means[0].start


def says_the_same(path: Path, calibration: Calibration, *, described: bool = True) -> bool:
    """Whether a file has the same calibration, except for its date and the one before it.

    A session goes on after its first result, so that its fingerprint and its warnings about the
    stream may differ.

    Args:
        path: the file.
        calibration: the result.
        described: whether device, place, operator and note have to be the same, too.
    """
    try:
        found = read_calibration(path)
    except RecordingError:
        return False
    sensors = {
        name: msgspec.structs.replace(one, as_found=None) for name, one in found.sensors.items()
    }
    own = {name: getattr(calibration, name) for name in ("created", "fingerprint", "warnings")}
    found = msgspec.structs.replace(found, **own, sensors=sensors)
    if not described:
        about = {
            name: getattr(calibration, name) for name in ("device", "place", "operator", "note")
        }
        found = msgspec.structs.replace(found, **about)
    return encode_json(found) == encode_json(calibration)


def read_calibration(path: Path) -> Calibration:
    """Read a calibration back.

    Raises:
        RecordingError: the file is missing, is no calibration, of another version, or contradicts
            itself.
    """
    data = read_schema(path, (CALIBRATION_SCHEMA,), "a calibration")
    try:
        found = msgspec.json.decode(data, type=Calibration)
    except (ValueError, RecursionError) as error:
        raise RecordingError(
            f"{path} is damaged: {error}; take the file as it was saved"
        ) from error
    for name, sensor in found.sensors.items():
        wrong = _wrong(name, sensor)
        if wrong:
            raise RecordingError(
                f"{path} is damaged or was edited by hand: the {name}'s {wrong}; take the file as "
                "it was saved"
            )
    if not found.sensors:
        raise RecordingError(f"{path} holds no sensor; take another calibration")
    wrong = wrong_measurements(
        found.hold_means, found.rotation_increments, found.field_means, found.table_means
    )
    if not wrong and lacks_temperature(found):
        raise RecordingError(
            f"{path} is of an earlier version, which did not save the temperature on the rate "
            "table and counted that of its rests apart: what its effect of the temperature means "
            "is not certain. Fit the recording again and save"
        )
    wrong = wrong or contradiction(found)
    if wrong:
        raise RecordingError(
            f"{path} is damaged or was edited by hand: {wrong}; take the file as it was saved"
        )
    return found


def _wrong(name: str, sensor: Sensor) -> str:
    """What of a sensor of this name cannot be applied, or "" if all can."""
    matrix, bias = sensor.matrix, sensor.bias
    if sensor.bias_unit not in (SI_UNIT.get(name), COUNT):
        return f"readings cannot be in {sensor.bias_unit!r}"
    if len(matrix) != 3 or any(len(row) != 3 for row in matrix):
        return "matrix is not three rows of three numbers"
    if len(bias) != 3:
        return "bias is not three numbers"
    if np.linalg.matrix_rank(np.array(matrix)) != 3:
        return "matrix is singular"
    for one in sensor.effects:
        if one.sensor != name:
            return f"{one.term} is an effect of another sensor"
        if len(one.sizes) != len(one.parameters):
            return f"{one.term} has {len(one.sizes)} sizes for {len(one.parameters)} parameters"
    if any((one.standard_error or 0.0) < 0.0 for one in sensor.parameters.values()):
        return "standard errors are not all positive"
    if sensor.degrees_of_freedom is not None and sensor.degrees_of_freedom < 1:
        return f"degrees of freedom are {sensor.degrees_of_freedom}"
    joint, count = sensor.parameter_covariance, len(sensor.parameters)
    if joint is not None and not is_covariance(joint, count):
        return f"covariance of the parameters is not a valid one of {count} numbers"
    if sensor.covariance is not None:
        entries = COVARIANCE_ENTRIES.get(name, len(sensor.covariance))
        if not is_covariance(sensor.covariance, entries):
            return f"covariance of bias and matrix is not a valid one of {entries} numbers"
    return ""
