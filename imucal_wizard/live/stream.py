"""The stream that an engine reads: what reads its bytes, how well it goes, what is said of it."""

from collections.abc import Iterator, Sequence

from imucal_wizard.devices.intake import Intake, StreamSetup
from imucal_wizard.live.flow import Flow
from imucal_wizard.live.remarks import Remark, Remarks
from imucal_wizard.live.snapshot import StreamStatus
from imucal_wizard.procedure.state import StepKind
from imucal_wizard.readings import Readings


class Stream:
    """Bytes to samples, with everything that is noticed on the way.

    Args:
        setup: what is known of it.
        source: what is read, in words.

    Attributes:
        source: the same; a port tells more once it is open.
        intake: what reads the bytes; it has read none where a recording is played.
        flow: whether anything comes.
    """

    def __init__(self, setup: StreamSetup, source: str) -> None:
        self.source = source
        self.flow = Flow()
        self._setup = setup
        self.restart()

    def restart(self) -> None:
        """Begin again with the next bytes, read in the same way."""
        self._begin(Intake(self._setup))

    def _begin(self, intake: Intake) -> None:
        self.intake = intake
        self._noted: tuple[str, ...] = ()
        self._remarks = Remarks()

    def read(self, pieces: Sequence[tuple[bytes, float]]) -> Readings | None:
        """The samples in new bytes, each piece with its arrival; None when there are none."""
        for _, arrival in pieces:
            self.flow.heard(arrival)
        return self.intake.feed_all(pieces)

    def reconfigure(self, setup: StreamSetup) -> Readings | None:
        """Read in another way from now on; the samples in what is still kept."""
        intake, readings = self.intake.reconfigured(setup)
        self._setup = setup
        self._begin(intake)
        return readings

    def note(self, texts: Sequence[str]) -> None:
        """Keep what somebody else noticed, each once."""
        self._noted = tuple(dict.fromkeys((*self._noted, *texts)))

    def remarks(self, step: StepKind, unwritten: str) -> Iterator[Remark]:
        """What is new and to be said at once.

        Args:
            step: the step at work.
            unwritten: why nothing is written down at present, or "".
        """
        stalled = self.flow.stalled(self.intake)
        return self._remarks.new(step, self.intake.warnings, stalled, unwritten)

    def status(self, rate: float, samples: int, unwritten: str) -> StreamStatus:
        """The stream as the screens show it.

        Args:
            rate: samples per second where no bytes are read.
            samples: how many samples the procedure has been fed.
            unwritten: why nothing is written down at present, or "".
        """
        intake = self.intake
        return StreamStatus(
            source=self.source,
            format=intake.format,
            connected=self.flow.connected,
            problem=self.flow.problem(intake, unwritten),
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
