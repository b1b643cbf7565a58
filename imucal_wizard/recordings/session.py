"""The bytes that a session keeps, decoded again."""

from dataclasses import replace
from pathlib import Path

from imucal_wizard.devices.setup import StreamSetup, named_columns
from imucal_wizard.digits import how_often
from imucal_wizard.errors import RecordingError, SessionError, UsageError
from imucal_wizard.output import harmless
from imucal_wizard.recordings import session_file
from imucal_wizard.recordings.columns import Samples
from imucal_wizard.recordings.decoded import decoded
from imucal_wizard.recordings.options import RecordingOptions
from imucal_wizard.recordings.text import is_database


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
    return decoded(pieces, with_options(setup, options))


def is_session(path: Path) -> bool:
    """Whether a file is a session; what is wrong with a damaged one is said when it is read."""
    return is_database(path)


def taken_back(path: Path) -> tuple[str, ...]:
    """What the samples of a file alone do not tell: that the operator took something back.

    Raises:
        SessionError: the file is a session that cannot be read.
    """
    count = session_file.corrections(path) if is_session(path) else 0
    if not count:
        return ()
    says = (
        f"in the wizard something was taken back or repeated {how_often(count)}; here all samples "
        f"of {harmless(path.name)} count, those as well"
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
