"""Files to readings, one file per file format."""

from typing import TYPE_CHECKING

from imucal_wizard.recordings.options import RecordingOptions

if TYPE_CHECKING:
    from imucal_wizard.recordings.reader import read

__all__ = ["RecordingOptions", "read"]


def __getattr__(name: str) -> object:
    """``read`` when somebody asks for it: numpy comes with it, and the first screen needs neither.

    Raises:
        AttributeError: there is no such name here.
    """
    if name == "read":
        from imucal_wizard.recordings.reader import read

        return read
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
