"""Quality of magnetometer samples: saturation, a plane instead of a shell, scatter.

The checks need no calibration, or only distances from one, so the guided procedure and the fit
refuse the same data with the same words.
"""

from math import comb, sqrt

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.limits.data_quality import MIN_FIELD_SAMPLES
from imucal_wizard.core.quantities import decimals, fixed
from imucal_wizard.core.readings import (
    MAX_READING,
    BoolArray,
    FloatArray,
    distinct,
)
from imucal_wizard.core.statistics import (
    median,
    median_of_rows,
    robust_deviation,
    sample_quantile,
)
from imucal_wizard.measurement.clipping import CLIPPING_ADVICE

MAX_PLANE_FLATNESS = 0.1
"""Ratio of the spread across a plane to that in it, up to which readings are a single circle."""
MAX_NEAR_PLANE_FLATNESS = 0.25
"""The same for readings that fit no ellipsoid."""
MIN_MOTION_RATIO = 2.5
"""Ratio of the spread to the sample-to-sample noise, below which the device did not turn."""
MAX_SHELL_SCATTER = 0.12
"""Ratio of the scatter to the magnitude of the field, above which readings are not a shell."""
EARTH_FIELD_RANGE = (22.0, 67.0)
"""Range of the Earth's field, µT (World Magnetic Model)."""
MAX_FIELD_SCALE_ERROR = 1.25
"""Largest factor by which a sensor's scale may be wrong; beyond it, the field is not the
Earth's."""
MIN_SPIKE_RATIO = 4.0
"""Distance of a spike from the median of five, as a multiple of the 75 % quantile of distances."""
SPIKE_QUANTILE = 0.75
"""Quantile of the distances that spikes do not affect."""
SAMPLES_PER_STRETCH = 50
"""Consecutive samples in a stretch."""
MAX_SPIKE_SAMPLES = 1500
"""Approximate number of samples searched for spikes, in stretches of the length above."""
MIN_STUCK_SHARE = 0.005
"""Share of samples at an extreme value, above which an axis may be saturated."""
MIN_STUCK_SAMPLES = 10
"""Samples at one extreme value that may be saturated."""
MIN_STUCK_DEPTH = 3.0
"""Distance of such samples inside the ellipsoid of the others, in standard deviations."""
MIN_STUCK_RATIO = 3.0
"""Ratio of the frequency of the extreme value to that of the values next to it."""
STUCK_NEIGHBOURS = 3
"""Number of values next to the extreme one that are compared with it."""
MIN_NOISE_STEPS = 0.5
"""Noise in resolution steps, above which the extreme value is rare even at rest. Rounding alone
appears as 0.29 of a step (1/√12)."""
DIFFERENCE_ORDERS = (2, 4, 6)
"""Orders of the differences that measure the noise: all agree for white noise; high orders suppress
smooth motion, low orders suppress jerks."""


def check_readings(readings: FloatArray) -> None:
    """Refuse data whose fault is visible without a fit.

    Args:
        readings: in the order of time, shape (n, 3).

    Raises:
        DataError: too few samples, a constant or saturated axis, or readings in one plane.
    """
    if len(readings) < MIN_FIELD_SAMPLES:
        raise DataError(
            f"{len(readings)} samples of the magnetometer are too few: turn the device for at "
            "least half a minute"
        )
    if not (np.abs(readings) < MAX_READING).all():
        raise DataError("the magnetometer's readings are not all numbers: check the columns")
    columns = np.ascontiguousarray(readings.T)
    still = np.flatnonzero(columns.max(axis=1) == columns.min(axis=1))
    if len(still) == 3:
        raise DataError(CONSTANT_FIELD)
    if len(still):
        raise DataError(
            f"axis {' and '.join('xyz'[i] for i in still)} of the magnetometer always reads the "
            "same: it is dead or not connected"
        )
    _check_clipping(readings)
    check_plane(readings)


def check_plane(readings: FloatArray) -> None:
    """Refuse a single circle; spikes are ignored.

    Args:
        readings: shape (n, 3), in the order of time.

    Raises:
        DataError: the readings lie in one plane.
    """
    calm = _without_spikes(readings)
    if _flatness(calm) < MAX_PLANE_FLATNESS and not _is_noise(calm):
        raise DataError(_PLANE)


