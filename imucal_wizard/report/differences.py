"""Calibrations against each other and against a reference: a factory certificate, a rate table.

Two values of a parameter differ by ``d ± √(e₁² + e₂²)``; the probability of as large a difference
by chance is Student's with the degrees of freedom of Welch and Satterthwaite (Q's tables III to V).
Of three and more the scatter stands beside the one that their own standard errors predict,
``√mean(e²)`` (Q's table II); the probability is that of F.
"""

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.input import read_document
from imucal_wizard.core.quantities import number, plus_minus, readable, value_and_error
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass, fields_of
from imucal_wizard.core.units import ACCELERATION_UNITS, RATE_UNITS
from imucal_wizard.estimate.distributions import EXACT_FREEDOM, exceeded, two_sided
from imucal_wizard.estimate.gauge import triangular
from imucal_wizard.estimate.parameters import triangular_parameters, with_errors
from imucal_wizard.model.effect import SENSORS
from imucal_wizard.report.calibration_file import Calibration, Sensor, read_calibration
from imucal_wizard.report.tables import fitting_widths, table_row

DIFF_SCHEMA = "imucal-wizard/diff/1"
MAX_PER_CENT = 10_000.0
"""Of a parameter that is nearly zero a difference in per cent says nothing."""
SIGNIFICANT = 0.01
"""Probability by chance below which a difference is marked."""


@dataclass(frozen=True)
class Known:
    """A parameter in one file.

    Attributes:
        value: in ``unit``.
        error: standard error, or None if there is none.
        unit: unit word; "" for that of the other files.
        freedom: degrees of freedom of the standard error.
        unsure: it has an error, but that is not known, as of a parameter that is not determined.
    """

    value: float
    error: float | None
    unit: str
    freedom: int = EXACT_FREEDOM
    unsure: bool = False


@dataclass(frozen=True)
class NamedParameters:
    """What one file says.

    Attributes:
        name: of the file.
        sensors: parameters by sensor and name.
        device: name or serial number, or None.
        own_frame: parameters of sensors with a full matrix, in their own frame.
        measured: what it was fitted to: the fingerprint of the recording, and its readings.
        gravity: by which the accelerometer was calibrated, m/s², or None.
    """

    name: str
    sensors: Mapping[str, Mapping[str, Known]]
    device: str | None = None
    own_frame: Mapping[str, Mapping[str, Known]] = field(default_factory=dict)
    measured: frozenset[object] = frozenset()
    gravity: float | None = None


@dataclass(frozen=True)
class Difference:
    """One parameter in all files.

    Attributes:
        values: by file, ``unit``.
        standard_errors: by file; None where there is none.
        unit: unit word.
        difference: of the last file from the first.
        standard_error: of the difference, or None.
        per_cent: difference of the first value, or None where that is zero.
        p: probability of as large a difference by chance; of three and more files of as much
            scatter; None without standard errors.
        mean: of three and more files, else None.
        standard_deviation: of three and more files.
        predicted_standard_deviation: by the files' own standard errors.
    """

    values: tuple[float, ...]
    standard_errors: tuple[float | None, ...]
    unit: str
    difference: float
    standard_error: float | None
    per_cent: float | None
    p: float | None
    mean: float | None = None
    standard_deviation: float | None = None
    predicted_standard_deviation: float | None = None


def named_parameters(path: Path) -> NamedParameters:
    """The parameters in a calibration file or a reference, TOML or JSON.

    Raises:
        RecordingError: the file cannot be read, or is neither.
    """
    data = read_document(path)
    try:
        toml = path.suffix == ".toml"
        loose: Any = tomllib.loads(data.decode()) if toml else msgspec.json.decode(data)
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"{path} is neither a calibration nor a reference: {error}") from error
    if isinstance(loose, dict) and "schema" in loose:
        return _of_calibration(path.name, read_calibration(path))
    try:
        sensors = {name: loose[name] for name in SENSORS if name in loose}
        found = {
            sensor: {name: _given(one) for name, one in values.items()}
            for sensor, values in sensors.items()
        }
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise RecordingError(
            f"{path} is no reference: write a table per sensor, with numbers or value, "
            "standard_error and unit of each parameter"
        ) from error
    if not found:
        raise RecordingError(
            f"{path} names no sensor: write tables named {', '.join(SENSORS)} with parameters"
        )
    return NamedParameters(str(loose.get("name", path.name)), found)


