"""How often a recheck is wrong: ``python -m benchmarks.recheck``.

A virtual device (the simulator shares no formula with the program) with 400 µg/√Hz is calibrated:
18 poses and 6 turns per axis. Each recheck is a new start: bias and scale of each axis have moved
by a turn-on spread of 0.5 mg, 0.02 %, 0.05 °/s and 0.05 % (standard deviations), and the
temperature differs by up to ±2 °C, with coefficients of 0.2 mg/°C, 50 ppm/°C, 0.015 °/s/°C and
100 ppm/°C (standard deviations, drawn anew unless they are known). The recheck is 5 s of rest and
the six faces in any order, 2.4 s each, and three more while an axis was not seen. Counted with 95 %
intervals (Clopper and Pearson):

- unchanged devices that are called NO-GO, and insufficient;
- devices with one change on an axis by chance that are called NO-GO.

The last table is of the wizard: the virtual hand performs the poses that the program asks for, and
the device time from the first sample to the verdict is printed.

The second table has ±10 °C; the coefficient of the biases is known from a calibration during which
the device warms up by 10 °C. The third has ±10 °C without a known coefficient, and counts verdicts
that say that the temperature differs.

    --devices      calibrations
    --rechecks     of each, unchanged and of each change
    --seed
    --only         near, known, unknown or wizard; may be given several times
    --counts       file with the counts of earlier runs, which this run continues with further
                   devices and writes anew; the tables are then of all runs together
"""

import argparse
import json
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial
from pathlib import Path

import numpy as np
from scipy.stats import beta

from benchmarks.measure import machine
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import RECHECK_STEPS, Procedure
from imucal_wizard.report.calibrated_device import (
    CalibratedDevice,
    RecheckSettings,
    recheck_data,
    recheck_readings,
)
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.calibration_record import from_report
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.reader import Reader
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.imu import VirtualImu
from imucal_wizard.simulate.recording import recording_script
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.scripts import FACE_NAMES
from imucal_wizard.simulate.sensor import DEGREE, MILLI_G, SensorModel, Thermal, Triad

RATE = 100.0
DENSITY = 0.400 * MILLI_G
AMBIENT = 25.0
TURN_ON = {"accelerometer": (0.5 * MILLI_G, 2e-4), "gyroscope": (0.05 * DEGREE, 5e-4)}
"""Standard deviations of bias and scale from one start to the next."""
COEFFICIENTS = {"accelerometer": (0.2 * MILLI_G, 5e-5), "gyroscope": (0.015 * DEGREE, 1e-4)}
"""The same of bias and scale per °C, from device to device."""
CHANGES = {
    "bias 5 mg": ("accelerometer", 5.0 * MILLI_G, 0.0),
    "scale 0.5 %": ("accelerometer", 0.0, 0.005),
    "rate bias 0.5 °/s": ("gyroscope", 0.5 * DEGREE, 0.0),
    "rate scale 1 %": ("gyroscope", 0.0, 0.01),
}
HOLD_SECONDS = 2.4
MAX_ROUNDS = 4
"""Three more faces are taken so often, less one, while an axis was not seen."""
NOW = datetime.fromisoformat("2026-01-01T12:00:00+00:00")


@dataclass(frozen=True)
class Study:
    """One table.

    Attributes:
        title: what it is of.
        apart: largest difference of temperature, °C.
        known: whether the calibration has the coefficient of the biases.
    """

    title: str
    apart: float
    known: bool


STUDIES = {
    "near": Study("±2 °C, coefficient not known", 2.0, known=False),
    "known": Study("±10 °C, coefficient of the biases known", 10.0, known=True),
    "unknown": Study("±10 °C, coefficient not known", 10.0, known=False),
}


WIZARD = "wizard"
"""The part about the time that it takes."""


def sampled(
    sensor: SensorModel, script: Iterator[Action], hidden: Sequence[str], seed: int
) -> Readings:
    """The samples of a device that a hand moves."""
    hand = VirtualHand(RATE, seed)
    stream = VirtualStream(hand, sensor, hidden, rate=RATE, seed=seed)
    hand.perform(script)
    parts = []
    while count := hand.remaining(4096):
        parts.append(stream.take(count))
    time = np.concatenate([one.time for one in parts])
    warm = np.concatenate([one.temperature for one in parts])[:, None]
    return Readings(
        Series(time, np.concatenate([one.accelerometer for one in parts]), "m/s^2"),
        Series(time, np.concatenate([one.gyroscope for one in parts]), "rad/s"),
        temperature=Series(time, warm, "degC"),
    )


