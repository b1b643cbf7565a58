"""The settle step: the device lies still while its noise is measured."""

from imucal_wizard.procedure.state import Status, StepKind
from imucal_wizard.tui.screens.step_screen import StepScreen
from imucal_wizard.tui.text import Line, bar


class SettleScreen(StepScreen):
    """Hold still for ten seconds or more."""

    step = StepKind.SETTLE

    def progress_words(self, status: Status) -> str:
        """Seconds measured."""
        done, wanted = status.progress
        return f"{done:.0f} of {wanted:.0f} s measured"

    def hold_row(self, status: Status) -> Line:
        """The step's own progress: the hold is the whole step."""
        done, wanted = status.progress
        share = done / wanted if wanted > 0 else 0.0
        return (
            ("HOLD    ", "strong"),
            (bar(share, 24), "good"),
            (f" {done:.1f} of {wanted:.0f} s", ""),
        )