def _of_calibration(name: str, calibration: Calibration) -> NamedParameters:
    device = calibration.device
    return NamedParameters(
        name,
        {
            sensor: {
                parameter: Known(
                    one.value,
                    one.standard_error,
                    one.unit,
                    record.degrees_of_freedom or EXACT_FREEDOM,
                    unsure=one.standard_error is None,
                )
                for parameter, one in record.parameters.items()
                if one.carried
            }
            for sensor, record in calibration.sensors.items()
        },
        None if device is None else device.serial or device.name,
        {
            sensor: _in_own_frame(record)
            for sensor, record in calibration.sensors.items()
            if record.covariance is not None and any(one == "cross_xy" for one in record.parameters)
        },
        frozenset(
            [
                *([calibration.fingerprint] if calibration.fingerprint else []),
                *((one.start, *one.accelerometer) for one in calibration.hold_means),
                *((one.time, *one.reading) for one in calibration.field_means),
                *((one.start, *one.gyroscope[0]) for one in calibration.table_means),
            ]
        ),
        calibration.gravity.value if "accelerometer" in calibration.sensors else None,
    )


def _in_own_frame(record: Sensor) -> dict[str, Known]:
    """Parameters of a full matrix as those of a triangular one, which a rate table determines.

    The two differ by a rotation, how the sensor lies to the accelerometer.
    """
    freedom = record.degrees_of_freedom or EXACT_FREEDOM
    units = {name: one.unit for name, one in record.parameters.items()}

    def convert(entries: FloatArray) -> dict[str, float]:
        return triangular_parameters(triangular(entries[:9].reshape(3, 3))[1], entries[9:])

    entries = np.append(np.ravel(record.matrix), record.bias)
    found = with_errors(
        convert, entries, np.array(record.covariance), lambda name: units.get(name, "rad"), ()
    )
    return {one.name: Known(one.value, one.standard_error, one.unit, freedom) for one in found}


class _Given(msgspec.Struct, frozen=True):
    """A parameter as a reference states it; a number alone is a value."""

    value: float
    standard_error: Annotated[float, msgspec.Meta(ge=0.0)] | None = None
    uncertainty: Annotated[float, msgspec.Meta(ge=0.0)] | None = None
    k: Annotated[float, msgspec.Meta(gt=0.0)] = 2.0
    unit: str = ""
    degrees_of_freedom: Annotated[int, msgspec.Meta(ge=1)] = EXACT_FREEDOM


def _given(one: Any) -> Known:
    """A number, or a table of value, standard error (or uncertainty and k) and unit.

    Raises:
        ValueError: it is neither, or a number in it cannot be.
    """
    given = msgspec.convert(one if isinstance(one, dict) else {"value": one}, _Given)
    error = given.standard_error
    if error is None and given.uncertainty is not None:
        error = given.uncertainty / given.k
    if not (math.isfinite(given.value) and math.isfinite(error or 0.0)):
        raise ValueError("a number is not finite")
    return Known(given.value, error, given.unit, given.degrees_of_freedom)


def _gravities(files: Sequence[NamedParameters]) -> list[str]:
    used = {number(one.gravity, 6): one.gravity for one in files if one.gravity is not None}
    if len(used) < 2:
        return []
    share = number(100.0 * (max(used.values()) / min(used.values()) - 1.0), 2)
    return [
        (
            f"the calibrations used gravities of {' and '.join(used)} m/s²: this alone makes "
            f"sensitivities of the accelerometer differ by {share} %"
        )
    ]