def at(triad: Triad, bias: FloatArray, scale: FloatArray) -> Triad:
    """A sensor with more bias, SI, and sensitivity, relative, on each axis."""
    sensitivity = (1.0 + scale)[:, None] * triad.sensitivity
    return replace(triad, sensitivity=sensitivity, bias=triad.bias + bias)


@dataclass(frozen=True, eq=False)
class Device:
    """A virtual device with its calibration.

    Attributes:
        sensor: as it was calibrated.
        hidden: its temperature coefficients.
        calibration: what the program has found.
    """

    sensor: SensorModel
    hidden: tuple[str, ...]
    calibration: Calibration


def calibrated(study: Study, seed: int) -> Device:
    """A device drawn by chance, and its calibration."""
    rng = np.random.default_rng([seed, 1])
    drawn = SensorModel.drawn(seed)
    quiet = Thermal(AMBIENT, 0.0)
    noisy = replace(drawn.accelerometer, density=DENSITY)
    sensor = replace(drawn, accelerometer=noisy, thermal=quiet)
    hidden = tuple(coefficients(rng))
    course = Thermal(AMBIENT - 5.0, 20.0, 400.0) if study.known else quiet
    script = recording_script("18", rng, hold=5.0, rotations=6)
    readings = sampled(replace(sensor, thermal=course), script, hidden, seed)
    report = fit_readings(readings)
    if study.known:
        benches = Benches(report, readings)
        for name in TURN_ON:
            bench = benches.bench(name)
            if bench is None:
                raise SystemExit("a simulated device was not calibrated")
            bench.add("bias-temperature")
        report = benches.fitted()
    return Device(sensor, hidden, from_report(report, "virtual", NOW.isoformat()))


def coefficients(rng: np.random.Generator) -> Iterator[str]:
    """Temperature coefficients of a device, as the simulator takes them."""
    for name, (bias, scale) in COEFFICIENTS.items():
        unit, before = (MILLI_G, "") if name == "accelerometer" else (DEGREE, "gyroscope/")
        for axis in "xyz":
            yield f"{before}bias-temperature:{rng.normal(0.0, bias / unit):.6f}:{axis}"
            yield f"{before}scale-temperature:{1e6 * rng.normal(0.0, scale):.3f}:{axis}"


def rechecked(study: Study, device: Device, change: str | None, seed: int) -> tuple[str, str]:
    """Verdict and reason of one recheck of a device that has changed, or not."""
    rng = np.random.default_rng([seed, 2])
    axis, sign = int(rng.integers(3)), float(rng.choice([-1.0, 1.0]))
    triads = {}
    for name, (bias, scale) in TURN_ON.items():
        moved, grown = rng.normal(0.0, bias, 3), rng.normal(0.0, scale, 3)
        if change is not None and CHANGES[change][0] == name:
            moved[axis] += sign * CHANGES[change][1]
            grown[axis] += sign * CHANGES[change][2]
        triads[name] = at(getattr(device.sensor, name), moved, grown)
    warm = Thermal(AMBIENT + float(rng.uniform(-study.apart, study.apart)), 0.0)
    sensor = replace(
        device.sensor,
        accelerometer=triads["accelerometer"],
        gyroscope=triads["gyroscope"],
        thermal=warm,
    )
    hidden = device.hidden if study.known else tuple(coefficients(rng))
    known = CalibratedDevice(device.calibration, RecheckSettings(NOW))
    places = rng.permutation(len(FACE_NAMES)).tolist()
    noise = int(rng.integers(2**31))
    for _ in range(MAX_ROUNDS):
        readings = sampled(sensor, recheck_script(places), hidden, noise)
        found = recheck_readings(known, readings)
        if found.verdict != "insufficient" or "temperature differs" in found.says:
            break
        places += rng.permutation(len(FACE_NAMES)).tolist()[:3]
    return str(found.verdict), found.says


def recheck_script(places: Sequence[int]) -> Iterator[Action]:
    """A rest, and some of the six faces one after the other."""
    yield LieStill(5.0)
    for place in places:
        yield PlacePose(FACE_NAMES[place])
        yield LieStill(HOLD_SECONDS)


