"""Errors that no effect of the catalogue makes."""

from collections.abc import Callable
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
class Knee(Extra):
    """A characteristic whose slope changes by ``size`` per g at an input between 0.3 and 0.7 g."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance, in one sense of its input."""
        axis, sense = _axis(rng), rng.choice((-1.0, 1.0))
        beyond = np.maximum(sense * schedule.up[:, axis] - rng.uniform(0.3, 0.7), 0.0)
        return _on(axis, self.size * beyond)


@dataclass(frozen=True)
class Across(Extra):
    """One axis feels the size of the force along another one: ``size · |f_j|``.

    With ``gain`` it is its scale that does: ``size · f_i |f_j|``.
    """

    size: float
    gain: bool = False

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance."""
        axis, other = rng.choice(3, 2, replace=False)
        felt = np.abs(schedule.up[:, other])
        return _on(int(axis), self.size * felt * (schedule.up[:, axis] if self.gain else 1.0))


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


@dataclass(frozen=True)
class AxisTilts(Extra):
    """An axis that tilts towards another one once in the session, by ``size`` in mg/g."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance, in the middle half of the session."""
        axis, other = rng.choice(3, 2, replace=False)
        length = schedule.end[-1] - schedule.start[0]
        late = schedule.middle > schedule.start[0] + rng.uniform(0.25, 0.75) * length
        return _on(int(axis), self.size * schedule.up[:, other] * late)


@dataclass(frozen=True)
class AxisWarms(Extra):
    """An axis whose angle to another one follows the temperature, by ``size`` in mg/g/°C."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance."""
        axis, other = rng.choice(3, 2, replace=False)
        warmer = schedule.temperature - schedule.temperature[0]
        return _on(int(axis), self.size * schedule.up[:, other] * warmer)


@dataclass(frozen=True)
class TwoBumped(Extra):
    """Two holds during which something touched the device, each in its own way."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """Along gravity, in two holds by chance."""
        error = np.zeros_like(schedule.up)
        for hold in rng.choice(len(error), 2, replace=False):
            pushed = self.size * rng.uniform(0.6, 1.4) * rng.choice((-1.0, 1.0))
            error[hold] = pushed * schedule.up[hold]
        return error


@dataclass(frozen=True)
class CubicCross(Extra):
    """A gain of one axis that changes with the square of the force on another."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance."""
        axis, other = rng.choice(3, 2, replace=False)
        return _on(int(axis), self.size * schedule.up[:, axis] * schedule.up[:, other] ** 2)


@dataclass(frozen=True)
class DeadZone(Extra):
    """An axis that does not answer to forces below ``size``, mg, and falls short of larger ones."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance."""
        axis = _axis(rng)
        force = 1000.0 * schedule.up[:, axis]
        answer = np.sign(force) * np.maximum(np.abs(force) - self.size, 0.0)
        return _on(axis, answer - force)


@dataclass(frozen=True)
class ThermalLag(Extra):
    """A bias of ``size`` mg/°C that follows a temperature behind that of the thermometer."""

    size: float

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """On an axis by chance; 20 to 120 s behind."""
        lag, middle = rng.uniform(20.0, 120.0), schedule.middle
        time = np.arange(0.0, middle[-1] + 1.0)
        shown = np.interp(time, middle, schedule.temperature)
        felt = shown.copy()
        for k in range(1, len(time)):
            felt[k] = felt[k - 1] + (shown[k] - felt[k - 1]) / lag
        return _on(_axis(rng), self.size * (np.interp(middle, time, felt) - felt[0]))


@dataclass(frozen=True)
class Visible(Extra):
    """A structure scaled to what bias, scale and angles cannot take up of it.

    Attributes:
        kind: the structure by its size.
        size: rms over the holds of the part along gravity that is no quadratic form of up, mg.
        first: a size to begin with, mg.
    """

    kind: Callable[[float], Extra]
    size: float
    first: float = 1.0

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """Begun anew with the same chance until the size is met; one step where it is linear."""
        size, seed = self.first, int(rng.integers(2**31))
        x, y, z = schedule.up.T
        base = np.stack([x, y, z, x * x, y * y, z * z, x * y, x * z, y * z], axis=1)
        for _ in range(3):
            error = self.kind(size).error(schedule, np.random.default_rng(seed))
            along = (error * schedule.up).sum(axis=1)
            left = along - base @ np.linalg.lstsq(base, along, rcond=None)[0]
            size *= self.size / max(float(np.sqrt(np.mean(left**2))), 1e-3 * self.first)
        return self.kind(size).error(schedule, np.random.default_rng(seed))
