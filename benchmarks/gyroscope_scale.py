"""Which wrong scales of a gyroscope are reported, and what is said of honest ones.

``python -m benchmarks.gyroscope_scale [N] [SEED]``: N sessions of drawn devices for each factor.
The factor is either in the readings (a wrong unit or range) or in the times (a wrong sampling rate,
a sample counter in place of the time).
"""

import sys
from collections import Counter
from dataclasses import replace

import numpy as np

from benchmarks.hand_motion import drawn_device, placed, recorded
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.estimate.recording import fit_readings

FRESH = 30_000
"""Seeds from here on were never used to choose a limit."""
FACTORS = (0.05, 0.08, 0.15, 0.3, 0.5, 0.65, 0.75, 1.35, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 25.0, 60.0)


def session(seed: int) -> tuple[Readings, np.random.Generator]:
    """A session of a drawn device whose scales are wrong by up to 10 %."""
    rng = np.random.default_rng([seed, 23])
    device = replace(drawn_device(rng, gyroscope=True), rate_range=2000.0)
    device = replace(device, rate=min(device.rate, 400.0), noise=min(device.noise, 0.3))
    speed, tremor = rng.uniform(60.0, 200.0), float(rng.choice([0.0, 1.0, 3.0]))
    motion = placed(device, rng, tremor=tremor, turns=2, speed=speed, hold=rng.uniform(2.5, 5.0))
    readings = recorded(motion, device, rng)
    return _scaled(readings, readings.gyroscope, 1.0 + rng.uniform(-0.1, 0.1, 3)), rng


def _scaled(readings: Readings, series: Series | None, factor: float | FloatArray) -> Readings:
    assert series is not None  # noqa: S101 (the device has one)
    return replace(readings, gyroscope=replace(series, values=series.values * factor))


def retimed(readings: Readings, factor: float) -> Readings:
    """The recording whose times run faster than they did by a factor."""
    force, rate = readings.accelerometer, readings.gyroscope
    assert rate is not None  # noqa: S101 (the device has one)
    return replace(
        readings,
        accelerometer=replace(force, time=force.time / factor),
        gyroscope=replace(rate, time=rate.time / factor),
    )


def answer(readings: Readings) -> str:
    """What the fit says: warned, nothing, no gyroscope, or refused with the duration or without."""
    try:
        report = fit_readings(readings)
    except DataError as error:
        named = "sampling rate" in str(error)
        return "refused, duration said" if named else "refused otherwise"
    words = ("which no sensor has", "that no sensor has", "By its own time")
    told = [*report.warnings, *(fit.unusable for fit in report.sensors.values())]
    if any(word in text for text in told for word in words):
        return "warned"
    return "silent" if "gyroscope" in report.sensors else "no gyroscope"


def main(count: int, seed: int) -> None:
    """Print the table."""
    total: Counter[str] = Counter()
    for name in ("readings", "times"):
        print(f"factor in the {name}: of {count} sessions each")
        for factor in FACTORS:
            found: Counter[str] = Counter()
            for one in range(seed, seed + count):
                readings, _ = session(one)
                wrong = (
                    retimed(readings, factor)
                    if name == "times"
                    else _scaled(readings, readings.gyroscope, 1.0 / factor)
                )
                found[answer(wrong)] += 1
            total += found
            print(f"  {factor:6.2f}  " + ", ".join(f"{n} {k}" for k, n in found.most_common()))
    print("together: " + ", ".join(f"{n} {k}" for k, n in total.most_common()))
    honest = Counter(answer(session(one)[0]) for one in range(seed, seed + 4 * count))
    print("scale errors up to 10 %: " + ", ".join(f"{n} {k}" for k, n in honest.most_common()))


if __name__ == "__main__":
    main(int((sys.argv[1:] or ["10"])[0]), int((sys.argv[2:] or [str(FRESH)])[0]))