def differences(
    files: Sequence[NamedParameters],
) -> tuple[dict[str, dict[str, Difference]], list[str]]:
    """Each parameter that all files have, and what to know about the others.

    Raises:
        UsageError: the files have no parameter in common, or one in units that do not convert.
    """
    notes, found = [], {}
    devices = {one.device for one in files if one.device is not None}
    if len(devices) > 1:
        notes.append(f"these are different devices: {', '.join(sorted(devices))}")
    if _share(files):
        notes.append(
            "these calibrations share measurements: their errors are not independent, so that the "
            "standard errors of the differences and p do not hold"
        )
    notes += _gravities(files)
    for sensor in SENSORS:
        tables = [one.sensors.get(sensor, {}) for one in files]
        if all(tables) and any("theta_yz" in one for one in tables):
            turned = [one.own_frame.get(sensor) for one in files]
            if any(turned):
                notes.append(
                    f"{sensor}: compared in its own frame, since not every file contains its "
                    "orientation to the accelerometer"
                )
            tables = [own or table for own, table in zip(turned, tables, strict=True)]
        names = list(dict.fromkeys(name for table in tables for name in table))
        common = [name for name in names if all(name in table for table in tables)]
        others = [name for name in names if name not in common]
        if others and all(tables):
            notes.append(f"{sensor}: not in every file: {', '.join(others)}")
        elif others:
            notes.append(f"the {sensor} is not in every file")
        if common:
            found[sensor] = {
                name: _difference(name, [table[name] for table in tables]) for name in common
            }
    if not found:
        raise UsageError("these files have no parameter in common: give calibrations of one sensor")
    return found, notes


def _share(files: Sequence[NamedParameters]) -> bool:
    """Whether two of the files were fitted to the same readings."""
    return any(one.measured & other.measured for one, other in combinations(files, 2))


def _difference(name: str, each: Sequence[Known]) -> Difference:
    unit = next((one.unit for one in each if one.unit), "")
    each = [_in_unit(name, one, unit) for one in each]
    first, last = each[0], each[-1]
    values = tuple(one.value for one in each)
    errors = [one.error for one in each]
    away = last.value - first.value
    both = _known([first, last])
    error = math.sqrt(sum(e * e for e, _ in both)) if both else None
    made = Difference(
        values=values,
        standard_errors=tuple(errors),
        unit=unit,
        difference=away,
        standard_error=error,
        per_cent=100.0 * away / abs(first.value) if first.value else None,
        p=_by_chance(away, both),
    )
    if len(each) < 3:
        return made
    count, mean = len(each), sum(values) / len(each)
    deviation = math.sqrt(sum((one - mean) ** 2 for one in values) / (count - 1))
    squares = [e * e for e in errors if e is not None]
    predicted = math.sqrt(sum(squares) / count) if len(squares) == count else None
    return replace(
        made,
        mean=mean,
        standard_deviation=deviation,
        predicted_standard_deviation=predicted,
        p=_scattered(deviation, predicted, count, each),
    )


def _in_unit(name: str, one: Known, unit: str) -> Known:
    """A value in another unit of the same quantity.

    Raises:
        UsageError: it has none.
    """
    if one.unit in ("", unit):
        return one
    for units in (ACCELERATION_UNITS, RATE_UNITS):
        if one.unit in units and unit in units:
            factor = units[one.unit] / units[unit]
            error = None if one.error is None else one.error * factor
            return replace(one, value=one.value * factor, error=error, unit=unit)
    raise UsageError(
        f"{name} is in {one.unit} in one file and in {unit} in another: only calibrations of "
        "readings in the same unit can be compared"
    )


def _known(each: Sequence[Known]) -> list[tuple[float, int]]:
    """Standard errors with their freedom; none if one is not known.

    A value without a standard error, as in a certificate, is exact.
    """
    if any(one.unsure for one in each):
        return []
    found = [(one.error, one.freedom) for one in each if one.error is not None]
    return [(error, freedom) for error, freedom in found if error > 0.0]


