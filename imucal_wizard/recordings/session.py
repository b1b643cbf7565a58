"""The bytes that a session keeps, decoded again."""

from dataclasses import replace
from pathlib import Path

from imucal_wizard.devices.setup import StreamSetup, named_columns
from imucal_wizard.errors import RecordingError, SessionError, UsageError
from imucal_wizard.recordings import session_file
from imucal_wizard.recordings.columns import Samples
from imucal_wizard.recordings.decoded import decoded
from imucal_wizard.recordings.options import RecordingOptions


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
    samples = decoded(pieces, with_options(setup, options))
    return Samples(samples.series, _taken_back(path) + samples.warnings)


def _taken_back(path: Path) -> tuple[str, ...]:
    """What the samples alone do not tell: that the operator took something back."""
    count = session_file.corrections(path)
    if not count:
        return ()
    times = "once" if count == 1 else f"{count} times"
    says = (
        f"in the wizard something was taken back or repeated {times}; read as a recording, the "
        f"session has all of it. imucal-wizard --resume {path} goes by what was kept"
    )
    return (says,)


def with_options(setup: StreamSetup, options: RecordingOptions) -> StreamSetup:
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
