"""What "could be" covers: ``python -m benchmarks.could_be [UNITS [SEED [SENSOR]]]``.

Units of a virtual sensor, half of them with nothing hidden, the other half with one effect
of the catalogue, drawn by chance, of a size drawn from that of consumer parts. For each the error
without noise is taken in new directions at the session's times and temperatures: of an
accelerometer that of the magnitude in holds, of a gyroscope the angle by which rotations about any
axis, with the rates of the session, do not close, of a magnetometer that of the field's magnitude,
at currents of the session. The bias of a session is its mean in it. The simulators are those of
``benchmarks.hidden_effects``, ``benchmarks.gyroscope_bound`` and
``benchmarks.hidden_magnetometer``, which share no formula with the fit.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation as Attitude

from benchmarks.gyroscope_bound import DEVICES, RATE, WARMING, Session, WrongRate, attitudes, fitted
from benchmarks.gyroscope_bound import Device as TurnedDevice
from benchmarks.hidden.designs import PLANS, Schedule
from benchmarks.hidden.fitted import measured_of
from benchmarks.hidden.noise import COLOURS
from benchmarks.hidden.recording import SETTLING, Recorded, record
from benchmarks.hidden_field.recording import CONSUMER, Colour, noise_of
from benchmarks.hidden_field.recording import record as record_field
from benchmarks.hidden_field.scenarios import EFFECTS as FIELD_EFFECTS
from benchmarks.hidden_field.sessions import REPEATED, STANDARD, Plan, session_of
from benchmarks.measure import Wanted, machine
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE, MAGNETOMETER, MILLI_G
from imucal_wizard.simulate.forward import TrueCircumstances
from imucal_wizard.simulate.hidden import HIDDEN_TERMS, Hidden
from tests.estimate.truth import turn

NEW = 300
"""New directions of each unit of an accelerometer."""
NEW_ROTATIONS = 40
"""New rotations of each unit of a gyroscope."""


@dataclass(frozen=True)
class Unit:
    """One unit, errors in mg or degrees.

    Attributes:
        hidden: name of the effect, or "".
        could_be: what the program says.
        held_out: error held out.
        errors: true ones in new directions, shape (n,).
    """

    hidden: str
    could_be: float
    held_out: float
    errors: FloatArray


def drawn(sensor: str, rng: np.random.Generator) -> tuple[Hidden, ...]:
    """Nothing, or one effect on one axis, of a size drawn from that of consumer parts."""
    if rng.random() < 0.5:
        return ()
    terms = HIDDEN_TERMS[sensor]
    known = FIELD_EFFECTS if sensor == MAGNETOMETER else tuple(terms)
    name = str(rng.choice(known))
    typical = effect(name).parameters(sensor)[0].typical
    axes = tuple(int(one) for one in rng.permutation(3)[: terms[name].letters])
    if name == EARTH_RATE:
        axes = (2,)  # a chain of rotations has no north
    return (Hidden(sensor, name, float(typical * rng.standard_normal()), axes),)


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


def errors_elsewhere(recorded: Recorded, bench: Bench, rng: np.random.Generator) -> FloatArray:
    """True errors of the fit in new holds without noise, m/s², shape (NEW,)."""
    readings = recorded.true_readings(elsewhere(recorded, rng)) + recorded.drift
    corrected = (readings - bench.fit.bias) @ bench.fit.matrix.T
    return np.asarray(np.linalg.norm(corrected, axis=1) - STANDARD_GRAVITY)


def one_unit(design: str, colour: str, rng: np.random.Generator) -> Unit:
    """One unit, calibrated and judged."""
    hidden = drawn(ACCELEROMETER, rng)
    recorded = record(PLANS[design], COLOURS[colour], hidden, rng)
    bench = Bench(ACCELEROMETER, measured_of(recorded))
    errors = errors_elsewhere(recorded, bench, rng)
    held_out = bench.fit.rms_held_out or np.nan
    return Unit(
        hidden[0].term if hidden else "",
        (bench.look().could_be or np.nan) / MILLI_G,
        held_out / MILLI_G,
        errors / MILLI_G,
    )


EARTH_RATE = "earth-rate"


@dataclass(frozen=True, eq=False)
class HiddenRate(WrongRate):
    """Effects of the simulator.

    Attributes:
        hidden: which.
        step: moment of a step, minutes.
        settling: time constant of a warm-up, minutes.
    """

    hidden: tuple[Hidden, ...]
    step: float
    settling: float

    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """See ``WrongRate``."""
        shown = np.degrees(rate)
        attitude = np.zeros((len(up), 4))
        if any(one.term == EARTH_RATE for one in self.hidden):
            upright = [Attitude.align_vectors([[0.0, 0.0, 1.0]], one[None])[0] for one in up]
            attitude = np.array([np.roll(one.as_quat(), 1) for one in upright])
        known = TrueCircumstances(
            force=up,
            rate=shown,
            temperature=WARMING.at(time),
            minutes=time / 60.0,
            previous=up,
            vibration=np.zeros_like(up),
            attitude=attitude,
            sensed=shown,
            step=self.step,
            settling=self.settling,
            warming=WARMING.warming_at(time),
            change=RATE * np.gradient(shown, axis=0) if len(time) > 1 else 0.0 * shown,
        )
        return sum((one.error(known) for one in self.hidden), np.zeros_like(rate))


def one_gyroscope(device: TurnedDevice, rng: np.random.Generator) -> Unit:
    """One unit of a gyroscope, calibrated and judged."""
    hidden = drawn(GYROSCOPE, rng)
    session = Session(device, int(rng.integers(2**31)))
    seconds = session.seconds
    settling = float(np.exp(rng.uniform(*np.log(SETTLING))))
    wrong = HiddenRate(hidden, float(rng.uniform(0.3, 0.7)) * seconds / 60.0, settling)
    slow = session.wandering(rng) if device.flicker else None
    found = fitted(*session.recorded(rng, wrong, slow))
    if found.experiment is None:
        raise SystemExit("a simulated gyroscope has no rows")
    bench = Bench(GYROSCOPE, found.experiment, first=found)
    sensor, errors = session.gyroscope, []
    drift = np.zeros(3) if slow is None else slow.mean(axis=0)
    for _ in range(NEW_ROTATIONS):
        up, axis = rng.standard_normal((2, 3))
        up, axis = up / np.linalg.norm(up), axis / np.linalg.norm(axis)
        vector = np.radians(rng.uniform(40.0, 170.0)) * axis
        motion = turn(up, vector, seconds=float(rng.uniform(1.2, 2.5)), rate=RATE)
        felt = motion.rate + wrong.error(
            rng.uniform(0.0, seconds) + motion.time, motion.rate, motion.up
        )
        reading = felt @ sensor.sensitivity.T + sensor.bias + drift
        rates = (reading - found.bias) @ found.matrix.T
        carried = attitudes(motion.time, rates)[-1].inv().apply(motion.up[0])
        errors.append(np.arccos(np.clip(carried @ motion.up[-1], -1.0, 1.0)))
    return Unit(
        hidden[0].term if hidden else "",
        float(np.degrees(bench.look().could_be or np.nan)),
        float(np.degrees(found.rms_held_out or np.nan)),
        np.degrees(errors),
    )


def one_magnetometer(plan: Plan, colour: Colour, rng: np.random.Generator) -> Unit:
    """One unit of a magnetometer, calibrated and judged."""
    hidden = drawn(MAGNETOMETER, rng)
    session = session_of(plan, int(rng.integers(2**31)))
    step = float(rng.uniform(0.3, 0.7) * session.motion.time[-1]) / 60.0
    seed = int(rng.integers(2**31))
    recorded = record_field(session, colour, hidden, np.random.default_rng(seed), step=step)
    # a bias is its mean over the session
    drift = noise_of(colour, session.motion.time, np.random.default_rng(seed)).mean(axis=0)
    bench = Bench(MAGNETOMETER, recorded)
    found = bench.fit
    # the same equations in new directions of the field, at moments of the session
    rows = rng.integers(len(session.seen), size=NEW)
    turned = rng.standard_normal((NEW, 3))
    field = float(np.linalg.norm(session.model.world))
    seen = field * turned / np.linalg.norm(turned, axis=1)[:, None]
    known = session.circumstances(step)
    where = replace(
        known,
        sensed=seen,
        temperature=known.temperature[rows],
        minutes=known.minutes[rows],
        current=session.current[rows],
        force=known.force[rows],
        rate=known.rate[rows],
        previous=known.previous[rows],
        vibration=known.vibration[rows],
        attitude=known.attitude[rows],
    )
    felt = seen + drift + sum((one.error(where) for one in hidden), np.zeros_like(seen))
    readings = felt @ session.model.gain.T + session.model.hard_iron
    corrected = (readings - found.bias) @ found.matrix.T
    return Unit(
        hidden[0].term if hidden else "",
        bench.look().could_be or np.nan,
        found.rms_held_out or np.nan,
        np.linalg.norm(corrected, axis=1) - field,
    )


def line(name: str, units: list[Unit]) -> str:
    """Coverage of these units with its error, and "could be" as a multiple of the truth.

    Units in which hardly any explanation of the catalogue fits have no such figure: they are
    counted apart.
    """
    every, units = len(units), [one for one in units if np.isfinite(one.could_be)]
    without = f"  (without {every - len(units)} that have no figure)" if len(units) < every else ""
    inside = np.array([np.mean(np.abs(one.errors) <= one.could_be) for one in units])
    true = np.array([np.sqrt(np.mean(one.errors**2)) for one in units])
    whole = np.mean(true <= [one.could_be for one in units])
    said = np.median([one.could_be for one in units])
    held_out = np.median([one.held_out for one in units])
    return (
        f"{name:26}{len(units):6}{100 * inside.mean():9.1f} ± "
        f"{100 * inside.std() / np.sqrt(len(units)):3.1f}{100 * whole:10.1f}"
        f"{np.median(true):10.3f}{held_out:10.3f}{said:10.3f}"
        f"{np.median([one.could_be for one in units] / true):8.2f}{without}"
    )


CASES: dict[str, dict[str, Callable[[np.random.Generator], Unit]]] = {
    ACCELEROMETER: {
        "18 poses, consumer noise": partial(one_unit, "18", "consumer"),
        "26+12 poses, consumer noise": partial(one_unit, "26+12", "consumer"),
        "18 poses, white noise": partial(one_unit, "18", "white"),
    },
    GYROSCOPE: {
        one.name: partial(one_gyroscope, one)
        for one in (
            DEVICES[2],
            DEVICES[0],
            replace(DEVICES[0], name="26 poses, 12 turns, 1 mg, flicker 5 °/h", flicker=0.0015),
        )
    },
    MAGNETOMETER: {
        "circles, 26+12 poses, circles; consumer noise": partial(
            one_magnetometer, REPEATED, CONSUMER
        ),
        "18 poses, circles; consumer noise": partial(one_magnetometer, STANDARD, CONSUMER),
        "18 poses, circles; white noise": partial(one_magnetometer, STANDARD, Colour(floor=0.0)),
    },
}
UNITS = {ACCELEROMETER: "mg", GYROSCOPE: "°", MAGNETOMETER: "µT"}


def main(
    units: str = "600", seed: str = "101", sensor: str = ACCELEROMETER, only: str = ""
) -> None:
    """Print the table."""
    print(machine())
    head = f"{'units':>6}{'inside, %':>15}{'rms, %':>10}{'true rms':>10}{'held out':>10}"
    print(f"{'hidden':26}{head}{'could be':>10}{'× rms':>8}   (medians, {UNITS[sensor]})")
    wanted = Wanted()
    for place, (name, one_of) in enumerate(CASES[sensor].items()):
        if only not in name:
            continue
        rng = np.random.default_rng([int(seed), place])
        made = [one_of(rng) for _ in range(int(units))]
        print(f"{sensor}, {name}; wanted inside: 93 to 97 %, × rms: at most 3")
        print(line("all", made))
        known = [one for one in made if np.isfinite(one.could_be)]
        inside = [100.0 * np.mean(np.abs(one.errors) <= one.could_be) for one in known]
        doubt = float(np.std(inside)) / np.sqrt(len(known))
        wanted.figure(f"{name}: inside", float(np.mean(inside)), 93.0, 97.0, doubt)
        true = [np.sqrt(np.mean(one.errors**2)) for one in known]
        times = [one.could_be / own for one, own in zip(known, true, strict=True)]
        wanted.figure(f"{name}: × rms", float(np.median(times)), 0.0, 3.0)
        print(line("nothing", [one for one in made if not one.hidden]))
        for term in sorted({one.hidden for one in made} - {""}):
            print(line(term, [one for one in made if one.hidden == term]), flush=True)
    print(wanted)


if __name__ == "__main__":
    main(*sys.argv[1:])
