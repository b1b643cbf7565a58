"""What disturbs the field at this moment, said when it begins and when it is over."""

from imucal_wizard.procedure.blocks import ALMOST
from imucal_wizard.procedure.field import words
from imucal_wizard.procedure.field.survey import Survey
from imucal_wizard.procedure.scene import Scene
from imucal_wizard.procedure.state import EventKind

QUIET = 0.4
"""Seconds without a disturbance after which it is over: a loudspeaker has pauses."""


class Disturbance:
    """Follows a disturbance from its beginning to its end.

    Args:
        scene: where it is said.

    Attributes:
        now: what disturbs at this moment, or "".
        lasting: for how long it has, s.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.forget()

    def forget(self) -> None:
        """Nobody knows what the field is by now."""
        self.now = ""
        self.lasting = self._quiet = 0.0

    def follow(self, survey: Survey, unit: str, seconds: float) -> None:
        """Take what the newest moment was judged to be.

        Args:
            survey: the samples.
            unit: theirs.
            seconds: since the last look.
        """
        if not len(survey.disturbed) or not survey.disturbed[-1]:
            self._calm_down(seconds)
            return
        if not self.now:
            text = "The field is disturbed: what comes now is left out."
            self._scene.emit(EventKind.WARNING, text)
        magnitude = None if survey.fit is None else survey.fit.magnitude
        self.now = words.disturbed(float(survey.off[-1]), magnitude, unit)
        self.lasting += seconds
        self._quiet = 0.0

    def _calm_down(self, seconds: float) -> None:
        self._quiet += seconds
        if self.now and self._quiet >= QUIET - ALMOST:
            self.forget()
            self._scene.emit(EventKind.FIELD_BACK, "The field is as before: what comes now counts.")
