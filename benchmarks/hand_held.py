"""A device held in the hand for a whole session: ``python -m benchmarks.hand_held [N [SEED]]``.

N (20) sessions of each hand from a simulator of its own (``hand_motion``): 18 poses and two turns
about each axis, in which the direction sways below 1 Hz also in the holds, and the hand trembles at
8 to 12 Hz; one moves it at all frequencies, others rock it at 1 to 9 Hz. An effect is hidden in
some. The table has the error held out and the noise figure beside it, rms over the sessions whose
holds determine the accelerometer (the program calls the others insufficient), the rms error of the
biases, and of the accelerometer's sensitivities too, over their standard errors, and the verdicts.
"""

import sys
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.hand_motion import Device, G, Motion, placed, recorded
from benchmarks.measure import Wanted, machine
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.survey import diagnosis_of
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.catalogue import effect

SIZES = {"": 0.0, "g-sensitivity": 0.1, "second-order": 0.2, "cross-product": 0.3}
"""°/s at 1 g; per cent at 1 rad/s."""
NAMES = (Verdict.MISSING, Verdict.AMBIGUOUS)
"""Verdicts that name an effect."""


@dataclass(frozen=True)
class Hand:
    """How a hand holds the device: see ``placed``."""

    sway: float
    tremor: float
    rate: float = 100.0
    hidden: str = ""
    restless: float = 0.0
    rocking: float = 0.0


HANDS = (
    Hand(0.0, 0.0),
    Hand(0.1, 2.0),
    Hand(0.3, 0.0),
    Hand(0.3, 5.0),
    Hand(0.5, 5.0),
    Hand(0.3, 20.0),
    Hand(0.3, 5.0, rate=25.0),
    Hand(0.3, 5.0, rate=400.0),
    *(Hand(0.3, 5.0, hidden=name) for name in SIZES if name),
    Hand(0.0, 0.0, restless=0.08),
    Hand(0.0, 0.0, restless=0.2),
    Hand(0.0, 0.0, rocking=0.25),
    Hand(0.0, 2.0, rocking=0.5),
    Hand(0.0, 2.0, rocking=0.8),
)


@dataclass(frozen=True)
class Session:
    """What was found in one session.

    Attributes:
        held_out: of the gyroscope, rad.
        floor: its noise figure, rad.
        held_out_a: of the accelerometer, m/s².
        floor_a: its noise figure, m/s².
        errors: of the gyroscope's biases over their standard errors, shape (3,).
        errors_a: of the accelerometer's biases and sensitivities over theirs, shape (6,).
        verdict: of the gyroscope, with what is named.
        verdict_a: of the accelerometer.
    """

    held_out: float
    floor: float
    held_out_a: float
    floor_a: float
    errors: FloatArray
    errors_a: FloatArray
    verdict: str
    verdict_a: str


def with_effect(motion: Motion, hidden: str) -> Motion:
    """The motion as a gyroscope with this effect feels it."""
    rate, error = motion.rate, np.zeros_like(motion.rate)
    size = SIZES[hidden]
    if hidden == "g-sensitivity":
        error[:, 0] = np.radians(size) * motion.force[:, 1] / G
    elif hidden == "second-order":
        error[:, 1] = 0.01 * size * rate[:, 1] ** 2
    elif hidden == "cross-product":
        error[:, 2] = 0.01 * size * rate[:, 0] * rate[:, 1]
    return replace(motion, rate=rate + error)


