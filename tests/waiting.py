"""Waiting for what should happen, never for a time."""

import time
from collections.abc import Callable

PATIENCE = 60.0
"""Seconds after which what has not happened will not happen, however busy the machine is."""
AT_ONCE = 2.0
"""Seconds that something immediate may take on a busy machine; a time-out takes longer."""


def wait_for(condition: Callable[[], bool]) -> None:
    """Return as soon as a condition holds; fail if it never does."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.005)  # between two looks, which would otherwise take all of a core


def received(read: Callable[[], bytes], wanted: int | Callable[[bytes], bool]) -> bytes:
    """Read until there are so many bytes, or those that are wanted; fail if they never come."""
    data, end = b"", time.monotonic() + PATIENCE
    while not (wanted(data) if callable(wanted) else len(data) >= wanted):
        assert time.monotonic() < end, f"only {len(data)} bytes came"
        data += read()
    return data
