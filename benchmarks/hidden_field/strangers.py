"""Changes of the field that no effect of a magnetometer makes."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from benchmarks.hidden_field.sessions import Session
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.simulate import attitude

WIDTH = (1.0, 4.0)
"""Half of the time that steel takes to pass, s."""
PLACE = 0.1
"""How far from one another the device is put down, standard deviation per axis, m."""
ARM = 0.08
"""From the middle of a turn to the magnetometer, m."""


class Extra(ABC):
    """Something that no effect of the catalogue makes."""

    @abstractmethod
    def error(self, session: Session, rng: np.random.Generator) -> FloatArray:
        """Error of the field in the magnetometer's axes, µT, shape (n, 3)."""


@dataclass(frozen=True)
class Steel(Extra):
    """Something of steel passes: a bump of ``size`` µT in the world."""

    size: float

    def error(self, session: Session, rng: np.random.Generator) -> FloatArray:
        """At a time by chance."""
        time = session.motion.time
        moment, width = rng.uniform(time[0], time[-1]), rng.uniform(*WIDTH)
        way = rng.standard_normal(3)
        course = (1.0 + ((time - moment) / width) ** 2) ** -1.5
        there = self.size * course[:, None] * way / np.linalg.norm(way)
        return attitude.to_body(session.motion.attitude, there)


@dataclass(frozen=True)
class Room(Extra):
    """A field that differs from place to place: ``size`` µT per metre, rms of the gradient.

    The device is put down a hand's breadth off each time, and the magnetometer sits aside from the
    middle of its turns.
    """

    size: float

    def error(self, session: Session, rng: np.random.Generator) -> FloatArray:
        """A gradient without curl and divergence, by chance."""
        gradient = rng.standard_normal((3, 3))
        gradient = 0.5 * (gradient + gradient.T)
        gradient -= np.trace(gradient) / 3.0 * np.eye(3)
        gradient *= self.size / float(np.sqrt(np.mean(gradient**2)))
        motion, count = session.motion, len(session.seen)
        arm = rng.standard_normal(3)
        place = ARM * attitude.to_world(
            motion.attitude, np.tile(arm / np.linalg.norm(arm), (count, 1))
        )
        number = np.searchsorted(session.holds[:, 0], motion.time)
        place += PLACE * rng.standard_normal((len(session.holds) + 1, 3))[number]
        return attitude.to_body(motion.attitude, place @ gradient)


@dataclass(frozen=True)
class Jump(Extra):
    """The bias jumps by ``size`` µT on an axis by chance."""

    size: float

    def error(self, session: Session, rng: np.random.Generator) -> FloatArray:
        """At a time between 0.2 and 0.8 of the session."""
        time = session.motion.time
        moment = time[0] + rng.uniform(0.2, 0.8) * (time[-1] - time[0])
        out = np.zeros_like(session.seen)
        out[:, int(rng.integers(3))] = self.size * (time >= moment)
        return out


@dataclass(frozen=True)
class Waves(Extra):
    """A smooth error of the direction of the field, ``size`` µT rms, that no effect makes.

    Three waves over the sphere, each with an amplitude on each axis.
    """

    size: float
    wavenumber: float = 4.0

    def error(self, session: Session, rng: np.random.Generator) -> FloatArray:
        """In directions and with amplitudes by chance."""
        field = session.seen / np.linalg.norm(session.seen, axis=1)[:, None]
        out = np.zeros_like(field)
        for _ in range(3):
            way, amplitude = rng.standard_normal((2, 3))
            along = self.wavenumber * field @ way / np.linalg.norm(way)
            out += np.sin(along + rng.uniform(0.0, 2.0 * np.pi))[:, None] * amplitude
        return np.asarray(self.size * out / np.sqrt((out**2).mean()))
