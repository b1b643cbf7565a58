"""The readings of a fit, read from the session file.

The readings show slow noise in a long rest, what the sensor's filter passes, vibration, resolution
and the samples of a hold. Hours of a stream are not kept in memory, so a thread reads them from the
session file before the fit.
"""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.measurement.holds import Hold

MAX_MEAN_DIFFERENCE = 1e-6
"""Relative difference of a hold's mean up to which it belongs to these readings."""

MAX_WRITE_DELAY_SECONDS = 3.0
"""Seconds by which a file that is being written may lag behind."""
RETRY_SECONDS = 0.2
"""Seconds between two attempts."""


def session_readings(path: Path | None, holds: Sequence[Hold]) -> Readings | None:
    """The readings of a session; None if the holds do not belong to them.

    Args:
        path: the session, or None.
        holds: holds of the session.
    """
    if path is None or not path.is_file():
        return None
    patience = time.monotonic() + MAX_WRITE_DELAY_SECONDS
    while True:
        try:
            readings = read_files([path])
        except ImucalError:  # the fit works without them, with less information
            return None
        if made_of(readings, holds):
            return readings
        ends = max((hold.end for hold in holds), default=0.0)
        complete = len(readings) > 0 and readings.accelerometer.time[-1] > ends
        if complete or time.monotonic() > patience:
            return None
        time.sleep(RETRY_SECONDS)  # the file is written in batches


def made_of(readings: Readings, holds: Sequence[Hold]) -> bool:
    """Whether the first and the last hold belong to these readings.

    What settling and a sway take off the force is none of the samples', but the rates stay as they
    are.
    """
    for hold in (*holds[:1], *holds[-1:]):
        # by the number of samples: the end is a sum that may round past the next sample
        first = int(np.searchsorted(readings.accelerometer.time, hold.start))
        past = first + hold.samples
        force = readings.accelerometer.part(first, past).values
        if len(force) < hold.samples:
            return False
        same = _is_mean(hold.accelerometer, force)
        if hold.gyroscope is not None and readings.gyroscope is not None:
            same |= _is_mean(hold.gyroscope, hold.readings(readings.gyroscope).values)
        if not same:
            return False
    return bool(holds)


def _is_mean(mean: FloatArray, values: FloatArray) -> bool:
    """Whether values, shape (n, 3), have this mean."""
    if not len(values):
        return False
    off = float(np.abs(values.mean(axis=0) - mean).max())
    return off <= MAX_MEAN_DIFFERENCE * float(np.abs(mean).max())
