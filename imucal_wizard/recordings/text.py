"""The bytes of a text file as text, whatever program wrote it."""

import codecs
import gzip
import io
import zlib
from pathlib import Path

from imucal_wizard.devices.garbage import binary_protocol
from imucal_wizard.errors import RecordingError
from imucal_wizard.recordings.foreign import foreign

_SQLITE = b"SQLite format 3\0"
_LOOKED_AT = 65_536
_MOST_GARBAGE = 0.05
_TEXT_BYTES = bytes([7, 8, 9, 10, 12, 13, 27, *range(32, 127), *range(128, 256)])
_GZIP = b"\x1f\x8b"
MOST = 2_000_000_000
"""Bytes of a recording: ten hours at 1,000 samples/s."""
_TOO_LARGE = "larger than 2 GB; cut it into shorter recordings, a calibration needs ten minutes"
_WIDE = 0.7
"""Text of two bytes per character has nothing in more than this share of one of them."""
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
        RecordingError: it cannot be read, is empty, or is no file.
    """
    try:
        if path.is_char_device():  # reading one would never end
            raise RecordingError(
                f"{path} is a port and no recording; listen to it with imucal-wizard --port {path}"
            )
        with path.open("rb") as file:
            data = file.read(MOST + 1)
    except FileNotFoundError:
        raise RecordingError(f"{path}: there is no such file; check the name") from None
    except IsADirectoryError:
        raise RecordingError(f"{path} is a folder; give the files in it") from None
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise RecordingError(f"{str(path)!r} is no name of a file: {error}") from None
    if not data.strip():
        raise RecordingError(f"{path} is empty; record again")
    if len(data) > MOST:
        raise RecordingError(f"{path} is {_TOO_LARGE}")
    return data


def decode(data: bytes) -> str:
    """The text of a file, with one newline at the end of each line.

    Raises:
        RecordingError: the bytes are not text.
    """
    if data.startswith(_GZIP):
        data = _unpacked(data)
    if says := foreign(data):
        raise RecordingError(says)
    if encoding := _utf16(data):
        return _lines(data.decode(encoding, errors="replace"))
    data = data.removeprefix(codecs.BOM_UTF8).rstrip(b"\0")
    start = data[:_LOOKED_AT]
    if len(start.translate(None, _TEXT_BYTES)) > _MOST_GARBAGE * len(start):
        raise RecordingError(_no_text(start))
    data = data.replace(b"\0", b"")
    try:
        return _lines(data.decode("utf-8"))
    except UnicodeDecodeError:
        return _lines(data.decode("latin-1"))


def _unpacked(data: bytes) -> bytes:
    """What gzip has made small.

    Raises:
        RecordingError: it is damaged, or too large.
    """
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
            content = file.read(MOST + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise RecordingError(
            f"it is compressed by gzip and damaged ({error}); unpack it with gunzip, which says"
            " how much of it can be saved"
        ) from error
    if len(content) > MOST:
        raise RecordingError(f"unpacked it is {_TOO_LARGE}")
    return content


def _utf16(data: bytes) -> str:
    """The encoding of text with two bytes per character, also where it does not say it; or ""."""
    if data.startswith(_UTF16):
        return "utf-16"
    start = data[: _LOOKED_AT & ~1]
    even, odd = start[::2].count(0), start[1::2].count(0)
    for few, many, encoding in ((even, odd, "utf-16-le"), (odd, even, "utf-16-be")):
        if many > _WIDE * len(start) / 2 and few < _MOST_GARBAGE * len(start) / 2:
            return encoding
    return ""


def _no_text(start: bytes) -> str:
    """What to say of bytes that are no text."""
    if protocol := binary_protocol(start):
        return (
            f"this looks like the binary protocol of {protocol}, which is not read here; switch the"
            " device to text (ASCII) output and record again"
        )
    return (
        "this is not text; give a CSV or a session file. If it was recorded from a serial port, the"
        " speed (--baud) was probably wrong: record again"
    )


def _lines(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text
