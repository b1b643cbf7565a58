"""Names of columns in files: those that streams use too, with what else a file may say."""

from imucal_wizard.devices.formats import names
from imucal_wizard.devices.formats.base import Column

SENSOR_CHANNELS: dict[str, tuple[str, ...]] = {
    "accelerometer": ("ax", "ay", "az"),
    "gyroscope": ("gx", "gy", "gz"),
    "magnetometer": ("mx", "my", "mz"),
    "temperature": ("temp",),
    "current": ("current",),
    "throttle": ("throttle",),
}
"""The channels of each sensor, in axis order."""


def column(text: str) -> Column:
    """What one name in a header (or in ``--columns``) stands for.

    Returns:
        The column; its channel is ``""`` for a name that means nothing here, its unit ``""``
        where the name does not say it. An unknown word in brackets stays as it is.
    """
    found = names.column(text)
    unit = found.unit or names.parts(found.name)[1]
    if found.channel == "temp":
        unit = unit or "degC"
    return Column(found.channel, unit if found.channel else "", found.name)


def is_time_of_day(one: Column) -> bool:
    """Whether a column is a clock on the wall, coarser than any other time beside it."""
    return one.channel == "t" and "rtc" in one.name.lower()
