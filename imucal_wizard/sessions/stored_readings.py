"""The readings behind a fit, read again from where they were written down.

Without them neither vibration nor the step of the readings is known to the bench, and no hold can
be looked at sample by sample. A stream of hours does not lie in memory, so a session is read from
its file, in a thread, when the bench is opened.
"""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from imucal_wizard.acquire.files import read_files
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.core.readings import Readings
from imucal_wizard.measurement.holds import Hold

MAX_MEAN_DIFFERENCE = 1e-6
"""Relative difference of a hold's mean up to which it was made of these readings."""

MAX_WRITE_DELAY_SECONDS = 3.0
"""Seconds for which a file that is being written may lack the newest samples."""
RETRY_SECONDS = 0.2


def session_readings(path: Path | None, holds: Sequence[Hold]) -> Readings | None:
    """The readings of a session; None if the holds were not made of them.

    Args:
        path: the session, or None.
        holds: found in it.
    """
    if path is None or not path.is_file():
        return None
    patience = time.monotonic() + MAX_WRITE_DELAY_SECONDS
    while True:
        try:
            readings = read_files([path])
        except ImucalError:  # the bench works without them, it only knows less
            return None
        if made_of(readings, holds):
            return readings
        ends = max((hold.end for hold in holds), default=0.0)
        complete = len(readings) > 0 and readings.accelerometer.time[-1] > ends
        if complete or time.monotonic() > patience:
            return None
        time.sleep(RETRY_SECONDS)  # who writes the file does so in batches


def made_of(readings: Readings, holds: Sequence[Hold]) -> bool:
    """Whether the first and the last hold were made of these readings."""
    for hold in (*holds[:1], *holds[-1:]):
        values = readings.accelerometer.between(hold.start, hold.end).values
        if not len(values):
            return False
        off = float(np.abs(values.mean(axis=0) - hold.accelerometer).max())
        if not off <= MAX_MEAN_DIFFERENCE * float(np.abs(hold.accelerometer).max()):
            return False
    return bool(holds)
