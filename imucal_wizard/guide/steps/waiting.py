"""The steps that measure nothing: source, result, save, verdict."""

from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.measurements import KeptHold
from imucal_wizard.guide.state import Status
from imucal_wizard.measurement.stillness import Block

WORDS: dict[StepKind, tuple[str, str]] = {
    StepKind.SOURCE: ("CHOOSE THE SOURCE", "look at the preview, then go on"),
    StepKind.RESULT: ("MEASURED", "look at the result; validate it, then save it"),
    StepKind.SAVE: ("SAVE THE RESULT", "choose where the calibration is written"),
    StepKind.VERDICT: ("MEASURED", "look at the verdict"),
}


class WaitingStage:
    """Waits for a command.

    Args:
        kind: kind of the step.
    """

    seconds = 0.0
    finished = False
    tally = (0.0, 1.0)

    def __init__(self, kind: StepKind) -> None:
        self._kind = kind

    @property
    def holds_here(self) -> bool:
        """Never: the step needs no hold."""
        return False

    def enter(self) -> None:
        """Nothing to begin."""

    def completed(self, kept: KeptHold) -> None:
        """This step needs no hold."""

    def follow(self, block: Block) -> None:
        """Nothing to follow."""

    def view(self) -> Status:
        """The instruction of the step."""
        instruction, detail = WORDS[self._kind]
        return Status(instruction=instruction, detail=detail)
