"""Bytes that a device sent, decoded as a live stream is: of a session, or of a log of its lines."""

from collections.abc import Iterable

from imucal_wizard.devices.intake import Intake, StreamSetup
from imucal_wizard.errors import RecordingError
from imucal_wizard.readings import Readings, Series, join
from imucal_wizard.recordings.columns import Samples
from imucal_wizard.recordings.options import UNIT_OPTION

_OPTION = {
    **{f"{sensor} unit": option for sensor, option in UNIT_OPTION.items()},
    "columns": "--columns",
}


class UnknownColumnsError(RecordingError):
    """Nothing says which number is what."""


def decoded(
    pieces: Iterable[tuple[float, bytes]], setup: StreamSetup, *, live: bool = True
) -> Samples:
    """The samples in bytes.

    Args:
        pieces: arrival time in seconds and bytes, in order.
        setup: what is known of the stream.
        live: whether the arrival times are those of the device.

    Raises:
        UnknownColumnsError: nothing says which number is what.
        RecordingError: the bytes do not give samples.
    """
    intake = Intake(setup, compare_arrivals=live)
    parts = [intake.feed(data, arrival) for arrival, data in pieces]
    found = [part for part in (*parts, intake.flush()) if part is not None]
    if not found:
        kind = UnknownColumnsError if "columns" in intake.needs else RecordingError
        raise kind(_why_nothing(intake, live))
    return Samples(_series(join(found)), _notes(intake))


def _series(readings: Readings) -> dict[str, Series]:
    names = ("accelerometer", "gyroscope", "magnetometer", "temperature", "current")
    found = {name: getattr(readings, name) for name in names}
    return {name: series for name, series in found.items() if series is not None and len(series)}


def _why_nothing(intake: Intake, live: bool) -> str:
    if intake.needs:
        options = " and ".join(_OPTION.get(need, need) for need in intake.needs)
        return f"the stream does not say its {', '.join(intake.needs)}; give {options}"
    if intake.problem:
        return intake.problem
    if intake.format and not live:
        return "it has no time; give the samples per second, for example --rate 100"
    if intake.format:
        return "its rate cannot be told from so few samples; give --rate with samples per second"
    return "no format known here was found in it; give --as with the name of its format"


def _notes(intake: Intake) -> tuple[str, ...]:
    notes = list(intake.warnings)
    if intake.lost:
        notes.append(f"{intake.lost} samples are missing; rotations across a gap are not used")
    if intake.malformed:
        notes.append(f"{intake.malformed} lines or frames could not be read; left out")
    return tuple(notes)
