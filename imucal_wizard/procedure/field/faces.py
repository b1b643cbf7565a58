"""Which face lies on the table, and since when."""

import numpy as np

from imucal_wizard.procedure.poses import DIRECTIONS, FACES, angle_between, nearest
from imucal_wizard.readings import FloatArray

NEAR_DEG = 25.0
"""A face lies on the table when it points down within this."""
STAYS_DEG = 35.0
"""It does so until it points elsewhere by more."""
STEADY = 1.0
"""Seconds after which a face is there to stay: in a tumble every face passes by."""


class FaceWatch:
    """Follows the face that points down.

    Attributes:
        face: the face that points down now, or None.
        seconds: for how long it has.
    """

    def __init__(self) -> None:
        self.face: str | None = None
        self.seconds = 0.0

    @property
    def steady(self) -> str | None:
        """The face that lies on the table."""
        return self.face if self.seconds >= STEADY else None

    def follow(self, up: FloatArray | None, seconds: float) -> None:
        """Take the next moment.

        Args:
            up: up direction in the body frame, or None where it is not known.
            seconds: how long the moment lasts.
        """
        face = None if up is None else self._pointing_down(up)
        self.seconds = self.seconds + seconds if face == self.face else 0.0
        self.face = face

    def _pointing_down(self, up: FloatArray) -> str | None:
        now = self.face
        if now is not None and np.degrees(angle_between(-up, DIRECTIONS[now])) < STAYS_DEG:
            return now
        return nearest(-up, FACES, NEAR_DEG)
