"""One short procedure performed on a virtual IMU, and what must not depend on how it arrives."""

import functools
import tempfile
from pathlib import Path

import numpy as np

from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import Procedure, standard
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.simulate.recording import simulate_recording


def settings() -> ProcedureSettings:
    """Settle, up/down and two rotations per axis: enough of a procedure, soon done."""
    whole = standard(2, settle_seconds=5.0)
    steps = tuple(step for step in whole.steps if step.kind is not StepKind.POSES)
    return ProcedureSettings(Procedure(steps))


@functools.cache
def recorded() -> bytes:
    """The lines that the virtual IMU prints during this procedure, with its own time."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "performed.csv"
        simulate_recording(path, rate=50.0, poses="6", rotations=2, hold=4.0)
        return path.read_bytes()


def pieces(data: bytes, size: int) -> list[tuple[float, bytes]]:
    """The bytes cut into pieces, with the times at which they would have arrived."""
    return [(start / 8000.0, data[start : start + size]) for start in range(0, len(data), size)]


def same(one: Collected, other: Collected) -> bool:
    """Whether two collections agree to the last bit."""
    holds = zip((*one.holds, *one.validation), (*other.holds, *other.validation), strict=True)
    turns = zip(one.rotations, other.rotations, strict=True)
    return all(
        (a.start, a.end, a.samples, a.pose) == (b.start, b.end, b.samples, b.pose)
        and np.array_equal(a.accelerometer, b.accelerometer)
        and np.array_equal(a.accelerometer_covariance, b.accelerometer_covariance)
        for a, b in holds
    ) and all(
        (a.axis, a.problem) == (b.axis, b.problem)
        and np.array_equal(a.time, b.time)
        and np.array_equal(a.rate, b.rate)
        for a, b in turns
    )
