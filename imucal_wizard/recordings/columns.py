"""Columns of numbers to the samples of each sensor, in SI or counts, each with its times."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.devices.formats.base import Column
from imucal_wizard.errors import RecordingError
from imucal_wizard.readings import FloatArray, Series
from imucal_wizard.recordings import guess, timeline
from imucal_wizard.recordings.header import SENSOR_CHANNELS
from imucal_wizard.recordings.layout import shown
from imucal_wizard.recordings.options import UNIT_OPTION, RecordingOptions
from imucal_wizard.recordings.timeline import Timeline
from imucal_wizard.units import COUNT, FACTORS, factor, si_unit, unit_of

SLOWER = ("magnetometer", "current", "throttle")
BESIDE = ("temperature", "current", "throttle")
"""What stands beside the sensors and can be done without."""


@dataclass(frozen=True, eq=False)
class Samples:
    """What one file holds.

    Attributes:
        series: the samples of each sensor by its name.
        warnings: what was noticed.
    """

    series: dict[str, Series]
    warnings: tuple[str, ...] = ()


def to_samples(
    values: FloatArray, columns: tuple[Column, ...], options: RecordingOptions
) -> Samples:
    """The sensors in a table.

    Args:
        values: shape (n, len(columns)); NaN where there is no value.
        columns: what each column is.
        options: what the user said beyond the file.

    Raises:
        RecordingError: a time, an axis or a unit is missing.
    """
    places = {column.channel: i for i, column in enumerate(columns)}
    times = _timeline(values, columns, places, options)
    series: dict[str, Series] = {}
    warnings = list(times.warnings)
    for sensor, channels in SENSOR_CHANNELS.items():
        present = [places[channel] for channel in channels if channel in places]
        if not present:
            continue
        if len(present) < len(channels):
            warnings += _lacking(sensor, [c for c in channels if c not in places])
            continue
        own = [columns[place] for place in present]
        if why := _numberless(sensor, values[:, present], own):
            warnings.append(why)
            continue
        if why := _unneeded(sensor, own):
            warnings.append(why)
            continue
        series[sensor], says = _series(sensor, values[:, present], own, times, options)
        warnings += says
    return Samples(series, tuple(warnings))


def _timeline(
    values: FloatArray,
    columns: tuple[Column, ...],
    places: dict[str, int],
    options: RecordingOptions,
) -> Timeline:
    if options.rate is not None and not options.rate > 0:
        raise RecordingError(f"--rate {options.rate:g} is no rate; give samples per second")
    if "t" in places:
        column = columns[places["t"]]
        if column.unit and column.unit not in FACTORS["time"]:
            raise RecordingError(
                f"{shown(column.unit)} in {shown(column.name)} is no unit of time; write one of"
                f" {', '.join(FACTORS['time'])}"
            )
        return timeline.from_column(values[:, places["t"]], column.unit, options.rate)
    if options.rate is None:
        raise RecordingError(
            "it has no time column; give the samples per second, for example --rate 100"
        )
    if "counter" in places:
        return timeline.from_counter(values[:, places["counter"]], options.rate)
    return timeline.from_rate(len(values), options.rate)


def _lacking(sensor: str, channels: list[str]) -> list[str]:
    """A sensor without all of its axes cannot be used; the accelerometer cannot be done without.

    Raises:
        RecordingError: it is the accelerometer.
    """
    says = f"the {sensor} has no column {' and '.join(channels)}"
    if sensor == "accelerometer":
        raise RecordingError(f"{says}; name the columns with --columns")
    return [f"{says} and was left out"]


def _numberless(sensor: str, values: FloatArray, columns: list[Column]) -> str:
    """Why a sensor has no whole sample and is left out, or ""; the accelerometer is needed.

    Raises:
        RecordingError: it is the accelerometer.
    """
    there = np.isfinite(values)
    if there.all(axis=1).any():
        return ""
    names = np.array([one.name or one.channel for one in columns])
    empty = names[~there.any(axis=0)].tolist()
    what = f"{' and '.join(empty)} hold no number" if empty else "no row has all of its axes"
    if sensor == "accelerometer":
        raise RecordingError(
            f"{what}: the {sensor} sends nothing; look at its wiring and record again"
        )
    return f"{what}: the {sensor} was left out; look at its wiring and at the sketch"


def _unneeded(sensor: str, columns: list[Column]) -> str:
    """Why a quantity that can be done without is left out, or ""."""
    unit = columns[0].unit
    if sensor not in BESIDE or unit in FACTORS[sensor]:
        return ""
    what = f"{shown(unit)} of column" if unit else "column"
    return (
        f"the {sensor} was left out: {what} {shown(columns[0].name)} has no unit of it"
        f" here; write {' or '.join(FACTORS[sensor])}"
    )


def _series(
    sensor: str,
    values: FloatArray,
    columns: list[Column],
    times: Timeline,
    options: RecordingOptions,
) -> tuple[Series, list[str]]:
    units, warnings = _units(sensor, values, columns, options)
    factors = np.array([factor(sensor, unit) for unit in units])
    values = values[times.rows]
    good = np.asarray(np.isfinite(values).all(axis=1))
    time = times.time
    if not good.all():
        if sensor not in SLOWER:  # it is slower than the others: absent in most rows of some
            warnings.append(
                f"{np.sum(~good)} of {len(good)} rows have no number for the {sensor}; left out"
            )
        values, time = values[good], time[good]
    if not len(values):
        raise RecordingError(f"no sample of the {sensor} has a time; look at the time column")
    return Series(time, values * factors, si_unit(sensor, units[0])), warnings


def _units(
    sensor: str, values: FloatArray, columns: list[Column], options: RecordingOptions
) -> tuple[list[str], list[str]]:
    """The unit of each axis: from the options, the header, or gravity; and what to say of it.

    Raises:
        RecordingError: a unit is missing or unknown, or only some axes are in counts.
    """
    given = options.unit(sensor)
    units = [unit_of(sensor, given)] * len(columns) if given else [c.unit for c in columns]
    says: list[str] = []
    if given and any(column.unit not in ("", units[0]) for column in columns):
        says.append(
            f"{UNIT_OPTION[sensor]} {given} was used instead of {columns[0].unit} in the header"
        )
    if sensor == "magnetometer" and not given and not set(units) <= {*FACTORS[sensor], COUNT, ""}:
        units = [""] * len(units)  # arbitrary units are as good as counts
    if not all(units):
        units, says = _without_unit(sensor, values, len(columns))
    for unit, column in zip(units, columns, strict=True):
        _known(sensor, unit, column.name, given)
    if len({unit == COUNT for unit in units}) > 1:
        raise RecordingError(f"only some axes of the {sensor} are in counts; give all in one unit")
    if sensor == "accelerometer" and len(set(units)) == 1:
        says += guess.doubt(values, units[0])
    return units, says


def _without_unit(sensor: str, values: FloatArray, axes: int) -> tuple[list[str], list[str]]:
    """Unit and warning where neither header nor option says it.

    Raises:
        RecordingError: it can only be told by the user.
    """
    if sensor == "accelerometer":
        unit, says = guess.acceleration_unit(values)
        return [unit] * axes, [says]
    if sensor == "magnetometer":
        return [COUNT] * axes, ["the field has no unit and was taken as counts; give --mag-unit"]
    raise RecordingError(
        f"nothing says the unit of the {sensor}, and a {sensor} at rest does not betray it; give"
        f" {UNIT_OPTION[sensor]} with one of {', '.join(FACTORS[sensor])}, {COUNT}"
    )


def _known(sensor: str, unit: str, name: str, given: str | None = None) -> None:
    counted = unit == COUNT and sensor in UNIT_OPTION
    if unit in FACTORS[sensor] or counted:
        return
    option = UNIT_OPTION.get(sensor, "")
    what = f"{option} {given}" if given else f"{shown(unit)} of column {shown(name)}"
    instead = f" or give {option}" if option and not given else ""
    raise RecordingError(
        f"{what} is no unit of the {sensor}; write one of {', '.join(FACTORS[sensor])},"
        f" {COUNT}{instead}"
    )
