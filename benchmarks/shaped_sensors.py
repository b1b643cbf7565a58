"""Virtual sensors with a shape that no effect makes, for ``benchmarks.unknown_shape``.

Accelerometers are those of ``benchmarks.hidden``, gyroscopes those of
``benchmarks.gyroscope_bound``, magnetometers those of ``benchmarks.hidden_field``; none shares a
formula with the program.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.could_be import HiddenRate
from benchmarks.gyroscope_bound import RATE, WARMING, WrongRate, fitted
from benchmarks.gyroscope_bound import Device as TurnedDevice
from benchmarks.gyroscope_bound import Session as Turned
from benchmarks.hidden.designs import PLANS, Schedule
from benchmarks.hidden.fitted import measured_of
from benchmarks.hidden.noise import CONSUMER, Colour
from benchmarks.hidden.recording import Extra, record
from benchmarks.hidden_field import recording as field_recording
from benchmarks.hidden_field import sessions, strangers
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DEGREE,
    GYROSCOPE,
    INPUT_OF,
    MAGNETOMETER,
    MILLI_G,
    Circumstances,
)
from imucal_wizard.model.terms import Terms, corrected
from imucal_wizard.model.unknown_shape import NAME
from imucal_wizard.simulate.hidden import HIDDEN_TERMS, Hidden
from imucal_wizard.simulate.samples import VirtualLoad
from tests.estimate.truth import EIGHTEEN, TWENTY_SIX

Course = Callable[[FloatArray, np.random.Generator], FloatArray]
"""Of places from −1 to 1."""
FRESH = 200
"""Inputs at which the true error is told."""


def _bump(at: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.exp(-0.5 * ((at - rng.uniform(-0.9, 0.9)) / rng.uniform(0.1, 0.2)) ** 2)


def _missing_code(at: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.where(at > rng.uniform(-0.9, 0.9), 1.0, 0.0)


def _ripple(at: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.sin(rng.uniform(5.0, 9.0) * at + rng.uniform(0.0, 2.0 * np.pi))


def _dead_zone(at: FloatArray, rng: np.random.Generator) -> FloatArray:
    return -np.clip(at / rng.uniform(0.02, 0.15), -1.0, 1.0)


def _swing(at: FloatArray, rng: np.random.Generator) -> FloatArray:
    return np.sin(np.pi * (rng.uniform(1.5, 4.0) * at + 2.0 * rng.random()))


def _knee(at: FloatArray, rng: np.random.Generator) -> FloatArray:
    """A straight line up to a knee, and none beyond it."""
    return np.minimum(at, rng.uniform(-0.4, 0.4))


@dataclass(frozen=True)
class Shape:
    """A shape that no effect makes.

    Attributes:
        over: ``input``, ``force``, ``time`` or ``current``.
        course: of places from −1 to 1 of that.
    """

    over: str
    course: Course


@dataclass(frozen=True)
class Hiding:
    """What is hidden in one recording.

    Attributes:
        effect: an effect of the catalogue, or None.
        shape: name of a shape, or "".
        size: of the shape, in units of the sensor's.
        axis: of the shape.
        felt: component of the force that it runs over.
        seed: of its course.
    """

    effect: Hidden | None
    shape: str
    size: float
    axis: int
    felt: int
    seed: int


@dataclass(frozen=True, eq=False)
class Fresh:
    """New readings without noise.

    Attributes:
        reading: as the sensor reads, shape (n, 3).
        true: what it should measure, shape (n, 3).
        where: circumstances as the program would have them.
        length: only the length of what it measures is judged.
    """

    reading: FloatArray
    true: FloatArray
    where: Circumstances
    length: bool

    def error(self, bench: Bench) -> float:
        """Rms error of the calibration, SI."""
        fit, known = bench.fit, bench.measured.circumstances
        where = replace(
            self.where,
            gravity=known.gravity,
            field_unit=known.field_unit,
            reference_temperature=known.reference_temperature,
            reference_time=known.reference_time,
        )
        sizes = np.concatenate([np.zeros(0), *fit.sizes])
        terms = Terms(fit.sensor, fit.terms)
        return self.rms(corrected((fit.matrix, fit.bias), terms, sizes, self.reading, where))

    def rms(self, found: FloatArray) -> float:
        """Rms error of corrected readings, SI."""
        if self.length:
            error = np.linalg.norm(found, axis=1) - np.linalg.norm(self.true, axis=1)
        else:
            error = np.linalg.norm(found - self.true, axis=1)
        return float(np.sqrt(np.mean(error**2)))


class Subject(ABC):
    """A kind of sensor, its sessions, and what may be hidden in them.

    Attributes:
        sensor: its kind.
        plans: names of its sessions.
        honest: noises.
        sizes: smallest and largest of a shape.
        shapes: by name.
    """

    sensor: str
    plans: tuple[str, ...]
    honest: tuple[str, ...]
    sizes: tuple[float, float]
    shapes: Mapping[str, Shape]

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects of the catalogue that its sessions can hide."""
        known = HIDDEN_TERMS[self.sensor]
        names = [one.name for one in effects_for(self.sensor) if one.name in known]
        return tuple(name for name in names if name not in ("misalignment", "earth-rate"))

    def hiding(self, what: str, rng: np.random.Generator) -> Hiding:
        """An effect of 0.5 to 3 times its typical size, a shape, or nothing."""
        axis, felt, seed = int(rng.integers(3)), int(rng.integers(3)), int(rng.integers(2**31))
        size = float(np.exp(rng.uniform(*np.log(self.sizes))))
        hidden = None
        if what in self.effects:
            parameters = effect(what).parameters(self.sensor)
            one = parameters[axis if len(parameters) == 3 else int(rng.integers(len(parameters)))]
            largest = one.typical * float(np.exp(rng.uniform(*np.log((0.5, 3.0)))))
            axes = tuple("xyz".index(letter) for letter in one.name if letter in "xyz") or (0,)
            if "all" in one.name:
                axes = (0,)
            hidden = Hidden(self.sensor, what, largest * float(rng.choice((-1.0, 1.0))), axes)
        return Hiding(hidden, what if what in self.shapes else "", size, axis, felt, seed)

    def right(self, hiding: Hiding) -> str:
        """Name of the right curve; "" where none is."""
        if not hiding.shape:
            return ""
        over = self.shapes[hiding.shape].over
        ending = {"input": "", "force": f"-force-{'xyz'[hiding.felt]}"}.get(over, f"-{over}")
        return f"{NAME}/{'xyz'[hiding.axis]}{ending}"

    def shaped(self, hiding: Hiding, places: Mapping[str, FloatArray]) -> FloatArray:
        """Error of the input by a shape, in units of the sensor's, shape (n, 3)."""
        found = np.zeros((len(next(iter(places.values()))), 3))
        if hiding.shape:
            one = self.shapes[hiding.shape]
            course = one.course(places[one.over], np.random.default_rng(hiding.seed))
            found[:, hiding.axis] = hiding.size * course
        return found

    @abstractmethod
    def recorded(
        self, plan: str, noise: str, hiding: Hiding, rng: np.random.Generator
    ) -> tuple[Bench, Fresh]:
        """One session, and new readings of the same sensor."""


