"""Warnings that other parts of the program ask for, by their kind."""

from collections.abc import Iterable, Mapping, Sequence
from enum import Enum, auto
from typing import Self


class NoticeKind(Enum):
    """What a warning is about."""

    NOT_CALIBRATED = auto()
    """The data do not determine a calibration of the sensor."""
    NOT_ALIGNED = auto()
    """The sensor stays in its own frame."""
    DEAD = auto()
    """An axis shows nothing."""
    CLIPPED = auto()
    """Samples reach the end of the range."""
    CLIPPED_ROTATIONS = auto()
    """Rotations reach the end of the range."""
    CLIPPED_HOLDS = auto()
    """Holds are at the end of the range."""
    STUCK_HOLDS = auto()
    """In some holds an axis repeats one reading."""
    RESTS_LEFT_OUT = auto()
    """In some rests the sensor reads another mean than in the holds; they are left out."""
    SETTLING = auto()
    """The sensor still settles in its holds."""
    GRAVITY_OF_SAMPLES = auto()
    """The samples at rest show a size of gravity that does not fit the unit."""
    SCALE = auto()
    """The fit shows a scale that does not fit the unit or the range."""
    BIAS = auto()
    """The fit shows a bias that no sensor has."""
    AXES = auto()
    """The axes of two sensors do not match."""
    CLOCKS = auto()
    """The clocks of two sensors run at different rates."""
    STEPS_OF_SAMPLES = auto()
    """The samples come in coarse steps."""
    STEPS_OF_HOLDS = auto()
    """The steps decide what the mean of a hold is worth."""
    UNIT_OF_SIZE = auto()
    """The unit of the readings was guessed from their size."""
    GAP = auto()
    """Samples are missing in a rotation for some time."""
    JUMP = auto()
    """A rate jumps in a rotation, as where samples are missing that the times do not show."""
    DISTURBED = auto()
    """Something near the device changes the field at present."""
    CHANGED = auto()
    """The field is another one than before, for good."""
    FIELD_TURNED = auto()
    """The field turned about the vertical during the session."""
    SILENT = auto()
    """The sensor sends nothing."""
    NOT_TURNED = auto()
    """The device rests where it is to be turned."""


UNLIKE_HOLDS = NoticeKind.RESTS_LEFT_OUT, NoticeKind.SETTLING
"""Of a sensor that reads another mean at rest than the means of the holds show."""


class Notice(str):
    """A warning with its kind.

    It is a text, so that a list of warnings remains a list of texts: most of them are only shown.

    Attributes:
        kind: what it is about.
        sensor: whose it is.
    """

    __slots__ = ("kind", "sensor")
    kind: NoticeKind
    sensor: str

    def __new__(cls, text: str, kind: NoticeKind, sensor: str) -> Self:
        """A text of a kind."""
        made = super().__new__(cls, text)
        made.kind, made.sensor = kind, sensor
        return made

    def __reduce__(self) -> tuple[type, tuple[str, NoticeKind, str]]:
        """For the checkpoint of a session."""
        return type(self), (str(self), self.kind, self.sensor)


def not_calibrated(sensor: str, why: object) -> Notice:
    """The warning about a sensor whose calibration the data do not determine."""
    return Notice(f"the {sensor} is not calibrated: {why}", NoticeKind.NOT_CALIBRATED, sensor)


def of_kind(warnings: Iterable[str], *kinds: NoticeKind, sensor: str = "") -> list[Notice]:
    """The warnings of these kinds.

    Args:
        warnings: with and without a kind.
        kinds: those wanted.
        sensor: whose; every sensor's if left out.
    """
    return [
        one
        for one in warnings
        if isinstance(one, Notice) and one.kind in kinds and sensor in ("", one.sensor)
    ]


def not_in_verdicts(warnings: Sequence[str], verdicts: Mapping[str, str]) -> list[str]:
    """The warnings that verdicts shown beside them do not repeat.

    Args:
        warnings: all of them.
        verdicts: in sentences by sensor; each says why the sensor is not calibrated.
    """

    def said(one: str) -> bool:
        if not isinstance(one, Notice) or one.sensor not in verdicts:
            return False
        # a sentence there begins with a capital letter and ends with a full stop
        return one.kind is NoticeKind.NOT_CALIBRATED or one[1:].rstrip(".") in verdicts[one.sensor]

    return [one for one in warnings if not said(one)]


def same_matter(one: str, other: str) -> bool:
    """Whether two statements are of the same kind and about the same sensor."""
    if not isinstance(one, Notice) or not isinstance(other, Notice):
        return False
    return (one.kind, one.sensor) == (other.kind, other.sensor)


def reworded(text: str, warning: str) -> str:
    """Another text of the same kind as a warning."""
    return Notice(text, warning.kind, warning.sensor) if isinstance(warning, Notice) else text


def begun(prefix: str, warning: str) -> str:
    """A warning with words before it, of the same kind."""
    return reworded(prefix + warning, warning)
