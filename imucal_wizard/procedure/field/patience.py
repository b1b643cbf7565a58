"""How long nothing new has come."""

from imucal_wizard.procedure.blocks import ALMOST

SECONDS = 20.0
"""Without progress for so long, the way on is offered."""


class Patience:
    """Waits for progress, in sample time.

    Attributes:
        waiting: seconds since the last progress.
    """

    def __init__(self) -> None:
        self.waiting = 0.0
        self._most = 0.0

    @property
    def over(self) -> bool:
        """Whether the way on is open."""
        return self.waiting >= SECONDS - ALMOST

    def wait(self, seconds: float, progress: float) -> bool:
        """Let some seconds pass; whether that was the last straw.

        Args:
            seconds: how many.
            progress: how far it has come by now, in any measure.
        """
        was_over = self.over
        if progress > self._most:
            self._most, self.waiting = progress, 0.0
        else:
            self.waiting += seconds
        return self.over and not was_over
