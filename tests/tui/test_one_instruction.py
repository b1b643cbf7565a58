"""Every panel of the screen says the one instruction of the moment, and no other."""

import re
from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import pytest

from imucal_wizard.guide.kinds import Act, StepKind
from imucal_wizard.guide.state import Status
from imucal_wizard.run.snapshot import Snapshot
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.screens.steps import StepScreen
from imucal_wizard.tui.widgets.big_text import BigText
from tests.guide.moments import moments
from tests.tui import fakes
from tests.tui.terminals import LARGE, USUAL, app_with
from tests.tui.waiting import seen, until

COMMANDS = r"tip it|turn it|rotate it|lift it|hold it still|put it down|lay it down"
OWN = {
    Act.POSE: {"tip it", "lift it"},
    Act.ROTATE: {"tip it"},
    Act.HOLD: {"hold it still"},
    Act.LIFT: {"lift it"},
    Act.CIRCLE: {"turn it"},
}
"""What may be said in words beside each headline."""


def shown_once(status: Status, text: str, headline: str) -> None:
    """Headline, words, drawing and state row agree."""
    assert headline == status.instruction
    flat = " ".join(text.split())
    found = set(re.findall(COMMANDS, flat))
    if status.act is Act.LAY_DOWN:
        found -= {"lay it down"}  # the advice for a table that shakes
    assert found <= OWN.get(status.act, set()), (headline, found)
    if status.guidance and status.step is not StepKind.FIELD:
        assert flat.count(status.guidance) == 1, status.guidance
    halted = status.act in (Act.CONNECT, Act.ENDED)
    assert "yes ●" not in text or not halted
    arrows = set("→↗↑↖←↙↓↘") & set(text.split("? help", maxsplit=1)[0])
    if status.turn is None:
        assert not arrows, arrows


def arrived(app: WizardApp, wanted: Snapshot) -> bool:
    """The snapshot is on its screen."""
    now, screen = app.state.snapshot, app.screen
    if now is None or now.serial != wanted.serial or not isinstance(screen, StepScreen):
        return False
    return screen.step == wanted.status.step and bool(screen.query(BigText))


@pytest.mark.parametrize("size", [USUAL, pytest.param(LARGE, marks=pytest.mark.study)])
@pytest.mark.parametrize("flow", ["lost", "silent", "ended"])
async def test_each_step_without_samples_shows_one_instruction(
    size: tuple[int, int], flow: str
) -> None:
    """One moment of each step."""
    await walk({status.step: name for name, status in measuring().items()}.values(), size, flow)


@pytest.mark.study
@pytest.mark.parametrize("size", [USUAL, LARGE])
async def test_each_moment_shows_one_instruction(size: tuple[int, int]) -> None:
    """All of them, in the order in which they were reached."""
    await walk(measuring(), size, "samples")


def measuring() -> dict[str, Status]:
    """The moments in which the device is wanted."""
    every = {name: status for name, (_, status) in moments().items()}
    aside = (StepKind.RESULT, StepKind.SAVE)
    return {name: status for name, status in every.items() if status.step not in aside}


async def walk(names: Iterable[str], size: tuple[int, int], flow: str) -> None:
    """Show these moments one after the other."""
    source = fakes.FakeSource(moments()["settle, moving"][1])
    field = (20.0, 3.0, -40.0)
    source.stream = replace(source.stream, magnetometer=field)
    if flow == "lost":
        source.stream = replace(source.stream, connected=False, problem="unplugged: plug it in")
    elif flow == "silent":
        source.stream = replace(source.stream, stalled=True, problem="no data for 4 s: is it on?")
    app = app_with(source)
    async with app.run_test(size=size) as pilot:
        for name in names:
            status = measuring()[name]
            if flow == "ended" and app.state.snapshot is not None:
                source.finished = True
            source.say(status)
            wanted = source.snapshot()
            await until(pilot, partial(arrived, app, wanted))
            big = app.screen.query_one(BigText)
            await pilot.pause()
            try:
                shown_once(wanted.status, seen(pilot), big.text)
            except AssertionError as error:
                raise AssertionError(f"{name}: {error}\n{seen(pilot)}") from error
