"""Files to readings, one file per file format."""

from typing import TYPE_CHECKING

from imucal_wizard.acquire.files.options import RecordingOptions

if TYPE_CHECKING:
    from imucal_wizard.acquire.files.reader import read_files

__all__ = ["RecordingOptions", "read_files"]


def __getattr__(name: str) -> object:
    """``read_files`` on demand: it needs numpy, which the first screen does not.

    Raises:
        AttributeError: there is no such name here.
    """
    if name == "read_files":
        from imucal_wizard.acquire.files.reader import read_files

        return read_files
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
