"""What is told of an effect, for a student."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Story:
    """What an author writes about an effect, for a student.

    Attributes:
        what: what happens in the sensor.
        equation: the equation in words.
        signature: what it looks like in the residuals.
        needs: what data reveal it.
    """

    what: str
    equation: str
    signature: str
    needs: str


@dataclass(frozen=True)
class Lesson:
    """All there is to tell about an effect; sizes and costs are computed."""

    what: str
    equation: str
    signature: str
    sizes: str
    needs: str
    cost: str
