"""From the start of the process to the first screen: ``python -m benchmarks.first_paint``."""

import statistics
import tempfile

from benchmarks.measure import PYTHON, machine, median_cost
from benchmarks.terminal import Terminal

RUNS = 9
BARE = """
from textual.app import App
from textual.widgets import Static
class Bare(App):
    def compose(self):
        yield Static("first words")
Bare().run()
"""


def seconds(command: list[str], words: str) -> float:
    """From the start of a program to its first screen with these words."""
    with Terminal(command, 80, 24) as terminal:
        return terminal.wait_for(words) - terminal.started


def main() -> None:
    """Print the time to the list of sources, and what a Textual app without anything takes."""
    print(machine())
    print(f"{'':36}{'median s':>9}{'fastest':>9}{'slowest':>9}")
    with tempfile.TemporaryDirectory() as folder:
        wizard = [PYTHON, "-m", "imucal_wizard", "--sessions", folder]
        for name, command, words in (
            ("wizard, until the list of sources", wizard, "virtual IMU"),
            ("of it a Textual app with one word", [PYTHON, "-c", BARE], "first words"),
        ):
            seconds(command, words)
            runs = [seconds(command, words) for _ in range(RUNS)]
            print(f"{name:36}{statistics.median(runs):9.2f}{min(runs):9.2f}{max(runs):9.2f}")
    for name, code in (("Python alone", "pass"), ("importing textual.app", "import textual.app")):
        print(f"{name:36}{median_cost([PYTHON, '-c', code]).wall:9.2f}")
    print(f"wanted: the wizard under 0.7 s (medians of {RUNS} runs after one that is not counted)")


if __name__ == "__main__":
    main()
