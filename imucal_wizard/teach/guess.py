"""Judging a student's guess: right, right family, or wrong."""

from enum import StrEnum

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.catalogue import effect, sensor_and_term
from imucal_wizard.simulate.hidden import HIDDEN_TERMS, Hidden


class Outcome(StrEnum):
    """Result of a guess."""

    RIGHT = "right"
    FAMILY = "right family"
    WRONG = "wrong"


@dataclass(frozen=True)
class Guess:
    """A guess, ``TERM:AXIS``, or ``gyroscope/TERM:AXIS`` for other sensors.

    Attributes:
        sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
        term: effect of the catalogue.
        axes: ``x``, or several letters (``xy``: y acts on x).
    """

    sensor: str
    term: str
    axes: str


def split_guess(text: str) -> tuple[str, str, str, str]:
    """Split ``[SENSOR/]TERM[:PARAMETER[:SIGN]]``; what is not given is "".

    Returns:
        Sensor (``accelerometer`` by default), term, parameter, and ``+``, ``−`` or "".

    Raises:
        UsageError: the text has another form.
    """
    name, *others = text.strip().split(":")
    sensor, term = sensor_and_term(name)
    parameter, sign = (*others, "", "")[:2]
    known = {"+": "+", "-": "−", "−": "−", "": ""}
    if not term or sign not in known or len(others) > 2:
        raise UsageError(
            f"the guess {text!r} is not TERM:AXIS, like second-order:x or second-order:x:+"
        )
    return sensor or "accelerometer", term, parameter, known[sign]


def parse_guess(text: str) -> Guess:
    """Parse the guess of an exercise: effect and axis.

    Raises:
        UsageError: another form, or an unknown term or axis.
    """
    sensor, term, axes, _ = split_guess(text)
    name = text.strip().partition(":")[0]
    if sensor not in HIDDEN_TERMS or term not in HIDDEN_TERMS[sensor]:
        there = ", ".join(HIDDEN_TERMS.get(sensor, HIDDEN_TERMS))
        raise UsageError(f"the guess {text!r}: there is no {name}; there is {there}")
    if not axes or not set(axes) <= set("xyz"):
        raise UsageError(
            f"the guess {text!r} is not TERM:AXIS: the axis is x, y or z, or xy if y acts on x"
        )
    return Guess(sensor, term, axes)


def judge_guess(guess: Guess, truth: Hidden) -> tuple[Outcome, str]:
    """The result of a guess and the reason.

    The first letter of an axis name with several letters is enough.
    """
    if (guess.sensor, guess.term) == (truth.sensor, truth.term):
        if truth.letters.startswith(guess.axes):
            return Outcome.RIGHT, "effect and axis"
        return Outcome.FAMILY, f"the effect is right, the axis is {truth.letters}"
    family = effect(truth.term).family
    if guess.sensor == truth.sensor and family and effect(guess.term).family == family:
        return Outcome.FAMILY, f"{guess.term} and {truth.term} are both {family}"
    return Outcome.WRONG, "another effect"
