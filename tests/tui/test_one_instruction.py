"""Every panel of the screen says the one instruction of the moment, and no other."""

import re
from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import pytest

from imucal_wizard.guide.instruction import present
from imucal_wizard.guide.kinds import Act, StepKind
from imucal_wizard.guide.state import Status
from imucal_wizard.run.snapshot import Snapshot, StreamStatus
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.screens.steps import StepScreen
from imucal_wizard.tui.sources import SourceChoice, SourceKind
from imucal_wizard.tui.text import wrapped
from imucal_wizard.tui.widgets.big_text import BigText
from imucal_wizard.tui.widgets.lines import Lines
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


SAID = (46, 3)
"""Columns and rows for the words of a step in the smallest terminal."""


def test_what_is_to_be_done_fits_the_smallest_terminal() -> None:
    """Progress, the way and the detail; the reason may be left out. The field has more rows."""
    width, height = SAID
    for name, moment in measuring().items():
        status = present(moment)
        if status.step is not StepKind.FIELD:
            words = [text for text in (status.guidance, status.detail) if text]
            assert 1 + sum(len(wrapped(text, width)) for text in words) <= height, (name, words)


NOTHING = StreamStatus(source="/dev/ttyACM0")
PORT = SourceChoice(SourceKind.PORT, "/dev/ttyACM0", "/dev/ttyACM0")
BEFORE_THE_START = {
    "opening": (
        replace(NOTHING, busy=True, problem="opening the port …"),
        "opening the port …", "",
    ),
    "no port": (
        replace(NOTHING, problem="There is no port /dev/ttyACM0. Plug the device in."),
        "not connected", "Plug the device in",
    ),
    "permission denied": (
        replace(NOTHING, problem="No permission to open it. Run 'sudo usermod', log in again."),
        "not connected", "Run 'sudo usermod'",
    ),
    "port gone": (
        replace(fakes.STREAM, connected=False, problem="/dev/ttyACM0 is gone: plug it in again."),
        "not connected", "plug it in again",
    ),
    "open, nothing yet": (replace(NOTHING, connected=True), "waiting for samples", ""),
    "open, nothing that can be read": (
        replace(NOTHING, connected=True, problem="the bytes are no text: is it another baud rate?"),
        "no samples", "another baud rate",
    ),
    "port silent": (
        replace(NOTHING, connected=True, stalled=True, problem="no data for 4 s: is it on?"),
        "no samples", "is it on?",
    ),
    "device falls silent": (
        replace(fakes.STREAM, stalled=True, problem="no data for 4 s: is it on?"),
        "no samples", "is it on?",
    ),
    "unreadable text": (
        replace(NOTHING, connected=True, stalled=True, line="\x81", problem="Set the right speed."),
        "no samples", "Set the right speed",
    ),
    "columns not known": (
        replace(NOTHING, connected=True, needs=("columns",), problem="not stated: enter it"),
        "not known: columns", "c: choose",
    ),
    "disk full": (
        replace(fakes.STREAM, unwritten="no longer being saved", problem="Free some space."),
        "the session is not being saved", "Free some space",
    ),
    "not yet started": (fakes.STREAM, "is this what you expect?", "enter starts"),
}  # fmt: skip
"""A stream before the start, its state, and what the operator is to do; "" for nothing."""
PANELS = ("question", "preview")


@pytest.mark.parametrize("size", [USUAL, LARGE])
async def test_each_state_of_the_source_shows_one_instruction(size: tuple[int, int]) -> None:
    """No state or instruction of another stream is beside it, and none is there twice."""
    source = fakes.FakeSource()
    states = {state for _, state, _ in BEFORE_THE_START.values()}
    tasks = {task for _, _, task in BEFORE_THE_START.values()} - {""}
    app = WizardApp(fakes.services(source), None, PORT)
    async with app.run_test(size=size) as pilot:

        def arrived() -> bool:
            return (
                app.state.snapshot is not None
                and app.state.snapshot.serial == source.snapshot().serial
            )

        def said() -> str:
            panels = (app.screen.query_one(f"#{name}", Lines) for name in PANELS)
            return " ".join(" ".join(panel.plain for panel in panels).split())

        for name, (stream, state, task) in BEFORE_THE_START.items():
            source.stream = stream
            source.say(Status())
            await until(pilot, arrived)
            text = said()
            assert {one: text.count(one) for one in states if one in text} == {state: 1}, name
            shown = {one: text.count(one) for one in tasks if one in text}
            assert shown == ({task: 1} if task else {}), name
            starts = task in ("enter starts", "Free some space")
            await until(pilot, lambda: ("enter start " in seen(pilot)) == starts)  # noqa: B023
