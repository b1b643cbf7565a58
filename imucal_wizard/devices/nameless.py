"""Columns without names that are known: proposed where gravity is plain, else asked for."""

from dataclasses import replace

from imucal_wizard.devices import guess
from imucal_wizard.devices.formats.base import Column
from imucal_wizard.devices.formats.names import sensor_of
from imucal_wizard.devices.formats.words import channel_of, no_reading, squeezed
from imucal_wizard.devices.plain import plain
from imucal_wizard.readings import FloatArray

ASK = (
    "The lines carry numbers without names that are known here. Say which column is what: choose "
    "it here, or give --columns ax,ay,az,gx,gy,gz."
)


def proposed(columns: tuple[Column, ...], values: FloatArray) -> tuple[tuple[Column, ...], bool]:
    """A channel for each column, and whether that is sure enough to go on without asking.

    Columns whose words say that they are no reading stay out. Where the device has names of its
    own, nothing is sure: they may say what nobody here knows.

    Args:
        columns: the columns, none of which has a channel.
        values: first rows, shape (n, len(columns)).
    """
    places = [i for i, c in enumerate(columns) if not no_reading(squeezed(c.name))]
    found, sure = guess.channels(values[:, places])
    channels = dict(zip(places, found, strict=True))
    named = tuple(replace(c, channel=channels.get(i, "")) for i, c in enumerate(columns))
    return named, sure and not _own_names(columns)


def told(columns: tuple[Column, ...]) -> str:
    """What to say of a proposal that is used."""
    names = ", ".join(c.channel or "-" for c in columns)
    return f"The lines have no names; read as {names}. Correct it if not so."


def twice(columns: tuple[Column, ...]) -> str:
    """What to say of a second sensor of the same kind, or ""."""
    first = {c.channel: c.name for c in columns if sensor_of(c.channel)}
    for c in columns:
        again = "" if c.channel else channel_of(c.name)
        if again in first and again not in ("t", "temp"):
            return (
                f"Two columns are {again}: {plain(first[again])} is used and {plain(c.name)} is "
                f"not. Correct it if not so (key c, or --columns)."
            )
    return ""


def missing(sensor: str, letter: str, channels: set[str]) -> str:
    """What to say of a sensor of which not all axes are there."""
    gone = [letter + axis for axis in "xyz" if letter + axis not in channels]
    are, them = ("is", "it") if len(gone) == 1 else ("are", "them")
    return (
        f"The {sensor} needs three columns and {', '.join(gone)} {are} missing: print {them}, or "
        f"say which column is what."
    )


def _own_names(columns: tuple[Column, ...]) -> bool:
    """Whether the device has named its columns in words that mean nothing here."""
    names = [c.name.lower() for c in columns]
    if len(set(names)) < len(names) or all(name.startswith("column ") for name in names):
        return False
    others = [name for name in names if channel_of(name) not in ("t", "temp", "counter")]
    return others != ["x", "y", "z"]
