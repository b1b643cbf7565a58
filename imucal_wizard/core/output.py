"""Output of the commands: safe lines for the terminal, and files written atomically."""

import os
import stat
import sys
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from imucal_wizard.core.errors import UsageError

_OBEYED = ("Cc", "Cf", "Cs", "Co")
"""Control, format (direction marks), surrogate and private characters."""


def without_control_characters(text: str) -> str:
    """The text without control characters, except for line ends."""
    if text.replace("\n", "").isprintable():
        return text
    return "".join(
        c if c == "\n" or unicodedata.category(c) not in _OBEYED else "\N{REPLACEMENT CHARACTER}"
        for c in text
    )


def say(text: str) -> None:
    """Write lines to standard output."""
    print(without_control_characters(text))


def note(text: str) -> None:
    """Write lines to standard error."""
    print(without_control_characters(text), file=sys.stderr)


def replace_unencodable_output() -> None:
    """Print ``?`` for characters that the terminal or the file cannot encode."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="replace")


def sanitise(text: str | bytes, limit: int = 200) -> str:
    """Text from a device as one printable line without control characters.

    Args:
        text: text sent by a device, or its name; bytes are decoded as UTF-8 with replacements.
        limit: longest result; longer text ends in an ellipsis.
    """
    if isinstance(text, bytes):
        text = text.decode("utf-8", errors="replace")
    # unprintable characters (control, format, direction, private, unassigned) can steer a terminal
    shown = "".join(c if c.isprintable() else " " for c in text[: 4 * limit])
    shown = " ".join(shown.split())
    return shown if len(shown) <= limit else shown[: limit - 1] + "…"


def encode_json(document: object) -> bytes:
    """Indented JSON; the numbers read back to the same bits."""
    import msgspec

    return msgspec.json.format(msgspec.json.encode(document), indent=1) + b"\n"


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file completely or not at all, see ``replacing``.

    Raises:
        UsageError: the file cannot be written.
    """
    with replacing(path) as file:
        file.write(data)


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file that takes another one's place when it is complete and on the disk.

    It is written under a name of its own in the same folder, so that neither a full disk nor a
    second program leaves half a file. A symbolic link stays, and its target is replaced.

    Raises:
        UsageError: the place is a folder or a device, or the file cannot be written.
    """
    place = Path(os.path.realpath(path))
    draft = place.with_name(f".{place.name}.{os.urandom(6).hex()}")
    try:
        refuse_special(path)
        try:
            with draft.open("xb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            if place.exists():
                draft.chmod(stat.S_IMODE(place.stat().st_mode))
            draft.replace(place)
        finally:
            draft.unlink(missing_ok=True)
    except OSError as error:
        raise UsageError(
            f"{path} cannot be written: {error.strerror or error}. Choose another place",
            settings=("save",),
        ) from error


def refuse_special(path: Path) -> None:
    """Refuse to write where no regular file is or can be.

    Raises:
        UsageError: the place is a folder, a device, a FIFO or a socket.
    """
    if path.is_dir():
        raise UsageError(f"{path} is a folder; give a file in it", settings=("save",))
    if path.exists() and not path.is_file():
        raise UsageError(f"{path} is no regular file; choose another place", settings=("save",))


def begins_otherwise(path: Path, mark: bytes) -> bool:
    """Whether a file is there that is not empty and has no such mark in its first 4 KiB."""
    if not path.is_file():
        return False
    try:
        with path.open("rb") as file:
            begin = file.read(4096)
    except OSError:  # what cannot be read is not overwritten
        return True
    return bool(begin) and mark not in begin
