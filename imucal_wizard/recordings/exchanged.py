"""Were the columns of accelerometer and gyroscope exchanged? Gravity tells.

In every position of rest an accelerometer reads the same size in another direction, a gyroscope
the same bias. The unit does not matter, so that counts are told as well.
"""

import numpy as np

from imucal_wizard.devices.gravity import looks_like, usual_size
from imucal_wizard.errors import RecordingError
from imucal_wizard.readings import FloatArray, Readings, Series
from imucal_wizard.recordings.header import SENSOR_CHANNELS
from imucal_wizard.units import STANDARD_GRAVITY

_BLOCK = 0.5
_QUIET = 3.0
"""Blocks are still whose noise is less than so many times that of the quietest tenth."""
_TURNED = 20.0
"""Rests differ by more than so many times their noise when the sensor feels its position."""
_EVEN = 0.25
"""Spread of the size of gravity over all positions, as a share of it, with bias and scale."""
_FEWEST = 20
_NOTHING = 0.3
"""Less of gravity than this has been taken out by the device."""


def refuse(readings: Readings) -> None:
    """Refuse a recording whose accelerometer does not feel gravity.

    Raises:
        RecordingError: the gyroscope feels it instead, or the device has taken it out.
    """
    gyroscope = readings.gyroscope
    if gyroscope is not None and exchanged(readings.accelerometer, gyroscope):
        names = {s: ",".join(SENSOR_CHANNELS[s]) for s in ("accelerometer", "gyroscope")}
        raise RecordingError(
            f"accelerometer and gyroscope are exchanged: {names['gyroscope']} feel gravity in every"
            f" position and {names['accelerometer']} do not; name the columns in their true order"
            " with --columns (with --as imu_tk give the accelerometer's file first)"
        )
    series = readings.accelerometer
    size = usual_size(series.values)
    without = series.unit == "m/s^2" and size < _NOTHING * STANDARD_GRAVITY
    if without and looks_like(size, whole=False) is None and _feels(series) < _TURNED:
        raise RecordingError(
            f"the accelerations measure only {size:.3g} m/s^2 at rest: the device has taken gravity"
            " out (linear or user acceleration), or these columns are another sensor's; record the"
            " raw accelerometer, or name its columns with --columns"
        )


def exchanged(accelerometer: Series, gyroscope: Series) -> bool:
    """Whether what is called gyroscope feels gravity and what is called accelerometer does not."""
    felt = _feels(gyroscope)
    return felt > _TURNED and _even(gyroscope) and _feels(accelerometer) < felt / _TURNED


def _feels(series: Series) -> float:
    """By how many times their noise the positions of rest differ; 0 when there are too few."""
    means, noise = _rests(series)
    if len(means) < _FEWEST or not noise.any():
        return 0.0
    return float(np.sqrt(means.var(axis=0).sum()) / np.median(noise[noise > 0.0]))


def _even(series: Series) -> bool:
    """Whether the readings have about one size in all positions."""
    sizes = np.linalg.norm(_rests(series)[0], axis=1)
    return float(sizes.std()) < _EVEN * float(sizes.mean())


def _rests(series: Series) -> tuple[FloatArray, FloatArray]:
    """Means (k, 3) and noise (k,) of the quiet blocks."""
    size = max(2, round(_BLOCK * series.rate))
    count = len(series) // size
    if count < _FEWEST:
        return np.zeros((0, 3)), np.zeros(0)
    blocks = series.values[: count * size].reshape(count, size, 3)
    noise = np.sqrt(blocks.var(axis=1).sum(axis=1))
    quiet = noise <= _QUIET * np.quantile(noise, 0.1)
    return blocks.mean(axis=1)[quiet], noise[quiet]
