"""Random choice of the hidden effect of an exercise, in a typical size for the sensor."""

import secrets
from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.catalogue import builtin_effects
from imucal_wizard.model.effect import MAGNETOMETER, Effect, EffectParameter
from imucal_wizard.simulate.hidden import HIDDEN_TERMS, Hidden
from imucal_wizard.simulate.sensor import SensorModel

GRADE_NOISE = {"consumer": 1.0, "industrial": 0.3, "tactical": 0.1}
"""Noise, bias instability and step of a sensor of each grade, relative to a consumer part."""
EXCLUDED_EFFECTS = frozenset({"vibration-rectification", "earth-rate", "misalignment", "clock"})
"""Effects that are not suitable: the support does not vibrate, every gyroscope measures the Earth's
rate, every board has some misalignment, and a clock has no axis to guess."""
INERTIAL_SENSORS = ("accelerometer", "gyroscope")
"""Sensors in every recording of an exercise."""


@dataclass(frozen=True)
class HiddenChoice:
    """An effect and a parameter that may be hidden.

    Attributes:
        sensor: sensor with the effect.
        effect: effect of the catalogue.
        parameter: one of its parameters.
    """

    sensor: str
    effect: Effect
    parameter: EffectParameter


def hidden_choices(
    grade: str, sensors: Sequence[str] = INERTIAL_SENSORS
) -> list[list[HiddenChoice]]:
    """The effects that may be hidden in these sensors, each with its parameters.

    Raises:
        UsageError: there is no such grade.
    """
    if grade not in GRADE_NOISE:
        raise UsageError(f"no grade {grade!r}; choose one of {', '.join(GRADE_NOISE)}")
    found = []
    for effect in builtin_effects():
        for sensor in (one for one in effect.sensors if one in sensors):
            known = effect.name in HIDDEN_TERMS[sensor] and effect.name not in EXCLUDED_EFFECTS
            parameters = effect.parameters(sensor) if known else ()
            own = [HiddenChoice(sensor, effect, one) for one in parameters if grade in one.grades]
            found += [own] if own else []
    return found


def random_generator(number: int | None = None) -> np.random.Generator:
    """Random generator of an exercise: from its number, or from the system's entropy."""
    return np.random.default_rng(secrets.randbits(128) if number is None else [number % 2**63, 8])


def exercise_sensors(*, magnetometer: bool) -> tuple[str, ...]:
    """Sensors of a device in which an effect may be hidden."""
    return (*INERTIAL_SENSORS, MAGNETOMETER) if magnetometer else INERTIAL_SENSORS


def draw_effect(
    rng: np.random.Generator, grade: str, sensors: Sequence[str] = INERTIAL_SENSORS
) -> Hidden:
    """A random effect: first all effects are equally likely, then all axes and both signs.

    The size is log-uniform in the upper half of the range of sensors of this grade. In the lower
    half the noise of one session usually hides the effect.

    Args:
        rng: random numbers.
        grade: ``consumer``, ``industrial`` or ``tactical``.
        sensors: sensors in which it may be hidden.
    """
    among = hidden_choices(grade, sensors)
    chosen = among[int(rng.integers(len(among)))]
    choice = chosen[int(rng.integers(len(chosen)))]
    low, high = choice.parameter.grades[grade]
    size = float(np.exp(rng.uniform(0.5 * np.log(low * high), np.log(high))))
    signed = size * float(rng.choice((-1.0, 1.0)))
    axes = tuple("xyz".index(letter) for letter in choice.parameter.name)
    return Hidden(choice.sensor, choice.effect.name, float(f"{signed:.3g}"), axes)


def virtual_sensor(seed: int, grade: str) -> SensorModel:
    """The virtual sensor of a seed, with the noise of its grade."""
    return SensorModel.drawn(seed).with_noise(GRADE_NOISE[grade])