def _where(sensor: str, true: FloatArray, **known: FloatArray) -> Circumstances:
    """Circumstances of new readings."""
    none, count = np.zeros_like(true), len(true)
    empty = dict.fromkeys(("force", "rate", "previous"), none) | dict.fromkeys(
        ("temperature", "time", "vibration"), np.zeros(count)
    )
    return Circumstances(**{**empty, **known, INPUT_OF[sensor]: true})  # type: ignore[arg-type] # arrays


class _Accelerometers(Subject):
    """Mean readings of holds; sizes in mg."""

    sensor = ACCELEROMETER
    plans = ("18", "26+12")
    sizes = 0.4, 6.0
    """3 to 50 times the noise of a hold's mean."""
    shapes: Mapping[str, Shape] = {
        "bump": Shape("input", _bump),
        "missing code": Shape("input", _missing_code),
        "ripple": Shape("input", _ripple),
        "dead zone about 0 g": Shape("input", _dead_zone),
        "bias that swings in time": Shape("time", _swing),
    }
    colours: Mapping[str, Colour] = {
        "usual flicker noise": CONSUMER,
        "white noise": replace(CONSUMER, name="white", floor=0.0),
        "four times the flicker": replace(CONSUMER, name="4x", floor=0.12),
        "bias wanders by 0.3 mg/√min": replace(CONSUMER, name="walk", walk=0.3),
        "placing scatters by 0.3 mg": replace(CONSUMER, name="scatter", scatter=0.3),
    }
    honest = tuple(colours)

    def recorded(
        self, plan: str, noise: str, hiding: Hiding, rng: np.random.Generator
    ) -> tuple[Bench, Fresh]:
        """See ``Subject``."""
        subject = self

        class OnAxis(Extra):
            def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
                del rng
                places = {"input": schedule.up[:, hiding.axis]}
                return subject.shaped(hiding, {**places, "time": schedule.middle / 400.0 - 1.0})

        hidden = () if hiding.effect is None else (hiding.effect,)
        extra = OnAxis()
        made = record(PLANS[plan], self.colours[noise], hidden, rng, extra)
        bench = Bench(self.sensor, measured_of(made))
        up, old = _directions(rng), made.schedule
        like = rng.integers(0, len(old.up), FRESH)
        fresh = Schedule(
            up,
            old.start[like],
            old.end[like],
            old.temperature[like],
            old.vibration[like],
            old.shaken[like],
        )
        # the sensor's matrix, from its readings of unit vectors
        unit = replace(fresh, **{name: value[:4] for name, value in vars(fresh).items()})
        ends = made.true_readings(replace(unit, up=np.vstack([np.zeros((1, 3)), np.eye(3)])))
        matrix = (ends[1:] - ends[0]) / STANDARD_GRAVITY
        reading = made.true_readings(fresh) + MILLI_G * extra.error(fresh, rng) @ matrix
        true = STANDARD_GRAVITY * up
        where = _where(
            self.sensor,
            true,
            temperature=fresh.temperature,
            time=fresh.middle,
            previous=np.roll(true, 1, axis=0),
            vibration=fresh.vibration * STANDARD_GRAVITY**2,
        )
        return bench, Fresh(reading, true, where, length=True)