def trial(study: Study, rechecks: int, seed: int, number: int) -> dict[str, Counter[str]]:
    """Verdicts on one device, by what has changed; "temperature" counts what says so."""
    device = calibrated(study, 1000 * seed + number)
    found: dict[str, Counter[str]] = {}
    for place, change in enumerate((None, *CHANGES)):
        counts = found[change or "unchanged"] = Counter()
        for k in range(rechecks):
            own = ((seed * 1000 + number) * 10 + place) * 1000 + k
            verdict, says = rechecked(study, device, change, own)
            counts[verdict] += 1
            counts["temperature"] += "temperature differs" in says
    return found


def table(study: Study, rechecks: int, seed: int, devices: range) -> dict[str, Counter[str]]:
    """Verdicts on many devices, by what has changed."""
    total = {name: Counter[str]() for name in ("unchanged", *CHANGES)}
    with ProcessPoolExecutor() as pool:
        for found in pool.map(partial(trial, study, rechecks, seed), devices):
            for name, counts in found.items():
                total[name].update(counts)
    return total


def in_the_wizard(seed: int, number: int) -> tuple[float, str]:
    """Device time and verdict of a recheck by the virtual hand, of an unchanged device."""
    device = calibrated(STUDIES["near"], 1000 * seed + number)
    known = CalibratedDevice(device.calibration, RecheckSettings(NOW))
    imu = VirtualImu(
        RATE, 1000 * seed + number + 500, float("inf"), sensor=device.sensor, following=True
    )
    settings = ProcedureSettings(Procedure(RECHECK_STEPS))
    reader = Reader(imu, Engine(None, settings, planner=known.next_pose))
    reader.start()
    started = False
    while (status := reader.snapshot().status).step is not StepKind.VERDICT:
        if not started and reader.snapshot().stream.samples:
            reader.command("start")
            started = True
        time.sleep(0.01)
    measured = recheck_data(reader.collected(), status.elapsed)
    reader.stop()
    units = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}
    return status.elapsed, str(known.recheck(measured, units).verdict)


def interval(count: int, of: int) -> str:
    """A share with its 95 % interval, in per cent."""
    low = float(beta.ppf(0.025, count, of - count + 1)) if count else 0.0
    high = float(beta.ppf(0.975, count + 1, of - count)) if count < of else 1.0
    return f"{count:5} of {of:<5}{100 * count / of:6.2f} % [{100 * low:.2f}, {100 * high:.2f}]"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="benchmarks.recheck")
    parser.add_argument("--devices", type=int, default=50)
    parser.add_argument("--rechecks", type=int, default=20)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--only", choices=[*STUDIES, WIZARD], action="append")
    parser.add_argument("--counts", type=Path)
    given = parser.parse_args()
    print(machine())
    wanted = given.only or [*STUDIES, WIZARD]
    for name in wanted:
        if name == WIZARD:
            print_durations(given.seed, given.devices)
            continue
        study, kept = STUDIES[name], {}
        if given.counts is not None and given.counts.exists():
            kept = json.loads(given.counts.read_text())
        done = kept.setdefault(name, {"devices": 0, "seed": given.seed, "rechecks": given.rechecks})
        if (done["seed"], done["rechecks"]) != (given.seed, given.rechecks):
            parser.error("the counts are of another seed or another number of rechecks")
        past = range(done["devices"], done["devices"] + given.devices)
        found = table(study, given.rechecks, given.seed, past)
        for what, counts in found.items():
            counts.update(done.get(what, {}))
        kept[name] = done | {"devices": past.stop} | found
        if given.counts is not None:
            given.counts.write_text(json.dumps(kept, indent=1))
        of = past.stop * given.rechecks
        print(f"\n{study.title}\n{'':20}{'NO-GO':36}{'insufficient':36}temperature differs")
        for what, counts in found.items():
            cells = (interval(counts[one], of) for one in ("no-go", "insufficient", "temperature"))
            print(f"{what:20}" + "".join(f"{cell:36}" for cell in cells).rstrip(), flush=True)


def print_durations(seed: int, devices: int) -> None:
    """Print how long the wizard takes with the virtual hand."""
    with ProcessPoolExecutor() as pool:
        found = list(pool.map(partial(in_the_wizard, seed), range(devices)))
    seconds = np.array([one for one, _ in found])
    verdicts = Counter(verdict for _, verdict in found)
    print(
        f"\nin the wizard with the virtual hand, {devices} devices: median of the device time "
        f"{np.median(seconds):.0f} s, longest {seconds.max():.0f} s; verdicts {dict(verdicts)}"
    )


if __name__ == "__main__":
    main()
