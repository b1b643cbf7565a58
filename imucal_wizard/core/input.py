"""Bounded reading of files: size, silence of a pipe, ratio of unpacked to packed bytes."""

import io
import os
import stat
import sys
from pathlib import Path
from typing import BinaryIO, cast

from imucal_wizard.core.errors import RecordingError

MAX_DOCUMENT_BYTES = 100_000_000
"""Bytes of a calibration, a reference or a table of limits; a calibration of 200 holds and 100
rotations has 2 MB."""
MAX_SILENCE_OF_PIPE_SECONDS = 10.0
"""Seconds without data from a pipe; a program that writes to it has begun by then."""
MAX_PACKING_RATIO = 50.0
"""Unpacked over packed bytes: readings with noise pack to a third, a constant reading to a
thirtieth."""
_FREE_BYTES = 32_000_000
"""Unpacked bytes up to which the ratio does not count; they fit everywhere."""
MEMORY_PER_BYTE = 3.5
"""Bytes of memory that a recording needs per byte of its text, with its samples and their fit."""
_PIECE = 1 << 20
_GZIP = b"\x1f\x8b"


def is_file(path: Path) -> bool:
    """Whether there is a file; not if its name is too long or its folder may not be entered."""
    try:
        return path.is_file()
    except OSError:
        return False


def check_file(path: Path) -> None:
    """Report a recording that is not there before the work with it begins.

    Raises:
        RecordingError: there is no such file, or it is a folder.
    """
    if is_file(path):
        return
    try:
        folder = path.is_dir()
    except OSError:
        folder = False
    if folder:
        raise _is_folder(path)
    raise RecordingError(f"there is no file {path}; check the path")


def is_port(path: Path) -> bool:
    """Whether a path is a character device; not if it is no possible name."""
    try:
        return path.is_char_device()
    except (OSError, ValueError):
        return False


def read_document(path: Path) -> bytes:
    """The content of a small file, see ``read_bounded``.

    Raises:
        RecordingError: it cannot be read, or is too large.
    """
    return read_bounded(path, MAX_DOCUMENT_BYTES)


def read_schema(path: Path, schemas: tuple[str, ...], what: str) -> bytes:
    """The content of a JSON document of a known kind.

    Args:
        path: the file.
        schemas: kinds and versions that can be read.
        what: the document in words, with its article.

    Raises:
        RecordingError: it cannot be read, is not JSON, or is of another kind or version.
    """
    import json  # few runs read a document

    data = read_document(path)
    try:
        found = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"{path} is not {what}: it is not JSON; check the name") from error
    schema = found.get("schema") if isinstance(found, dict) else None
    if schema not in schemas:
        raise RecordingError(
            f"{path} is not {what}: its schema is {schema!r} instead of {' or '.join(schemas)}; "
            "check the name and the version of the program"
        )
    return data


def read_bounded(path: Path, most: int) -> bytes:
    """The content of a file or of a pipe.

    Args:
        path: the file.
        most: bytes that it may have.

    Raises:
        RecordingError: it is missing, a folder or a device, cannot be read, is too large, or is a
            pipe into which nothing is written.
    """
    try:
        mode = path.stat().st_mode
        if stat.S_ISCHR(mode) or stat.S_ISBLK(mode):  # reading one might never end
            raise RecordingError(f"{path} is a device and no file; give a file")
        if stat.S_ISFIFO(mode):
            return _read_pipe(path, most)
        if path.stat().st_size > most:
            raise _too_large(path, most)
        with path.open("rb") as file:
            data = file.read(most + 1)
    except FileNotFoundError:
        raise RecordingError(f"{path}: there is no such file; check the name") from None
    except IsADirectoryError:
        raise _is_folder(path) from None
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise RecordingError(f"{str(path)!r} is not a file name: {error}") from None
    return _within(data, path, most)


def _within(data: bytes, path: Path, most: int) -> bytes:
    if len(data) > most:
        raise _too_large(path, most)
    return data


def _is_folder(path: Path) -> RecordingError:
    return RecordingError(f"{path} is a folder; give the files in it")


