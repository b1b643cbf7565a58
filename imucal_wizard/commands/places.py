"""Where a command may write: found out before its work, and not after it."""

import argparse
import os
from collections.abc import Sequence
from pathlib import Path

from imucal_wizard.errors import UsageError

STANDARD_OUT = "-"


def file_to_write(text: str) -> Path:
    """A file that can be written, as an option's type; its folder is there already."""
    path = Path(text)
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"{text} is a folder; give a file in it")
    if not path.parent.is_dir():
        raise argparse.ArgumentTypeError(f"there is no folder {path.parent}; make it first")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise argparse.ArgumentTypeError(f"{text} cannot be written; choose another place")
    return path


def spare(files: Sequence[Path], *places: str | Path | None) -> None:
    """Let nothing be written over what is read: what was measured cannot be had again.

    Raises:
        UsageError: a place is one of the files.
    """
    for place in places:
        if place is not None and any(_same(Path(place), file) for file in files):
            raise UsageError(f"{place} is the recording itself: give another name to write to")


def _same(place: Path, file: Path) -> bool:
    try:
        return place.samefile(file)
    except OSError:  # one of them is not there
        return False


def document_place(text: str) -> str:
    """The same for a JSON document, or ``-`` for standard output."""
    return text if text == STANDARD_OUT else str(file_to_write(text))
