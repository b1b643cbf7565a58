"""Recordings of the virtual IMU for the bench's tests, made once per run."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from imucal_wizard.devices.virtual.simulate import simulate_recording
from imucal_wizard.fitting import fit_readings
from imucal_wizard.readings import Readings
from imucal_wizard.recordings import read
from imucal_wizard.solver.result import FitReport


@cache
def fitted(
    *hidden: str, poses: str = "18", seed: int = 4, rotations: int = 0
) -> tuple[FitReport, Readings]:
    """A recording with these effects hidden in it, and its plain fit."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "recording.csv"
        simulate_recording(path, hidden=hidden, poses=poses, seed=seed, rotations=rotations)
        readings = read([path])
    return fit_readings(readings), readings
