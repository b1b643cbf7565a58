"""Which clipped rotations are found, with and without noise or a filter behind the clipping.

``python -m benchmarks.clipping [N] [SEED]``: N sessions of each kind with drawn devices. A rotation
counts as clipped if it loses more than 3 % of its angle, and as honest if no reading is clipped;
between them either answer is right.
"""

import sys
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from benchmarks.hand_motion import Device, drawn_device, placed, recorded
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.measurement.clipping import is_clipped

FRESH = 20_000
"""Seeds from here on were never used to choose a limit."""
KINDS = {
    "clipped by the converter": (1, 0.0),
    "noise of 0.3 °/s after it": (1, 0.3),
    "a filter after it": (5, 0.0),
    "a filter and noise after it": (5, 0.3),
}
"""Samples that a filter averages after the clipping at 100 Hz, and noise after it, °/s."""


def behind(
    rate: FloatArray, limit: float, length: int, noise: float, rng: np.random.Generator
) -> FloatArray:
    """The readings of a gyroscope that clips before its filter and its noise."""
    values = uniform_filter1d(np.clip(rate, -limit, limit), length, axis=0)
    return np.asarray(values + np.radians(noise) * rng.standard_normal(values.shape))


def drawn(seed: int, *, steady: bool = False) -> tuple[Device, Readings, np.random.Generator]:
    """A session of a drawn device, with turns about each axis, before anything clips."""
    rng = np.random.default_rng([seed, 17])
    device = replace(drawn_device(rng, gyroscope=True), rate_range=2000.0)
    device = replace(device, rate=min(device.rate, 400.0), noise=min(device.noise, 0.3))
    speed, tremor = rng.uniform(60.0, 300.0), float(rng.choice([0.0, 1.0, 3.0]))
    motion = placed(device, rng, tremor=tremor, turns=2, speed=speed, steady=steady)
    return device, recorded(motion, device, rng), rng


def rotations(readings: Readings) -> list[tuple[float, float, bool]]:
    """Begin, end and whether it is called clipped, of each rotation found."""
    try:
        found = fit_readings(readings).rotations
    except DataError:
        return []
    return [(one.time[0], one.time[-1], is_clipped(one.problem)) for one in found]


def session(seed: int, kind: str) -> tuple[int, int, int, int]:
    """Clipped rotations and those found of them, honest ones and those called clipped."""
    device, readings, rng = drawn(seed)
    series = readings.gyroscope
    assert series is not None  # noqa: S101 (the device has one)
    peak = float(np.abs(series.values - series.values[0]).max())
    limit = peak * float(rng.uniform(0.5, 0.9))
    length, noise = KINDS[kind]
    length = max(1, round(length * device.rate / 100.0))
    values = behind(series.values, limit, length, noise, rng)
    counts = [0, 0, 0, 0]
    clipped = Readings(readings.accelerometer, Series(series.time, values, series.unit))
    for begin, end, called in rotations(clipped):
        inside = (series.time >= begin) & (series.time <= end)
        true = np.abs(series.values[inside] - series.values[0]).sum(axis=0)
        left = np.abs(np.clip(series.values[inside], -limit, limit) - series.values[0]).sum(axis=0)
        axis = int(true.argmax())
        lost = 1.0 - float(left[axis] / true[axis])
        place = 0 if lost > 0.03 else 2
        if place == 0 or not (np.abs(series.values[inside]) >= limit).any():
            counts[place] += 1
            counts[place + 1] += called
    return counts[0], counts[1], counts[2], counts[3]


def main(count: int, seed: int) -> None:
    """Print the table."""
    print(f"{count} sessions of each kind; clipped: more than 3 % of the angle is lost")
    for kind in KINDS:
        table = np.array([session(one, kind) for one in range(seed, seed + count)])
        some = table[:, 0] >= 2
        missed = int((table[some, 1] == 0).sum())
        clipped, found, honest, false = table.sum(axis=0)
        print(
            f"  {kind:30s} rotations: {found} of {clipped} clipped found, {false} of {honest} "
            f"honest called clipped; sessions without any warning: {missed} of {some.sum()}"
        )
    for name, steady in (("nothing clips, a hand", False), ("nothing clips, a turntable", True)):
        wrong = total = 0
        for one in range(seed, seed + count):
            called = [row[2] for row in rotations(drawn(one, steady=steady)[1])]
            wrong, total = wrong + sum(called), total + len(called)
        print(f"  {name:30s} rotations: {wrong} of {total} called clipped")


if __name__ == "__main__":
    main(int((sys.argv[1:] or ["25"])[0]), int((sys.argv[2:] or [str(FRESH)])[0]))
