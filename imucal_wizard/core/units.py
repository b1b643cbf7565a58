"""Units of files and streams; inside the program everything is in SI, radians or raw counts."""

import math

from imucal_wizard.core.errors import UsageError

STANDARD_GRAVITY = 9.80665
"""Conventional gravity, m/s² (CGPM 1901)."""
GRAVITY_ON_EARTH = (9.75, 9.84)
"""Limits of what is taken for a local gravity, m/s²: from a height of 9 km at the equator to the
sea at the poles."""
GRAVITY_ON_EARTH_TEXT = "a gravity on Earth; it lies between 9.75 and 9.84 m/s²"
FIELD_ON_EARTH = (20.0, 70.0)
"""Limits of what is taken for the magnitude of the Earth's field, µT."""
FIELD_ON_EARTH_TEXT = "the Earth's field; it lies between 20 and 70 µT"

COUNT = "count"
"""Unit of a reading whose scale is unknown before the fit."""

ACCELERATION_UNITS: dict[str, float] = {
    "m/s^2": 1.0,
    "g": STANDARD_GRAVITY,
    "mg": STANDARD_GRAVITY / 1000.0,
    "cm/s^2": 0.01,
}
RATE_UNITS: dict[str, float] = {
    "rad/s": 1.0,
    "mrad/s": 1e-3,
    "deg/s": math.pi / 180.0,
    "mdeg/s": math.pi / 180_000.0,
    "rpm": math.pi / 30.0,
}
FIELD_UNITS: dict[str, float] = {"uT": 1.0, "nT": 1e-3, "mT": 1e3, "G": 100.0, "mG": 0.1}
TIME_UNITS: dict[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
TEMPERATURE_UNITS: dict[str, float] = {"degC": 1.0}
CURRENT_UNITS: dict[str, float] = {"A": 1.0, "mA": 1e-3}
THROTTLE_UNITS: dict[str, float] = {"%": 1.0}

SI_UNIT: dict[str, str] = {
    "accelerometer": "m/s^2",
    "gyroscope": "rad/s",
    "magnetometer": "uT",
    "temperature": "degC",
    "current": "A",
    "throttle": "%",
    "time": "s",
}
"""The unit in which the program stores each quantity (flux density in µT)."""

UNIT_FACTORS: dict[str, dict[str, float]] = {
    "accelerometer": ACCELERATION_UNITS,
    "gyroscope": RATE_UNITS,
    "magnetometer": FIELD_UNITS,
    "temperature": TEMPERATURE_UNITS,
    "current": CURRENT_UNITS,
    "throttle": THROTTLE_UNITS,
    "time": TIME_UNITS,
}

_SPELLINGS: dict[str, str] = {
    spelling: unit
    for unit, spellings in {
        "m/s^2": "m/s2 ms-2 m/s/s m/sec2 m/sec/sec mps2 ms2 mpss meter/s2 meters/s2 metre/s2 "
        "metres/s2 meter/second2 meters/second2 meters/sec2",
        "g": "gee gees gs g0 gn",
        "mg": "milli-g millig mgee",
        "cm/s^2": "cm/s2 cms-2 cm/s/s cm/sec2 cmps2 gal gals",
        "rad/s": "rads-1 rad/sec rad/second rads radps rads/s radian/s radians/s radians/sec "
        "radian/sec radians/second radianspersecond radpersec rps",
        "mrad/s": "mrads-1 mrad/sec mradps",
        "deg/s": "degs-1 dps degps °/s °s-1 °/sec deg/sec"
        " deg/second degree/s degrees/s degree/sec degrees/sec degrees/second degs "
        "degreespersecond degpersec",
        "mdeg/s": "mdps mdegs-1 mdeg/sec m°/s mdegps",
        "rpm": "r/min rev/min revs/min",
        "uT": "microtesla microteslas",
        "mT": "millitesla",
        "nT": "nanotesla",
        "G": "gauss ga",
        "mG": "milligauss mgauss mga",
        "degC": "°c c celsius degreescelsius degreesc °",
        "A": "amp amps ampere amperes",
        "mA": "milliamp milliamps milliampere milliamperes",
        "%": "percent pct",
        COUNT: "counts lsb lsbs raw adc digits digit",
        "s": "sec secs second seconds",
        "ms": "millis msec msecs millisecond milliseconds",
        "us": "micros usec usecs microsecond microseconds",
        "ns": "nanos nsec nsecs nanosecond nanoseconds",
    }.items()
    for spelling in spellings.split()
}
_SIGNS = str.maketrans(
    {
        "µ": "u",
        "μ": "u",
        "²": "2",
        "¹": "1",
        "⁻": "-",
        "−": "-",
        "º": "°",
        "˚": "°",
        **dict.fromkeys(" ^*·⋅()", None),
    }
)
_OF_GRAVITY = {"G": "g", "mG": "mg"}
"""Symbols that mean gauss for a field and gravity for an acceleration."""


def canonical_unit(word: str) -> str:
    """The unit in this program's spelling; an unknown word is returned unchanged."""
    word = word.strip()
    known = {COUNT, *(unit for table in UNIT_FACTORS.values() for unit in table)}
    if word in known:
        return word
    plain = word.translate(_SIGNS).lower()
    if plain in _SPELLINGS:
        return _SPELLINGS[plain]
    matches = [unit for unit in known if unit.lower() == plain]
    return matches[0] if len(matches) == 1 else word


def unit_for_sensor(sensor: str, word: str) -> str:
    """The unit of a known sensor, in this program's spelling."""
    unit = canonical_unit(word)
    return _OF_GRAVITY.get(unit, unit) if sensor == "accelerometer" else unit


def unit_factor(sensor: str, unit: str) -> float:
    """The factor from ``unit`` to the sensor's SI unit; 1 for counts.

    Raises:
        UsageError: the unit is not one of this sensor's.
    """
    unit = unit_for_sensor(sensor, unit)
    if unit == COUNT and sensor in ("accelerometer", "gyroscope", "magnetometer"):
        return 1.0
    try:
        return UNIT_FACTORS[sensor][unit]
    except KeyError:
        allowed = ", ".join([*UNIT_FACTORS[sensor], COUNT])
        raise UsageError(f"{unit!r} is not a unit of the {sensor}; give one of {allowed}") from None


def si_unit(sensor: str, unit: str) -> str:
    """The unit of a reading inside the program: the sensor's SI unit, or counts."""
    return COUNT if canonical_unit(unit) == COUNT else SI_UNIT[sensor]
