"""A recording with a magnetometer, and its holds as if the wizard had taken them."""

import itertools
from functools import cache

import numpy as np

from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.measurement.holds import Collected, Hold, Rotation
from tests.estimate.whole_session import Session

EVER = ((-np.inf, np.inf),)
UNITS = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}
SESSION = Session(rate=100.0)


@cache
def recording(seed: int) -> Readings:
    """Forty rests and the turns between them."""
    return SESSION.readings(seed)


@cache
def offline(seed: int) -> FitReport:
    """The fit of the recording."""
    return fit_readings(recording(seed))


def collected(readings: Readings, holds: tuple[Hold, ...], series: Series | None) -> Collected:
    """The holds that were found in a recording, as if the wizard had taken them."""
    gyroscope = readings.gyroscope
    assert gyroscope is not None
    rotations = []
    for before, after in itertools.pairwise(holds):
        part = gyroscope.between(before.end - 0.05, after.start + 0.05)
        force = readings.accelerometer.between(before.end - 0.05, after.start + 0.05)
        rotations.append(
            Rotation(before, after, part.time, part.values, accelerometer=force.values)
        )
    return Collected(holds, tuple(rotations), magnetometer=series, field_spans=EVER)


def with_field() -> Collected:
    """All of the recording, with the magnetometer's step from beginning to end."""
    return collected(recording(0), offline(0).holds, recording(0).magnetometer)
