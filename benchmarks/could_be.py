"""What "could be" covers: ``python -m benchmarks.could_be [UNITS [SEED]]``.

Units of a virtual accelerometer, half of them with nothing hidden, the other half with one effect
of the catalogue, drawn by chance, of a size drawn from that of consumer parts. For each the error
without noise is taken in new directions at the session's times and temperatures. The simulator is
that of ``benchmarks.hidden_effects``, which shares no formula with the fit.
"""

import sys
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.hidden.designs import PLANS, Schedule
from benchmarks.hidden.fitted import measured_of
from benchmarks.hidden.noise import COLOURS
from benchmarks.hidden.recording import Recorded, record
from benchmarks.measure import machine
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.effect import ACCELEROMETER, MILLI_G
from imucal_wizard.simulate.hidden import ACCELEROMETER_TERMS, Hidden

NEW = 300
"""New directions of each unit."""


@dataclass(frozen=True)
class Unit:
    """One unit, errors in mg.

    Attributes:
        hidden: name of the effect, or "".
        could_be: what the program says.
        held_out: error held out.
        errors: true ones in new directions, shape (NEW,).
    """

    hidden: str
    could_be: float
    held_out: float
    errors: FloatArray


def drawn(rng: np.random.Generator) -> tuple[Hidden, ...]:
    """Nothing, or one effect on one axis, of a size drawn from that of consumer parts."""
    if rng.random() < 0.5:
        return ()
    name = str(rng.choice(list(ACCELEROMETER_TERMS)))
    typical = effect(name).parameters(ACCELEROMETER)[0].typical
    axes = tuple(int(one) for one in rng.permutation(3)[: ACCELEROMETER_TERMS[name].letters])
    return (Hidden(ACCELEROMETER, name, float(typical * rng.standard_normal()), axes),)


def elsewhere(recorded: Recorded, rng: np.random.Generator) -> Schedule:
    """New holds in directions by chance, at times and temperatures of the session."""
    schedule = recorded.schedule
    rows = rng.integers(len(schedule.up), size=NEW)
    up = rng.standard_normal((NEW, 3))
    return replace(
        schedule,
        up=up / np.linalg.norm(up, axis=1)[:, None],
        start=schedule.start[rows],
        end=schedule.end[rows],
        temperature=schedule.temperature[rows],
        vibration=schedule.vibration[rows],
        shaken=schedule.shaken[rows],
    )


def one_unit(design: str, colour: str, rng: np.random.Generator) -> Unit:
    """One unit, calibrated and judged."""
    hidden = drawn(rng)
    recorded = record(PLANS[design], COLOURS[colour], hidden, rng)
    bench = Bench(ACCELEROMETER, measured_of(recorded))
    readings = recorded.true_readings(elsewhere(recorded, rng))
    corrected = (readings - bench.fit.bias) @ bench.fit.matrix.T
    errors = np.linalg.norm(corrected, axis=1) - STANDARD_GRAVITY
    held_out = bench.fit.rms_held_out or np.nan
    return Unit(
        hidden[0].term if hidden else "",
        (bench.look().could_be or np.nan) / MILLI_G,
        held_out / MILLI_G,
        errors / MILLI_G,
    )


def line(name: str, units: list[Unit]) -> str:
    """Coverage of these units with its error, and "could be" as a multiple of the truth."""
    inside = np.array([np.mean(np.abs(one.errors) <= one.could_be) for one in units])
    true = np.array([np.sqrt(np.mean(one.errors**2)) for one in units])
    whole = np.mean(true <= [one.could_be for one in units])
    said = np.median([one.could_be for one in units])
    held_out = np.median([one.held_out for one in units])
    return (
        f"{name:26}{len(units):6}{100 * inside.mean():9.1f} ± "
        f"{100 * inside.std() / np.sqrt(len(units)):3.1f}{100 * whole:10.1f}"
        f"{np.median(true):10.3f}{held_out:10.3f}{said:10.3f}"
        f"{np.median([one.could_be for one in units] / true):8.2f}"
    )


def main(units: int = 600, seed: int = 101) -> None:
    """Print the table."""
    print(machine())
    head = f"{'units':>6}{'inside, %':>15}{'rms, %':>10}{'true rms':>10}{'held out':>10}"
    print(f"{'hidden':26}{head}{'could be':>10}{'× rms':>8}   (medians, mg)")
    for design, colour in (("18", "consumer"), ("26+12", "consumer"), ("18", "white")):
        rng = np.random.default_rng([seed, len(design), len(colour)])
        made = [one_unit(design, colour, rng) for _ in range(units)]
        print(f"{design} poses, {colour} noise; wanted inside: 93 to 97 %, × rms: at most 3")
        print(line("all", made))
        print(line("nothing", [one for one in made if not one.hidden]))
        for name in sorted({one.hidden for one in made} - {""}):
            print(line(name, [one for one in made if one.hidden == name]), flush=True)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
