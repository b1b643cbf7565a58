"""An exercise in the wizard: the effect is hidden in the virtual IMU that the wizard opens."""

import secrets
from pathlib import Path

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.records import dataclass
from imucal_wizard.simulate.hidden import Hidden
from imucal_wizard.simulate.sensor import SensorModel
from imucal_wizard.teach.draw import draw_effect, exercise_sensors, random_generator, virtual_sensor
from imucal_wizard.teach.exercise import ANSWER_SUFFIX, cover_answer
from imucal_wizard.teach.seal import Sealed, seal_text, unseal_text

_COVER, _PARTS = "imucal-wizard", ("salt", "digest", "text")


@dataclass(frozen=True)
class ExerciseSession:
    """A virtual IMU with a randomly hidden effect.

    Attributes:
        number: the same number gives the same exercise.
        grade: grade of the sensor.
        truth: the hidden effect.
        hand: seed of the hand and of the noise.
        sensor: its errors without the hidden effect.
        magnetometer: whether the device has a magnetometer and an ammeter; the effect may then be
            in the magnetometer.
    """

    number: int
    grade: str
    truth: Hidden
    hand: int
    sensor: SensorModel
    magnetometer: bool = False


def random_number() -> int:
    """A random number for an exercise."""
    return secrets.randbits(62)


def draw_exercise_session(
    number: int, grade: str = "consumer", *, magnetometer: bool = False
) -> ExerciseSession:
    """The exercise of a number.

    Args:
        number: the same number gives the same exercise, separately with and without a magnetometer.
        grade: of the sensor.
        magnetometer: whether the device has a magnetometer.

    Raises:
        UsageError: there is no such grade.
    """
    rng = random_generator(number)
    truth = draw_effect(rng, grade, exercise_sensors(magnetometer=magnetometer))
    hand = int(rng.integers(2**62))
    return ExerciseSession(number, grade, truth, hand, virtual_sensor(hand, grade), magnetometer)


def covered_number(number: int) -> dict[str, str]:
    """The number of an exercise as a session stores it: covered against a glance, not secret."""
    sealed = seal_text(str(number), _COVER, secrets.token_bytes(16))
    return {name: getattr(sealed, name).hex() for name in _PARTS}


def uncovered_number(stored: object) -> int:
    """The number that a session stores; sessions of earlier versions store it in clear.

    Raises:
        ValueError: it is none.
    """
    if not isinstance(stored, dict):
        return int(str(stored))
    try:
        sealed = Sealed(*(bytes.fromhex(stored[name]) for name in _PARTS))
        return int(unseal_text(sealed, _COVER))
    except (KeyError, TypeError, DataError) as error:
        raise ValueError("the number of the exercise is damaged") from error


def seal_beside_session(session: Path, made: ExerciseSession, key: str) -> Path:
    """Write the answer beside a session file; the command ``simulate`` reveals it.

    Raises:
        UsageError: it cannot be written.
    """
    answer = session.with_suffix(ANSWER_SUFFIX)
    cover_answer(answer, session.name, made.grade, made.truth, key)
    return answer