def _by_chance(away: float, errors: Sequence[tuple[float, int]]) -> float | None:
    """Welch's test."""
    total = sum(e * e for e, _ in errors)
    if total <= 0.0:
        return None
    freedom = total**2 / sum(e**4 / freedom for e, freedom in errors)
    t = away / math.sqrt(total)
    if freedom > 1000.0:
        return math.erfc(abs(t) / math.sqrt(2.0))
    return two_sided(t, max(int(freedom), 1))


def _scattered(
    deviation: float, predicted: float | None, count: int, each: Sequence[Known]
) -> float | None:
    """Probability of more scatter by chance."""
    if not predicted:
        return None
    freedom = min(sum(one.freedom for one in each), EXACT_FREEDOM)
    return exceeded((deviation / predicted) ** 2, count - 1, freedom)


def difference_document(
    files: Sequence[NamedParameters],
    found: Mapping[str, Mapping[str, Difference]],
    notes: Sequence[str],
) -> dict[str, Any]:
    """The differences for scripts (diff/1); the arguments are those of ``difference_table``."""
    return {
        "schema": DIFF_SCHEMA,
        "files": [one.name for one in files],
        "sensors": {
            sensor: {name: fields_of(one) for name, one in rows.items()}
            for sensor, rows in found.items()
        },
        "notes": notes,
    }


def difference_table(
    files: Sequence[NamedParameters],
    found: Mapping[str, Mapping[str, Difference]],
    notes: Sequence[str],
) -> str:
    """The differences as text, one row per parameter."""
    many = len(files) > 2
    heads = ("mean", "scatter", "predicted", "p") if many else ("1", "2", "2 − 1", "%", "p")
    table: list[tuple[str, ...]] = []
    marked = total = 0
    for sensor, rows in found.items():
        table += [(), (sensor.upper(), *heads)]
        for name, one in rows.items():
            total += one.p is not None
            odd = one.p is not None and one.p < SIGNIFICANT
            marked += odd
            factor, sign = readable(one.unit)
            label = f"{'▸' if odd else ' '} {name}{f' [{sign}]' if sign else ''}"
            table.append((label, *(_many(one, factor) if many else _two(one, factor))))
    widths = fitting_widths(table)
    lines = [f"{place}: {one.name}" for place, one in enumerate(files, 1)]
    lines += [table_row(cells, widths) if cells else "" for cells in table]
    what = "scatter more than their standard errors predict" if many else "differ"
    expected = f"(p < {SIGNIFICANT:g}; {SIGNIFICANT * total:.2g} expected by chance)"
    lines += [
        "",
        f"▸ {marked} of {total} parameters {what}",
        *([] if _share(files) else [f"  {expected}"]),
        *(f"note: {text}" for text in notes),
    ]
    return "\n".join(lines)


def _two(one: Difference, factor: float) -> tuple[str, ...]:
    """Both values with the decimals of the difference's error."""
    error = None if one.standard_error is None else factor * one.standard_error
    first, second = (
        number(factor * v, 5) if not error else value_and_error(factor * v, error)[0]
        for v in one.values
    )
    away = plus_minus(factor * one.difference, error)
    share = one.per_cent if one.per_cent and abs(one.per_cent) < MAX_PER_CENT else None
    return first, second, away, number(share, 2), _chance(one.p)


def _many(one: Difference, factor: float) -> tuple[str, ...]:
    scatters = one.standard_deviation, one.predicted_standard_deviation
    mean, *scattered = (None if v is None else factor * v for v in (one.mean, *scatters))
    return number(mean, 5), *map(number, scattered), _chance(one.p)


def _chance(p: float | None) -> str:
    return "<1e−9" if p is not None and p < 1e-9 else number(p, 2)
