"""Real pseudo-terminals and sockets that stand in for devices."""

import os
import socket
import tty
from pathlib import Path

from tests.waiting import PATIENCE


class Pty:
    """A pseudo-terminal whose master end plays the device."""

    def __init__(self) -> None:
        self.master, self._slave = os.openpty()
        tty.setraw(self.master)
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)

    def send(self, data: bytes) -> None:
        """The device prints."""
        os.write(self.master, data)

    def unplug(self) -> None:
        """The device goes away."""
        for fd in (self.master, self._slave):
            if fd >= 0:
                os.close(fd)
        self.master = self._slave = -1


def link(name: Path, target: str) -> str:
    """A stable name for a device, as under ``/dev/serial/by-id``; an old one is replaced."""
    name.unlink(missing_ok=True)
    name.symlink_to(target)
    return str(name)


def server() -> socket.socket:
    """A loopback server that waits for one connection."""
    listening = socket.create_server(("127.0.0.1", 0))
    listening.settimeout(PATIENCE)
    return listening


def url_of(listening: socket.socket) -> str:
    """Where a server is reached."""
    return f"socket://127.0.0.1:{listening.getsockname()[1]}"