class _Gyroscopes(Subject):
    """Rates at rest, and rotations between rests; sizes in multiples of the noise at rest."""

    sensor = GYROSCOPE
    plans = ("18", "26")
    sizes = 4.0, 60.0
    shapes: Mapping[str, Shape] = {
        "bump over a force": Shape("force", _bump),
        "jump over a force": Shape("force", _missing_code),
        "ripple over a force": Shape("force", _ripple),
        "bump over the rate": Shape("input", _bump),
        "jump over the rate": Shape("input", _missing_code),
        "ripple over the rate": Shape("input", _ripple),
        "bias that swings in time": Shape("time", _swing),
    }
    honest = ("white noise", "flicker of 20 °/h", "0.004 °/s from hold to hold")
    per_rate = 10.0
    """A shape over the rate acts for a second, one at rest for the whole hold."""

    def recorded(
        self, plan: str, noise: str, hiding: Hiding, rng: np.random.Generator
    ) -> tuple[Bench, Fresh]:
        """See ``Subject``."""
        factor = float(np.exp(rng.uniform(*np.log((0.3, 3.0)))))
        rate, force = 0.03 * factor, float(rng.uniform(0.3, 2.0))
        flicker, jitter = (
            value * factor * (name == noise)
            for value, name in zip((0.006, 0.004), self.honest[1:], strict=True)
        )
        samples, poses = int(rng.integers(100, 300)), EIGHTEEN if plan == "18" else TWENTY_SIX
        device = TurnedDevice(
            "", poses, 12, samples, force, (rate, rate, rate), jitter=jitter, flicker=flicker
        )
        session, subject = Turned(device, int(rng.integers(2**31))), self
        seconds = len(session.motions) * (samples / RATE + 5.0)
        unit = np.radians(rate) / np.sqrt(samples)
        if hiding.shape and self.shapes[hiding.shape].over == "input":
            unit *= self.per_rate
        step, settling = (float(one) for one in rng.uniform(0.3, 0.7, 2) * seconds / 60.0)
        hidden = () if hiding.effect is None else (hiding.effect,)
        known = HiddenRate(hidden, step, settling)

        class Wrong(WrongRate):
            def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
                places = {
                    "force": up[:, hiding.felt],
                    "input": np.degrees(rate[:, hiding.axis]) / 250.0,
                    "time": 2.0 * time / seconds - 1.0,
                }
                found = unit * subject.shaped(hiding, places)
                found = found + known.error(time, rate, up)
                return np.asarray(found)

        wrong = Wrong()
        slow = session.wandering(rng) if flicker else None
        found = fitted(*session.recorded(rng, wrong, slow))
        if found.experiment is None:
            raise DataError("a simulated gyroscope has no rows")
        up, time = _directions(rng), rng.uniform(0.0, seconds, FRESH)
        true = np.zeros_like(up)
        if hiding.shape and self.shapes[hiding.shape].over == "input":
            true[:, hiding.axis] = rng.uniform(-100.0, 100.0, FRESH) * DEGREE
        felt = true + wrong.error(time, true, up)
        reading = felt @ session.gyroscope.sensitivity.T + session.gyroscope.bias
        where = _where(
            self.sensor, true, force=STANDARD_GRAVITY * up, time=time, temperature=WARMING.at(time)
        )
        bench = Bench(self.sensor, found.experiment, first=found)
        return bench, Fresh(reading, true, where, length=False)


