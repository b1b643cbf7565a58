"""What sampling loses of rotations by a trembling hand: ``python -m benchmarks.tremor [N [SEED]]``.

N sessions for each sampling rate and hand. Each has 26 rotations between still poses; the attitude
is a smooth turn times a small rotation by sines of all frequencies up to 700 Hz that begins and
ends at zero, the rate is its difference over a tenth of a millisecond, sampled at single moments.
The table compares the noise figure that the fit says with the error that it finds held out; without
what sampling loses the figure is that of a calm hand.

Some sensors have a low-pass filter or average between samples: their rates and their noise are made
twenty times as often. A third table hides an effect in sessions of a trembling hand: the noise
figure must not follow it, and the effect must still be seen. ``N SEED PART`` prints one table only:
``rates``, ``sensors`` or ``hidden``.
"""

import sys
from collections import Counter
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.signal import butter, sosfilt
from scipy.spatial.transform import Rotation as Attitude

from benchmarks.gyroscope_bound import WrongRate
from benchmarks.measure import Wanted
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.estimate.gyroscope_report import GyroscopeReport, fit_gyroscope
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.estimate.rest_spectrum import rest_spectrum
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.model.effect import GYROSCOPE
from tests.estimate.truth import TWENTY_SIX, smooth_step, tilted, typical_gyroscope

GRAVITY = 9.80665
RATES = (25.0, 50.0, 100.0, 200.0)
HIGHEST = 700.0
SINES = 150
INSTANT = 1e-4
FINER = 20
"""Moments to each sample of a sensor that does not take single moments."""
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


@dataclass(frozen=True)
class Sensor:
    """What a gyroscope does before a sample is taken.

    Attributes:
        name: in the table.
        corner: of its low-pass filter (Butterworth, second order), in units of the sampling rate.
        averages: a sample is the mean since the sample before.
    """

    name: str
    corner: float | None = None
    averages: bool = False

    def sampled(self, fine: FloatArray) -> FloatArray:
        """Samples from what it feels ``FINER`` times as often, shape (n, 3)."""
        if self.corner is not None:
            filtered = butter(2, 2.0 * self.corner / FINER, output="sos")
            fine = fine[0] + sosfilt(filtered, fine - fine[0], axis=0)
        if self.averages:
            whole = len(fine) // FINER * FINER
            return np.asarray(fine[:whole].reshape(-1, FINER, 3).mean(axis=1))
        return np.asarray(fine[::FINER])


MOMENTS = Sensor("single moments")
SENSORS = (
    Sensor("low-pass filter at 0.3 f", corner=0.3),
    Sensor("low-pass filter at 0.45 f", corner=0.45),
    Sensor("mean between samples", averages=True),
)


@dataclass(frozen=True)
class WrongGain(WrongRate):
    """One axis whose gain follows its own rate or that of another axis."""

    out: int
    factor: int
    size: float

    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """See ``WrongRate``: ``size`` is the error at 1 rad/s."""
        del time, up
        error = np.zeros_like(rate)
        error[:, self.out] = self.size * rate[:, self.out] * rate[:, self.factor]
        return error


@dataclass(frozen=True)
class FeelsGravity(WrongRate):
    """One axis that feels gravity."""

    size: float

    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """See ``WrongRate``."""
        del time
        return np.asarray(self.size * np.roll(up, 1, axis=1) * [1.0, 0.0, 0.0] + 0.0 * rate)


HIDDEN: dict[str, WrongRate | None] = {
    "nothing": None,
    "second-order of x, 0.15 %": WrongGain(0, 0, 0.0015),
    "cross-product, 0.3 %": WrongGain(2, 1, 0.003),
    "g-sensitivity, 0.1 °/s/g": FeelsGravity(float(np.radians(0.1))),
}


@dataclass(frozen=True)
class Recorded:
    """One session: holds, rotations, and the samples in the holds."""

    holds: list[Hold]
    rotations: list[Rotation]
    readings: Readings


