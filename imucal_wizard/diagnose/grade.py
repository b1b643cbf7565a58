"""The grade of each sensor: good, doubtful or not usable, with the reason in one sentence."""

import re
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path

from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.input import read_document
from imucal_wizard.core.limits.use import LIMITS_OF_USE, USUAL_GRADE, USUAL_ROTATION_SECONDS
from imucal_wizard.core.notices import NoticeKind
from imucal_wizard.core.quantities import number, quantity
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import (
    ACCELERATION_UNITS,
    COUNT,
    FIELD_UNITS,
    RATE_UNITS,
    canonical_unit,
)
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.result import (
    FitReport,
    SensorFit,
    beyond_limit,
    impossible_scale,
    usual_scale,
)

Limits = Mapping[str, float]
"""The limit of use of each sensor, in the unit of its errors: m/s², rad, µT."""
MAX_OF_METHOD = 1.5
"""Error of a method of the papers, over that of the fit of the same data by which the verdict is
given, above which the verdict does not hold for the method."""
_UNITS = {
    "accelerometer": ACCELERATION_UNITS,
    "gyroscope": {
        "rad": 1.0,
        "deg": RATE_UNITS["deg/s"],
        "°": RATE_UNITS["deg/s"],
        **{unit: size * USUAL_ROTATION_SECONDS for unit, size in RATE_UNITS.items()},
    },
    "magnetometer": FIELD_UNITS,
}
"""Units of the errors: a gyroscope's is the angle by which a rotation does not close; a rate means
what it sums up to in a usual rotation."""
_REASONS = {
    Verdict.MISSING: "something is missing in the model",
    Verdict.AMBIGUOUS: "something is missing in the model, and several effects explain it",
    Verdict.UNEXPLAINED: "noise hardly makes all that is left, and no explanation is certain",
    Verdict.NOT_REPEATABLE: "the same pose does not repeat",
    Verdict.DISTURBED: "a part of the measurement disagrees with all the rest",
    Verdict.INSUFFICIENT: "the data are too few for this model",
    Verdict.WAITING: "the accelerometer's model must be completed first",
}


_UNLIKE = {
    NoticeKind.RESTS_LEFT_OUT: "it reads another mean in rests that are left out",
    NoticeKind.SETTLING: "it still settles in the holds",
}


class Grade(StrEnum):
    """The words of the contract."""

    GOOD = "good"
    DOUBTFUL = "doubtful"
    NOT_USABLE = "not-usable"

    @property
    def word(self) -> str:
        """As it is shown: ``NOT USABLE``."""
        return self.replace("-", " ").upper()


@dataclass(frozen=True)
class Graded:
    """The grade of one sensor.

    Attributes:
        sensor: which.
        grade: in one word.
        why: the reason in one clause; of a sensor that is not usable a sentence with what to do.
        limit: of use, in the unit of the sensor's errors; None of a sensor without a fit.
    """

    sensor: str
    grade: Grade
    why: str
    limit: float | None = None


def graded(
    report: FitReport, diagnoses: Mapping[str, Diagnosis], limits: Limits | None = None
) -> dict[str, Graded]:
    """The grade of each sensor that was measured; of none while there are no diagnoses.

    Good is a sensor whose calibration is usable, whose model is complete and whose error is within
    the limit of use: the error held out as well as the one that these data may not show.

    Args:
        report: the fit.
        diagnoses: of the sensors.
        limits: of use; the usual ones when left out.
    """
    limits = limits or _limits({})
    found: dict[str, Graded] = {}
    for name in dict.fromkeys((*report.rates, *report.sensors)) if diagnoses else ():
        fit, diagnosis = report.sensors.get(name), diagnoses.get(name)
        if fit is None:
            found[name] = Graded(name, Grade.NOT_USABLE, report.why_not(name))
            continue
        limit = limits[name] * _limit_unit(fit, diagnosis)
        if fit.unusable:
            found[name] = Graded(name, Grade.NOT_USABLE, fit.unusable, limit)
            continue
        doubt = _doubt(fit, diagnosis, limit)
        why = doubt or f"within the limit of use, {quantity(limit, fit.unit, 2)}"
        found[name] = Graded(name, Grade.DOUBTFUL if doubt else Grade.GOOD, why, limit)
    return found


def _limit_unit(fit: SensorFit, diagnosis: Diagnosis | None) -> float:
    """One unit of the limits in that of the errors; of a field in counts by its usual size."""
    if fit.unit == "rad/s":
        return 1.0 / USUAL_ROTATION_SECONDS
    if fit.unit != COUNT or diagnosis is None or diagnosis.bench is None:
        return 1.0
    return diagnosis.bench.measured.circumstances.field_unit.size


