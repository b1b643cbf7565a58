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
from imucal_wizard.devices.virtual.simulate import simulate_recording
from imucal_wizard.effects.catalogue import effects_for
from imucal_wizard.fitting import fit_readings
from imucal_wizard.recordings import read
from imucal_wizard.solver.extended.fit import (
    Measured,
    fit_with,
    measured_accelerometer,
    measured_gyroscope,
)
from imucal_wizard.solver.extended.terms import Term

HOLDS, ROTATIONS = 60, 40
TURNS_PER_AXIS = 14


def main() -> None:
    """Print the median CPU time of each effect in ms, and of scoring all of them once."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "session.csv"
        simulate_recording(path, seed=7, rotations=TURNS_PER_AXIS)
        readings = read([path])
    report = fit_readings(readings)
    accelerometer = measured_accelerometer(report, readings)
    plain = fit_with(accelerometer)
    gyroscope = measured_gyroscope(report, plain, readings)
    print(machine())
    print(f"accelerometer, {len(accelerometer.holds)} holds, wanted 100 ms each for {HOLDS}")
    show(accelerometer, "accelerometer")
    samples = len(gyroscope.samples.time)
    print(
        f"gyroscope, {len(gyroscope)} rotations, {samples} samples, wanted 500 ms for {ROTATIONS}"
    )
    show(gyroscope, "gyroscope")


def show(measured: Measured, sensor: str) -> None:
    """One line per effect, and one for the derivatives by all of them."""
    linear = fit_with(measured).linear
    for one in effects_for(sensor):
        term = Term(one, one.variants(measured.circumstances)[0])
        print(f"  {one.name:26}{milliseconds(partial(fit_with, measured, (term,))):8.0f}")

    def lifts() -> None:
        for one in effects_for(sensor):
            for variant in one.variants(measured.circumstances):
                linear.lift(one, variant)

    print(f"  {'derivatives by all':26}{milliseconds(lifts):8.0f}")


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
