"""Recordings from files: text, binary captures, sessions; here what needs no numpy."""

from pathlib import Path

from imucal_wizard.core.records import dataclass

_SQLITE = b"SQLite format 3\0"
_PAGE_BYTES = 4096
SUFFIX = ".imucal"
"""The end of a session file's name."""
Batch = list[tuple[bytes, float]] | tuple[bytes, float, float]
"""Pieces with their arrival times, s; or as one, with the arrivals of the last and the first."""


@dataclass(frozen=True)
class RecordingOptions:
    """The user's statements about the files; each overrides a header.

    Attributes:
        columns: names of the columns in their order (``ax``, ``t[ms]``, ``-`` for none).
        rate: samples per second where the file has no time column, Hz.
        accelerometer_unit: unit of the accelerations, or None when the file says it.
        gyroscope_unit: unit of the angular rates.
        magnetometer_unit: unit of the field.
        as_format: name of the format (``imu_tk`` or a wire format), or None to look at the content.
        without: spans of time whose samples are left out, s, in the times of the readings.
    """

    columns: tuple[str, ...] = ()
    rate: float | None = None
    accelerometer_unit: str | None = None
    gyroscope_unit: str | None = None
    magnetometer_unit: str | None = None
    as_format: str | None = None
    without: tuple[tuple[float, float], ...] = ()


def log_of(path: Path) -> Path:
    """The write-ahead log that SQLite keeps beside a file."""
    return path.with_name(f"{path.name}-wal")


def is_session(path: Path) -> bool:
    """Whether a file is an SQLite database, as session files are; reading it reports any damage.

    A session whose first page is damaged is known by its name and by its whole pages. One that may
    be open is known by its name and its log: to close another handle of a file ends all locks of a
    process on it (POSIX), and the next program to close the session would remove the log.
    """
    try:
        if not path.is_file():  # what is read from a pipe is gone
            return False
        if path.suffix == SUFFIX and log_of(path).exists():
            return True
        with path.open("rb") as file:
            whole = file.read(len(_SQLITE)) == _SQLITE
        size = path.stat().st_size
        return whole or (path.suffix == SUFFIX and size > 0 and size % _PAGE_BYTES == 0)
    except (OSError, ValueError):
        return False
