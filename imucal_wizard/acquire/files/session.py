"""The bytes that a session keeps, decoded again."""

from pathlib import Path

from imucal_wizard.acquire.files.options import RecordingOptions
from imucal_wizard.acquire.files.reader import FileSamples, decoded, with_options
from imucal_wizard.acquire.files.text import is_database
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.errors import RecordingError, SessionError, UsageError
from imucal_wizard.core.output import harmless
from imucal_wizard.core.quantities import how_often


def read_session(path: Path, options: RecordingOptions) -> FileSamples:
    """The samples of a session, from the bytes that were written down.

    Raises:
        SessionError: the file cannot be read.
        RecordingError: its bytes do not give samples.
    """
    from imucal_wizard.acquire.files.session_file import read_raw  # SQLite

    about, pieces = read_raw(path)
    try:
        setup = StreamSetup.from_json(about.get("setup", {}))
    except (UsageError, AttributeError) as error:
        raise SessionError(f"{path} lacks its settings ({error}); begin a new session") from error
    if not pieces:
        raise RecordingError("nothing was received in this session; resume it and measure")
    intake = Intake(with_options(setup, options))
    samples = decoded(intake, pieces)
    if samples is None:
        raise RecordingError(_why_nothing(intake), settings=_settings(intake))
    warnings = list(samples.warnings)
    if intake.lost:
        warnings.append(f"{intake.lost} samples are missing; rotations across a gap are not used")
    if intake.malformed:
        warnings.append(f"{intake.malformed} lines or frames could not be read; left out")
    return FileSamples(samples.series, tuple(warnings))


def _settings(intake: Intake) -> tuple[str, ...]:
    return tuple(need.replace(" ", "_") for need in intake.needs)


def _why_nothing(intake: Intake) -> str:
    if intake.needs:
        return f"the stream does not say its {', '.join(intake.needs)}"
    if intake.problem:
        return intake.problem
    if intake.format:
        return "its rate cannot be told from so few samples; give the samples per second"
    return "no format known here was found in it; say which it is"


def is_session(path: Path) -> bool:
    """Whether a file is a session; what is wrong with a damaged one is said when it is read."""
    return is_database(path)


def taken_back(path: Path) -> tuple[str, ...]:
    """What the samples of a file alone do not tell: that the operator took something back.

    Raises:
        SessionError: the file is a session that cannot be read.
    """
    if not is_session(path):
        return ()
    from imucal_wizard.acquire.files.session_file import corrections  # SQLite

    count = corrections(path)
    if not count:
        return ()
    says = (
        f"in the wizard something was taken back or repeated {how_often(count)}; here all samples "
        f"of {harmless(path.name)} count, those as well"
    )
    return (says,)
