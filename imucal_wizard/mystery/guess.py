"""A student's guess against the truth: right, the right family, or wrong."""

from dataclasses import dataclass
from enum import StrEnum

from imucal_wizard.devices.virtual.hidden import TERMS, Hidden
from imucal_wizard.effects.catalogue import effect
from imucal_wizard.errors import UsageError


class Outcome(StrEnum):
    """What a guess was worth."""

    RIGHT = "right"
    FAMILY = "right family"
    WRONG = "wrong"


@dataclass(frozen=True)
class Guess:
    """What a student says: ``TERM:AXIS``, another sensor's as ``gyroscope/TERM:AXIS``.

    Attributes:
        sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
        term: of the catalogue.
        axes: ``x``, or all letters where there are more (``xy``: x feels y).
    """

    sensor: str
    term: str
    axes: str


def parse_guess(text: str) -> Guess:
    """Read a guess.

    Raises:
        UsageError: not of that form, or no such term or axis.
    """
    name, _, axes = text.strip().rpartition(":")
    sensor, _, term = name.rpartition("/")
    sensor = sensor or "accelerometer"
    if not name:
        raise UsageError(f"--guess {text!r}: write TERM:AXIS, for instance second-order:x")
    if sensor not in TERMS or term not in TERMS[sensor]:
        there = ", ".join(TERMS.get(sensor, TERMS))
        raise UsageError(f"--guess {text!r}: there is no {name}; there is {there}")
    if not axes or not set(axes) <= set("xyz"):
        raise UsageError(f"--guess {text!r}: the axis is x, y or z, or xy where x feels y")
    return Guess(sensor, term, axes)


def judged(guess: Guess, truth: Hidden) -> tuple[Outcome, str]:
    """What the guess is worth, and why.

    The first letter is enough for an effect whose name of the axis has more.
    """
    letters = "".join("xyz"[axis] for axis in truth.axes)
    if (guess.sensor, guess.term) == (truth.sensor, truth.term):
        if letters.startswith(guess.axes):
            return Outcome.RIGHT, "effect and axis"
        return Outcome.FAMILY, f"the effect is right, the axis is {letters}"
    family = effect(truth.term).family
    if guess.sensor == truth.sensor and family and effect(guess.term).family == family:
        return Outcome.FAMILY, f"{guess.term} and {truth.term} are both {family}"
    return Outcome.WRONG, "another effect"
