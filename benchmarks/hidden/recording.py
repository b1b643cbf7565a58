"""One simulated session of a virtual accelerometer, as far as the program would see it."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.hidden.designs import Plan, Schedule, drawn_schedule
from benchmarks.hidden.noise import MILLI_G, Colour, averaged_rounding, batch_noise
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.rounded import with_rounding
from imucal_wizard.measurement.holds import Hold, mean_and_covariance
from imucal_wizard.simulate import forward
from imucal_wizard.simulate.hidden import Hidden
from imucal_wizard.simulate.sensor import SensorModel

RATE = 100.0
SETTLING = (1.2, 8.0)
"""Time constants of a warm-up, minutes; each recording has one by chance."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """What the program gets.

    Attributes:
        holds: the holds, n of them.
        vibration: mean square in each as measured, (m/s²)², shape (n,).
        schedule: what truly happened.
        foreign: true error of the input that no effect makes, m/s², shape (n, 3).
        noise: true error of each hold's mean by noise, m/s², shape (n, 3).
        drift: mean of what the bias wanders over the session, a part of the bias in it, reading,
            shape (3,).
        step: moment of a step, s.
        settling: time constant of a warm-up, s.
        true_readings: without noise, of new holds: of a schedule, m/s², shape (n, 3).
    """

    holds: tuple[Hold, ...]
    vibration: FloatArray
    schedule: Schedule
    foreign: FloatArray
    noise: FloatArray
    drift: FloatArray
    step: float
    settling: float
    true_readings: Callable[[Schedule], FloatArray]


@dataclass(frozen=True)
class Device:
    """What differs from device to device beside the colour of its noise.

    Attributes:
        rate: samples per second.
        bits: of the converter over ±4 g.
    """

    rate: float = RATE
    bits: int = 14

    @property
    def step(self) -> float:
        """Least significant bit, m/s²."""
        return float(8.0 * STANDARD_GRAVITY / 2**self.bits)


USUAL = Device()


def record(
    plan: Plan,
    colour: Colour,
    hidden: Sequence[Hidden],
    rng: np.random.Generator,
    extra: "Extra | None" = None,
    device: Device = USUAL,
    setting: float | None = None,
    schedule: Schedule | None = None,
) -> Recorded:
    """One session.

    Args:
        plan: what the session is drawn from.
        colour: the noise.
        hidden: the effects.
        rng: chance.
        extra: what is no effect of the catalogue.
        device: its converter and sampling rate.
        setting: moment of a step and time constant of a warm-up, s; by chance when not given.
        schedule: how the session went; drawn from the plan when not given.
    """
    if schedule is None:
        schedule = drawn_schedule(plan, rng)
    sensor = SensorModel.drawn(int(rng.integers(2**31))).accelerometer
    noise, drift = (MILLI_G * part for part in batch_noise(colour, schedule, rng))
    step = float(rng.uniform(0.3, 0.7) * (schedule.end[-1] - schedule.start[0]))
    settling = float(np.exp(rng.uniform(*np.log(SETTLING))))
    moment = (schedule.start[0] + step) / 60.0
    if setting is not None:
        moment = settling = setting / 60.0

    def felt_in(these: Schedule) -> FloatArray:
        c = circumstances(these, moment, settling)
        return STANDARD_GRAVITY * these.up + sum(
            (one.error(c) for one in hidden), np.zeros((len(these.up), 3))
        )

    felt, foreign = felt_in(schedule), np.zeros_like(schedule.up)
    if extra is not None:
        foreign = extra.error(schedule, rng) * MILLI_G
    felt += foreign
    vibration = schedule.vibration * STANDARD_GRAVITY**2
    dither = np.sqrt((colour.density * MILLI_G) ** 2 * device.rate / 2.0 + vibration / 3.0)
    means = (felt[:, None, :] + noise) @ sensor.sensitivity.T + sensor.bias
    rounded = averaged_rounding(means, device.step, dither[:, None, None])
    measured = vibration + 3.0 * (colour.density * MILLI_G) ** 2 * device.rate / 2.0
    measured = measured * (1.0 + 0.03 * rng.standard_normal(len(measured)))

    def true_readings(these: Schedule) -> FloatArray:
        return np.asarray(felt_in(these) @ sensor.sensitivity.T + sensor.bias)

    holds = _holds(schedule, rounded, device)
    of_noise, drift = noise.mean(axis=1), drift @ sensor.sensitivity.T
    return Recorded(
        holds=holds,
        vibration=measured,
        schedule=schedule,
        foreign=foreign,
        noise=of_noise,
        drift=drift,
        step=60.0 * moment,
        settling=60.0 * settling,
        true_readings=true_readings,
    )


def circumstances(schedule: Schedule, step: float, settling: float) -> forward.TrueCircumstances:
    """What the forward equations need, one row per hold; ``step`` and ``settling`` in minutes."""
    n = len(schedule.up)
    moments, first = np.unique(schedule.middle, return_index=True)
    shown = schedule.temperature[first]
    slope = np.gradient(shown, moments) if len(moments) > 1 else np.zeros(1)
    return forward.TrueCircumstances(
        force=schedule.up,
        rate=np.zeros((n, 3)),
        temperature=schedule.temperature,
        minutes=schedule.middle / 60.0,
        previous=schedule.previous,
        vibration=np.sqrt(schedule.vibration / 3.0)[:, None] * np.ones(3),
        attitude=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)),
        sensed=schedule.up,
        step=step,
        settling=settling,
        warming=np.interp(schedule.middle, moments, slope),
    )


def _holds(schedule: Schedule, batches: FloatArray, device: Device) -> tuple[Hold, ...]:
    temperature = np.round(schedule.temperature * 16.0) / 16.0
    averages = [mean_and_covariance(one) for one in batches]
    holds = tuple(
        Hold(
            start=float(start),
            end=float(end),
            accelerometer=mean,
            accelerometer_covariance=covariance,
            gyroscope=None,
            gyroscope_covariance=None,
            samples=int((end - start) * device.rate),
            temperature=float(warm),
        )
        for start, end, (mean, covariance, _), warm in zip(
            schedule.start, schedule.end, averages, temperature, strict=True
        )
    )
    return tuple(with_rounding(holds, (np.full(3, device.step), None)))


class Extra(ABC):
    """Something that no effect of the catalogue makes."""

    @abstractmethod
    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """Error of the input, mg, shape (n, 3)."""
