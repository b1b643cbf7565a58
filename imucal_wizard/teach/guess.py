"""Judging a student's guess: right, right family, or wrong."""

from enum import StrEnum

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.catalogue import effect
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


def parse_guess(text: str) -> Guess:
    """Parse a guess.

    Raises:
        UsageError: another form, or an unknown term or axis.
    """
    name, _, axes = text.strip().rpartition(":")
    sensor, _, term = name.rpartition("/")
    sensor = sensor or "accelerometer"
    if not name:
        raise UsageError(f"the guess {text!r} is not like second-order:x: write TERM:AXIS")
    if sensor not in HIDDEN_TERMS or term not in HIDDEN_TERMS[sensor]:
        there = ", ".join(HIDDEN_TERMS.get(sensor, HIDDEN_TERMS))
        raise UsageError(f"the guess {text!r}: there is no {name}; there is {there}")
    if not axes or not set(axes) <= set("xyz"):
        raise UsageError(f"the guess {text!r}: the axis is x, y or z, or xy if y acts on x")
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