def _too_large(path: Path, most: int) -> RecordingError:
    return RecordingError(
        f"{path} is larger than {in_words(most)}, the most that can be read here; give a shorter"
        " one"
    )


def readable_bytes(most: int) -> int:
    """Bytes of text that a recording may have: so many, or fewer where memory is short."""
    free = float("inf")
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                free = 1024.0 * int(line.split()[1])
        limit = int(Path("/sys/fs/cgroup/memory.max").read_text(encoding="ascii"))
        used = int(Path("/sys/fs/cgroup/memory.current").read_text(encoding="ascii"))
        free = min(free, limit - used)
    except (OSError, ValueError):  # another system, or no limit ("max")
        pass
    return int(min(most, max(free, 0.0) / MEMORY_PER_BYTE))


def _read_pipe(path: Path, most: int) -> bytes:
    """What is written into a pipe until it is closed; opening it does not wait for a writer."""
    import select

    poll = select.poll()
    pieces, size = io.BytesIO(), 0
    file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    try:
        poll.register(file, select.POLLIN)
        while size <= most:
            if not poll.poll(1e3 * MAX_SILENCE_OF_PIPE_SECONDS):
                raise RecordingError(
                    f"{path} is a pipe, and nothing was written into it for"
                    f" {MAX_SILENCE_OF_PIPE_SECONDS:g} s; start the program that writes into it"
                    " first, or give a file"
                )
            piece = os.read(file, _PIECE)
            if not piece:
                break
            size += pieces.write(piece)
    finally:
        os.close(file)
    return _within(pieces.getvalue(), path, most)


def open_unpacked(path: Path) -> BinaryIO:
    """A file opened to be read piece by piece, unpacked if it is packed by gzip.

    Raises:
        OSError: it cannot be opened.
    """
    import gzip  # few files need this

    with path.open("rb") as file:
        packed = file.read(len(_GZIP)) == _GZIP
    return cast("BinaryIO", gzip.open(path)) if packed else path.open("rb")


def unpacked(data: bytes, most: int) -> bytes:
    """The bytes, unpacked if they are packed by gzip.

    Args:
        data: the bytes.
        most: unpacked bytes at most.

    Raises:
        RecordingError: they are damaged, or there is more in them than a recording has.
    """
    if not data.startswith(_GZIP):
        return data
    import gzip  # few files need this
    import zlib

    content, size = io.BytesIO(), 0
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
            while piece := file.read(_PIECE):
                size += content.write(piece)
                if size > max(_FREE_BYTES, MAX_PACKING_RATIO * len(data)):
                    raise RecordingError(
                        f"unpacked it is more than {MAX_PACKING_RATIO:g} times as large as packed,"
                        " which no recording of a sensor is; unpack it with gunzip if you trust it"
                    )
                if size > most:
                    raise RecordingError(
                        f"unpacked it is larger than {in_words(most)}; cut it into shorter"
                        " recordings, a calibration needs ten minutes"
                    )
    except (OSError, EOFError, zlib.error) as error:
        raise RecordingError(
            f"it is compressed by gzip and damaged ({error}); unpack it with gunzip, which"
            " recovers as much as possible"
        ) from error
    return content.getvalue()


def in_words(size: int) -> str:
    """``2 GB``, ``100 MB``."""
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / 1e6:.3g} MB"


def others_may_write(file: BinaryIO, path: Path) -> str:
    """Who besides this user may change an open file or put another in its place; "" for nobody.

    The group counts unless it is the user's own.
    """
    if sys.platform == "win32":
        return ""
    own, folder = os.fstat(file.fileno()), path.resolve().parent.stat()
    if own.st_uid not in (0, os.geteuid()):
        return "another user, who owns it"
    group = stat.S_IWGRP if own.st_gid != os.getegid() else 0
    if own.st_mode & (stat.S_IWOTH | group):
        return "others"
    sticky = folder.st_mode & stat.S_ISVTX
    return "others in its folder" if folder.st_mode & stat.S_IWOTH and not sticky else ""
