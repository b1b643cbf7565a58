"""A session gone through again from its file: what counts is what the operator let stand."""

from dataclasses import dataclass
from pathlib import Path

from imucal_wizard.fitting import FitOptions, fit_collected
from imucal_wizard.live.past import Past
from imucal_wizard.live.snapshot import StreamStatus
from imucal_wizard.procedure.collected import Collected
from imucal_wizard.procedure.commands import AFTERWARDS
from imucal_wizard.procedure.state import StepKind
from imucal_wizard.recordings.options import RecordingOptions
from imucal_wizard.recordings.session import with_options
from imucal_wizard.sessions import KeptSession
from imucal_wizard.solver.result import FitReport


@dataclass(frozen=True, eq=False)
class Reviewed:
    """What a session has come to.

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


def review(path: Path, options: RecordingOptions) -> Reviewed:
    """Go through a session again, as a resume does, without writing.

    Args:
        path: the session.
        options: what the user says of its stream; it goes over what the session knows.

    Raises:
        SessionError: it cannot be read.
    """
    with KeptSession.look(path) as session:
        past = Past(session, lambda setup: with_options(setup, options))
        engine = past.engine()
        past.replay(engine)
        snapshot = engine.snapshot()
        return Reviewed(
            engine.collected(), snapshot.stream, snapshot.status.step, past.settings.gravity
        )


def fit_stream(collected: Collected, stream: StreamStatus, options: FitOptions) -> FitReport:
    """Fit what was collected of a stream.

    Raises:
        DataError: it does not carry a calibration.
    """
    units = {"accelerometer": stream.accelerometer_unit}
    if stream.gyroscope is not None:
        units["gyroscope"] = stream.gyroscope_unit
    return fit_collected(collected, units, stream.rate, options, stream.warnings)