def session(
    hand: Hand,
    rate: float,
    rng: np.random.Generator,
    sensor: Sensor = MOMENTS,
    wrong: WrongRate | None = None,
) -> Recorded:
    """One session, with an ideal accelerometer."""
    up = tilted(TWENTY_SIX[rng.permutation(26)], 2.0, rng)
    gyroscope, holds, rotations, rests, start = typical_gyroscope(), [], [], [], 0.0
    moments = sensor == MOMENTS
    density, now = RATE**2 * rate / 2.0, up[0]

    def read(true: FloatArray) -> FloatArray:
        """Samples of a rate that is known at single moments, or so much more often."""
        size = np.sqrt(density * (1.0 if moments else FINER))
        noisy = true @ gyroscope.sensitivity.T + gyroscope.bias
        noisy = noisy + size * rng.standard_normal(true.shape)
        return noisy if moments else sensor.sampled(noisy)

    def rest(start: float, up: FloatArray) -> None:
        felt = (
            np.zeros((1, 3))
            if wrong is None
            else wrong.error(np.zeros(1), np.zeros((1, 3)), up[None])
        )
        count = round(HOLD * rate) * (1 if moments else FINER)
        samples = read(np.tile(felt, (count, 1)))
        rests.append((start + np.arange(len(samples)) / rate, samples))
        holds.append(_rest(up, start, samples, rng))

    for target in [*up[1:], up[0]]:
        seconds = float(rng.uniform(1.5, 3.0))
        axis = np.cross(target, now)
        if np.linalg.norm(axis) < 0.1:
            axis = np.cross(now, np.eye(3)[np.abs(now).argmin()])
        angle = np.arccos(np.clip(target @ now, -1.0, 1.0))
        twist = Attitude.from_rotvec(rng.uniform(-1.5, 1.5) * now)
        turn = (twist * Attitude.from_rotvec(angle * axis / np.linalg.norm(axis))).as_rotvec()
        attitude = partial(_attitude, seconds, turn, *hand.sines(rng))
        step = 1.0 / rate if moments else 1.0 / (rate * FINER)
        time = np.arange(-0.1, seconds + 0.1, step) + rng.random() / rate
        instant = INSTANT if moments else step
        later, sooner = attitude(time + 0.5 * instant), attitude(time - 0.5 * instant)
        true = (sooner.inv() * later).as_rotvec() / instant
        ups = attitude(time).inv().apply(now)
        if wrong is not None:
            true = true + wrong.error(time, true, ups)
        rest(start, now)
        begin = start + HOLD + MOVED
        reading = read(true)
        place = np.arange(len(reading)) * (1 if moments else FINER)
        rotations.append((begin + time[place], reading, GRAVITY * ups[place]))
        now = attitude(np.array([2.0 * seconds])).inv().apply(now)[0]
        start = begin + seconds + MOVED
    rest(start, now)
    times, values = (np.concatenate(part) for part in zip(*rests, strict=True))
    series = Series(times, values, "rad/s")
    return Recorded(
        holds,
        [
            Rotation(before, after, time, reading, accelerometer=force)
            for before, after, (time, reading, force) in zip(
                holds[:-1], holds[1:], rotations, strict=True
            )
        ],
        Readings(Series(series.time, np.zeros_like(series.values), "m/s^2"), series),
    )


def _attitude(
    seconds: float, turn: FloatArray, frequency: FloatArray, size: FloatArray, time: FloatArray
) -> Attitude:
    share = np.clip(time / seconds, 0.0, 1.0)
    waves = np.exp(2j * np.pi * np.outer(time, frequency))
    shaken = (waves @ (size / (2j * np.pi * frequency[:, None]))).real
    bump = smooth_step(4.0 * share) * smooth_step(4.0 * (1.0 - share))
    turned = Attitude.from_rotvec(np.outer(smooth_step(share), turn))
    return turned * Attitude.from_rotvec(bump[:, None] * shaken)


