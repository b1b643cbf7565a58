"""Output of the commands: safe lines for the terminal, and files written atomically."""

import errno
import itertools
import os
import stat
import sys
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, TextIO

from imucal_wizard.core.errors import PlaceError, UsageError
from imucal_wizard.core.notices import Notice

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


def say(text: str, *, flush: bool = False) -> None:
    """Write lines to standard output."""
    with readers_may_leave(sys.stdout):
        print(without_control_characters(text), flush=flush)


@contextmanager
def readers_may_leave(stream: TextIO) -> Iterator[None]:
    """Go on if the reader of a stream has closed it, like ``head``: there are files to write.

    What follows on this stream goes to nobody.
    """
    try:
        yield
    except BrokenPipeError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def note(text: str) -> None:
    """Write lines to standard error; on a terminal they break between words."""
    text, error = without_control_characters(text), sys.stderr
    if error.isatty():
        with suppress(OSError, ValueError):  # of a terminal without a width
            width = os.get_terminal_size(error.fileno()).columns
            text = "\n".join(_between_words(row, width) for row in text.split("\n"))
    with readers_may_leave(error):
        print(text, file=error)


def _between_words(row: str, width: int) -> str:
    """A line as lines of at most so many columns; a longer word stays whole."""
    if len(row) <= width or width <= 0:
        return row
    import textwrap

    rows = textwrap.wrap(row, width, break_long_words=False, break_on_hyphens=False)
    return "\n".join(rows)


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
    """Indented JSON; the numbers read back to the same bits, and warnings as their text."""
    import msgspec

    return msgspec.json.format(msgspec.json.encode(document, enc_hook=_text), indent=1) + b"\n"


def _text(value: object) -> str:
    """A warning of a kind as text.

    Raises:
        TypeError: it is something else, which JSON has no form for.
    """
    if isinstance(value, Notice):
        return str(value)
    raise TypeError(f"{type(value).__name__} cannot be written as JSON")


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
        UsageError: the place is a folder or a device.
        PlaceError: the file cannot be written.
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
            _sync_folder(place.parent)
        finally:
            draft.unlink(missing_ok=True)
    except OSError as error:
        other = place_elsewhere(place)
        advice = "Choose another place" if other is None else f"There is room for it at {other}"
        raise PlaceError(f"{path} cannot be written: {cause_of(error)}. {advice}", other) from error


def _sync_folder(folder: Path) -> None:
    """Make the names in a folder outlast a loss of power, where the system can."""
    with suppress(OSError):
        file = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(file)
        finally:
            os.close(file)


def cause_of(error: OSError) -> str:
    """Why a file cannot be written, in words."""
    return _CAUSES.get(errno.errorcode.get(error.errno or 0, ""), error.strerror or str(error))


_CAUSES = {
    "ENOSPC": "the disk is full",
    "EDQUOT": "the quota of the disk is used up",
    "EFBIG": "the limit of the size of a file is reached",
    "EROFS": "the disk is read-only",
    "EIO": "the disk does not work (input/output error)",
}
"""The causes that an operator can do something about, by the names of their error numbers."""
PROBE_BYTES = 1 << 16
"""Bytes that are written to find out why a file cannot grow."""
ROOM_BYTES = 1 << 24
"""Free bytes of a disk that is proposed instead of another one."""


def why_it_cannot_grow(*files: Path, by: int = PROBE_BYTES, whole: bool = True) -> str:
    """Why files of one folder cannot grow, "" if they can; tried by another file there.

    Args:
        files: the files.
        by: bytes by which the largest is to grow.
        whole: try it by a file as large as they are, and wait until the disk has taken it: limits
            of the size of a file, and network disks, refuse only that. Otherwise by the bytes
            alone: a disk without sparse files would fill the rest with zeros.
    """
    import tempfile

    try:
        sizes = (one.stat().st_size for one in files if whole and one.exists())
        size = max(sizes, default=0)
        with tempfile.TemporaryFile(dir=files[0].parent) as file:
            file.seek(size)
            file.write(b"\1" * by)
            file.flush()
            if whole:
                os.fsync(file.fileno())
    except OSError as error:
        return cause_of(error)
    return ""


def place_elsewhere(path: Path) -> Path | None:
    """A free name for the same file on another disk where there is room; None without one."""
    import shutil
    import tempfile

    for folder in (Path.home(), Path.cwd(), Path(tempfile.gettempdir())):
        try:
            other = folder.stat().st_dev != path.parent.stat().st_dev
            room = shutil.disk_usage(folder).free >= ROOM_BYTES
        except OSError:
            continue
        if other and room and os.access(folder, os.W_OK):
            return next(one for one in numbered_names(folder / path.name) if not one.exists())
    return None


def refuse_special(path: Path) -> None:
    """Refuse to write where no regular file is or can be.

    Raises:
        UsageError: the place is a folder, a device, a FIFO or a socket.
    """
    if path.is_dir():
        raise UsageError(f"{path} is a folder; give a file in it", settings=("save",))
    if path.exists() and not path.is_file():
        raise UsageError(f"{path} is no regular file; choose another place", settings=("save",))


def numbered_names(first: Path) -> Iterator[Path]:
    """A name, and the same with the numbers 2, 3, … before its ending, without end."""
    yield first
    for number in itertools.count(2):
        yield first.with_name(f"{first.stem}-{number}{first.suffix}")


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
