"""Which effect is hidden: drawn from the catalogue, in a size that such sensors have."""

import secrets
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.devices.virtual.hidden import TERMS, Hidden
from imucal_wizard.devices.virtual.sensor import SensorModel, Triad
from imucal_wizard.effects.catalogue import builtin_effects
from imucal_wizard.effects.effect import MAGNETOMETER, Effect, EffectParameter
from imucal_wizard.errors import UsageError

NOISE = {"consumer": 1.0, "industrial": 0.3, "tactical": 0.1}
"""Noise, bias instability and step of a sensor of each grade, against those of a consumer part."""
UNSEEN = frozenset({"vibration-rectification", "earth-rate", "misalignment"})
"""A support that does not shake, a rate that every gyroscope feels, and an angle that every board
has, make no exercise."""


SENSORS = ("accelerometer", "gyroscope")
"""Those that every recording of an exercise has."""


@dataclass(frozen=True)
class Choice:
    """One place where an effect may hide.

    Attributes:
        sensor: whose.
        effect: which.
        parameter: which of its numbers.
    """

    sensor: str
    effect: Effect
    parameter: EffectParameter


def choices(grade: str, sensors: Sequence[str] = SENSORS) -> list[list[Choice]]:
    """The effects that may be hidden in these sensors, each with its parameters.

    Raises:
        UsageError: there is no such grade.
    """
    if grade not in NOISE:
        raise UsageError(f"no grade {grade!r}; choose one of {', '.join(NOISE)}")
    found = []
    for effect in builtin_effects():
        for sensor in (one for one in effect.sensors if one in sensors):
            known = effect.name in TERMS[sensor] and effect.name not in UNSEEN
            parameters = effect.parameters(sensor) if known else ()
            own = [Choice(sensor, effect, one) for one in parameters if grade in one.grades]
            found += [own] if own else []
    return found


def chance(number: int | None = None) -> np.random.Generator:
    """Where the chance of an exercise comes from: its number, or nobody knows."""
    return np.random.default_rng(secrets.randbits(128) if number is None else [number % 2**63, 8])


def sensors_of(*, magnetometer: bool) -> tuple[str, ...]:
    """The sensors of a device, in any of which an effect may be hidden."""
    return (*SENSORS, MAGNETOMETER) if magnetometer else SENSORS


def draw(rng: np.random.Generator, grade: str, sensors: Sequence[str] = SENSORS) -> Hidden:
    """An effect by chance: any with the same chance, then any of its axes, size and sign.

    The size is from the upper half, by ratio, of what sensors of this grade have: the lower half
    drowns in the noise of one session more often than not.

    Args:
        rng: where chance comes from.
        grade: ``consumer``, ``industrial`` or ``tactical``.
        sensors: that it may be hidden in.
    """
    among = choices(grade, sensors)
    chosen = among[int(rng.integers(len(among)))]
    choice = chosen[int(rng.integers(len(chosen)))]
    low, high = choice.parameter.grades[grade]
    size = float(np.exp(rng.uniform(0.5 * np.log(low * high), np.log(high))))
    signed = size * float(rng.choice((-1.0, 1.0)))
    axes = tuple("xyz".index(letter) for letter in choice.parameter.name)
    return Hidden(choice.sensor, choice.effect.name, float(f"{signed:.3g}"), axes)


def sensor_of(seed: int, grade: str) -> SensorModel:
    """The virtual sensor of a seed, as quiet as its grade."""
    model, share = SensorModel.drawn(seed), NOISE[grade]
    return replace(
        model,
        accelerometer=_quieter(model.accelerometer, share),
        gyroscope=_quieter(model.gyroscope, share),
    )


def _quieter(triad: Triad, share: float) -> Triad:
    return replace(
        triad,
        density=triad.density * share,
        floor=triad.floor * share,
        step=triad.step * share,
    )
