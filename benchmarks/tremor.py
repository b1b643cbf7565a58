"""What sampling loses of rotations by a trembling hand: ``python -m benchmarks.tremor [N [SEED]]``.

N sessions for each sampling rate and hand. Each has 26 rotations between still poses; the attitude
is a smooth turn times a small rotation by sines of all frequencies up to 700 Hz that begins and
ends at zero, the rate is its difference over a tenth of a millisecond, sampled at single moments.
The table compares the noise figure that the fit says with the error that it finds held out; without
what sampling loses the figure is that of a calm hand.
"""

import sys
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.accelerometer import fit_accelerometer
from imucal_wizard.estimate.gyroscope_report import GyroscopeReport, fit_gyroscope
from imucal_wizard.measurement.holds import Hold, Rotation
from tests.estimate.truth import TWENTY_SIX, smooth_step, tilted, typical_gyroscope

GRAVITY = 9.80665
RATES = (25.0, 50.0, 100.0, 200.0)
HIGHEST = 700.0
SINES = 150
INSTANT = 1e-4
HOLD, MOVED = 3.0, 1.0
FORCE, RATE = 0.08e-3 * GRAVITY, np.radians(0.005)
"""Noise of a hold's mean acceleration, m/s², and of the rate, rad/s/√Hz."""


