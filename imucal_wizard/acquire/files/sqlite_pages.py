"""Rows of an SQLite file, read page by page, without the tree that leads to the pages.

SQLite reaches a row through a tree of pages, and gives up at the first damaged page. Here each page
of rows is read by itself, following the file format
(https://sqlite.org/fileformat2.html, sections 1.5 and 1.6 pages, 2.1 records, 4 write-ahead log).
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from imucal_wizard.acquire.files import log_of

Row = tuple[int, tuple[Any, ...]]
"""Number and values of a row; an INTEGER PRIMARY KEY has the value None."""
_HEADER_BYTES = 100
_LEAF_OF_TABLE = 13
_USUAL_PAGE_BYTES = 4096
_WAL_HEADER_BYTES, _FRAME_HEADER_BYTES = 32, 24
_MAX_PAGES = 1 << 24
_VALUE_BYTES = (0, 1, 2, 3, 4, 6, 8, 8, 0, 0)
"""Bytes of a value by its serial type; 7 is a float, 8 and 9 are the numbers 0 and 1."""


class PageReader:
    """The pages of a file, with those that its write-ahead log has committed.

    Args:
        path: the file; pages that the disk cannot read count as empty.

    Raises:
        OSError: the file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        with path.open("rb") as file:
            head = file.read(_HEADER_BYTES).ljust(_HEADER_BYTES, b"\0")
            size = int.from_bytes(head[16:18], "big")
            whole = head.startswith(b"SQLite format 3\0") and size >= 512 and not size & (size - 1)
            self._size = size if whole else _USUAL_PAGE_BYTES
            self._usable = self._size - (head[20] if whole and head[20] <= 32 else 0)
            self._pages = [
                _page(file, number * self._size, self._size)
                for number in range(-(-path.stat().st_size // self._size))
            ]
        for number, page in _committed(log_of(path), self._size).items():
            self._pages += [bytes(self._size)] * (number - len(self._pages))
            self._pages[number - 1] = page

    def leaves(self) -> Iterator[list[Row]]:
        """The readable rows of each page that holds rows; those of a page belong to one table."""
        for index, page in enumerate(self._pages):
            start = 0 if index else _HEADER_BYTES
            if page[start] == _LEAF_OF_TABLE:
                count = int.from_bytes(page[start + 3 : start + 5], "big")
                places = page[start + 8 : min(start + 8 + 2 * count, self._usable)]
                rows = (self._row(page, *place) for place in struct.iter_unpack(">H", places))
                yield [row for row in rows if row is not None]

    def _row(self, page: bytes, place: int) -> Row | None:
        """The row at a place of a page; None if there is none."""
        try:
            length, place = _varint(page, place)
            number, place = _varint(page, place)
            return number, _values(self._payload(page, place, length))
        except (IndexError, ValueError, struct.error):
            return None

    def _payload(self, page: bytes, place: int, length: int) -> bytes:
        """The bytes of a record, whose end may lie in a chain of other pages.

        Raises:
            ValueError: they are not all there.
        """
        most = self._usable - 35
        local = length
        if length > most:
            least = (self._usable - 12) * 32 // 255 - 23
            local = least + (length - least) % (self._usable - 4)
            local = local if local <= most else least
        data = page[place : place + local]
        if length > local:
            after = int.from_bytes(page[place + local : place + local + 4], "big")
            parts, left = [data], length - local
            while left > 0:
                if not 0 < after <= len(self._pages):
                    raise ValueError("the chain is broken")
                chained = self._pages[after - 1]
                parts.append(chained[4 : min(self._usable, 4 + left)])
                left -= self._usable - 4
                after = int.from_bytes(chained[:4], "big")
            data = b"".join(parts)
        if len(data) != length:
            raise ValueError("the record is cut short")
        return data


def _page(file: Any, place: int, size: int) -> bytes:
    try:
        file.seek(place)
        return bytes(file.read(size)).ljust(size, b"\0")
    except OSError:  # a bad sector of the disk
        return bytes(size)


def _committed(path: Path, size: int) -> dict[int, bytes]:
    """The committed pages of a write-ahead log by number; none if there is no log."""
    try:
        log = path.read_bytes()
    except OSError:
        return {}
    salt, found, pending = log[16:24], dict[int, bytes](), dict[int, bytes]()
    step = _FRAME_HEADER_BYTES + size
    for start in range(_WAL_HEADER_BYTES, len(log) - step + 1, step):
        number, committed = struct.unpack_from(">II", log, start)
        if log[start + 8 : start + 16] != salt or not 0 < number < _MAX_PAGES:
            break  # older frames follow, which were copied to the file
        pending[number] = log[start + _FRAME_HEADER_BYTES : start + step]
        if committed:
            found |= pending
            pending = {}
    return found


def _varint(data: bytes, place: int) -> tuple[int, int]:
    """A number of variable length, and the place after it."""
    value = 0
    for _ in range(8):
        byte = data[place]
        place += 1
        value = value << 7 | byte & 127
        if byte < 128:
            return value, place
    return value << 8 | data[place], place + 1


def _values(record: bytes) -> tuple[Any, ...]:
    """The values of a record.

    Raises:
        ValueError: it is no record.
    """
    end, place = _varint(record, 0)
    body, values = end, []
    while place < end:
        kind, place = _varint(record, place)
        if kind in (10, 11):
            raise ValueError("a type that is not used")
        size = _VALUE_BYTES[kind] if kind < 12 else (kind - 12) // 2
        values.append(_value(kind, record[body : body + size]))
        body += size
    if place != end or body != len(record):
        raise ValueError("types and bytes do not agree")
    return tuple(values)


def _value(kind: int, data: bytes) -> Any:
    """One value by its serial type.

    Raises:
        ValueError: it is no text in UTF-8.
    """
    if kind == 0:
        return None
    if kind == 7:
        return struct.unpack(">d", data)[0]
    if kind in (8, 9):
        return kind - 8
    if kind < 7:
        return int.from_bytes(data, "big", signed=True)
    return data.decode() if kind % 2 else data
