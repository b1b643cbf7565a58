"""The words of the magnetometer's step."""

from imucal_wizard.procedure.field.survey import Survey
from imucal_wizard.procedure.wording import label
from imucal_wizard.units import COUNT

TURN_ROUND, TURN_ABOUT = "TURN IT ROUND", "TURN IT ABOUT"
"""Instructions: a circle on the face that is down; any motion. They are read from two metres."""


def how_far(off: float, magnitude: float | None, unit: str) -> str:
    """By how much the field is off: "12 µT too much", "8 % too little"."""
    sense = "much" if off > 0.0 else "little"
    if magnitude is None or unit == COUNT:
        return f"{100.0 * abs(off):.0f} % too {sense}"
    return f"{abs(off) * magnitude:.0f} µT too {sense}"


def disturbed(off: float, magnitude: float | None, unit: str) -> str:
    """What happens while the field is not the place's own."""
    far = how_far(off, magnitude, unit)
    return f"the field is disturbed: {far}; these samples are left out"


def left_out(survey: Survey, unit: str) -> tuple[tuple[float, float, str], ...]:
    """What was disturbed: from, to, s, and how."""
    magnitude = None if survey.fit is None else survey.fit.magnitude
    return tuple(
        (start, end, f"the field was {how_far(off, magnitude, unit)}")
        for start, end, off in survey.left()
    )


def lay_down(face: str) -> str:
    """The instruction to lay a face on the table: "LAY −Z DOWN"."""
    return f"LAY {label(face)} DOWN"


def sentence(text: str) -> str:
    """Words as a sentence of their own; µT and names of axes stay as they are."""
    return f"{text[:1].upper()}{text[1:]}." if text else ""
