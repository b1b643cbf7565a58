"""Attacks on the program, one module per line of the table: ``python -m benchmarks.attacks``.

A module has ``NUMBER`` (its place in the table), ``ATTACK`` (what is done to the program, in 60
characters at most) and ``run(full)``, which makes the attempts and returns their ``Outcome``.
"""

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field


class Clock:
    """When an attack makes no further attempts.

    Attributes:
        end: on ``time.monotonic``.
    """

    end = float("inf")

    def allow(self, minutes: float) -> None:
        """Let the attempts of the next attack begin within so many minutes."""
        self.end = time.monotonic() + 60.0 * minutes

    def attempts(self, count: int) -> Iterator[int]:
        """The numbers of so many attempts, or of those that begin in time; there is a first one."""
        for number in range(count):
            if number and time.monotonic() > self.end:
                return
            yield number


CLOCK = Clock()


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
