"""An exercise in one sitting: the effect is hidden in the virtual IMU that the wizard opens."""

import secrets
from dataclasses import dataclass
from pathlib import Path

from imucal_wizard.devices.virtual.hidden import Hidden
from imucal_wizard.devices.virtual.sensor import SensorModel
from imucal_wizard.mystery.draw import chance, draw, sensor_of, sensors_of
from imucal_wizard.mystery.exercise import write_answer


@dataclass(frozen=True)
class Sitting:
    """A virtual IMU with an effect that chance has hidden in it.

    Attributes:
        number: the same number is the same exercise.
        grade: how good the sensor is.
        truth: what is hidden.
        hand: seed of the hand and of the noise.
        sensor: its errors but for what is hidden.
        magnetometer: it has one, and an ammeter beside it, and the effect may be its.
    """

    number: int
    grade: str
    truth: Hidden
    hand: int
    sensor: SensorModel
    magnetometer: bool = False


def any_number() -> int:
    """A number that nobody knows."""
    return secrets.randbits(62)


def sitting(number: int, grade: str = "consumer", *, magnetometer: bool = False) -> Sitting:
    """The exercise of a number.

    Args:
        number: the same is the same exercise, with a magnetometer or without.
        grade: of the sensor.
        magnetometer: the device has one.

    Raises:
        UsageError: there is no such grade.
    """
    rng = chance(number)
    truth = draw(rng, grade, sensors_of(magnetometer=magnetometer))
    hand = int(rng.integers(2**62))
    return Sitting(number, grade, truth, hand, sensor_of(hand, grade), magnetometer)


def seal_beside(session: Path, made: Sitting, key: str) -> Path:
    """Write the sealed answer beside a session; ``simulate --reveal`` opens it.

    Raises:
        RecordingError: it cannot be written.
    """
    answer = session.with_suffix(".mystery")
    write_answer(answer, session.name, made.grade, made.truth, key)
    return answer
