"""Local gravity, and the unit of accelerations inferred from its magnitude.

An accelerometer at rest measures one gravity; a gyroscope at rest says nothing about its unit.
"""

import math

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import median
from imucal_wizard.core.units import ACCELERATION_UNITS, COUNT, STANDARD_GRAVITY

MAX_UNIT_ERROR = 0.3
"""Bias and scale errors of an uncalibrated sensor, and hand-held pauses, stay within this share of
g."""
MIN_GRAVITY_COUNTS = 100.0
"""Every sensor resolves gravity in more counts than this."""
UNITS_BY_SIZE = ("m/s^2", "g", "mg")
"""Units that the magnitude of gravity can distinguish; cm/s² and mg are too similar."""


def median_magnitude(values: FloatArray) -> float:
    """Median magnitude of readings, shape (n, 3); rows with NaN are ignored."""
    lengths = np.sqrt(np.einsum("ij,ij->i", values, values))
    return median(lengths[~np.isnan(lengths)])


def are_whole_numbers(values: FloatArray) -> bool:
    """Whether all readings are whole numbers, as counts are."""
    finite = values[np.isfinite(values)]
    return bool(np.all(finite == np.floor(finite)))


def gravity_fits_unit(size: float, unit: str, within: float = MAX_UNIT_ERROR) -> bool:
    """Whether gravity may have this magnitude in a unit, within a relative tolerance."""
    if unit == COUNT:
        return size >= MIN_GRAVITY_COUNTS
    return abs(size * ACCELERATION_UNITS[unit] / STANDARD_GRAVITY - 1.0) < within


def unit_of_gravity(size: float, within: float = MAX_UNIT_ERROR) -> str | None:
    """The unit in which gravity has this magnitude within a tolerance; None for counts."""
    return next((unit for unit in UNITS_BY_SIZE if gravity_fits_unit(size, unit, within)), None)


def acceleration_unit(size: float, whole: bool) -> str | None:
    """The unit of accelerations in which gravity would have this magnitude, or None.

    Args:
        size: median magnitude of the readings.
        whole: whether all readings are whole numbers.
    """
    found = unit_of_gravity(size)
    if not whole or found == "mg":  # the only SI unit in which gravity is printed as whole numbers
        return found
    return COUNT if gravity_fits_unit(size, COUNT) else None


NORMAL_GRAVITY_SOURCE = (
    "Geodetic Reference System 1980: Somigliana's formula with the second-order free-air "
    "reduction (H. Moritz, Journal of Geodesy 74, 2000)"
)
GRAVITY_ANOMALY = 1e-3
"""By how much local gravity differs from normal gravity nearly everywhere, m/s²."""
_EQUATOR, _POLE_FACTOR, _ECCENTRICITY = 9.7803267715, 0.001931851353, 0.00669438002290
_RADIUS, _FLATTENING, _CENTRIFUGAL = 6378137.0, 0.00335281068118, 0.00344978600308


def normal_gravity(latitude: float, height: float) -> float:
    """Gravity of the ellipsoid of GRS 1980 at a height above it, m/s².

    Args:
        latitude: geodetic, rad.
        height: m.
    """
    square = math.sin(latitude) ** 2
    on_ellipsoid = (
        _EQUATOR * (1.0 + _POLE_FACTOR * square) / math.sqrt(1.0 - _ECCENTRICITY * square)
    )
    shape = 1.0 + _FLATTENING + _CENTRIFUGAL - 2.0 * _FLATTENING * square
    ratio = height / _RADIUS
    return on_ellipsoid * (1.0 - 2.0 * shape * ratio + 3.0 * ratio**2)
