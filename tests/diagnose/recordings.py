"""Recordings of the virtual IMU for the bench's tests, made once per run, and what spoils them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.core.units import ACCELERATION_UNITS
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.estimate.recording import FitOptions, fit_holds, fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.simulate.recording import simulate_recording

MG = ACCELERATION_UNITS["mg"]


@cache
def fitted(
    *hidden: str, poses: str = "18", seed: int = 4, rotations: int = 0
) -> tuple[FitReport, Readings]:
    """A recording with these effects hidden in it, and its plain fit."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "recording.csv"
        simulate_recording(path, hidden=hidden, poses=poses, seed=seed, rotations=rotations)
        readings = read_files([path])
    return fit_readings(readings), readings


@cache
def tumbled(*hidden: str, seed: int = 3) -> Benches:
    """The benches of a recording with a magnetometer and a circle on each face."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "recording.csv"
        simulate_recording(path, hidden=hidden, seed=seed, rotations=0, magnetometer=True)
        readings = read_files([path])
    return Benches(fit_readings(readings), readings)


def refitted(
    report: FitReport, holds: Sequence[Hold], readings: Readings | None = None
) -> FitReport:
    """The fit of other holds of the same recording."""
    options, units = FitOptions(report.gravity), {"accelerometer": "m/s^2"}
    rates = {"accelerometer": report.rates["accelerometer"]}
    return fit_holds(holds, (), rates, units, options, (), (), readings)


def moved(report: FitReport, by: Callable[[int, Hold], FloatArray | float]) -> FitReport:
    """The fit with something added to the accelerometer's mean in each hold, m/s²."""
    holds = [
        replace(hold, accelerometer=hold.accelerometer + by(number, hold))
        for number, hold in enumerate(report.holds)
    ]
    return refitted(report, holds)


def along(hold: Hold, size: float) -> FloatArray:
    """A vector of this size along the hold's own reading, m/s²."""
    return np.asarray(size * hold.accelerometer / np.linalg.norm(hold.accelerometer))
