"""Whether a device still agrees with its calibration: GO, NO-GO or insufficient.

The rows are those of a calibration: holds against gravity, means at rest, rotations between the
holds. ``change`` estimates by how much each sensor has changed. A sensor is a NO-GO where the error
that follows exceeds the limit: the larger of the limit of use and the error that an unchanged
sensor exceeds by noise and drift once in a hundred rechecks of the whole device. It is insufficient
where one of the changes that are looked for would not be seen.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from enum import StrEnum

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.limits.drift import DRIFT, NO_GO_BY_CHANCE, POWER
from imucal_wizard.core.poses import (
    AXES,
    DIRECTIONS,
    POSE_SETS,
    POSE_TOLERANCE_DEG,
    angle_between,
)
from imucal_wizard.core.quantities import as_sentence, listed, number, quantity
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.calibrated_sensor import (
    CalibratedSensor,
    DriftCovariance,
    RecheckData,
)
from imucal_wizard.diagnose.change import PLANNING_DRAWS, Change, DetectableChange, DetectionPower
from imucal_wizard.estimate.parameters import with_errors
from imucal_wizard.estimate.result import GravityReference
from imucal_wizard.model.effect import SENSORS

FIELD_FLOORS = 3.0
"""Errors that a calibration left on other directions, up to which a field that varies is usual."""
FIELD_SHARE = 0.4
"""Of the field, on an axis from which on that axis sees it. An error of its scale changes the
magnitude by the square of this share, a sixth. A choice below 1/√3: a field along a corner is seen
by all three axes."""
SURE_TO_MOVE = 2.0
"""Standard errors by which a parameter that has moved is away from what it was, at least."""
MANY_MOVED = 0.6
"""Share of its parameters from which on a sensor is likely to be another one."""


class RecheckVerdict(StrEnum):
    """The words of the contract, and that of a sensor that is reported and not judged."""

    GO = "go"
    NO_GO = "no-go"
    INSUFFICIENT = "insufficient"
    REPORTED = "reported"

    @property
    def word(self) -> str:
        """As it is shown: ``NO-GO``."""
        return self.upper()


@dataclass(frozen=True)
class MovedParameter:
    """A parameter that has changed.

    Attributes:
        parameter: name.
        by: change, in ``unit``.
        standard_error: of the change, the calibration's own included.
        unit: unit word.
        p: probability of as large a change for an unchanged sensor.
    """

    parameter: str
    by: float
    standard_error: float | None
    unit: str
    p: float


@dataclass(frozen=True)
class SensorRecheck:
    """The recheck of one sensor.

    Attributes:
        verdict: see ``RecheckVerdict``.
        error: largest error of corrected readings by the change found; None if nothing was found.
        limit: of that error.
        floor: rms of that error by noise and the calibration's own uncertainty; None likewise.
        unit: of the three.
        moved: parameters that have changed.
        seen: power of seeing each change that is looked for.
        misread: the readings are scaled as no sensor's are, so that a unit or range is wrong.
        says: the reason in a sentence, or "".
    """

    verdict: RecheckVerdict
    error: float | None
    limit: float
    floor: float | None
    unit: str
    moved: tuple[MovedParameter, ...] = ()
    seen: tuple[DetectableChange, ...] = ()
    misread: bool = False
    says: str = ""


@dataclass(frozen=True)
class Recheck:
    """The recheck of a device.

    Attributes:
        verdict: of all sensors together.
        seconds: duration of the recording, s.
        sensors: by name.
        says: the result in a sentence or two.
    """

    verdict: RecheckVerdict
    seconds: float
    sensors: Mapping[str, SensorRecheck]
    says: str

    @property
    def judged(self) -> bool:
        """Whether anything was measured by which a sensor can be judged."""
        return any(one.floor is not None for one in self.sensors.values())


@dataclass(frozen=True)
class RecheckCriteria:
    """What a device is judged by.

    Attributes:
        gravity: local gravity, m/s².
        grade: of the sensors, for turn-on spread and ageing.
        limits: of the errors by sensor, m/s², rad/s and µT, in place of the usual ones.
        gyro_zeroed: the gyroscope's bias is zeroed at each start: it is reported, not judged.
    """

    gravity: float
    grade: str
    limits: Mapping[str, float]
    gyro_zeroed: bool = False


def recheck(
    known: Mapping[str, CalibratedSensor], measured: RecheckData, criteria: RecheckCriteria
) -> dict[str, SensorRecheck]:
    """The verdict on accelerometer and gyroscope.

    Args:
        known: what is calibrated, in the order in which it is judged.
        measured: holds and rotations of today, with the readings' units of the calibration.
        criteria: limits and grade.
    """
    found: dict[str, SensorRecheck] = {}
    for one, drift, change in _changes(known, measured, criteria):
        if isinstance(change, str):
            found[one.sensor] = not_seen(one, criteria, f"x, y and z were not seen: {change}")
        else:
            found[one.sensor] = _judged(change, drift, criteria, _warmer(one, measured))
    return found


def detection_powers(
    known: Mapping[str, CalibratedSensor], measured: RecheckData, criteria: RecheckCriteria
) -> list[DetectionPower]:
    """What the measurements so far would show of each sensor; the arguments are ``recheck``'s."""
    level = NO_GO_BY_CHANCE / len(SENSORS)
    return [
        DetectionPower(one, drift.whole, criteria.gravity, level, draws=PLANNING_DRAWS)
        if isinstance(change, str)
        else change.power
        for one, drift, change in _changes(known, measured, criteria)
        if not (one.zeroes and criteria.gyro_zeroed)
    ]


