"""What the values of a recording betray: too few digits, repeats, dead or clipped axes."""

import itertools
from collections.abc import Iterator

import numpy as np

from imucal_wizard.readings import FloatArray, Readings
from imucal_wizard.recordings.header import SENSOR_CHANNELS
from imucal_wizard.units import COUNT, STANDARD_GRAVITY

_REPEATS = 0.2
_COARSE_STEP = 0.0095
"""m/s²: steps of 1 mg and more make more error than the noise of any sensor worth calibrating."""
_RUN = 4
"""So many equal extremes in a row are no chance ..."""
_RUN_ELSEWHERE = 3.0
"""... where they are so many times longer than any other run: coarse readings stand still too."""
_ZEROS = 0.3
_LOOKED_AT = 5000
_ENOUGH = 50
"""Fewer samples betray nothing."""


def check(readings: Readings) -> tuple[str, ...]:
    """Warnings about the values, each a sentence that says what to do."""
    if len(readings) < _ENOUGH:
        return (f"there are only {len(readings)} samples",)
    return (
        *_digits(readings),
        *_repeats(readings),
        *_dead(readings),
        *_clipped(readings),
        *_zeroed(readings),
    )


def _digits(readings: Readings) -> Iterator[str]:
    """The smallest step between printed accelerations, when it is coarse.

    Noise above half a step dithers it away in the average of a hold; then it does no harm.
    """
    if readings.accelerometer.unit == COUNT:
        return
    values = readings.accelerometer.values[:_LOOKED_AT]
    step = smallest_step(values)
    if step >= _COARSE_STEP and _quietest_noise(values) < step / 2.0:
        yield (
            f"the accelerations come in steps of {step / STANDARD_GRAVITY * 1000:.2g} mg: let the"
            " device print more digits (in an Arduino sketch Serial.print(x, 5))"
        )


def _quietest_noise(values: FloatArray) -> float:
    """Noise of the stillest stretch, from differences of neighbours; the largest axis."""
    count = len(values) // _ENOUGH
    steps = np.diff(values, axis=0, prepend=values[:1])[: count * _ENOUGH]
    squares = (steps**2).reshape(count, _ENOUGH, 3).mean(axis=1)
    return float(np.sqrt(squares[squares.sum(axis=1).argmin()].max() / 2.0))


def smallest_step(values: FloatArray) -> float:
    """Smallest difference between distinct values of the axis that resolves best; 0 without one."""
    steps = []
    for axis in values.T:
        differences = np.diff(np.unique(axis))
        differences = differences[differences > 1e-9 * max(1.0, float(np.abs(axis).max()))]
        if len(differences):
            steps.append(float(differences.min()))
    return min(steps, default=0.0)


def _repeats(readings: Readings) -> Iterator[str]:
    """Samples that repeat the one before in every channel."""
    repeated = np.all(np.diff(readings.accelerometer.values, axis=0) == 0.0, axis=1)
    gyroscope = readings.gyroscope
    if gyroscope is not None and len(gyroscope) == len(readings):
        repeated &= np.all(np.diff(gyroscope.values, axis=0) == 0.0, axis=1)
    share = float(repeated.mean())
    if share > _REPEATS:
        yield (
            f"{share:.0%} of the samples repeat the one before: the device prints faster than it"
            " measures, or with too few digits; print once per measurement"
        )


def _dead(readings: Readings) -> Iterator[str]:
    """Axes that always give the same value, or whose value two axes share."""
    for sensor in ("accelerometer", "gyroscope"):
        series = getattr(readings, sensor)
        if series is None or len(series) < _ENOUGH:
            continue
        axes = dict(zip(SENSOR_CHANNELS[sensor], series.values.T, strict=True))
        for name, values in axes.items():
            if np.ptp(values) == 0.0:
                yield (
                    f"{name} never changes from {values[0]:.6g}: the axis is dead or is not sent;"
                    " look at the columns and at the wiring"
                )
        for one, other in itertools.combinations(axes, 2):
            if np.ptp(axes[one]) > 0.0 and np.array_equal(axes[one], axes[other]):
                yield (
                    f"{one} and {other} are the same in every sample: one column was given twice;"
                    " look at the sketch or at --columns"
                )


def _clipped(readings: Readings) -> Iterator[str]:
    """Axes that stand at their largest or smallest value while they never stand elsewhere."""
    for sensor in ("accelerometer", "gyroscope"):
        series = getattr(readings, sensor)
        if series is None or len(series) < _ENOUGH:
            continue
        for name, values in zip(SENSOR_CHANNELS[sensor], series.values.T, strict=True):
            ends = [end for end in (values.min(), values.max()) if _stands_at(values, float(end))]
            if ends and np.ptp(values) > 0.0:
                at = " and ".join(f"{end:.5g} {series.unit}" for end in ends)
                yield (
                    f"{name} stands still at {at}, the end of its range: set a wider range in the"
                    " device, or turn more slowly; what was measured there is wrong"
                )


def _stands_at(values: FloatArray, end: float) -> bool:
    """Whether runs of this extreme are long, and longer than those of all other values."""
    starts = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1])
    lengths = np.diff(np.append(starts, len(values)))
    here = values[starts] == end
    # the middle one of the long runs elsewhere: a sensor that hangs once is no rule
    elsewhere = lengths[~here]
    usual = float(np.quantile(elsewhere, 0.999)) if len(elsewhere) else np.inf
    return bool(lengths[here].max() >= max(_RUN, _RUN_ELSEWHERE * usual))


def _zeroed(readings: Readings) -> Iterator[str]:
    """A gyroscope that reads exactly nothing at rest takes its own bias out."""
    gyroscope = readings.gyroscope
    if gyroscope is None or len(gyroscope) < _ENOUGH or not gyroscope.values.any():
        return
    if float((gyroscope.values == 0.0).all(axis=1).mean()) > _ZEROS:
        yield (
            "the gyroscope reads exactly zero at rest: the device takes its own bias out (BNO055 in"
            " a fusion mode, WitMotion with automatic calibration) or prints too few digits; record"
            " its raw data, or its bias cannot be found"
        )
