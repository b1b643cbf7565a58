"""The wizard is one coroutine: the domain decides which step it is, the screen follows."""

import asyncio
from importlib import import_module
from typing import TYPE_CHECKING

from imucal_wizard.tui.screens.live_screen import LiveScreen
from imucal_wizard.tui.screens.source_screen import SourceScreen

if TYPE_CHECKING:
    from imucal_wizard.tui.app import WizardApp

_SCREENS = "imucal_wizard.tui.screens"
_POSE_STEPS = ("up-down", "poses", "validate")
_MEASURED = ("result", "validate", "save")
"""Steps in which what the fit is made of does not change."""


async def conduct(app: "WizardApp") -> None:
    """Show the screen of the step the machine is in until the app is left.

    A screen ends with the step that the machine has gone to, forwards or backwards.
    """
    first = SourceScreen()
    loading = asyncio.create_task(_load_behind(app, first))
    step = await app.push_screen_wait(first)
    first.seen.set()  # it may have ended before it was drawn
    await loading
    while True:
        if step not in _MEASURED:
            app.report = None
        step = await app.push_screen_wait(screen_for(step))


async def _load_behind(app: "WizardApp", screen: SourceScreen) -> None:
    """Import the other screens while this one is being looked at."""
    await screen.seen.wait()
    await asyncio.to_thread(_load)
    app.services.loaded()


def _load() -> None:
    """Import the screens that need numpy."""
    for name in ("settle", "pose", "rotation", "field", "result", "save", "more"):
        import_module(f"{_SCREENS}.{name}_screen")


def screen_for(step: str) -> LiveScreen:
    """The screen of a step of the machine."""
    if step in _POSE_STEPS:
        from imucal_wizard.procedure.state import StepKind
        from imucal_wizard.tui.screens.pose_screen import PoseScreen

        return PoseScreen(StepKind(step))
    if step == "settle":
        from imucal_wizard.tui.screens.settle_screen import SettleScreen

        return SettleScreen()
    if step == "rotations":
        from imucal_wizard.tui.screens.rotation_screen import RotationScreen

        return RotationScreen()
    if step == "field":
        from imucal_wizard.tui.screens.field_screen import FieldScreen

        return FieldScreen()
    if step == "more":
        from imucal_wizard.tui.screens.more_screen import MoreScreen

        return MoreScreen()
    if step == "result":
        from imucal_wizard.tui.screens.result_screen import ResultScreen

        return ResultScreen()
    if step == "save":
        from imucal_wizard.tui.screens.save_screen import SaveScreen

        return SaveScreen()
    return SourceScreen()
