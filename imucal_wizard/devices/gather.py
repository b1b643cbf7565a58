"""Bytes from a file descriptor: at once when they are few, gathered when they come fast."""

import os
import select
import time

_GATHER = 0.025
"""Seconds for which bytes that keep coming are gathered into one chunk."""
_PAUSE = 0.002
"""Seconds between two looks while gathering; a tty holds 4 KiB, 5 ms at 8,000 lines/s."""
_SLOW = 512
"""So few bytes in ``_PAUSE`` are no fast stream: nothing is gained by waiting for more."""


def _readable(fd: int, timeout: float) -> bool:
    return bool(select.select([fd], [], [], timeout)[0])


def gathered(fd: int, timeout: float) -> bytes:
    """Wait for the first bytes; while they keep coming fast, gather for a moment.

    A slow stream is handed over at once. A fast one comes in few large chunks, which costs a
    third; no look is later than ``_PAUSE``, so that the terminal's buffer never fills.

    Raises:
        OSError: the stream has ended and all its bytes have been handed over.
    """
    if not _readable(fd, timeout):
        return b""
    data = _taken(fd)
    end = time.monotonic() + _GATHER
    while time.monotonic() < end:
        time.sleep(_PAUSE)  # select would wake for every few bytes and so gather none
        try:
            data += _taken(fd)
        except BlockingIOError:  # nothing new; asking before would cost another turn of the lock
            if len(data) < _SLOW:
                break
        except OSError:
            break  # the device is gone: first hand over its last bytes, the next call says so
    return data


def _taken(fd: int) -> bytes:
    data = os.read(fd, 65536)
    if not data:
        raise OSError("end of the stream")
    return data