def session(hand: Hand, seed: int, number: int) -> Session | None:
    """One session of a hand, fitted and judged; None where too few holds leave nothing out."""
    rng = np.random.default_rng([seed, number, HANDS.index(hand)])
    device = Device(rate=hand.rate)
    motion = placed(
        device,
        rng,
        tremor=hand.tremor,
        sway=hand.sway,
        restless=hand.restless,
        rocking=hand.rocking,
        turns=2,
    )
    # the readings without turning and white noise tell the bias, with what it wanders
    state = rng.bit_generator.state
    readings = recorded(with_effect(motion, hand.hidden), device, rng)
    rng.bit_generator.state = state
    still = replace(motion, rate=np.zeros_like(motion.rate))
    exact = replace(device, noise=0.0, flicker=0.0, rate_noise=0.0, bits=48)
    none = recorded(still, exact, rng)
    try:
        report = fit_readings(readings)
    except DataError:  # most of its holds move too much
        return None
    sensor, accelerometer = report.sensors["gyroscope"], report.sensors["accelerometer"]
    if sensor.floor is None or accelerometer.floor is None or none.gyroscope is None:
        return None
    errors = sensor.bias - none.gyroscope.values.mean(axis=0)
    known = [one.standard_error or np.nan for one in sensor.parameters if "bias" in one.name]
    # readings without noise tell the accelerometer's bias, and its sensitivity along each axis
    felt = np.column_stack([motion.force, np.ones(len(motion.force))])
    true = np.linalg.lstsq(felt, none.accelerometer.values, rcond=None)[0]
    errors_a = np.append(
        accelerometer.bias - true[3],
        np.linalg.norm(accelerometer.matrix @ true[:3].T, axis=0) - 1.0,
    )
    known_a = [
        one.standard_error or np.nan
        for one in accelerometer.parameters
        if one.name.startswith(("bias", "sensitivity"))
    ]
    benches, said = Benches(report, readings), []
    for name in ("gyroscope", "accelerometer"):
        bench = benches.bench(name)
        if bench is None:
            raise SystemExit(f"a simulated session has no bench for the {name}")
        found = diagnosis_of(benches, bench)
        named = bench.look().opinion.families if found.verdict in NAMES else ()
        said.append(" ".join([str(found.verdict), *named]))
    return Session(
        sensor.rms_held_out or np.nan,
        sensor.floor,
        accelerometer.rms_held_out or np.nan,
        accelerometer.floor,
        errors / known,
        errors_a / known_a,
        *said,
    )


def label(hand: Hand) -> str:
    """Its name in the table."""
    moves = f"{hand.sway:.1f}°, {hand.tremor:.0f} mg"
    if hand.restless:
        moves = f"{hand.restless:.2f}° at all frequencies"
    if hand.rocking:
        moves = f"{hand.rocking:.2f}° at 1 to 9 Hz, {hand.tremor:.0f} mg"
    return f"{moves}, {hand.rate:.0f} Hz {hand.hidden}".rstrip()


def row(hand: Hand, sessions: list[Session]) -> str:
    """A line of the table."""
    known = [one for one in sessions if one.verdict_a != Verdict.INSUFFICIENT]

    def rms(name: str, unit: float = 1.0) -> float:
        return float(np.sqrt(np.mean([np.square(getattr(s, name)) for s in known]))) / unit

    degree, mg = np.pi / 180.0, 1e-3 * G
    figures = (
        f"{rms('held_out', degree):10.4f}{rms('floor', degree):9.4f}"
        f"{rms('errors'):9.2f}{rms('held_out_a', mg):10.3f}{rms('floor_a', mg):9.3f}"
        f"{rms('errors_a'):9.2f}"
    )
    said = ", ".join(f"{n} {v}" for v, n in Counter(s.verdict for s in sessions).most_common())
    complete = sum(s.verdict_a == "complete" for s in sessions)
    return f"{label(hand):34}{figures}{complete:11}  {said}"


def main(count: str = "20", seed: str = "1") -> None:
    """Print the table."""
    print(machine())
    print(f"{count} sessions of each hand, seed {seed}")
    print(
        f"{'sway, tremor, samples/s, hidden':34}{'°: held':>10}{'noise':>9}{'bias/se':>9}"
        f"{'mg: held':>10}{'noise':>9}{'err/se':>9}{'complete':>11}  gyroscope's verdicts"
    )
    wanted = Wanted()
    for hand in HANDS:
        each = [session(hand, int(seed), number) for number in range(int(count))]
        done = [one for one in each if one is not None]
        print(row(hand, done), flush=True)
        name = label(hand)
        if hand.hidden:
            family = effect(hand.hidden).family or hand.hidden
            named = sum(family in one.verdict.split() for one in done)
            wanted.share(f"{name} named", named, len(done), 90.0)
            continue
        said, true = (np.square([getattr(one, of) for one in done]) for of in ("floor", "held_out"))
        ratio = np.sqrt(said.mean() / true.mean())
        doubt = 0.5 * ratio * float(true.std() / true.mean()) / np.sqrt(len(done))
        wanted.figure(f"{name}: noise figure over error", float(ratio), 0.8, 1.3, doubt)
        judged = [one for one in done if one.verdict_a != Verdict.INSUFFICIENT]
        squares = np.square([one.errors_a for one in judged]).mean(axis=1)
        size = float(np.sqrt(squares.mean()))
        doubt = 0.5 * float(squares.std()) / size / np.sqrt(len(judged))
        wanted.figure(f"{name}: accelerometer's errors / se", size, 0.0, 1.2, doubt)
        complete = sum(one.verdict == "complete" for one in done)
        wanted.share(f"{name} complete", complete, len(done), 95.0)
        if len(done) < len(each):
            print(f"  {len(each) - len(done)} of these sessions have too few holds")
    print(wanted)


if __name__ == "__main__":
    main(*sys.argv[1:])
