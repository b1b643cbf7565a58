"""A device as its calibration file describes it, ready for rechecks."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime

import numpy as np

from imucal_wizard.core.dates import SECONDS_PER_YEAR, seconds_of
from imucal_wizard.core.description import Description
from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.core.gravity import median_magnitude
from imucal_wizard.core.limits import drift
from imucal_wizard.core.limits.use import IMPLAUSIBLE_SCALE, LIMITS_OF_USE, USUAL_GRADE
from imucal_wizard.core.poses import (
    AXES,
    DIRECTIONS,
    POSE_SETS,
    POSE_TOLERANCE_DEG,
    axes_in_words,
    nearest_pose,
)
from imucal_wizard.core.quantities import or_nan
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import COUNT
from imucal_wizard.diagnose.calibrated_sensor import (
    CALIBRATED_SENSORS,
    CalibratedSensor,
    RecheckData,
    TableGyroscope,
    plain_forces,
)
from imucal_wizard.diagnose.grade import given_limits
from imucal_wizard.diagnose.other_axes import (
    SIGNED_PERMUTATIONS,
    AxesBySensor,
    axes_changed,
    likely_axes,
    likely_rates,
    with_axes,
)
from imucal_wizard.diagnose.recheck import (
    Recheck,
    RecheckCriteria,
    RecheckVerdict,
    SensorRecheck,
    best_pose,
    detection_powers,
    device_verdict,
    judge_field,
    not_seen,
    recheck,
)
from imucal_wizard.estimate.fit_warnings import scale_notes, unit_notes
from imucal_wizard.estimate.hold_search import find_holds
from imucal_wizard.estimate.magnetometer.field_data import field_unit
from imucal_wizard.estimate.magnetometer.surroundings import around, recorded
from imucal_wizard.estimate.rate_table import find_table
from imucal_wizard.estimate.rest_spectrum import rest_spectrum
from imucal_wizard.estimate.rounded import resolution_in, steps_in, with_rounding
from imucal_wizard.estimate.surroundings import circumstances_of
from imucal_wizard.estimate.sway import without_sway
from imucal_wizard.estimate.table_steps import KnownRates
from imucal_wizard.guide.steps.recheck import Proposal
from imucal_wizard.measurement.clipping import axes_without_noise
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.measurement.rounding import rounding_step
from imucal_wizard.measurement.segmentation import rotations_between
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    GYROSCOPE,
    MAGNETOMETER,
    AxisEffect,
    Effect,
    FieldUnit,
)
from imucal_wizard.model.rows.source import ENTRIES, Parameters
from imucal_wizard.report.calibration_file import Calibration, Device, Sensor
from imucal_wizard.run.snapshot import StreamStatus

ENOUGH_HOLDS = 8
LEAST_GAIN = 0.05
"""After so many holds a pose that shows so little more (1 is one change) is not asked for."""
MIN_HOLDS_OF_AXES = 3
"""From which on exchanged axes of a magnetometer are looked for. Magnitude and dip of two holds
agree to a hundredth by chance under one of the 48 orders in 2 % of rechecks."""
OTHER_AXES = (
    "the readings do not have the axes of the calibration. With the axes put right no sensor "
    "disagrees, so no new calibration is needed: correct the columns, the wiring or the axes set "
    "in the device"
)
OWN = "the calibration's"
"""Whose axes those of the readings are said to lie along."""
TYPICAL_SHARE = 0.1
"""Standard error of a calibration that states none, over the changes that a recheck looks for."""


@dataclass(frozen=True)
class RecheckSettings:
    """The user's choices; ``diagnose.recheck.RecheckCriteria`` follow from them and the file.

    Attributes:
        now: date and time, for the age of the calibration.
        grade: of the sensors.
        limits: of use, by sensor: m/s², rad (over a usual rotation), µT.
        gyro_zeroed: the gyroscope's bias is zeroed at each start.
        gravity: local gravity, m/s²; None for that of the calibration.
        own: the user's own effects that the calibration may have.
        table: what a rate table did, for a gyroscope that it alone has calibrated.
    """

    now: datetime
    grade: str = USUAL_GRADE
    limits: Mapping[str, float] | None = None
    gyro_zeroed: bool = False
    gravity: float | None = None
    own: Sequence[Effect] = ()
    table: KnownRates = KnownRates()


class CalibratedDevice:
    """A calibration, ready for rechecks.

    Args:
        calibration: as it was saved.
        settings: of the user.

    Raises:
        UsageError: its gyroscope needs a rate table, or cannot be checked on one.

    Attributes:
        sensors: accelerometer and gyroscope.
        warnings: what to know of the file.
    """

    def __init__(self, calibration: Calibration, settings: RecheckSettings) -> None:
        check_table(calibration, settings.table)
        self.calibration, self.settings = calibration, settings
        self.warnings: list[str] = []
        self._years = self._age()
        self.sensors = {
            name: self._known(kind, calibration[name]) for name, kind in _kinds(calibration).items()
        }
        known = CALIBRATED_SENSORS
        limits = {
            name: limit / (known[name].limit_seconds if name in known else 1.0)
            for name, limit in (settings.limits or {}).items()
        }
        gravity = calibration.gravity.value if settings.gravity is None else settings.gravity
        self.criteria = RecheckCriteria(gravity, settings.grade, limits, settings.gyro_zeroed)

    def recheck(self, measured: RecheckData, units: Mapping[str, str]) -> Recheck:
        """The verdict on what was measured.

        Args:
            measured: holds and rotations.
            units: of the readings, by sensor.

        Raises:
            UsageError: the readings have another unit than those of the calibration.
        """
        self.check_units(units)
        if why := self._misread(measured):
            return unreadable_recheck(self, why, measured.seconds, "it was not judged")
        measured = self._without_sway(measured, units)
        sensors = self._judged(measured, units)
        notes = list(self.warnings)
        if MAGNETOMETER in self.calibration.sensors and MAGNETOMETER not in units:
            notes.append("the magnetometer was not checked: its readings are missing")
        if not self._wrong(sensors, measured):
            return device_verdict(sensors, measured.seconds, notes)
        gyroscope = sensors.get(GYROSCOPE)
        if gyroscope and not gyroscope.misread and self._wrong({GYROSCOPE: gyroscope}, measured):
            seen = {name: one for name, one in self.sensors.items() if name in units}
            if (scale := likely_rates(seen, measured)) is not None:
                says, no_go = "; ".join(scale_notes(scale, 0.0)), RecheckVerdict.NO_GO
                sensors[GYROSCOPE] = replace(
                    gyroscope, verdict=no_go, moved=(), misread=True, says=says
                )
                return device_verdict(sensors, measured.seconds, notes)
        found = self._other_axes(measured, units, sensors)
        # one sensor alone may have changed in the way in which other axes look
        if len(found) == 1 and sum(one.floor is not None for one in found[0][1].values()) > 1:
            axes, corrected = found[0]
            for name, order in axes.items():
                words = axes_in_words(order, OWN)
                says = f"its axes differ from the calibration's: {words}"
                known = sensors[name]
                corrected[name] = replace(known, verdict=RecheckVerdict.NO_GO, moved=(), says=says)
            return device_verdict(corrected, measured.seconds, notes, OTHER_AXES)
        if found:
            each = [
                " and ".join(f"the {name}'s {axes_in_words(order, OWN)}" for name, order in one)
                for one in (axes.items() for axes, _ in found)
            ]
            notes.append(f"the readings agree with the calibration if {', or if '.join(each)}")
        return device_verdict(sensors, measured.seconds, notes)

    def _without_sway(self, measured: RecheckData, units: Mapping[str, str]) -> RecheckData:
        """The same with holds that do not sway, as far as the gyroscope shows."""
        spectrum = rest_spectrum(measured.readings, measured.holds)
        known = self.sensors.get(GYROSCOPE)
        if known is None and units.get(GYROSCOPE) == COUNT:
            return measured  # nothing tells the size of a count
        size = 1.0 if known is None else known.size
        least = None if spectrum is None else spectrum.least
        return replace(measured, holds=without_sway(measured.holds, measured.readings, size, least))

    def _wrong(self, sensors: Mapping[str, SensorRecheck], measured: RecheckData) -> bool:
        """Whether a sensor disagrees with its calibration, or its rows with any."""
        return any(
            one.verdict is RecheckVerdict.NO_GO
            or (one.floor is None and name in self.sensors and bool(measured.rotations))
            for name, one in sensors.items()
        )

    def _other_axes(
        self,
        measured: RecheckData,
        units: Mapping[str, str],
        sensors: Mapping[str, SensorRecheck],
    ) -> list[tuple[AxesBySensor, dict[str, SensorRecheck]]]:
        """The axes that make every sensor agree, with the verdicts then: the fewest changes.

        Args:
            measured: holds and rotations.
            units: of the readings, by sensor.
            sensors: the verdicts with the axes as they are.
        """
        inertial = {name: sensors[name] for name in self.sensors}
        tried: list[AxesBySensor] = [{}]
        if self._wrong(inertial, measured):
            seen = {name: one for name, one in self.sensors.items() if name in units}
            tried = likely_axes(seen, measured, self.criteria.gravity)
        found: list[tuple[AxesBySensor, dict[str, SensorRecheck]]] = []
        for axes in tried:
            again = self._judged(with_axes(measured, axes), units)
            field, every = again.get(MAGNETOMETER), axes
            enough = len(measured.holds) >= MIN_HOLDS_OF_AXES
            if field is not None and field.verdict is RecheckVerdict.NO_GO and enough:
                # the same axes first: all sensors may have changed alike
                for order in (*axes.values(), *SIGNED_PERMUTATIONS):
                    every = {**axes, MAGNETOMETER: order}
                    again[MAGNETOMETER] = self._field(
                        with_axes(measured, every), again.get(ACCELEROMETER)
                    )
                    if again[MAGNETOMETER].verdict is RecheckVerdict.GO:
                        break
                else:  # too few directions under other axes agree with nothing
                    again[MAGNETOMETER] = field
            if not self._wrong(again, measured):
                found.append((every, again))
        least = min((axes_changed(axes) for axes, _ in found), default=0.0)
        return [one for one in found if axes_changed(one[0]) == least]

    def _judged(self, measured: RecheckData, units: Mapping[str, str]) -> dict[str, SensorRecheck]:
        """The verdict on each sensor; the arguments are those of ``recheck``."""
        seen = {name: one for name, one in self.sensors.items() if name in units}
        sensors = recheck(seen, measured, self.criteria)
        for name, one in self.sensors.items():
            if name not in units:
                says = f"the recording has no {name}: x, y and z were not seen"
                sensors[name] = not_seen(one, self.criteria, says)
        if MAGNETOMETER in self.calibration.sensors and MAGNETOMETER in units:
            sensors[MAGNETOMETER] = self._field(measured, sensors.get(ACCELEROMETER))
        return sensors

    def next_pose(self, collected: Collected, units: Mapping[str, str]) -> Proposal:
        """The pose that would show most of what has not been seen.

        Args:
            collected: holds and rotations so far.
            units: of the readings, by sensor.
        """
        try:
            self.check_units(units)
        except UsageError as error:  # the verdict says so; no pose changes it
            return Proposal(None, 0, 1, str(error))
        sensors = {name: one for name, one in self.sensors.items() if name in units}
        measured = recheck_data(collected)
        if why := self._misread(measured):
            return Proposal(None, 0, 1, why)
        proposal = self._proposal(sensors, measured)
        if proposal.pose is None or len(measured.holds) < ENOUGH_HOLDS:
            return proposal
        # a sensor with other axes than the calibration's shows nothing, however many poses follow
        judged = self._judged(measured, units)
        found = self._other_axes(measured, units, judged) if self._wrong(judged, measured) else []
        if len(found) != 1:
            return proposal
        axes = found[0][0]
        proposal = self._proposal(sensors, with_axes(measured, axes))
        if proposal.pose is None or ACCELEROMETER not in axes:
            return proposal
        up = axes[ACCELEROMETER].T @ DIRECTIONS[proposal.pose]
        return replace(proposal, pose=nearest_pose(up, POSE_SETS["18"], POSE_TOLERANCE_DEG))

    def _proposal(self, sensors: Mapping[str, CalibratedSensor], measured: RecheckData) -> Proposal:
        """The next pose, in the axes of what was measured."""
        detection = detection_powers(sensors, measured, self.criteria)
        powers = [
            one.power
            for each in detection
            for one in each.seen(self.criteria.limits.get(each.known.sensor))
        ]
        count = sum(power >= drift.POWER for power in powers), len(powers)
        own = self.sensors.get(ACCELEROMETER)
        if not measured.holds or own is None:
            return Proposal("+z", *count)
        plain, reading = own.calibration, measured.holds[-1].accelerometer
        best = best_pose(detection, self.criteria, plain.matrix @ (reading - plain.bias))
        enough = len(measured.holds) >= ENOUGH_HOLDS
        if best is None or (enough and best[1] < LEAST_GAIN):
            return Proposal(None, *count)
        return Proposal(best[0], *count, "of all poses it shows most of what was not seen yet")

    @property
    def described(self) -> Description:
        """The device that was calibrated."""
        about = self.calibration.device or Device()
        return Description(about.name or "", about.serial or "", about.chip or "")

    def is_of(self, checked: Description) -> bool:
        """Whether this device may be the one that was calibrated.

        Args:
            checked: its serial number decides, else its name; what is not known decides nothing.
        """
        known = self.described
        if known.serial and checked.serial:
            return known.serial == checked.serial
        return not (known.device and checked.device) or known.device == checked.device

    def check_device(self, serial: str) -> None:
        """Refuse another device than the one that was calibrated.

        Args:
            serial: number of the device that is checked, or "" where it is not known.

        Raises:
            UsageError: both serial numbers are known, and they differ.
        """
        known = self.calibration.serial
        if known and serial and known != serial:
            raise UsageError(
                f"the calibration is of the device {known}, and these readings are of {serial}: "
                "take the calibration of this device"
            )

    def check_units(self, units: Mapping[str, str]) -> None:
        """Refuse readings in another unit than those that were calibrated.

        Raises:
            UsageError: they are.
        """
        for name, unit in units.items():
            sensor = self.calibration.sensors.get(name)
            if sensor is not None and sensor.bias_unit != unit:
                raise UsageError(
                    f"the {name} was calibrated in {sensor.bias_unit}, and these readings are in "
                    f"{unit}: take the stream that was calibrated, or give its unit",
                    settings=(f"{name}_unit",),
                )

    def _age(self) -> float:
        created = seconds_of(self.calibration.date)
        if created is None:
            self.warnings.append("the calibration has no date: its age counts as a year")
            return 1.0
        years = (self.settings.now.timestamp() - created) / SECONDS_PER_YEAR
        if years < -1.0 / 365.0:  # the time of day may be missing
            self.warnings.append("the calibration is later than this check: its age counts as zero")
        return max(years, 0.0)

    def _known(self, kind: type[CalibratedSensor], sensor: Sensor) -> CalibratedSensor:
        calibration, name = self.calibration, kind.sensor
        warm = [one.temperature for one in calibration.hold_means if one.temperature is not None]
        temperature = float(np.mean(warm)) if warm else None
        if temperature is None and calibration.temperature is not None:
            temperature = float(np.mean(calibration.temperature))
        first = sensor.effects[0] if sensor.effects else None
        known = kind(
            calibration=Parameters(
                np.array(sensor.matrix),
                np.array(sensor.bias),
                np.concatenate([np.zeros(0), *(one.sizes for one in sensor.effects)]),
            ),
            unit=sensor.bias_unit,
            covariance=np.zeros((ENTRIES, ENTRIES)),
            terms=tuple(one.known(self.settings.own) for one in sensor.effects),
            reference_temperature=or_nan(first.reference_temperature if first else None),
            reference_time=or_nan(first.reference_time if first else None),
            temperature=temperature,
            coefficient=_coefficient(name, sensor),
            scale_coefficient="scale-temperature" in sensor.model,
            years=self._years,
            seat=_seat(sensor, kind.error_unit),
            limit=self._limit(name, sensor) / kind.limit_seconds,
        )
        left = [n for n, one in sensor.parameters.items() if not one.carried]
        if sensor.covariance is None:
            self.warnings.append(
                f"the {name}'s calibration has no standard errors: usual ones are taken"
            )
            bias, scale = (TYPICAL_SHARE * change for change in drift.CHANGES[name])
            spread = known.spread(np.full(3, bias**2), scale**2, scale**2)
            covariance = known.left_out(left) + spread
        else:
            covariance = np.zeros((ENTRIES, ENTRIES))
            covariance[np.ix_(kind.entries, kind.entries)] = np.array(sensor.covariance)
            # a calibration file may count what stays nominal as without an error
            exact = np.diag(covariance) == 0.0
            covariance += np.where(np.outer(exact, exact), known.left_out(left), 0.0)
        return replace(known, covariance=covariance)

    def _limit(self, name: str, sensor: Sensor) -> float:
        """The limit of use that the calibration was graded for, else that of the grade."""
        usual = given_limits([f"{name}={LIMITS_OF_USE[self.settings.grade][name]}"])[name]
        return usual if sensor.limit is None else sensor.limit

    def _misread(self, measured: RecheckData) -> str:
        """That gravity reads as no sensor makes it: another unit or range; "" if it does not."""
        known = self.sensors.get(ACCELEROMETER)
        if known is None or not measured.holds:
            return ""
        means = np.array([hold.accelerometer for hold in measured.holds])
        size = median_magnitude(
            plain_forces(known, measured.holds) if known.unit == COUNT else means
        )
        ratio = self.criteria.gravity / max(size, 1e-9)
        return "; ".join(unit_notes(ratio)) if abs(np.log(ratio)) > IMPLAUSIBLE_SCALE else ""

    def _field(self, measured: RecheckData, accelerometer: SensorRecheck | None) -> SensorRecheck:
        """The magnetometer, by constancy of magnitude and dip.

        Args:
            measured: holds and rotations.
            accelerometer: its verdict; one that has changed does not show the dip.
        """
        sensor, readings = self.calibration[MAGNETOMETER], measured.readings
        series = None if readings is None else readings.magnetometer
        parts = {
            place: part
            for place, hold in enumerate(measured.holds)
            if series is not None and len(part := series.between(hold.start, hold.end))
        }
        field = sensor.parameters.get("field")
        unit = FieldUnit() if field is None else field_unit(sensor.unit, field.value)
        limit = self.criteria.limits.get(MAGNETOMETER)
        if limit is None and sensor.limit is not None:
            limit = sensor.limit
        else:
            limit = unit.size * (self._limit(MAGNETOMETER, sensor) if limit is None else limit)
        changed = accelerometer is not None and accelerometer.verdict is RecheckVerdict.NO_GO
        up = None if changed or not parts else self._forces(measured)
        vectors = self._fields([*parts.values()], unit, readings)
        floor = sensor.error_as_left
        return judge_field(vectors, None if up is None else up[[*parts]], limit, floor, sensor.unit)

    def _forces(self, measured: RecheckData) -> FloatArray | None:
        """Corrected force in each hold, m/s², shape (n, 3); None without an accelerometer."""
        known = self.sensors.get(ACCELEROMETER)
        if known is None:
            return None
        plain, holds = plain_forces(known, measured.holds), measured.holds
        if not known.terms:
            return plain
        gravity, readings = self.criteria.gravity, measured.readings
        where = circumstances_of(holds, unit_vectors(plain), gravity, known.size, readings)
        means = np.array([hold.accelerometer for hold in holds])
        return self.calibration[ACCELEROMETER].apply(means, where, self.settings.own)

    def _fields(
        self, parts: Sequence[Series], unit: FieldUnit, readings: Readings | None
    ) -> FloatArray:
        """Mean of the corrected field in each part of the readings, shape (n, 3)."""
        if not parts:
            return np.zeros((0, 3))
        time = np.concatenate([one.time for one in parts])
        values = np.concatenate([one.values for one in parts])
        beside = recorded(time, readings)
        where = around(time, values, beside, readings, self.criteria.gravity, unit)
        where = replace(where, current=np.nan_to_num(where.current))  # unknown: none flows
        corrected = self.calibration[MAGNETOMETER].apply(values, where, self.settings.own)
        ends = np.cumsum([len(one) for one in parts])[:-1]
        return np.array([one.mean(axis=0) for one in np.split(corrected, ends)])


def recheck_data(
    collected: Collected, seconds: float = 0.0, readings: Readings | None = None
) -> RecheckData:
    """What the wizard has collected, as a recheck takes it.

    Args:
        collected: holds and rotations.
        seconds: duration, s.
        readings: the recording, where it is at hand.
    """
    steps = steps_in(collected, resolution_in(collected), readings)
    holds = with_rounding(collected.holds, steps)
    return RecheckData(holds, collected.rotations, seconds, readings)


def recheck_readings(known: CalibratedDevice, readings: Readings) -> Recheck:
    """The recheck of a recording.

    Args:
        known: the calibration.
        readings: the recording.

    Raises:
        DataError: the recording is too short, or the device was never at rest.
        UsageError: its readings have another unit than those of the calibration.
    """
    units = {ACCELEROMETER: readings.accelerometer.unit}
    for name in (GYROSCOPE, MAGNETOMETER):
        series = getattr(readings, name)
        if series is not None and len(series):
            units[name] = series.unit
    known.check_units(units)
    if known.settings.table:
        return _recheck_on_table(known, readings)
    if not len(readings):
        raise DataError("the recording has no accelerometer: a recheck needs gravity")
    holds, resolution, _ = find_holds(readings, known.criteria.gravity)
    time = readings.accelerometer.time
    wrong, _ = axes_without_noise(holds, resolution[0])
    if wrong:
        return unreadable_recheck(known, "; ".join(wrong), float(time[-1] - time[0]))
    holds = with_rounding(holds, (rounding_step(readings.accelerometer.values), resolution[1]))
    turned = readings.gyroscope
    rotations = [] if turned is None else rotations_between(holds, turned, readings.accelerometer)
    return known.recheck(RecheckData(holds, rotations, float(time[-1] - time[0]), readings), units)


def _recheck_on_table(known: CalibratedDevice, readings: Readings) -> Recheck:
    """The recheck of a gyroscope by known rates or angles of a rate table.

    Raises:
        DataError: the recording has no gyroscope, or nothing in it has the listed rates.
    """
    series = readings.gyroscope
    if series is None or not len(series):
        raise DataError("the recording has no gyroscope, which alone a rate table shows")
    data = find_table(series, known.settings.table)
    seconds = float(series.time[-1] - series.time[0])
    measured = RecheckData((), (), seconds, readings, data)
    return known.recheck(measured, {GYROSCOPE: series.unit})


def recheck_collected(
    known: CalibratedDevice,
    collected: Collected,
    stream: StreamStatus,
    seconds: float,
    readings: Readings | None,
) -> Recheck:
    """The recheck by what the wizard has collected.

    Args:
        known: the calibration.
        collected: holds and rotations.
        stream: the stream, for its units.
        seconds: duration, s.
        readings: the recording, where it is at hand.

    Raises:
        UsageError: the readings have another unit than those of the calibration.
    """
    units = stream.units
    if readings is not None and readings.magnetometer is not None:
        units[MAGNETOMETER] = readings.magnetometer.unit
    return known.recheck(recheck_data(collected, seconds, readings), units)


def unreadable_recheck(
    known: CalibratedDevice,
    why: str,
    seconds: float = 0.0,
    says: str = "x, y and z were not seen",
) -> Recheck:
    """The result of a recording in which nothing can be judged.

    Args:
        known: the calibration.
        why: the reason.
        seconds: duration, s.
        says: what this means for each sensor.
    """
    sensors = {name: not_seen(one, known.criteria, says) for name, one in known.sensors.items()}
    return device_verdict(sensors, seconds, [why])


def _kinds(calibration: Calibration) -> dict[str, type[CalibratedSensor]]:
    """How each inertial sensor of a calibration is judged, in the order in which that is done."""
    sensors = calibration.sensors
    kinds = {name: kind for name, kind in CALIBRATED_SENSORS.items() if name in sensors}
    if GYROSCOPE in kinds and calibration[GYROSCOPE].frame == "own":
        kinds[GYROSCOPE] = TableGyroscope
    return kinds


def check_table(calibration: Calibration, table: KnownRates) -> None:
    """Refuse a rate table where gravity is needed, and the other way round.

    Raises:
        UsageError: it is.
    """
    by_table = _kinds(calibration).get(GYROSCOPE) is TableGyroscope
    if table and not by_table:
        raise UsageError(
            "this calibration has no gyroscope that a rate table alone has calibrated: recheck it "
            "by holds and rotations"
        )
    if by_table and not table and not {ACCELEROMETER, MAGNETOMETER} & calibration.sensors.keys():
        raise UsageError(
            "a rate table alone has calibrated this gyroscope, and gravity does not show its "
            "scale: record it on the table, and state the rates or angles",
            settings=("rates",),
        )


def _coefficient(name: str, sensor: Sensor) -> FloatArray | None:
    """Standard error of the temperature coefficient of each bias, SI/°C; None where unknown."""
    term = "bias-temperature"
    if term not in sensor.model:
        return None
    one = effect(term)
    size = one.sizes[name].si if isinstance(one, AxisEffect) else 1.0
    found = (sensor.parameters.get(f"{term}_{axis}") for axis in AXES)
    errors = [None if one is None else one.standard_error for one in found]
    return None if None in errors else size * np.array(errors, float)


def _seat(sensor: Sensor, unit: str) -> float:
    """Variance by which repeated poses scatter beyond their noise."""
    floor = sensor.floor_fitted or sensor.floor or 0.0
    if sensor.repeatability is None or sensor.repeatability_unit != unit:
        return 0.0
    own = floor**2 if sensor.unit == unit else 0.0
    return max(sensor.repeatability**2 - own, 0.0)
