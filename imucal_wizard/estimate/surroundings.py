"""The circumstances of holds: what the effects may depend on, as far as it was recorded."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.quantities import or_nan
from imucal_wizard.core.readings import FloatArray, IntArray, Readings
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.measurement.segmentation import rest_numbers
from imucal_wizard.model.effect import Circumstances

AWAY_AND_BACK = 3.0
"""Seconds that it takes at least to take a pose anew."""
UNMOVED = np.radians(0.1)
"""No hand takes a pose again so exactly."""


def circumstances_of(
    holds: Sequence[Hold],
    up: FloatArray,
    gravity: float,
    gain: float,
    readings: Readings | None,
) -> Circumstances:
    """One row per hold.

    Args:
        holds: in the order of time.
        up: unit up vector of each, shape (n, 3).
        gravity: m/s².
        gain: m/s² per reading unit, for the vibration.
        readings: what the holds were found in; without them the session begins with the first
            hold, and vibration is guessed from how much the averages scatter.
    """
    force = gravity * up
    middle = np.array([0.5 * (hold.start + hold.end) for hold in holds])
    return Circumstances(
        force=force,
        rate=np.zeros_like(force),
        temperature=np.array([or_nan(hold.temperature) for hold in holds]),
        time=middle - first_time(holds, readings),
        previous=_previous(holds, force),
        vibration=gain**2 * _vibration(holds, readings),
        seconds=np.array([hold.end - hold.start for hold in holds]),
        gravity=gravity,
    )


def _previous(holds: Sequence[Hold], force: FloatArray) -> FloatArray:
    """Force in the pose before, shape (n, 3); NaN in the first.

    A rest that a disturbance has cut in two holds is one pose; a device that was turned and put
    down in the same direction again has this direction as the pose before.
    """
    before, rest = np.full_like(force, np.nan), rest_numbers(holds)
    up = unit_vectors(force)
    for row in range(1, len(force)):
        same = rest[row] == rest[row - 1]
        same |= float(np.linalg.norm(up[row] - up[row - 1])) < UNMOVED
        before[row] = before[row - 1] if same else force[row - 1]
    return before


def visits(holds: Sequence[Hold], up: FloatArray, labels: IntArray) -> IntArray:
    """Which holds are pieces of one rest, shape (n,); only different visits repeat a pose.

    A disturbance cuts a rest in pieces: the next hold in the same direction begins before the
    device could have been turned away and back, or lies exactly as before.

    Args:
        holds: in the order of time.
        up: unit up vector of each.
        labels: number of each one's direction, shape (n,).
    """
    start = np.array([hold.start for hold in holds])
    end = np.array([hold.end for hold in holds])
    near = start[1:] - end[:-1] < AWAY_AND_BACK
    near |= np.linalg.norm(np.diff(up, axis=0), axis=1) < UNMOVED
    new = (np.diff(labels) != 0) | ~near
    return np.concatenate([np.zeros(min(len(holds), 1), np.int64), np.cumsum(new)])


def first_time(holds: Sequence[Hold], readings: Readings | None) -> float:
    """Time of the session's first sample, s."""
    if readings is None or not len(readings):
        return holds[0].start
    return float(readings.accelerometer.time[0])


def _vibration(holds: Sequence[Hold], readings: Readings | None) -> FloatArray:
    """Mean square of the accelerometer about its mean, sum over the axes, reading units², (n,)."""
    if readings is None:
        covariances = np.array([hold.accelerometer_covariance for hold in holds])
        samples = np.array([hold.samples for hold in holds])
        return np.asarray(np.trace(covariances.reshape(-1, 3, 3), axis1=1, axis2=2) * samples)
    series = readings.accelerometer
    found = np.full(len(holds), np.nan)
    for place, hold in enumerate(holds):
        values = hold.readings(series).values
        if len(values):
            found[place] = sum(axis.var() for axis in values.T)  # a fifth of the time of ``axis=0``
    return found
