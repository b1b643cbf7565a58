"""However the program is stopped, the terminal is as it was before."""

import asyncio
import os
import signal
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from imucal_wizard.tui.driver import TerminalDriver
from tests.terminal.terminal import Terminal, program

LINE_WRAP, CURSOR = 7, 25
"""The modes that are on in a terminal; all others that the program uses are off."""
FIRST = "virtual IMU"
"""On the first screen."""
KEYS = "u undo last"
"""On the screen of every step."""
GONE_SECONDS = 1.0
PATIENCE = 20.0
HANGUP_IGNORED = ("/bin/sh", "-c", "trap '' HUP; exec \"$@\"", "sh")
"""Runs a command as ``nohup`` does: it is not told that its terminal is gone."""


def check_left(terminal: Terminal, before: list[object]) -> None:
    """Everything that the program changed is as before, and it did change something."""
    terminal.pump(0.2)
    assert terminal.settings == before
    on = {mode for mode, is_on in terminal.modes.items() if is_on}
    assert on == {LINE_WRAP, CURSOR}
    received = bytes(terminal.received)
    assert received.count(b"\x1b[?1049h") == received.count(b"\x1b[?1049l") > 0
    assert received.count(b"\x1b[>") == received.count(b"\x1b[<u") > 0  # the keyboard's protocol
    assert b"\x1b[?1003h" in received


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGTERM,
        pytest.param(signal.SIGINT, marks=pytest.mark.study),
        pytest.param(signal.SIGQUIT, marks=pytest.mark.study),
        pytest.param(signal.SIGHUP, marks=pytest.mark.study),
    ],
)
def test_a_signal_that_ends_the_program_leaves_the_terminal_as_it_was(number: int) -> None:
    with Terminal(program("--mute")) as terminal:
        before = terminal.settings
        terminal.wait_for(FIRST)
        assert terminal.settings != before
        os.kill(terminal.pid, number)
        assert terminal.wait(PATIENCE) == 128 + number
        check_left(terminal, before)


def test_a_program_whose_terminal_is_gone_ends_at_once_and_closes_its_session(
    tmp_path: Path,
) -> None:
    command = program("--auto", "--mute", "--sessions", str(tmp_path))
    with Terminal([*HANGUP_IGNORED, *command]) as terminal:
        terminal.wait_for("▸SETTLE")
        begin = time.monotonic()
        terminal.hang_up()
        while terminal.status() is None and time.monotonic() - begin < PATIENCE:
            time.sleep(0.01)
        assert terminal.status() == 128 + signal.SIGHUP
        assert time.monotonic() - begin < GONE_SECONDS
    (session,) = tmp_path.iterdir()  # without the log that SQLite removes when it closes a file
    assert session.suffix == ".imucal"


@pytest.mark.study
def test_a_terminal_that_nobody_reads_does_not_keep_the_program(tmp_path: Path) -> None:
    with Terminal(program("--auto", "--mute", "--sessions", str(tmp_path))) as terminal:
        terminal.wait_for("▸SETTLE")
        time.sleep(3.0)  # the program waits until it can draw the next frame
        begin = time.monotonic()
        os.kill(terminal.pid, signal.SIGHUP)
        while terminal.status() is None and time.monotonic() - begin < PATIENCE:
            time.sleep(0.01)
        assert terminal.status() == 128 + signal.SIGHUP
        assert time.monotonic() - begin < GONE_SECONDS


@pytest.mark.study
def test_a_shell_can_suspend_the_program_and_bring_it_back(tmp_path: Path) -> None:
    """By Ctrl-Z, and by a stop that no program can prepare for."""
    command = " ".join(program("--auto", "--mute", "--sessions", str(tmp_path)))
    shell = ["bash", "--norc", "--noprofile", "--noediting", "-i"]
    with Terminal(shell, environment={"PS1": "ready> "}) as terminal:
        terminal.wait_for("ready>")
        before = terminal.settings
        terminal.press(f"{command}\n")
        terminal.wait_for(KEYS)
        terminal.press("\x1a")
        terminal.wait_for("Stopped")
        check_left(terminal, before)
        terminal.screen.reset()
        terminal.press("fg\n")
        terminal.wait_for(KEYS)
        assert terminal.settings != before
        os.kill(job(terminal), signal.SIGSTOP)
        terminal.wait_for("Stopped")
        terminal.press("fg\n")
        terminal.wait_for(lambda _: terminal.received.count(b"\x1b[?1049h") == 3)  # taken again
        terminal.press("q")
        terminal.wait_for("continue with")
        check_left(terminal, before)


@pytest.mark.parametrize("number", [signal.SIGCONT, signal.SIGTSTP])
async def test_a_signal_in_the_middle_of_drawing_is_handled_after_it(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The app may hold the lock of its output, for which a handler that writes waits for ever."""
    steps: list[str] = []
    app = SimpleNamespace(
        _loop=asyncio.get_running_loop(), refresh=lambda **_: steps.append("drawn")
    )
    before = {one: signal.getsignal(one) for one in (signal.SIGCONT, signal.SIGTSTP)}
    monkeypatch.setattr(signal, "pthread_kill", lambda *_: steps.append("stopped"))
    try:
        driver = TerminalDriver(cast("Any", app))
        monkeypatch.setattr(driver, "_drawing", True)
        monkeypatch.setattr(driver, "suspend_application_mode", lambda: steps.append("left"))
        signal.raise_signal(number)
        assert steps == []
        await asyncio.sleep(0)
        assert steps == ["left", *["stopped"] * (number == signal.SIGTSTP), "drawn"]
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)


def job(terminal: Terminal) -> int:
    """The process that the shell has started."""
    children = Path(f"/proc/{terminal.pid}/task/{terminal.pid}/children")
    return int(children.read_text().split()[0])
