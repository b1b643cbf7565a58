"""Readings of which no calibration can come: refused with what is wrong and what to do."""

import numpy as np

from imucal_wizard.digits import decimals, fixed
from imucal_wizard.ellipsoid.saturation import check_clipping
from imucal_wizard.errors import DataError
from imucal_wizard.readings import ENDLESS, FloatArray

FEWEST_SAMPLES = 60
"""Six directions ten times over."""
FLAT = 0.1
"""Spread out of the plane over spread in it, up to which readings are a single circle."""
NEARLY_FLAT = 0.25
"""The same for readings through which no ellipsoid could be laid."""
RESTLESS = 2.5
"""Spread over sample-to-sample noise, below which nothing but noise is seen."""
LOOSE = 0.12
"""Scatter over the field's size beyond which readings are no shell at all."""
EARTH = (22.0, 67.0)
"""The Earth's field from the South Atlantic to the poles, µT (World Magnetic Model)."""
MARGIN = 1.25
"""How far a sensor's scale may be off: beyond, the field is not the Earth's."""
SPIKE = 4.0
"""How many times as far from the median of five a wild sample lies as three in four do."""
USUAL = 0.75
STRETCH = 50
ENOUGH = 1500
"""Samples that are looked at for wild ones, about, in stretches of so many."""


def check_readings(readings: FloatArray) -> None:
    """Refuse what is visible without a fit.

    Args:
        readings: in the order of time, shape (n, 3).

    Raises:
        DataError: too few samples, an axis that says nothing or is plainly cut off, or readings in
            one plane.
    """
    if len(readings) < FEWEST_SAMPLES:
        raise DataError(
            f"{len(readings)} samples of the magnetometer are too few: turn the device for at "
            "least half a minute"
        )
    if not (np.abs(readings) < ENDLESS).all():
        raise DataError("the magnetometer's readings are not all numbers: check the columns")
    columns = np.ascontiguousarray(readings.T)
    still = np.flatnonzero(columns.max(axis=1) == columns.min(axis=1))
    if len(still) == 3:
        raise DataError(
            "the magnetometer sends one and the same value: it is not there, or asleep. Look at "
            "its wiring, address and sketch"
        )
    if len(still):
        raise DataError(
            f"axis {' and '.join('xyz'[i] for i in still)} of the magnetometer always reads the "
            "same: it is dead or not connected"
        )
    check_clipping(readings)
    check_plane(readings)


def check_plane(readings: FloatArray) -> None:
    """Refuse a single circle, whatever wild samples stand around it.

    Args:
        readings: shape (n, 3), in the order of time.

    Raises:
        DataError: the readings lie in one plane.
    """
    calm = _without_spikes(readings)
    if _flatness(calm) < FLAT and not _is_noise(calm):
        raise DataError(_PLANE)


def no_shell(readings: FloatArray) -> DataError | None:
    """What to say of readings that fit no ellipsoid, when its reason is plain to see."""
    readings = _without_spikes(readings)
    if _is_noise(readings):
        return DataError(
            "the device does not turn: the magnetometer's readings are one value and noise. Turn "
            "it through all directions while it records"
        )
    return DataError(_PLANE) if _flatness(readings) < NEARLY_FLAT else None


def _without_spikes(readings: FloatArray) -> FloatArray:
    """Readings without single wild ones: a few make a plane look thick, and a turn like noise.

    Of many readings some stretches will do.
    """
    stretch = np.arange(len(readings)) // STRETCH
    readings = readings[stretch % max(1, len(readings) // ENOUGH) == 0]
    middle = np.median(np.lib.stride_tricks.sliding_window_view(readings, 5, axis=0), axis=-1)
    off = np.linalg.norm(readings[4:-4] - middle[2:-2], axis=1)
    apart = np.linalg.norm(middle[4:] - middle[:-4], axis=1)
    # a fast turn is off as well, but there the neighbours are apart
    wild = (off > SPIKE * np.quantile(off, USUAL)) & (apart < 0.5 * off)
    return np.asarray(readings[4:-4][~wild])


def _flatness(readings: FloatArray) -> float:
    """Spread across the plane of the readings over the spread in it."""
    values = np.linalg.eigvalsh(np.cov(readings.T))
    return float(np.sqrt(max(values[0], 0.0) / values[2]))


def _is_noise(readings: FloatArray) -> bool:
    steps = np.diff(readings, axis=0)
    noise = np.sqrt(0.5 * (steps**2).mean(axis=0))
    return bool((readings.std(axis=0) < RESTLESS * noise).all())


def check_scatter(sigma: float, radius: float, readings: FloatArray) -> None:
    """Refuse a cloud through which an ellipsoid was laid all the same.

    Args:
        sigma: robust scatter of the distances.
        radius: mean radius, same unit.
        readings: shape (n, 3).

    Raises:
        DataError: the readings are no shell.
    """
    if sigma <= LOOSE * radius:
        return
    raise no_shell(readings) or DataError(
        f"the magnetometer's readings scatter by {100.0 * sigma / radius:.0f} % of the field: it "
        "is not one constant field. Measure away from iron, magnets and currents"
    )


def check_field(magnitude: float, unit: str, field: float | None) -> str:
    """A warning about the field's size, or "".

    Args:
        magnitude: mean size of the field by the reading's own unit.
        unit: the reading's unit.
        field: the local field that the user gave, µT.

    Raises:
        DataError: it is far from the Earth's.
    """
    if unit != "uT":
        return ""
    low, high = EARTH
    if not low / MARGIN <= magnitude <= high * MARGIN:
        raise DataError(
            f"a field of {fixed(magnitude, decimals(magnitude, 3))} µT is not the Earth's "
            f"({low:.0f} to {high:.0f} µT): a magnet or iron turns with it, an axis is saturated, "
            "or the unit is another (--mag-unit)"
        )
    if field is not None and not 1.0 / MARGIN <= magnitude / field <= MARGIN:
        return (
            f"the readings say {magnitude:.3g} µT where --field says {field:.3g} µT: look at the "
            "unit, and at what iron is near"
        )
    if not low <= magnitude <= high:
        return f"the field of {magnitude:.3g} µT is outside the Earth's {low:.0f} to {high:.0f} µT"
    return ""


_PLANE = (
    "the magnetometer's readings lie in one plane: one circle, or half of one, carries no "
    "calibration. Turn it once round with each of its six faces down"
)
