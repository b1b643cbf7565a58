"""What the bench asks for: exactly these poses and turns, then back to the result and the bench."""

from typing import ClassVar

from textual.app import ComposeResult

from imucal_wizard.live.snapshot import Snapshot
from imucal_wizard.procedure.poses import POSE_TOLERANCE_DEG
from imucal_wizard.procedure.state import Status, StepKind
from imucal_wizard.tui.cube import Matrix
from imucal_wizard.tui.screens.rotation_screen import ENOUGH_DEG, swinging
from imucal_wizard.tui.screens.step_screen import StepScreen
from imucal_wizard.tui.text import Line, line, wrapped
from imucal_wizard.tui.widgets.key_footer import Keys
from imucal_wizard.tui.widgets.pose_list import PoseList
from imucal_wizard.tui.widgets.rotation_panel import RotationPanel


class MoreScreen(StepScreen):
    """Any pose still missing is accepted; turns come after the poses."""

    step = StepKind.MORE
    keys: ClassVar[Keys] = (
        ("?", "help"),
        ("u", "undo last"),
        ("s", "enough: to the bench"),
        ("r", "repeat all"),
        ("m", "sound"),
        ("q", "quit"),
    )

    def below(self) -> ComposeResult:
        """The poses asked for, or the turn under way."""
        yield PoseList()
        yield RotationPanel()

    def take(self, snapshot: Snapshot) -> None:
        """Show a snapshot."""
        super().take(snapshot)
        status = snapshot.status
        poses, turn = self.query_one(PoseList), self.query_one(RotationPanel)
        poses.display, turn.display = status.rotation is None, status.rotation is not None
        if status.rotation is not None:
            turn.tell(status.rotation)
        else:
            poses.tell(status.done, status.missing, status.wanted, status.recognised)

    def action_skip(self) -> None:
        """Back with what there is: nothing is lost by it."""
        self.wizard.order("skip")

    def in_place(self, status: Status) -> bool:
        """In the pose asked for or another one missing; at the end of a turn that counts."""
        if status.rotation is not None:
            return abs(status.rotation.angle) > ENOUGH_DEG
        here = status.off_by is not None and status.off_by <= POSE_TOLERANCE_DEG
        return here or (status.recognised is not None and status.recognised in status.missing)

    def progress_words(self, status: Status) -> str:
        """How much of what the bench asked for is done."""
        return f"for the bench: {super().progress_words(status)}"

    def say_rows(self, status: Status, width: int) -> list[Line]:
        """The way first: some of these poses have no name to go by."""
        rows = [line(self.progress_words(status), "accent")]
        rows += wrapped(status.guidance, width, "strong") if status.guidance else []
        rows += wrapped(status.detail, width) if status.detail else []
        return rows + (wrapped(status.reason, width, "quiet") if status.reason else [])

    def wanted_attitude(self, status: Status, now: Matrix) -> tuple[Matrix | None, str]:
        """The pose, or the turn that is meant."""
        if status.rotation is not None:
            return swinging(status, now)
        return super().wanted_attitude(status, now)
