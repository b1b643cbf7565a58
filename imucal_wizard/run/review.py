"""A session replayed from its file, without the measurements that the operator took back."""

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
        collected: what has been measured and not taken back.
        stream: of what.
        step: where the session was left.
        gravity: by which it was carried out, m/s².
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
    """Go through a session again, as a resume does, without writing.

    Args:
        path: the session.
        options: what the user says of its stream; it goes over what the session knows.

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
        DataError: it does not carry a calibration.
    """
    units = {"accelerometer": stream.accelerometer_unit}
    if stream.gyroscope is not None:
        units["gyroscope"] = stream.gyroscope_unit
    return fit_collected(collected, units, stream.rate, options, stream.warnings)
