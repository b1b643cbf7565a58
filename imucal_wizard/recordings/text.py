"""The bytes of a text file as text, whatever program wrote it."""

import codecs
from pathlib import Path

from imucal_wizard.errors import RecordingError

_SQLITE = b"SQLite format 3\0"
_LOOKED_AT = 65_536
_MOST_GARBAGE = 0.05
_TEXT_BYTES = bytes([7, 8, 9, 10, 12, 13, 27, *range(32, 127), *range(128, 256)])
_UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def is_database(path: Path) -> bool:
    """Whether a file is an SQLite database, as session files are."""
    try:
        with path.open("rb") as file:
            return file.read(len(_SQLITE)) == _SQLITE
    except OSError:
        return False


def read_bytes(path: Path) -> bytes:
    """The content of a file.

    Raises:
        RecordingError: it cannot be read, or is empty.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise RecordingError(f"{path}: there is no such file; check the name") from None
    except IsADirectoryError:
        raise RecordingError(f"{path} is a folder; give the files in it") from None
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}") from error
    if not data.strip():
        raise RecordingError(f"{path} is empty; record again")
    return data


def decode(data: bytes) -> str:
    """The text of a file, with one newline at the end of each line.

    Raises:
        RecordingError: the bytes are not text.
    """
    if data.startswith(_UTF16):
        return _lines(data.decode("utf-16", errors="replace"))
    data = data.removeprefix(codecs.BOM_UTF8)
    start = data[:_LOOKED_AT]
    if len(start.translate(None, _TEXT_BYTES)) > _MOST_GARBAGE * len(start):
        raise RecordingError(
            "this is not text; give a CSV or a session file, or say with --as what it is"
        )
    try:
        return _lines(data.decode("utf-8"))
    except UnicodeDecodeError:
        return _lines(data.decode("latin-1"))


def _lines(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text
