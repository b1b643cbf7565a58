"""What the stream is like at one moment, in one picture."""

from imucal_wizard.devices.intake import Intake
from imucal_wizard.live.health import Health
from imucal_wizard.live.snapshot import StreamStatus


def stream_status(
    intake: Intake,
    health: Health,
    *,
    source: str,
    rate: float,
    samples: int,
    unwritten: str,
    noted: tuple[str, ...],
) -> StreamStatus:
    """The stream as the screens show it.

    Args:
        intake: what reads the bytes; it has read none where a recording is played.
        health: whether the port is well.
        source: what is read, in words.
        rate: samples per second where no bytes are read.
        samples: how many samples the procedure has been fed.
        unwritten: why nothing is written down at present, or "".
        noted: what was noticed of a recording.
    """
    return StreamStatus(
        source=source,
        format=intake.format,
        connected=health.connected,
        problem=health.problem(intake, unwritten),
        unwritten=unwritten,
        rate=intake.measured_rate if intake.samples > 0 else rate,
        samples=samples,
        lost=intake.lost,
        malformed=intake.malformed,
        digits=intake.digits,
        warnings=tuple(dict.fromkeys((*noted, *intake.warnings))),
        needs=intake.needs,
        columns=intake.columns,
        line=intake.preview.line,
        values=intake.preview.values,
    )
