"""The setup of a stream, stated by the user or found in the stream; stored in the session."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from typing import Any

from imucal_wizard.acquire.decode.base import Column
from imucal_wizard.acquire.decode.vocabulary import (
    LETTER_OF_SENSOR,
    SENSOR_CHANNELS,
    column_of_name,
    quantity_of,
)
from imucal_wizard.core import units
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.records import dataclass

AUTO = "auto"


@dataclass(frozen=True)
class StreamSetup:
    """The setup of a stream. Empty fields are determined or asked for.

    Attributes:
        format: name of a format, or ``auto``.
        columns: the columns in order.
        rate: samples per second of a stream that carries no time; None to measure it.
        accelerometer_unit: unit word; overrides what the columns say.
        gyroscope_unit: the same for the gyroscope.
        magnetometer_unit: the same for the magnetometer.
    """

    format: str = AUTO
    columns: tuple[Column, ...] = ()
    rate: float | None = None
    accelerometer_unit: str = ""
    gyroscope_unit: str = ""
    magnetometer_unit: str = ""

    def __post_init__(self) -> None:
        for sensor in LETTER_OF_SENSOR:
            word = getattr(self, f"{sensor}_unit")
            if word:
                units.unit_factor(sensor, word)
        if self.rate is not None and not 0 < self.rate < 1e6:
            raise UsageError(f"a rate of {self.rate} per second is impossible; give one like 100")

    def unit_of(self, column: Column) -> str:
        """The unit of a column: as stated for its sensor, or as declared by the column."""
        sensor = quantity_of(column.channel)
        said = getattr(self, f"{sensor}_unit", "") if sensor else ""
        return units.canonical_unit(said or column.unit)

    def to_json(self) -> dict[str, Any]:
        """A value that the ``json`` module writes."""
        return {**asdict(self), "columns": [asdict(c) for c in self.columns]}

    @classmethod
    def from_json(cls, value: object) -> "StreamSetup":
        """The setup that ``to_json`` wrote.

        Raises:
            UsageError: a key is not known, a value is of another kind, or a unit does not exist.
        """
        import msgspec

        known = {one.name for one in fields(cls)}
        if not isinstance(value, dict) or not value.keys() <= known:
            raise UsageError(f"This stream setup cannot be read: {str(value)[:80]}")
        try:
            return msgspec.convert(value, cls)
        except msgspec.ValidationError as error:
            raise UsageError(f"This stream setup cannot be read: {error}") from error


def named_columns(names: str) -> tuple[Column, ...]:
    """The columns of a list like ``ax,ay,az,gx,gy,gz``; ``-`` or nothing skips a column.

    Units in brackets may follow each name.

    Raises:
        UsageError: a name is not known.
    """
    found = tuple(column_of_name(name) for name in names.split(","))
    for c in found:
        if not c.channel and c.name not in ("", "-", "_", "skip"):
            raise UsageError(
                f"{c.name!r} is not a column; use t, ax, ay, az, gx, gy, gz, mx, my, mz, temp, "
                f"counter, or - for one to skip"
            )
    return found


def chosen_setup(
    stream_format: str,
    columns: Sequence[Column],
    channels: Sequence[str],
    chosen_units: Mapping[str, str],
) -> StreamSetup:
    """The setup of a stream whose columns and units a person has chosen.

    Args:
        stream_format: name of the stream's format, or "".
        columns: as the stream describes them.
        channels: the channel chosen for each column; "" for a column that is not used.
        chosen_units: the unit of ``time`` and of each sensor; "" if none was chosen.

    Raises:
        UsageError: a channel has two columns, a sensor lacks an axis, or a unit is missing.
    """
    used = [channel for channel in channels if channel]
    twice = sorted({channel for channel in used if used.count(channel) > 1})
    if twice:
        raise UsageError(f"{', '.join(twice)} is given twice; a channel has one column")
    for sensor in LETTER_OF_SENSOR:
        missing = [channel for channel in SENSOR_CHANNELS[sensor] if channel not in used]
        if missing and sensor == "accelerometer":
            raise UsageError(
                f"the accelerometer lacks {', '.join(missing)}: choose the column of each"
            )
        if 0 < len(missing) < len(SENSOR_CHANNELS[sensor]):
            raise UsageError(
                f"the {sensor} needs all of {', '.join(SENSOR_CHANNELS[sensor])}, or none"
            )
    asked = {quantity_of(channel) for channel in used} & chosen_units.keys()
    for quantity in chosen_units:
        if quantity in asked and not chosen_units[quantity]:
            raise UsageError(f"choose the unit of the {quantity}")
    made = []
    for own, channel in zip(columns, channels, strict=True):
        quantity = quantity_of(channel) or ""
        kept = own.unit if channel == own.channel else ""
        unit = chosen_units.get(quantity) or kept or units.SI_UNIT.get(quantity, "")
        made.append(replace(own, channel=channel, unit=unit if channel else ""))
    own_units = {name: unit for name, unit in chosen_units.items() if name in asked}
    return StreamSetup(
        format=stream_format or AUTO,
        columns=tuple(made),
        accelerometer_unit=own_units.get("accelerometer", ""),
        gyroscope_unit=own_units.get("gyroscope", ""),
        magnetometer_unit=own_units.get("magnetometer", ""),
    )
