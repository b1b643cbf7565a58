"""The thread that fetches: nothing waits in the port's small buffer while others are busy."""

import threading
from collections.abc import Iterator

import pytest

from imucal_wizard.acquire.transport import Transport
from imucal_wizard.core.errors import LinkError
from imucal_wizard.run.reader import MAX_WAITING_BYTES, Pump
from tests.acquire.ports import Pty
from tests.waiting import wait_for


@pytest.fixture
def pump(pty: Pty) -> Iterator[Pump]:
    """What fetches from it."""
    made = Pump(Transport(pty.path))
    made.open()
    yield made
    made.close()


def _all(pump: Pump, size: int) -> bytes:
    data = b""

    def enough() -> bool:
        nonlocal data
        data += pump.read(0.05)
        return len(data) >= size

    wait_for(enough)
    return data


def test_more_than_a_terminal_holds_is_fetched_while_nobody_reads(pty: Pty, pump: Pump) -> None:
    sent = bytes(range(256)) * 400  # a terminal holds a fifth of it, and the sender would block
    sender = threading.Thread(target=pty.send, args=(sent,), daemon=True)
    sender.start()
    wait_for(lambda: not sender.is_alive())
    assert _all(pump, len(sent)) == sent


def test_what_came_before_a_loss_is_handed_over_before_the_loss_is_told(
    pty: Pty, pump: Pump
) -> None:
    pty.send(b"1,2,3\n")
    wait_for(lambda: pump._size > 0)
    pty.unplug()
    wait_for(lambda: pump._lost is not None)
    assert pump.read() == b"1,2,3\n"
    with pytest.raises(LinkError, match="is gone"):
        pump.read()


def test_nothing_comes_back_in_time_when_nothing_is_sent(pump: Pump) -> None:
    assert pump.read(0.0) == b""


class _Flood:
    """A sender faster than any reader."""

    description = "a flood"

    def __init__(self) -> None:
        self.reads = 0

    def open(self) -> None:
        """Always there."""

    def read(self, timeout: float = 0.05) -> bytes:  # noqa: ARG002 (a link's signature)
        self.reads += 1
        return b"x" * 4096

    def reopen(self) -> bool:
        return True

    def close(self) -> None:
        """Nothing to let go of."""


def test_too_many_bytes_at_once_do_not_fill_the_memory() -> None:
    flood = _Flood()
    pump = Pump(flood)
    pump.open()
    wait_for(lambda: pump._size >= MAX_WAITING_BYTES)
    assert flood.reads <= MAX_WAITING_BYTES // 4096 + 2
    assert len(pump.read()) <= MAX_WAITING_BYTES + 4096
    wait_for(lambda: pump._size >= MAX_WAITING_BYTES)
    pump.close()
    assert not any(thread.name == "Pump" for thread in threading.enumerate())
