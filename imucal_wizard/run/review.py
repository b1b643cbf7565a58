"""A session replayed from its file, without withdrawn measurements."""

from pathlib import Path

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import with_options
from imucal_wizard.core.readings import Readings
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.recording import FitOptions, fit_collected
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.kinds import AFTERWARDS, StepKind
from imucal_wizard.guide.steps.recheck import Planner
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.run.session_replay import SessionReplay
from imucal_wizard.run.snapshot import StreamStatus
from imucal_wizard.sessions import KeptSession


@dataclass(frozen=True, eq=False)
class ReviewedSession:
    """The state in which a session was left.

    Attributes:
        collected: the measurements that were not withdrawn.
        stream: the stream.
        step: the step in which the session was left.
        gravity: gravity used by the procedure, m/s².
        seconds: sample time since the start, s.
    """

    collected: Collected
    stream: StreamStatus
    step: StepKind
    gravity: float
    seconds: float

    @property
    def finished(self) -> bool:
        """Whether its result was reached."""
        return self.step in AFTERWARDS


def review_session(
    path: Path, options: RecordingOptions, planner: Planner | None = None
) -> ReviewedSession:
    """Replay a session, as a resume does, without writing.

    Args:
        path: the session.
        options: the user's statements about the stream; they override the session's.
        planner: chooses the poses of a recheck, which decides when it had enough of them.

    Raises:
        SessionError: it cannot be read.
    """
    with KeptSession.look(path) as session:
        past = SessionReplay(session, lambda setup: with_options(setup, options))
        engine = past.engine(planner)
        past.replay(engine)
        snapshot = engine.snapshot()
        status = snapshot.status
        return ReviewedSession(
            engine.collected(),
            snapshot.stream,
            status.step,
            past.settings.gravity,
            status.elapsed,
        )


def fit_stream(
    collected: Collected,
    stream: StreamStatus,
    options: FitOptions,
    readings: Readings | None = None,
) -> FitReport:
    """Fit the measurements of a stream.

    Args:
        collected: the measurements.
        stream: the stream.
        options: gravity and methods.
        readings: its samples, where they are at hand.

    Raises:
        DataError: the measurements do not determine a calibration.
    """
    args = stream.units, stream.rate, options, stream.warnings, readings
    return fit_collected(collected, *args)
