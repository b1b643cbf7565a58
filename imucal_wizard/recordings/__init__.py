"""Files to readings, one file per file format."""

from imucal_wizard.recordings.options import RecordingOptions
from imucal_wizard.recordings.reader import read

__all__ = ["RecordingOptions", "read"]