@dataclass(frozen=True)
class Hand:
    """How a hand trembles while it turns the device.

    Attributes:
        name: in the table.
        size: rms of the rate, °/s.
        fall: p of the power's fall as 1/ν^p.
        peak: frequency of the largest power, Hz; below, it is even.
        width: of the peak, Hz; 0 for an even spectrum below it.
    """

    name: str
    size: float
    fall: float
    peak: float = 4.0
    width: float = 0.0

    def sines(self, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Frequencies, Hz, (n,), and amplitudes of the rate, rad/s, complex, (n, 3)."""
        edges = np.geomspace(0.5, HIGHEST, SINES + 1)
        frequency = edges[:-1] + rng.random(SINES) * np.diff(edges)
        if self.width:
            power = 1.0 / (self.width**2 + (frequency - self.peak) ** 2)
            power *= np.minimum(1.0, (self.peak / frequency) ** (self.fall - 2.0))
        else:
            power = np.minimum(1.0, (self.peak / frequency) ** self.fall)
        spread = np.sqrt(power * np.diff(edges))
        spread *= np.radians(self.size) / np.linalg.norm(spread)
        both = rng.standard_normal((2, SINES, 3)) * spread[:, None]
        return frequency, both[0] + 1j * both[1]


HANDS = (
    Hand("calm", 0.0, 2.0),
    Hand("5 °/s, 1/ν²", 5.0, 2.0),
    Hand("5 °/s, 1/ν⁴", 5.0, 4.0),
    Hand("20 °/s, peak at 8 to 12 Hz", 20.0, 4.0, 10.0, 2.0),
    Hand("10 °/s, 1/ν³", 10.0, 3.0, 8.0),
    Hand("8 °/s, peak at 6 Hz, 1/ν³", 8.0, 3.0, 6.0, 3.0),
    Hand("2 °/s, 1/ν²·⁵ from 20 Hz", 2.0, 2.5, 20.0),
)
"""The last three were drawn after the estimate was made."""


def session(hand: Hand, rate: float, rng: np.random.Generator) -> tuple[list[Hold], list[Rotation]]:
    """One session, with an ideal accelerometer."""
    up = tilted(TWENTY_SIX[rng.permutation(26)], 2.0, rng)
    gyroscope, holds, rotations, start = typical_gyroscope(), [], [], 0.0
    density, now = RATE**2 * rate / 2.0, up[0]
    for target in [*up[1:], up[0]]:
        seconds = float(rng.uniform(1.5, 3.0))
        axis = np.cross(target, now)
        if np.linalg.norm(axis) < 0.1:
            axis = np.cross(now, np.eye(3)[np.abs(now).argmin()])
        angle = np.arccos(np.clip(target @ now, -1.0, 1.0))
        twist = Attitude.from_rotvec(rng.uniform(-1.5, 1.5) * now)
        turn = (twist * Attitude.from_rotvec(angle * axis / np.linalg.norm(axis))).as_rotvec()
        attitude = partial(_attitude, seconds, turn, *hand.sines(rng))
        time = np.arange(-0.1, seconds + 0.1, 1.0 / rate) + rng.random() / rate
        later, sooner = attitude(time + 0.5 * INSTANT), attitude(time - 0.5 * INSTANT)
        true = (sooner.inv() * later).as_rotvec() / INSTANT
        holds.append(_rest(now, start, rate, density, rng))
        noise = np.sqrt(density) * rng.standard_normal(true.shape)
        ups = attitude(time).inv().apply(now)
        reading = true @ gyroscope.sensitivity.T + gyroscope.bias + noise
        begin = start + HOLD + MOVED
        rotations.append((begin + time, reading, GRAVITY * ups))
        now = attitude(np.array([2.0 * seconds])).inv().apply(now)[0]
        start = begin + seconds + MOVED
    holds.append(_rest(now, start, rate, density, rng))
    return holds, [
        Rotation(before, after, time, reading, accelerometer=force)
        for before, after, (time, reading, force) in zip(
            holds[:-1], holds[1:], rotations, strict=True
        )
    ]


def _attitude(
    seconds: float, turn: FloatArray, frequency: FloatArray, size: FloatArray, time: FloatArray
) -> Attitude:
    share = np.clip(time / seconds, 0.0, 1.0)
    waves = np.exp(2j * np.pi * np.outer(time, frequency))
    shaken = (waves @ (size / (2j * np.pi * frequency[:, None]))).real
    bump = smooth_step(4.0 * share) * smooth_step(4.0 * (1.0 - share))
    turned = Attitude.from_rotvec(np.outer(smooth_step(share), turn))
    return turned * Attitude.from_rotvec(bump[:, None] * shaken)


def _rest(
    up: FloatArray, start: float, rate: float, density: float, rng: np.random.Generator
) -> Hold:
    samples = round(HOLD * rate)
    force = GRAVITY * up + FORCE * rng.standard_normal(3)
    variance = density / samples
    still = typical_gyroscope().bias + np.sqrt(variance) * rng.standard_normal(3)
    scatters = (one * rng.chisquare(4, 3) / 4.0 for one in (FORCE**2, variance))
    forces, rates = (np.diag(one) for one in scatters)
    return Hold(
        start,
        start + HOLD,
        force,
        forces,
        still,
        rates,
        samples,
        accelerometer_scatter=FORCE**2 * rng.chisquare(samples, 3) / samples,
        gyroscope_scatter=variance * rng.chisquare(samples, 3) / samples,
    )


def found(hand: Hand, rate: float, rng: np.random.Generator) -> GyroscopeReport:
    """The gyroscope of one session."""
    holds, rotations = session(hand, rate, rng)
    return fit_gyroscope(holds, rotations, fit_accelerometer(holds, GRAVITY, "m/s^2"), "rad/s")


def compared(hand: Hand, rate: float, sessions: int, seed: int) -> tuple[float, float, float]:
    """Noise figure said and error found held out, °, rms; share of sessions that are warned."""
    rng = np.random.default_rng([seed, round(rate), HANDS.index(hand)])
    said, true, warned = [], [], []
    for _ in range(sessions):
        one = found(hand, rate, rng)
        if one.fit is None:
            raise SystemExit("a simulated gyroscope was not fitted")
        said.append(one.fit.floor or np.nan)
        true.append(one.fit.rms_held_out or np.nan)
        warned.append(any("sample faster" in text for text in one.warnings))
    floor, held_out = (float(np.degrees(np.sqrt(np.mean(np.square(x))))) for x in (said, true))
    return floor, held_out, float(np.mean(warned))


def main(sessions: int = 20, seed: int = 1) -> None:
    """Print the table."""
    print(f"{sessions} sessions of 26 rotations each, seed {seed}; rms over rotations, °")
    print(
        f"{'hand':30}{'samples/s':>10}{'noise said':>12}{'held out':>10}{'ratio':>8}{'warned':>8}"
    )
    for hand in HANDS:
        for rate in RATES:
            said, true, warned = compared(hand, rate, sessions, seed)
            figures = f"{said:12.4f}{true:10.4f}{said / true:8.2f}{100.0 * warned:7.0f}%"
            print(f"{hand.name:30}{rate:10.0f}{figures}", flush=True)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