def _doubt(fit: SensorFit, diagnosis: Diagnosis | None, limit: float) -> str:
    """Why a usable calibration is not good; "" if it is."""
    if diagnosis is None:
        return "it has no verdict"
    if diagnosis.base_left_out:
        return f"its model lacks {' and '.join(diagnosis.base_left_out)}"
    if diagnosis.unlike_holds is not None:
        return _UNLIKE[diagnosis.unlike_holds.kind]
    if diagnosis.verdict in _REASONS:
        return _REASONS[diagnosis.verdict]
    newest = None if diagnosis.bench is None else diagnosis.bench.ladder[-1]
    if newest is not None and newest.added is not None and newest.confirmed is False:
        return f"data held out do not confirm {newest.added}, which its model has"
    if fit.unit == "rad/s":
        return "its error is that of rates at rest, which show no scale"
    if diagnosis.warned(NoticeKind.CLOCKS):
        return "its clock runs at another rate than the accelerometer's"
    known = fit.unit in ("m/s^2", "rad") and fit.bias_unit != COUNT
    scale = impossible_scale(fit.matrix) if known else None
    if scale is not None:
        # a wrong sampling rate changes the angle about all axes alike
        by_rate = fit.unit == "rad" and scale == usual_scale(fit.matrix)[0]
        causes = "the unit, the range or the sampling rate" if by_rate else "the unit or the range"
        return (
            f"its scale of about {number(scale, 2)} is impossible: {causes} is wrong, or the order "
            "of the columns"
        )
    if diagnosis.warned(NoticeKind.AXES):
        return "its axes do not match the accelerometer's"
    if diagnosis.warned(NoticeKind.FIELD_TURNED):
        return "the field turned about the vertical during the session"
    error = fit.rms_fitted if fit.rms_held_out is None else fit.rms_held_out
    if diagnosis.by_method and diagnosis.bench is not None:
        best = diagnosis.bench.fit
        least = best.rms_fitted if best.rms_held_out is None else best.rms_held_out
        if best.unit == fit.unit and error > MAX_OF_METHOD * least:
            leaves = quantity(least, fit.unit)
            return f"without the {diagnosis.by_method} method the same data leave {leaves}"
    return beyond_limit(max(error, fit.validation_rms or 0.0), diagnosis.could_be, limit, fit.unit)


def read_limits(path: Path) -> Limits:
    """The limits of use of a TOML file.

    ``grade = "industrial"`` takes those of a grade; ``accelerometer = "2 mg"``, ``gyroscope =
    "1 deg"`` and ``magnetometer = "0.5 uT"`` give single ones.

    Raises:
        RecordingError: the file cannot be read or is no TOML.
        UsageError: a key, grade, number or unit is not known.
    """
    import tomllib

    try:
        given = tomllib.loads(read_document(path).decode())
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"{path} is not TOML: {error}") from error
    try:
        return _limits(given)
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from error


def _limits(given: Mapping[str, object]) -> Limits:
    """The limits of a grade, and single ones in their place.

    Raises:
        UsageError: a key, grade, number or unit is not known.
    """
    grade = given.get("grade", USUAL_GRADE)
    if grade not in LIMITS_OF_USE:
        raise UsageError(f"there is no grade {grade!r}; give one of {', '.join(LIMITS_OF_USE)}")
    wanted: dict[str, object] = {**LIMITS_OF_USE[str(grade)], **given}
    wanted.pop("grade", None)
    for sensor in wanted:
        if sensor not in _UNITS:
            raise UsageError(f"there is no {sensor!r}; the keys are grade, {', '.join(_UNITS)}")
    return {sensor: _limit(sensor, text) for sensor, text in wanted.items()}


def given_limits(texts: Sequence[str], path: Path | None = None) -> dict[str, float]:
    """Limits like ``accelerometer=2mg``, and those of a file before them.

    Raises:
        RecordingError: the file cannot be read or is no TOML.
        UsageError: a sensor, number or unit is not known.
    """
    found = {} if path is None else dict(read_limits(path))
    for text in texts:
        sensor, equals, limit = text.partition("=")
        if not equals or sensor.strip() not in _UNITS:
            raise UsageError(
                f"{text!r} is not a limit; write a sensor, =, a number and a unit, like "
                "accelerometer=2mg"
            )
        found[sensor.strip()] = _limit(sensor.strip(), limit)
    return found


_NUMBER = re.compile(r"([-+.\d]+(?:[eE][-+]?\d+)?)\s*(.*)")


def _limit(sensor: str, text: object) -> float:
    """A limit like ``2 mg`` in the unit of the sensor's errors.

    Raises:
        UsageError: it is none.
    """
    parts = _NUMBER.fullmatch(str(text).strip())
    value, unit = parts.groups() if parts else ("", "")
    factor = _UNITS[sensor].get(unit.strip(), _UNITS[sensor].get(canonical_unit(unit)))
    try:
        size = float(value)
    except ValueError:
        size = 0.0
    if factor is None or not 0.0 < size < float("inf"):
        units, like = ", ".join(_UNITS[sensor]), LIMITS_OF_USE[USUAL_GRADE][sensor]
        raise UsageError(
            f"{sensor} = {text!r} is not a limit; write a number above zero and a unit ({units}), "
            f'like "{like}"'
        )
    return size * factor