def _rest(up: FloatArray, start: float, samples: FloatArray, rng: np.random.Generator) -> Hold:
    force = GRAVITY * up + FORCE * rng.standard_normal(3)
    forces = np.diag(FORCE**2 * rng.chisquare(4, 3) / 4.0)
    count = len(samples)
    batches = samples[: count // 5 * 5].reshape(5, -1, 3).mean(axis=1)
    off = batches - batches.mean(axis=0)
    return Hold(
        start,
        start + HOLD,
        force,
        forces,
        samples.mean(axis=0),
        off.T @ off / 20.0,
        count,
        accelerometer_scatter=FORCE**2 * rng.chisquare(count, 3) / count,
        gyroscope_scatter=samples.var(axis=0, ddof=1) / count,
    )


def found(
    hand: Hand,
    rate: float,
    rng: np.random.Generator,
    sensor: Sensor = MOMENTS,
    wrong: WrongRate | None = None,
) -> GyroscopeReport:
    """The gyroscope of one session."""
    one = session(hand, rate, rng, sensor, wrong)
    known = fit_accelerometer(one.holds, GRAVITY, "m/s^2")
    spectrum = rest_spectrum(one.readings, one.holds)
    args = one.holds, one.rotations, known, "rad/s"
    return fit_gyroscope(*args, readings=one.readings, spectrum=spectrum)


@dataclass(frozen=True)
class Row:
    """Of many sessions.

    Attributes:
        said: the noise figure, rms, °.
        held_out: the error found held out, rms, °.
        warned: share of sessions that are warned.
        verdicts: how often each verdict was given; none where they were not asked for.
    """

    said: float
    held_out: float
    warned: float
    verdicts: Counter[str]

    def __str__(self) -> str:
        verdicts = ", ".join(f"{n} {word}" for word, n in self.verdicts.most_common())
        ratio = self.said / self.held_out
        figures = f"{self.said:12.4f}{self.held_out:10.4f}{ratio:8.2f}{100.0 * self.warned:7.0f}%"
        return f"{figures}  {verdicts}".rstrip()


def compared(
    hand: Hand,
    rate: float,
    sessions: int,
    seed: int,
    sensor: Sensor = MOMENTS,
    hidden: str = "",
) -> Row:
    """Many sessions; with what is hidden also judged."""
    rng = np.random.default_rng([seed, round(rate), HANDS.index(hand)])
    said, true, warned, verdicts = [], [], [], Counter[str]()
    for _ in range(sessions):
        one = found(hand, rate, rng, sensor, HIDDEN.get(hidden))
        if one.fit is None or one.fit.experiment is None:
            raise SystemExit("a simulated gyroscope was not fitted")
        said.append(one.fit.floor or np.nan)
        true.append(one.fit.rms_held_out or np.nan)
        warned.append(any("sample faster" in text for text in one.warnings))
        if hidden:
            bench = Bench(GYROSCOPE, one.fit.experiment, first=one.fit)
            verdicts[str(bench.look().opinion.verdict)] += 1
    floor, held_out = (float(np.degrees(np.sqrt(np.mean(np.square(x))))) for x in (said, true))
    return Row(floor, held_out, float(np.mean(warned)), verdicts)


RIGHT = 0.8, 1.3
"""Noise figure over the error held out, wanted."""
HEAD = f"{'samples/s':>10}{'noise said':>12}{'held out':>10}{'ratio':>8}{'warned':>8}"


def main(sessions: str = "40", seed: str = "1", part: str = "") -> None:
    """Print the tables."""
    count, begin = int(sessions), int(seed)
    print(f"{count} sessions of 26 rotations each, seed {begin}; rms over rotations, °")
    wanted = Wanted()
    if part in ("", "rates"):
        print(f"{'hand':46}{HEAD}")
        for hand in HANDS:
            for rate in RATES:
                row = compared(hand, rate, count, begin)
                print(f"{hand.name:46}{rate:10.0f}{row}", flush=True)
                ratio, doubt = row.said / row.held_out, 1.0 / np.sqrt(count)
                wanted.figure(f"{hand.name}, {rate:.0f}/s: ratio", ratio, *RIGHT, doubt * ratio)
    if part in ("", "sensors"):
        print(f"{'sensor, hand':46}{HEAD}")
        for sensor in SENSORS:
            for hand in HANDS[1:3]:
                row = compared(hand, 50.0, count, begin, sensor)
                name = f"{sensor.name}, {hand.name}"
                print(f"{name:46}{50:10}{row}", flush=True)
                ratio, doubt = row.said / row.held_out, 1.0 / np.sqrt(count)
                wanted.figure(f"{name}: ratio", ratio, *RIGHT, doubt * ratio)
    if part in ("", "hidden"):
        print(f"{'hidden, hand':46}{HEAD}  verdicts")
        for hand in (HANDS[0], HANDS[2]):
            for hidden in HIDDEN:
                row = compared(hand, 50.0, count, begin, hidden=hidden)
                print(f"{hidden + ', ' + hand.name:46}{50:10}{row}", flush=True)
    print(wanted)


if __name__ == "__main__":
    main(*sys.argv[1:])
