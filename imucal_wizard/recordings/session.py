"""The bytes that a session keeps, decoded again."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from imucal_wizard.devices.intake import Intake, StreamSetup
from imucal_wizard.devices.setup import named_columns
from imucal_wizard.errors import RecordingError, SessionError, UsageError
from imucal_wizard.readings import Readings, Series, join
from imucal_wizard.recordings import session_file
from imucal_wizard.recordings.columns import Samples
from imucal_wizard.recordings.options import UNIT_OPTION, RecordingOptions

_OPTION = {
    **{f"{sensor} unit": option for sensor, option in UNIT_OPTION.items()},
    "columns": "--columns",
    "rate": "--rate",
}


def read_session(path: Path, options: RecordingOptions) -> Samples:
    """The samples of a session, from the bytes that were written down.

    Raises:
        SessionError: the file cannot be read.
        RecordingError: its bytes do not give samples.
    """
    about, pieces = session_file.read_raw(path)
    try:
        setup = StreamSetup.from_json(about.get("setup", {}))
    except (UsageError, AttributeError) as error:
        raise SessionError(f"{path} lacks its settings ({error}); begin a new session") from error
    if not pieces:
        raise RecordingError("nothing was received in this session; resume it and measure")
    return _decoded(pieces, _with_options(setup, options))


def _with_options(setup: StreamSetup, options: RecordingOptions) -> StreamSetup:
    """The setup with what the user said over it."""
    columns = named_columns(",".join(options.columns)) if options.columns else setup.columns
    return replace(
        setup,
        columns=columns,
        rate=options.rate or setup.rate,
        accelerometer_unit=options.accelerometer_unit or setup.accelerometer_unit,
        gyroscope_unit=options.gyroscope_unit or setup.gyroscope_unit,
        magnetometer_unit=options.magnetometer_unit or setup.magnetometer_unit,
    )


def _decoded(pieces: Iterable[tuple[float, bytes]], setup: StreamSetup) -> Samples:
    intake = Intake(setup)
    parts = [intake.feed(data, arrival) for arrival, data in pieces]
    found = [part for part in (*parts, intake.flush()) if part is not None]
    if not found:
        raise RecordingError(_why_nothing(intake))
    return Samples(_series(join(found)), _notes(intake))


def _series(readings: Readings) -> dict[str, Series]:
    names = ("accelerometer", "gyroscope", "magnetometer", "temperature")
    found = {name: getattr(readings, name) for name in names}
    return {name: series for name, series in found.items() if series is not None and len(series)}


def _why_nothing(intake: Intake) -> str:
    if intake.needs:
        options = " and ".join(_OPTION.get(need, need) for need in intake.needs)
        return f"the stream does not say its {', '.join(intake.needs)}; give {options}"
    if intake.problem:
        return intake.problem
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