def best_pose(
    detection: Sequence[DetectionPower], criteria: RecheckCriteria, up: FloatArray
) -> tuple[str, float] | None:
    """The pose that would show most, and by how much more; None where every change is seen.

    Args:
        detection: what is seen so far.
        criteria: limits.
        up: of the newest hold, unit vector; a pose near it is none to go to.
    """
    before = [_shown(one, criteria) for one in detection]
    if all(share >= 1.0 for each in before for share in each):
        return None
    gains: dict[str, float] = {}
    for name in POSE_SETS["18"]:
        there = DIRECTIONS[name]
        if np.degrees(angle_between(up, there)) <= POSE_TOLERANCE_DEG:
            continue
        after = [
            _shown(one.more(*one.known.planned(up, there, criteria.gravity)), criteria)
            for one in detection
        ]
        gains[name] = float(sum(map(sum, after)) - sum(map(sum, before)))
    best = max(gains, key=lambda name: round(gains[name], 3))
    return best, gains[best]


def _shown(one: DetectionPower, criteria: RecheckCriteria) -> list[float]:
    """Of each change that is looked for: its size over the least that is seen, at most 1."""
    seen = one.seen(criteria.limits.get(one.known.sensor))
    return [min(each.change / max(each.smallest, 1e-300), 1.0) for each in seen]


def _changes(
    known: Mapping[str, CalibratedSensor], measured: RecheckData, criteria: RecheckCriteria
) -> Iterator[tuple[CalibratedSensor, DriftCovariance, "Change | str"]]:
    """Each sensor with the covariances of its drift and its change, or why there is no row."""
    level = NO_GO_BY_CHANCE / len(SENSORS)
    reference: GravityReference | None = None
    for sensor, one in known.items():
        drift = one.drift(DRIFT[criteria.grade][sensor], _warmer(one, measured))
        try:
            rows = one.experiment(measured, criteria.gravity, reference)
            change = Change(one, rows, drift.whole, criteria.gravity, level)
        except DataError as error:
            yield one, drift, str(error)
            continue
        reference = one.reference(rows, change.found, change.covariance) or reference
        yield one, drift, change


def not_seen(known: CalibratedSensor, criteria: RecheckCriteria, says: str) -> SensorRecheck:
    """Of a sensor without a row.

    Args:
        known: the calibration.
        criteria: limits.
        says: why, with the axes.
    """
    limit = criteria.limits.get(known.sensor, known.limit)
    insufficient = RecheckVerdict.INSUFFICIENT
    return SensorRecheck(insufficient, None, limit, None, known.error_unit, says=says)


