"""Names of columns in files: those that streams use too, and those that only files have."""

import re

from imucal_wizard.devices.formats import names
from imucal_wizard.devices.formats.base import Column
from imucal_wizard.units import canonical

SENSOR_CHANNELS: dict[str, tuple[str, ...]] = {
    "accelerometer": ("ax", "ay", "az"),
    "gyroscope": ("gx", "gy", "gz"),
    "magnetometer": ("mx", "my", "mz"),
    "temperature": ("temp",),
}
"""The channels of each sensor, in axis order."""

_OF_FILES: dict[str, str] = {
    **dict.fromkeys(["nsamples", "samples", "samplenumber", "idx"], "counter"),
    # as ROS names specific force: gravity is in it, unlike in Android's quantity of this name
    **{f"linearacceleration{axis}": f"a{axis}" for axis in "xyz"},
}
_TWO_WORD_UNITS = re.compile(r"(?P<name>.+)_(?P<unit>m?(?:rad|deg)_s|m_s2)$", re.IGNORECASE)
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*$")


def column(text: str) -> Column:
    """What one name in a header (or in ``--columns``) stands for.

    Returns:
        The column; its channel is ``""`` for a name that means nothing here, its unit ``""``
        where the name does not say it. An unknown word in brackets stays as it is.
    """
    name = text.strip().strip("\"'").strip()
    bare, unit = name, ""
    if match := _BRACKETS.match(name):
        bare, unit = match["name"], canonical(match["unit"])
    elif match := _TWO_WORD_UNITS.match(name):
        bare, unit = match["name"], canonical(match["unit"].replace("_", "/"))
    found = names.column(bare)
    channel = found.channel or _OF_FILES.get(re.sub(r"[^a-z]", "", bare.lower()), "")
    if channel == "temp":
        unit = unit or "degC"
    return Column(channel, unit or found.unit if channel else "", name)


def is_time_of_day(one: Column) -> bool:
    """Whether a column is a clock on the wall, coarser than any other time beside it."""
    return one.channel == "t" and "rtc" in one.name.lower()
