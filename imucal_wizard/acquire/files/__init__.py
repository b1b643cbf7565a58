"""Recordings from files: text, binary captures, sessions."""

from pathlib import Path
from typing import TYPE_CHECKING

from imucal_wizard.core.records import dataclass

if TYPE_CHECKING:
    from imucal_wizard.acquire.files.recording_files import read_files

__all__ = ["RecordingOptions", "is_session", "read_files"]
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
    """

    columns: tuple[str, ...] = ()
    rate: float | None = None
    accelerometer_unit: str | None = None
    gyroscope_unit: str | None = None
    magnetometer_unit: str | None = None
    as_format: str | None = None

    def unit(self, sensor: str) -> str | None:
        """The unit given for a sensor, or None."""
        return {
            "accelerometer": self.accelerometer_unit,
            "gyroscope": self.gyroscope_unit,
            "magnetometer": self.magnetometer_unit,
        }.get(sensor)


def is_session(path: Path) -> bool:
    """Whether a file is an SQLite database, as session files are; reading it reports any damage.

    A session whose first page is damaged is known by its name and by its whole pages.
    """
    try:
        if not path.is_file():  # what is read from a pipe is gone
            return False
        with path.open("rb") as file:
            whole = file.read(len(_SQLITE)) == _SQLITE
        size = path.stat().st_size
        return whole or (path.suffix == SUFFIX and size > 0 and size % _PAGE_BYTES == 0)
    except (OSError, ValueError):
        return False


def __getattr__(name: str) -> object:
    """``read_files``, imported on demand because it needs numpy.

    Raises:
        AttributeError: there is no such name here.
    """
    if name == "read_files":
        from imucal_wizard.acquire.files.recording_files import read_files

        return read_files
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
