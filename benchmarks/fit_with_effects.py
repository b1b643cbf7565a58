"""Adding an effect and fitting again, held out included: ``python -m benchmarks.fit_with_effects``.

60 holds, and 40 rotations at 100 samples/s, of the virtual IMU.
"""

import statistics
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.measure import machine
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.estimate.accelerometer import AccelerometerExperiment
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.catalogue import effects_for
from imucal_wizard.model.terms import Term
from imucal_wizard.simulate.recording import simulate_recording

HOLDS, ROTATIONS = 60, 40
TURNS_PER_AXIS = 14


def main() -> None:
    """Print the median CPU time of each effect in ms, and of scoring all of them once."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "session.csv"
        simulate_recording(path, seed=7, rotations=TURNS_PER_AXIS)
        readings = read_files([path])
    report = fit_readings(readings)
    accelerometer = report.sensors["accelerometer"].experiment
    gyroscope = report.sensors["gyroscope"].experiment
    if not isinstance(accelerometer, AccelerometerExperiment):
        raise SystemExit("the simulated accelerometer was not fitted")
    if not isinstance(gyroscope, GyroscopeExperiment):
        raise SystemExit("the simulated gyroscope was not fitted")
    print(machine())
    print(f"accelerometer, {len(accelerometer.holds)} holds, wanted 100 ms each for {HOLDS}")
    show(accelerometer, "accelerometer")
    samples = len(gyroscope.closure.samples.time)
    print(
        f"gyroscope, {len(gyroscope.rotations.usable)} rotations, {samples} samples, "
        f"wanted 500 ms for {ROTATIONS}"
    )
    show(gyroscope, "gyroscope")


def show(measured: Experiment, sensor: str) -> None:
    """One line per effect, and one for the derivatives by all of them."""
    table = fit(measured).rows
    if table is None:
        raise SystemExit("a published method has no residual table")
    for one in effects_for(sensor):
        term = Term(one, one.variants(measured.circumstances)[0])
        print(f"  {one.name:26}{milliseconds(partial(fit, measured, (term,))):8.0f}")

    terms = [
        Term(one, variant)
        for one in effects_for(sensor)
        for variant in one.variants(measured.circumstances)
    ]
    work = milliseconds(partial(table.design_columns, terms))
    print(f"  {'derivatives by all':26}{work:8.0f}")


def milliseconds(work: Callable[[], object], runs: int = 5) -> float:
    """Median CPU time of some work after one run that is not counted.

    Other processes disturb it less than the wall time, which is the same on a machine at rest.
    """
    work()
    spent = []
    for _ in range(runs):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return 1e3 * statistics.median(spent)


if __name__ == "__main__":
    main()
