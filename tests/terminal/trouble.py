"""A hand that trembles, in a real terminal: every way out is offered and does what it says."""

from pathlib import Path

from tests.terminal.terminal import Terminal

SPEED = "6"
"""Fast enough to be soon done, slow enough for keys to fall between two of the machine's words."""


def a_trembling_hand(binary: str, folder: Path) -> None:
    """Loosened, taken hand-held, measured again; a step skipped, a pose undone, a step repeated."""
    command = [binary, "--speed", SPEED, "--seed", "5", "--sessions", str(folder / "trembling")]
    with Terminal(command) as terminal:
        terminal.wait_for("virtual IMU")
        terminal.press("\r")
        terminal.wait_for("is this what you expect")
        terminal.press("\r")
        terminal.wait_for("▸UP/DOWN")
        terminal.press("T")
        terminal.press(" ")  # in the pose that is taken, no way out would be offered
        _offered(terminal)
        terminal.wait_for("limit 0.")
        terminal.press("t")
        terminal.wait_for("+X taken, 2 of 6")
        terminal.press("u")
        terminal.wait_for("1 of 6 poses taken")
        _offered(terminal)
        terminal.press("l")
        terminal.wait_for("limits ×2")
        _offered(terminal)
        terminal.press("n")
        terminal.wait_for("▸SETTLE")
        for _ in range(6):  # back to +z
            terminal.press("\x1b[A")
        terminal.press("T")
        terminal.wait_for("▸UP/DOWN")
        terminal.wait_for("STILL?  yes")
        _commands(terminal)
        terminal.press("q")
        assert terminal.wait() == 0
    print("trembling: loosened, taken hand-held, measured again; skipped, undone, repeated")


def _offered(terminal: Terminal) -> None:
    """After fifteen seconds all ways out stand there, with the axis that moves and its limit."""
    for words in ("double the limits", "marked hand-held", "measure the noise again", "STILL?  no"):
        terminal.wait_for(words)


def _commands(terminal: Terminal) -> None:
    terminal.press(" ")
    terminal.wait_for("2 of 6 poses taken")
    terminal.press("u")
    terminal.wait_for("was taken back")
    terminal.wait_for("1 of 6 poses taken")
    terminal.press("r")
    terminal.wait_for("repeat Up/down?")
    terminal.press("\r")
    terminal.wait_for("+X taken, 1 of 6")  # where it lies, it is measured anew
    terminal.press("s")
    terminal.wait_for("no start values")
    terminal.press("\r")
    terminal.wait_for("▸18 POSES")
    terminal.wait_for("–Up/down")
