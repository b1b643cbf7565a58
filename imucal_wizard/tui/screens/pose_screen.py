"""The steps in which poses are held: up/down, the 18 poses, the validation."""

from textual.app import ComposeResult

from imucal_wizard.live.snapshot import Snapshot
from imucal_wizard.procedure.state import Status, StepKind
from imucal_wizard.tui.screens.step_screen import StepScreen
from imucal_wizard.tui.widgets.pose_list import PoseList
from imucal_wizard.tui.widgets.start_table import StartTable


class PoseScreen(StepScreen):
    """Any pose still missing is accepted, whichever is asked for."""

    def __init__(self, step: StepKind) -> None:
        super().__init__()
        self.step = step

    def below(self) -> ComposeResult:
        """The list of poses, or the start values in the up/down step."""
        yield StartTable() if self.step == StepKind.UP_DOWN else PoseList()

    def take(self, snapshot: Snapshot) -> None:
        """Show a snapshot."""
        super().take(snapshot)
        status = snapshot.status
        if self.step == StepKind.UP_DOWN:
            self.query_one(StartTable).tell(status.done, status.wanted, status.start_values)
        else:
            self.query_one(PoseList).tell(
                status.done, status.missing, status.wanted, status.recognised
            )

    def in_place(self, status: Status) -> bool:
        """In a pose that is still missing; anywhere new in the validation."""
        return status.recognised is not None and (
            status.recognised in status.missing or status.recognised == status.wanted
        )

    def progress_words(self, status: Status) -> str:
        """How many poses are done, and whether the one the device is in is among them."""
        words = super().progress_words(status)
        if status.recognised and status.recognised in status.done:
            return f"{words}   ✓ this one is done"
        return words
