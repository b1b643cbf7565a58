"""Steps in which nothing is measured: source, result, save."""

from imucal_wizard.procedure.ledger import KeptHold
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.state import Status, StepKind

WORDS: dict[StepKind, tuple[str, str]] = {
    StepKind.SOURCE: ("CHOOSE THE SOURCE", "look at the preview, then go on"),
    StepKind.RESULT: ("MEASURED", "look at the result; validate it, then save it"),
    StepKind.SAVE: ("SAVE THE RESULT", "choose where the calibration is written"),
}


class PlainStage:
    """Waits for a command."""

    seconds = 0.0
    finished = False
    tally = (0.0, 1.0)

    def __init__(self, kind: StepKind) -> None:
        self._kind = kind

    def enter(self) -> None:
        """Nothing to prepare."""

    def completed(self, kept: KeptHold) -> None:
        """No hold is asked for."""

    def follow(self, moment: Moment) -> None:
        """Nothing to follow."""

    def view(self) -> Status:
        """What to do on this screen."""
        instruction, detail = WORDS.get(self._kind, ("", ""))
        return Status(instruction=instruction, detail=detail)
