"""Does the stream flow: the port, the silence, what is not known; and what to do about it."""

from imucal_wizard.devices.intake import Intake

SILENCE = 3.0
"""Seconds without data after which the silence is a problem."""

_SILENT = "is the device switched on and sending, and is the speed (--baud) right?"


class Flow:
    """What has gone wrong with the stream, the most pressing first.

    Attributes:
        connected: whether the port is open.
    """

    def __init__(self) -> None:
        self.connected = True
        self._link = ""
        self._last: float | None = None
        self._silent = 0.0

    def link(self, problem: str) -> None:
        """The port is open (``""``), or what is wrong with it."""
        self.connected, self._link = not problem, problem
        self._last, self._silent = None, 0.0

    def heard(self, arrival: float) -> None:
        """Data came."""
        self._last, self._silent = arrival, 0.0

    def silent(self, arrival: float) -> bool:
        """No data until now; whether that has something new to say."""
        if self._last is None:
            self._last = arrival
        before, self._silent = self._silent, arrival - self._last
        return self._silent >= SILENCE and int(self._silent) != int(before)

    def stalled(self, intake: Intake) -> str:
        """Why no samples come although the port is open, or ``""``."""
        if self._link:
            return ""
        return f"No data comes any more: {_SILENT}" if self._silent >= SILENCE else intake.problem

    def problem(self, intake: Intake, journal: str) -> str:
        """What is wrong and what to do, or ``""``.

        Args:
            intake: what reads the stream.
            journal: why nothing is written down at present, or ``""``.
        """
        unwritten = f"the session is {journal}" if journal else ""
        if self._link or unwritten or intake.problem:
            return self._link or unwritten or intake.problem
        if self._silent >= SILENCE:
            return f"no data for {int(self._silent)} s: {_SILENT}"
        if intake.needs:
            return f"the stream does not say its {', '.join(intake.needs)}: please say it"
        return ""
