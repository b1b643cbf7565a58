"""From the start of the process to the first screen: ``python -m benchmarks.first_paint``."""

import statistics
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass

from benchmarks.measure import HERE, PYTHON, machine, program_environment
from benchmarks.terminal import Terminal

RUNS = 11
BARE = """
from textual.app import App
from textual.widgets import Static
class Bare(App):
    def compose(self):
        yield Static("first words")
Bare().run()
"""


@dataclass(frozen=True)
class Outcome:
    """Seconds from the start of a program to its first screen, and CPU seconds used by then."""

    wall: float
    cpu: float


def first_screen(command: list[str], words: str, environment: Mapping[str, str]) -> Outcome:
    """Run a program until its screen shows these words."""
    with Terminal(command, 80, 24, environment) as terminal:
        wall = terminal.wait_for(words) - terminal.started
        return Outcome(wall, terminal.cpu)


def main() -> None:
    """Print the time to the list of sources, and what a Textual app without anything takes."""
    print(machine())
    print(f"{'':38}{'median s':>9}{'fastest':>9}{'slowest':>9}{'CPU s':>8}")
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as bytecode:
        environment = program_environment(HERE, bytecode)
        programs = {
            "wizard, until the list of sources": (
                [PYTHON, "-m", "imucal_wizard", "--sessions", folder],
                "virtual IMU",
            ),
            "for comparison: Textual with one word": ([PYTHON, "-c", BARE], "first words"),
        }
        runs: dict[str, list[Outcome]] = {name: [] for name in programs}
        for _ in range(RUNS + 1):  # by turns, so that a busy machine disturbs both alike
            for name, (command, words) in programs.items():
                runs[name].append(first_screen(command, words, environment))
    medians = []
    for name, outcomes in runs.items():
        walls = [one.wall for one in outcomes[1:]]
        medians.append(statistics.median(walls))
        cpu = statistics.median(one.cpu for one in outcomes[1:])
        print(
            f"{name:38}{statistics.median(walls):9.2f}{min(walls):9.2f}{max(walls):9.2f}{cpu:8.2f}"
        )
    print(f"the wizard takes {medians[0] / medians[1]:.2f} times as long")
    print(
        "wanted: under 0.7 s, and at most 1.3 times as long "
        f"(of {RUNS} runs, after one that is not counted)"
    )


if __name__ == "__main__":
    main()
