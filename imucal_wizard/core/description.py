"""What the user states about a device, a place and a measurement."""

import math
from collections.abc import Mapping
from dataclasses import fields

from imucal_wizard.core.output import sanitise
from imucal_wizard.core.quantities import true_minus
from imucal_wizard.core.records import dataclass

MAX_DESCRIPTION_CHARACTERS = 120
"""Longest text; longer ones do not fit beside others in a list."""


@dataclass(frozen=True)
class Description:
    """Device, place and operator; "" for what is not stated.

    Attributes:
        device: name of the device.
        serial: its serial number.
        chip: kind of its chip.
        place: name of the place.
        operator: who measured.
        note: anything else.
    """

    device: str = ""
    serial: str = ""
    chip: str = ""
    place: str = ""
    operator: str = ""
    note: str = ""

    @classmethod
    def read(cls, about: Mapping[str, object]) -> "Description":
        """The description among other settings; anything but printable text is left out."""
        names = [one.name for one in fields(cls)]
        return cls(*(_line(about.get(name)) for name in names))

    def stated(self) -> dict[str, str]:
        """The texts by name, without empty ones."""
        texts = {one.name: getattr(self, one.name) for one in fields(self)}
        return {name: text for name, text in texts.items() if text}

    def over(self, other: "Description") -> "Description":
        """This description, completed by another one."""
        return Description(**(other.stated() | self.stated()))

    @property
    def named(self) -> str:
        """What a list calls the device: its name, else its serial number."""
        return self.device or self.serial


@dataclass(frozen=True)
class Location:
    """Where the device stands.

    Attributes:
        latitude: geodetic, °.
        height: above the sea, m.
    """

    latitude: float
    height: float = 0.0

    @property
    def gravity(self) -> float:
        """Normal gravity there, m/s²."""
        from imucal_wizard.core.gravity import normal_gravity  # NumPy

        return normal_gravity(math.radians(self.latitude), self.height)

    def __str__(self) -> str:
        """Latitude and height in words."""
        return true_minus(f"latitude {self.latitude:g}°, height {self.height:g} m")


def _line(text: object) -> str:
    return sanitise(text, MAX_DESCRIPTION_CHARACTERS) if isinstance(text, str) else ""