def missing_shell(readings: FloatArray) -> DataError | None:
    """The error for readings that fit no ellipsoid if the cause is visible, or None."""
    readings = _without_spikes(readings)
    if _is_noise(readings):
        return DataError(
            "the device does not turn: the magnetometer's readings are one value and noise. Turn "
            "it through all directions while it records"
        )
    return DataError(_PLANE) if _flatness(readings) < MAX_NEAR_PLANE_FLATNESS else None


def _without_spikes(readings: FloatArray) -> FloatArray:
    """Readings without spikes, which make a plane look thick and a rotation look like noise.

    Of a long series only some stretches are used.
    """
    stretch = np.arange(len(readings)) // SAMPLES_PER_STRETCH
    readings = readings[stretch % max(1, len(readings) // MAX_SPIKE_SAMPLES) == 0]
    last = len(readings) - 4
    middle = median_of_rows(np.stack([readings[place : last + place] for place in range(5)]))
    off = np.linalg.norm(readings[4:-4] - middle[2:-2], axis=1)
    apart = np.linalg.norm(middle[4:] - middle[:-4], axis=1)
    # a fast rotation deviates as well, but its neighbours differ
    wild = (off > MIN_SPIKE_RATIO * sample_quantile(off, SPIKE_QUANTILE)) & (apart < 0.5 * off)
    return np.asarray(readings[4:-4][~wild])


def _flatness(readings: FloatArray) -> float:
    """Ratio of the spread across the plane of the readings to the spread in it."""
    values = np.linalg.eigvalsh(np.cov(readings.T))
    return float(np.sqrt(max(values[0], 0.0) / values[2]))


def _is_noise(readings: FloatArray) -> bool:
    steps = np.diff(readings, axis=0)
    noise = np.sqrt(0.5 * (steps**2).mean(axis=0))
    return bool((readings.std(axis=0) < MIN_MOTION_RATIO * noise).all())


def check_scatter(sigma: float, radius: float, readings: FloatArray) -> None:
    """Refuse a cloud of readings to which an ellipsoid was fitted nevertheless.

    Args:
        sigma: robust scatter of the distances from the ellipsoid.
        radius: mean radius, same unit.
        readings: shape (n, 3).

    Raises:
        DataError: the readings are no shell.
    """
    if sigma <= MAX_SHELL_SCATTER * radius:
        return
    raise missing_shell(readings) or DataError(
        f"the magnetometer's readings scatter by {100.0 * sigma / radius:.0f} % of the field: the "
        "field is not constant. Measure away from iron, magnets and currents"
    )


def check_field(magnitude: float, unit: str, field: float | None) -> str:
    """A warning about the magnitude of the field, or "".

    Args:
        magnitude: mean magnitude of the field in the reading's unit.
        unit: the reading's unit.
        field: the local field stated by the user, µT.

    Raises:
        DataError: it is far from the Earth's.
    """
    if unit != "uT":
        return ""
    low, high = EARTH_FIELD_RANGE
    if not low / MAX_FIELD_SCALE_ERROR <= magnitude <= high * MAX_FIELD_SCALE_ERROR:
        raise DataError(
            f"a field of {fixed(magnitude, decimals(magnitude, 3))} µT is not the Earth's "
            f"({low:.0f} to {high:.0f} µT): a magnet or iron moves with the device, an axis is "
            "saturated, or the unit is wrong",
            settings=("magnetometer_unit",),
        )
    if (
        field is not None
        and not 1.0 / MAX_FIELD_SCALE_ERROR <= magnitude / field <= MAX_FIELD_SCALE_ERROR
    ):
        return (
            f"the readings give {magnitude:.3g} µT, but {field:.3g} µT was stated: check the "
            "unit, and look for iron nearby"
        )
    if not low <= magnitude <= high:
        return f"the field of {magnitude:.3g} µT is outside the Earth's {low:.0f} to {high:.0f} µT"
    return ""


def stuck_samples(readings: FloatArray) -> dict[str, BoolArray]:
    """Samples at an extreme value that is suspiciously frequent, by axis and end (``+x``)."""
    out: dict[str, BoolArray] = {}
    for axis, values in zip("xyz", readings.T, strict=True):
        low, high = float(values.min()), float(values.max())
        for sign, extreme in (("+", high), ("-", low)):
            there = values == extreme
            count = int(there.sum())
            if count < max(MIN_STUCK_SAMPLES, MIN_STUCK_SHARE * len(values)):
                continue
            near = np.abs(values - extreme) <= 0.1 * (high - low)
            levels = max(len(distinct(values[near])) - 1, 1)
            if count > MIN_STUCK_RATIO * (near.sum() - count) / levels:
                out[sign + axis] = there
    return out


def _check_clipping(readings: FloatArray) -> None:
    """Refuse an axis that is clearly saturated.

    If the noise is at least about a step, the largest value is rarer than those just below it, even
    at rest. A saturated axis has lost its noise, and the other axes have kept theirs: where they
    are calm as well, the device rests in a quiet place.

    Args:
        readings: in the order of time, shape (n, 3).

    Raises:
        DataError: an axis is saturated.
    """
    stuck = stuck_samples(readings)
    ends = [np.any([at for name, at in stuck.items() if name[1] == axis], axis=0) for axis in "xyz"]
    for name, there in stuck.items():
        axis = "xyz".index(name[1])
        values = readings[:, axis]
        levels, counts = np.unique(values, return_counts=True)
        if name[0] == "+":
            levels, counts = -levels[::-1], counts[::-1]
        beside = slice(1, 1 + STUCK_NEIGHBOURS)
        if len(levels) < 2 + STUCK_NEIGHBOURS or counts[0] < MIN_STUCK_RATIO * counts[beside].max():
            continue
        step = median(np.diff(levels[: 2 + STUCK_NEIGHBOURS]))
        others = [_noise(readings[:, k], ~there | ends[k]) for k in range(3) if k != axis]
        while_there = max((one for one in others if one is not None), default=np.inf)
        if min(_noise(values, there) or 0.0, while_there) > MIN_NOISE_STEPS * step:
            raise _saturation_error(name, there)


def _noise(values: FloatArray, without: BoolArray) -> float | None:
    """Noise of the other samples without any motion; None where too few of them are together."""
    found = []
    for order in DIFFERENCE_ORDERS:
        free = ~np.lib.stride_tricks.sliding_window_view(without, order + 1).any(axis=1)
        rough = np.diff(values, order)[free]
        if len(rough) >= MIN_STUCK_SAMPLES:
            found.append(robust_deviation(rough) / sqrt(comb(2 * order, order)))
    return min(found, default=None)


def check_saturation(stuck: dict[str, BoolArray], distance: FloatArray, step: FloatArray) -> None:
    """Refuse an axis whose extreme readings lie inside the ellipsoid of the other samples.

    Rounding moves a rest by up to half a step, and the ellipsoid through other rests by as much.

    Args:
        stuck: as returned by ``stuck_samples``.
        distance: distance of every sample from the ellipsoid of the others, shape (n,).
        step: resolution of each axis in the same unit, shape (3,).

    Raises:
        DataError: an axis is saturated.
    """
    others = ~np.any(list(stuck.values()), axis=0)
    sigma = robust_deviation(distance[others])
    for name, there in stuck.items():
        allowed = MIN_STUCK_DEPTH * sigma + step["xyz".index(name[1])]
        if median(distance[there]) < -allowed:
            raise _saturation_error(name, there)


def _saturation_error(name: str, there: BoolArray) -> DataError:
    """The error for a saturated axis.

    Args:
        name: axis and end, like ``+x``.
        there: which samples are at the end, shape (n,).
    """
    end = "largest" if name[0] == "+" else "smallest"
    return DataError(
        f"axis {name[1]} of the magnetometer is saturated: {int(there.sum())} samples "
        f"({100.0 * there.mean():.1f} %) read its {end} value: "
        f"{CLIPPING_ADVICE['magnetometer']}"
    )


_PLANE = (
    "the magnetometer's readings lie in one plane: one circle cannot determine a "
    "calibration. Turn it once round with each of its six faces down"
)
CONSTANT_FIELD = (
    "the magnetometer always sends the same value: it is missing or asleep. Check its wiring, "
    "address and sketch"
)
"""Message about a magnetometer whose readings never change, live and in a recording."""
