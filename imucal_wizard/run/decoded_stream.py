"""The stream of an engine: its decoded bytes, the health of its link, its notifications."""

from collections.abc import Iterator, Sequence

from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.readings import Readings
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.run.snapshot import StreamStatus

MAX_SILENCE_SECONDS = 3.0
"""Seconds without data after which silence is a problem."""

_SILENT = "is the device switched on and sending, and is the baud rate right?"


class LinkHealth:
    """The problems of the stream, the most urgent one first.

    Attributes:
        connected: whether the port is open.
        busy: whether it is being opened.
    """

    def __init__(self) -> None:
        self.connected, self.busy = True, False
        self._link = ""
        self._last: float | None = None
        self._silent = 0.0

    def link(self, problem: str, *, busy: bool = False) -> None:
        """Set the problem of the port; ``""`` if it is open; ``busy``: it ends by itself."""
        self.connected, self.busy, self._link = not problem, busy, problem
        self._last, self._silent = None, 0.0

    def heard(self, arrival: float) -> None:
        """Data arrived."""
        self._last, self._silent = arrival, 0.0

    def silent(self, arrival: float) -> bool:
        """No data until now; True if the message about it changes."""
        if self._last is None:
            self._last = arrival
        before, self._silent = self._silent, arrival - self._last
        return self._silent >= MAX_SILENCE_SECONDS and int(self._silent) != int(before)

    def stalled(self, intake: Intake) -> str:
        """The reason why no samples arrive although the port is open, or ``""``."""
        if self._link:
            return ""
        return (
            f"No data arrive any more: {_SILENT}"
            if self._silent >= MAX_SILENCE_SECONDS
            else intake.problem
        )

    def problem(self, intake: Intake, journal: str) -> str:
        """The problem and what to do next, or ``""``.

        Args:
            intake: the intake of the stream.
            journal: why what was received is not on the disk yet, or ``""``.
        """
        unwritten = f"the session is {journal}" if journal else ""
        if self._link or unwritten or intake.problem:
            return self._link or unwritten or intake.problem
        if self._silent >= MAX_SILENCE_SECONDS:
            return f"no data for {int(self._silent)} s: {_SILENT}"
        if intake.needs:
            return f"the stream does not state its {', '.join(intake.needs)}: enter it"
        return ""


Notification = tuple[EventKind, str]
_AT_EASE = (StepKind.SOURCE, StepKind.RESULT, StepKind.SAVE)
"""Steps without measurements."""


class Notifications:
    """Notifications that are not events of the procedure, each once."""

    def __init__(self) -> None:
        self._warned: set[str] = set()
        self._stalled = False

    def new(self, step: StepKind, warnings: Sequence[str], stalled: str) -> Iterator[Notification]:
        """The new notifications.

        Args:
            step: the present step.
            warnings: all warnings of the intake so far.
            stalled: the reason why no samples arrive, or "".
        """
        noticed = self._noticed(warnings)
        if step is not StepKind.SOURCE:  # the preview shows it in that step
            yield from ((EventKind.WARNING, text) for text in noticed)
        if step not in _AT_EASE:
            yield from self._flow(stalled)

    def _noticed(self, warnings: Sequence[str]) -> list[str]:
        if len(warnings) == len(self._warned):
            return []
        new = [text for text in warnings if text not in self._warned]
        self._warned.update(new)
        return new

    def _flow(self, stalled: str) -> Iterator[Notification]:
        before, self._stalled = self._stalled, bool(stalled)
        if stalled and not before:
            yield EventKind.STALLED, stalled
        elif before and not stalled:
            yield EventKind.FLOWING, "Samples arrive again."


class DecodedStream:
    """Decodes bytes to samples and collects warnings and problems.

    Args:
        setup: known properties of the stream.
        source: description of the source.

    Attributes:
        source: description of the source; a port adds the device once it is open.
        intake: the intake of the bytes; unused if a recording is played.
        link_health: state of the link.
    """

    def __init__(self, setup: StreamSetup, source: str) -> None:
        self.source = source
        self.link_health = LinkHealth()
        self._setup = setup
        self.restart()

    def restart(self) -> None:
        """Start again with the next bytes and the same setup."""
        self._begin(Intake(self._setup))

    def _begin(self, intake: Intake) -> None:
        self.intake = intake
        self._noted: tuple[str, ...] = ()
        self._notifications = Notifications()

    def read(self, pieces: Sequence[tuple[bytes, float]]) -> Readings | None:
        """The samples in new bytes, each piece with its arrival; None if there are none."""
        for _, arrival in pieces:
            self.link_health.heard(arrival)
        return self.intake.feed_all(pieces)

    def reconfigure(self, setup: StreamSetup) -> Readings | None:
        """Use another setup from now on; returns the samples in the bytes kept so far."""
        intake, readings = self.intake.reconfigured(setup)
        self._setup = setup
        self._begin(intake)
        return readings

    def note(self, texts: Sequence[str]) -> None:
        """Add warnings from elsewhere, each once."""
        self._noted = tuple(dict.fromkeys((*self._noted, *texts)))

    def notifications(self, step: StepKind) -> Iterator[Notification]:
        """The new notifications in a step."""
        stalled = self.link_health.stalled(self.intake)
        return self._notifications.new(step, self.intake.warnings, stalled)

    def status(self, rate: float, samples: int, unwritten: str) -> StreamStatus:
        """The status of the stream for the screens.

        Args:
            rate: samples per second if no bytes are read.
            samples: number of samples that the procedure has received.
            unwritten: why what was received is not on the disk yet, or "".
        """
        intake = self.intake
        return StreamStatus(
            source=self.source,
            format=intake.format,
            connected=self.link_health.connected,
            problem=self.link_health.problem(intake, unwritten),
            busy=self.link_health.busy,
            stalled=bool(self.link_health.stalled(intake)),
            unwritten=unwritten,
            rate=intake.measured_rate if intake.samples > 0 else rate,
            samples=samples,
            lost=intake.lost,
            malformed=intake.malformed,
            digits=intake.digits,
            warnings=tuple(dict.fromkeys((*self._noted, *intake.warnings))),
            needs=intake.needs,
            columns=intake.columns,
            line=intake.preview.line,
            values=intake.preview.values,
        )
