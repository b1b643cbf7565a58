"""A session replayed from its file, without withdrawn measurements."""

from pathlib import Path

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import with_options
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.recording import FitOptions, fit_collected
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.kinds import AFTERWARDS, StepKind
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
    """

    collected: Collected
    stream: StreamStatus
    step: StepKind
    gravity: float

    @property
    def finished(self) -> bool:
        """Whether its result was reached."""
        return self.step in AFTERWARDS


def review_session(path: Path, options: RecordingOptions) -> ReviewedSession:
    """Replay a session, as a resume does, without writing.

    Args:
        path: the session.
        options: the user's statements about the stream; they override the session's.

    Raises:
        SessionError: it cannot be read.
    """
    with KeptSession.look(path) as session:
        past = SessionReplay(session, lambda setup: with_options(setup, options))
        engine = past.engine()
        past.replay(engine)
        snapshot = engine.snapshot()
        return ReviewedSession(
            engine.collected(), snapshot.stream, snapshot.status.step, past.settings.gravity
        )


def fit_stream(collected: Collected, stream: StreamStatus, options: FitOptions) -> FitReport:
    """Fit the measurements of a stream.

    Raises:
        DataError: the measurements do not determine a calibration.
    """
    units = {"accelerometer": stream.accelerometer_unit}
    if stream.gyroscope is not None:
        units["gyroscope"] = stream.gyroscope_unit
    return fit_collected(collected, units, stream.rate, options, stream.warnings)
