"""Unit words at the edges of the program. Inside, everything is SI and radians, or raw counts."""

import math

from imucal_wizard.errors import UsageError

STANDARD_GRAVITY = 9.80665
"""Conventional gravity, m/s² (CGPM 1901)."""

COUNT = "count"
"""The unit of a reading whose scale is not known before the fit."""

ACCELERATION: dict[str, float] = {
    "m/s^2": 1.0,
    "g": STANDARD_GRAVITY,
    "mg": STANDARD_GRAVITY / 1000.0,
}
RATE: dict[str, float] = {
    "rad/s": 1.0,
    "mrad/s": 1e-3,
    "deg/s": math.pi / 180.0,
    "mdeg/s": math.pi / 180_000.0,
}
FIELD: dict[str, float] = {"uT": 1.0, "nT": 1e-3, "mT": 1e3, "G": 100.0, "mG": 0.1}
TIME: dict[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
TEMPERATURE: dict[str, float] = {"degC": 1.0}

SI_UNIT: dict[str, str] = {
    "accelerometer": "m/s^2",
    "gyroscope": "rad/s",
    "magnetometer": "uT",
    "temperature": "degC",
    "time": "s",
}
"""The unit in which the program keeps each quantity (flux density stays in µT)."""

FACTORS: dict[str, dict[str, float]] = {
    "accelerometer": ACCELERATION,
    "gyroscope": RATE,
    "magnetometer": FIELD,
    "temperature": TEMPERATURE,
    "time": TIME,
}

_SPELLINGS: dict[str, str] = {
    "m/s2": "m/s^2",
    "m/s²": "m/s^2",
    "m/s/s": "m/s^2",
    "m/s**2": "m/s^2",
    "mps2": "m/s^2",
    "dps": "deg/s",
    "°/s": "deg/s",
    "deg/sec": "deg/s",
    "degree/s": "deg/s",
    "mdps": "mdeg/s",
    "rad/sec": "rad/s",
    "rps": "rad/s",
    "µt": "uT",
    "μt": "uT",
    "gauss": "G",
    "milligauss": "mG",
    "°c": "degC",
    "c": "degC",
    "celsius": "degC",
    "counts": COUNT,
    "lsb": COUNT,
    "raw": COUNT,
    "sec": "s",
    "µs": "us",
    "μs": "us",
    "micros": "us",
    "millis": "ms",
}


def canonical(word: str) -> str:
    """The unit as this program spells it; an unknown word comes back unchanged."""
    word = word.strip()
    if word in _SPELLINGS:
        return _SPELLINGS[word]
    known = {COUNT, *(unit for table in FACTORS.values() for unit in table)}
    if word in known:
        return word
    lowered = word.lower()
    if lowered in _SPELLINGS:
        return _SPELLINGS[lowered]
    matches = [unit for unit in known if unit.lower() == lowered]
    return matches[0] if len(matches) == 1 else word


def factor(sensor: str, unit: str) -> float:
    """What a reading in ``unit`` is multiplied by to reach the sensor's SI unit; 1 for counts.

    Raises:
        UsageError: the unit does not belong to the sensor.
    """
    unit = canonical(unit)
    if unit == COUNT and sensor in ("accelerometer", "gyroscope", "magnetometer"):
        return 1.0
    try:
        return FACTORS[sensor][unit]
    except KeyError:
        allowed = ", ".join([*FACTORS[sensor], COUNT])
        raise UsageError(f"{unit!r} is not a unit of the {sensor}; give one of {allowed}") from None


def si_unit(sensor: str, unit: str) -> str:
    """The unit a reading has inside the program: the sensor's SI unit, or counts."""
    return COUNT if canonical(unit) == COUNT else SI_UNIT[sensor]