class _Magnetometers(Subject):
    """Circles and still poses; sizes in µT."""

    sensor = MAGNETOMETER
    plans = ("standard", "repeated")
    sizes = 0.3, 5.0
    shapes: Mapping[str, Shape] = {
        "bump": Shape("input", _bump),
        "missing code": Shape("input", _missing_code),
        "ripple": Shape("input", _ripple),
        "bias that swings in time": Shape("time", _swing),
        "field of a current with a knee": Shape("current", _knee),
    }
    colours: Mapping[str, field_recording.Colour] = {
        "usual flicker noise": field_recording.CONSUMER,
        "five times the flicker": field_recording.Colour(floor=0.05),
        "bias wanders by 0.03 µT/√min": field_recording.Colour(walk=0.03),
    }
    honest = (*colours, "room of 1 µT/m", "room of 4 µT/m")

    def recorded(
        self, plan: str, noise: str, hiding: Hiding, rng: np.random.Generator
    ) -> tuple[Bench, Fresh]:
        """See ``Subject``."""
        seed, subject = int(rng.integers(2**31)), self
        session = sessions.session_of(sessions.PLANS[plan], seed)
        end, strength = session.motion.time[-1], float(np.linalg.norm(session.model.world))
        most = float(session.current.max())

        def places(
            seen: FloatArray, time: FloatArray, current: FloatArray
        ) -> dict[str, FloatArray]:
            return {
                "input": seen[:, hiding.axis] / strength,
                "time": 2.0 * time / end - 1.0,
                "current": 2.0 * current / most - 1.0,
            }

        class Felt(strangers.Extra):
            def error(self, session: sessions.Session, rng: np.random.Generator) -> FloatArray:
                room = float(noise.split()[2]) if noise.startswith("room") else 0.0
                known = places(session.seen, session.motion.time, session.current)
                return subject.shaped(hiding, known) + strangers.Room(room).error(session, rng)

        hidden = () if hiding.effect is None else (hiding.effect,)
        colour = self.colours.get(noise, field_recording.CONSUMER)
        bench = Bench(self.sensor, field_recording.record(session, colour, hidden, rng, Felt()))
        true, time = strength * _directions(rng), rng.uniform(0.0, end, FRESH)
        order = np.argsort(time)
        current = np.empty(FRESH)
        current[order] = VirtualLoad(seed).at(time[order])
        felt = true + self.shaped(hiding, places(true, time, current))
        reading = felt @ session.model.gain.T + session.model.hard_iron
        warm = sessions.PLANS[plan].thermal.at(time)
        where = _where(self.sensor, true, time=time, temperature=warm, current=current)
        return bench, Fresh(reading, true, where, length=True)


def _directions(rng: np.random.Generator) -> FloatArray:
    """Unit vectors all over the sphere, shape (FRESH, 3)."""
    up = rng.standard_normal((FRESH, 3))
    return np.asarray(up / np.linalg.norm(up, axis=1, keepdims=True))


SUBJECTS = {one.sensor: one for one in (_Accelerometers(), _Gyroscopes(), _Magnetometers())}
"""By sensor."""
