"""Errors that no effect of the catalogue makes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.hidden.designs import Schedule
from benchmarks.hidden.recording import Extra
from imucal_wizard.core.readings import FloatArray

WAVES = 24
"""Zonal harmonics that together make a random field."""


def _axis(rng: np.random.Generator) -> int:
    return int(rng.integers(3))


def _on(axis: int, values: NDArray[np.floating]) -> FloatArray:
    error = np.zeros((len(values), 3))
    error[:, axis] = values
    return error


@dataclass(frozen=True)
class Ripple(Extra):
    """A wavy characteristic of one axis: ``size · sin(ω u + φ)``."""

    size: float
    omega: float = 6.0
    phase: float = 1.0

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance."""
        axis = _axis(rng)
        return _on(axis, self.size * np.sin(self.omega * schedule.up[:, axis] + self.phase))


@dataclass(frozen=True)
class AnyRipple(Extra):
    """A ripple of any frequency and phase."""

    size: float
    omega: tuple[float, float] = (5.0, 12.0)

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance."""
        omega, phase = rng.uniform(*self.omega), rng.uniform(0.0, 2.0 * np.pi)
        return Ripple(self.size, omega, phase).error(schedule, rng)


@dataclass(frozen=True)
class Jump(Extra):
    """A converter's missing code: one axis jumps by ``size`` where its input crosses a value."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """At an input between −0.9 and 0.9 g."""
        axis = _axis(rng)
        return _on(axis, self.size * (schedule.up[:, axis] > rng.uniform(-0.9, 0.9)))


@dataclass(frozen=True)
class Field(Extra):
    """A random smooth field over the sphere of one degree, ``size`` its rms."""

    size: float
    degree: int = 5

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """Radial."""
        poles = rng.standard_normal((WAVES, 3))
        poles /= np.linalg.norm(poles, axis=1, keepdims=True)
        weight = rng.standard_normal(WAVES) * np.sqrt((2 * self.degree + 1) / WAVES)
        one = np.zeros(self.degree + 1)
        one[-1] = 1.0
        waves = np.polynomial.legendre.legval(schedule.up @ poles.T, one)
        return np.asarray(self.size * (waves @ weight)[:, None] * schedule.up)


@dataclass(frozen=True)
class Disturbed(Extra):
    """One hold during which something touched the device."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """Along gravity, in a hold by chance."""
        error = np.zeros_like(schedule.up)
        hold = int(rng.integers(len(error)))
        error[hold] = self.size * rng.choice((-1.0, 1.0)) * schedule.up[hold]
        return error


@dataclass(frozen=True)
class Swing(Extra):
    """A bias that swings slowly, one to four periods in the session."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance."""
        share = (schedule.middle - schedule.start[0]) / (schedule.end[-1] - schedule.start[0])
        phase = 2.0 * np.pi * (rng.uniform(1.0, 4.0) * share + rng.random())
        return _on(_axis(rng), self.size * np.sin(phase))


@dataclass(frozen=True)
class Scatter(Extra):
    """Each placing is off by chance, ``size`` its standard deviation on each axis."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On all axes."""
        return np.asarray(self.size * rng.standard_normal(schedule.up.shape))


@dataclass(frozen=True)
class Stiction(Extra):
    """A mass that sticks short of its place, on the side from which it came."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance."""
        axis = _axis(rng)
        came = np.tanh((schedule.up - schedule.previous)[:, axis] / 0.3)
        return _on(axis, -self.size * came)


@dataclass(frozen=True)
class Bump(Extra):
    """A bump of the characteristic of one axis, about 0.15 g wide."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """At an input between −0.9 and 0.9 g."""
        axis = _axis(rng)
        away = (schedule.up[:, axis] - rng.uniform(-0.9, 0.9)) / 0.15
        return _on(axis, self.size * np.exp(-0.5 * away**2))


@dataclass(frozen=True)
class ScaleStep(Extra):
    """A scale that changes once in the session, by ``size`` in mg/g."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance, in the middle half of the session."""
        axis = _axis(rng)
        length = schedule.end[-1] - schedule.start[0]
        late = schedule.middle > schedule.start[0] + rng.uniform(0.25, 0.75) * length
        return _on(axis, self.size * schedule.up[:, axis] * late)