def _warmer(known: CalibratedSensor, measured: RecheckData) -> float | None:
    """Temperature above that of the calibration, °C; None where it is not known."""
    today = [one.temperature for one in measured.holds if one.temperature is not None]
    if known.temperature is None or not today:
        return None
    return float(np.mean(today)) - known.temperature


def _judged(
    change: Change,
    drift: DriftCovariance,
    criteria: RecheckCriteria,
    warmer: float | None,
) -> SensorRecheck:
    known = change.known
    unit, given = known.error_unit, criteria.limits.get(known.sensor)
    limit = change.power.limit(given)
    moved, seen = _moved(change), tuple(change.power.seen(given))
    made = SensorRecheck(RecheckVerdict.GO, change.error, limit, change.noise, unit, moved, seen)
    if known.zeroes and criteria.gyro_zeroed:
        says = "its bias is zeroed at each start: it is reported, not judged"
        return replace(made, verdict=RecheckVerdict.REPORTED, says=says)
    error, by_noise = quantity(change.error, unit), quantity(change.noise, unit)
    words = f"error {error} (noise alone makes {by_noise}), limit {quantity(limit, unit)}"
    if misread := known.misread(change.found.calibration):
        says = f"{words}; {misread}"
        return replace(made, verdict=RecheckVerdict.NO_GO, moved=(), misread=True, says=says)
    if change.error > max(limit, change.resolved):
        return replace(made, verdict=RecheckVerdict.NO_GO, says=f"{words}{_most(change, moved)}")
    if limit < change.resolved:
        says = (
            f"this check resolves {quantity(change.resolved, unit)} and not the limit, "
            f"{quantity(limit, unit)}: hold and turn the device longer about x, y and z"
        )
        return replace(made, verdict=RecheckVerdict.INSUFFICIENT, says=says)
    blind = [one for one in seen if one.power < POWER]
    if not blind:
        return replace(made, says=words)
    return replace(
        made,
        verdict=RecheckVerdict.INSUFFICIENT,
        says=_blind(change, blind, drift, warmer, given),
    )


def _blind(
    change: Change,
    blind: Sequence[DetectableChange],
    drift: DriftCovariance,
    warmer: float | None,
    given: float | None,
) -> str:
    """Which axis was not seen, and why."""
    known = change.known
    axes: dict[str, list[str]] = {}
    for one in blind:
        axes.setdefault(one.parameter, []).append(one.axis)
    which = " and ".join(f"{name} {', '.join(each)}" for name, each in axes.items())
    least = min(one.power for one in blind)
    text = f"a change of {which} would be seen in {number(100.0 * least)} % only"

    def seen_without(part: FloatArray) -> bool:
        usual = change.power.scatter(drift.whole - part)
        return all(one.power >= POWER for one in change.power.seen(given, usual))

    if warmer is not None and drift.by_temperature.any() and seen_without(drift.by_temperature):
        known_well = "no temperature coefficient is known"
        if known.coefficient is not None:
            known_well = "the temperature coefficients are not known well enough"
        return (
            f"temperature differs by {number(warmer, 2)} °C and {known_well}: {text}. Recheck "
            "at the temperature of the calibration"
        )
    if drift.by_age.any() and seen_without(drift.by_age + drift.by_temperature):
        return (
            f"the calibration is {number(12.0 * known.years, 2)} months old, and ageing hides "
            f"changes: {text}. No further pose helps: calibrate anew, or state a limit of use"
        )
    if len(blind) == len(tuple(change.power.seen(given))):
        calmer = "put it down in each pose and let it rest longer: the holds may scatter too much"
        return f"{text}: {known.advice}. If that was done, {calmer}"
    return f"{text}: {known.advice}"


def _moved(change: Change) -> tuple[MovedParameter, ...]:
    """Parameters that have changed by more than an unchanged sensor does, the surest first."""
    experiment, known = change.found.experiment, change.known
    before = known.named(known.calibration.entries)
    args = known.named, change.found.calibration.entries
    moved = with_errors(*args, change.covariance, experiment.unit_of, ())
    usual = with_errors(*args, change.power.usual, experiment.unit_of, ())
    found = []
    for one, by_drift in zip(moved, usual, strict=True):
        by, spread = one.value - before[one.name], by_drift.standard_error or 0.0
        p = math.erfc(abs(by) / spread / math.sqrt(2.0)) if spread else 1.0
        found.append(MovedParameter(one.name, by, one.standard_error, one.unit, p))
    sure = [
        one
        for one in found
        if one.p < NO_GO_BY_CHANCE / len(found)
        and abs(one.by) > SURE_TO_MOVE * (one.standard_error or 0.0)
    ]
    return tuple(sorted(sure, key=lambda one: one.p))


