"""Attacks on the program, one module per line of the table: ``python -m benchmarks.attacks``.

A module has ``NUMBER`` (its place in the table), ``ATTACK`` (what is done to the program, in 60
characters at most) and ``run(full)``, which makes the attempts and returns their ``Outcome``.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field


@dataclass
class Outcome:
    """What became of the attempts of one attack.

    Attributes:
        tries: number of attempts.
        lost: what was lost in each attempt that the program did not survive, in a sentence.
        notes: further figures, printed below the line of the table.
    """

    tries: int = 0
    lost: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def count(self, problem: str) -> None:
        """Count one attempt; ``problem`` says what was lost, and is "" if nothing was."""
        self.tries += 1
        if problem:
            self.lost.append(problem)

    def add(self, problems: Iterable[str]) -> None:
        """Count one attempt for each text, as ``count`` does."""
        for problem in problems:
            self.count(problem)

    @property
    def survived(self) -> int:
        """Attempts in which nothing was lost."""
        return self.tries - len(self.lost)