def _most(change: Change, moved: Sequence[MovedParameter]) -> str:
    """What has moved, in words."""
    known = change.known
    every = known.named(known.calibration.entries)
    if len(moved) > MANY_MOVED * len(every):
        return "; nearly every parameter has moved: is this the device that was calibrated?"
    names = [one.parameter for one in moved]
    return f"; {listed(names)} {'has' if len(names) == 1 else 'have'} moved" if names else ""


def judge_field(
    field: FloatArray, up: FloatArray | None, limit: float, floor: float, unit: str
) -> SensorRecheck:
    """A magnetometer by constancy of the field's magnitude and dip, as at any place.

    Args:
        field: corrected mean of each hold, shape (n, 3).
        up: corrected force of each, any length, shape (n, 3); None if the accelerometer does not
            show it, so that the dip is not judged.
        limit: of use.
        floor: rms error that the calibration left on other directions.
        unit: of the field and of both, ``uT`` or ``count``.
    """
    limit = max(limit, FIELD_FLOORS * floor)
    made = SensorRecheck(RecheckVerdict.GO, None, limit, floor, unit)
    length = np.linalg.norm(field, axis=1)
    error = float(length.std(ddof=1)) if len(field) > 1 else 0.0
    if up is not None and len(field) > 1:
        dip = np.arcsin((field * up).sum(axis=1) / length / np.linalg.norm(up, axis=1))
        error = max(error, float(dip.std(ddof=1) * length.mean()))
    what = "magnitude varies" if up is None else "magnitude and dip vary"
    words = f"{what} by {quantity(error, unit)}, limit {quantity(limit, unit)}"
    made = replace(made, error=error, says=words)
    if error > limit:  # however few directions show it
        return replace(made, verdict=RecheckVerdict.NO_GO)
    shown = np.abs(field) > FIELD_SHARE * length[:, None]
    axes = [axis for axis, seen in zip(AXES, shown.sum(axis=0), strict=True) if seen < 2]
    if axes or not len(field):
        says = f"the field was not seen on {', '.join(axes or AXES)}: turn that axis towards it"
        return replace(made, verdict=RecheckVerdict.INSUFFICIENT, error=None, says=says)
    return made


def device_verdict(
    sensors: Mapping[str, SensorRecheck],
    seconds: float,
    notes: Sequence[str] = (),
    advice: str = "",
) -> Recheck:
    """The verdict on the device: NO-GO or insufficient if one of its sensors is.

    Args:
        sensors: by name.
        seconds: duration, s.
        notes: what to know besides.
        advice: in place of the usual one for the verdict.
    """
    verdicts = {one.verdict for one in sensors.values()}
    verdict = RecheckVerdict.GO
    for worse in (RecheckVerdict.INSUFFICIENT, RecheckVerdict.NO_GO):
        if worse in verdicts:
            verdict = worse
    if RecheckVerdict.GO not in verdicts and verdict is RecheckVerdict.GO:
        verdict = RecheckVerdict.INSUFFICIENT
    told = {verdict, RecheckVerdict.INSUFFICIENT}
    reasons = [f"{name}: {one.says}" for name, one in sensors.items() if one.verdict in told]
    if not advice and any(one.misread for one in sensors.values()):
        advice = "the readings are not scaled as those that were calibrated"
    advice = (
        advice
        or {
            RecheckVerdict.GO: "the calibration is still good",
            RecheckVerdict.NO_GO: "calibrate the device again",
            RecheckVerdict.INSUFFICIENT: "this check cannot decide",
        }[verdict]
    )
    says = " ".join(map(as_sentence, [advice, *reasons, *notes]))
    return Recheck(verdict, seconds, sensors, says)
