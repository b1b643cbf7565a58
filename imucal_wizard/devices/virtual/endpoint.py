"""The device's end of the line: a pseudo-terminal, or a socket where there is none."""

import os
import select
import socket
import sys
from typing import Protocol

if sys.platform != "win32":
    import tty


class Endpoint(Protocol):
    """Where the virtual device writes. Nothing here ever blocks."""

    @property
    def url(self) -> str:
        """What the other side opens: a device path or ``socket://host:port``."""

    @property
    def descriptor(self) -> int:
        """What to wait for with ``select``."""

    def connected(self) -> bool:
        """Whether somebody has opened the other side."""

    def read(self) -> bytes:
        """What the other side sent; empty when nothing."""

    def write(self, data: bytes) -> int:
        """Send as much as goes now; how many bytes went."""

    def close(self) -> None:
        """Close this side."""


class Pty:
    """A pseudo-terminal whose slave is opened like any serial port."""

    def __init__(self) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self._master, False)
        self.url = os.ttyname(slave)
        # Linux says with POLLHUP that nobody holds the slave, if this side does not hold it either.
        self._slave = slave
        if sys.platform == "linux":
            os.close(slave)

    @property
    def descriptor(self) -> int:
        """The master's."""
        return self._master

    def connected(self) -> bool:
        """Whether the slave is open."""
        if sys.platform != "linux":
            return True
        poll = select.poll()
        poll.register(self._master, 0)
        return not any(event & select.POLLHUP for _, event in poll.poll(0))

    def read(self) -> bytes:
        """Bytes written to the slave."""
        try:
            return os.read(self._master, 4096)
        except OSError:  # nothing there, or nobody
            return b""

    def write(self, data: bytes) -> int:
        """Fill the line's buffer as far as it goes."""
        try:
            return os.write(self._master, data)
        except OSError:  # full, or nobody
            return 0

    def close(self) -> None:
        """Hang up."""
        os.close(self._master)
        if sys.platform != "linux":
            os.close(self._slave)


class Loopback:
    """A server on this machine only, for systems without pseudo-terminals; one client at a time."""

    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0), backlog=1)
        self._server.setblocking(False)
        self._client: socket.socket | None = None
        self.url = f"socket://127.0.0.1:{self._server.getsockname()[1]}"

    @property
    def descriptor(self) -> int:
        """The client's, or the server's before there is one."""
        return (self._client or self._server).fileno()

    def connected(self) -> bool:
        """Whether a client is there; takes the next one if not."""
        if self._client is None:
            try:
                self._client, _ = self._server.accept()
            except OSError:  # nobody calls
                return False
            self._client.setblocking(False)
        return True

    def read(self) -> bytes:
        """Bytes from the client; forgets a client that has gone."""
        if self._client is None:
            return b""
        try:
            data = self._client.recv(4096)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._forget()
        return data

    def write(self, data: bytes) -> int:
        """Send as far as it goes; forgets a client that has gone."""
        if self._client is None:
            return 0
        try:
            return self._client.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            self._forget()
            return 0

    def close(self) -> None:
        """Hang up."""
        self._forget()
        self._server.close()

    def _forget(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None


def open_endpoint(loopback: bool = False) -> Endpoint:
    """A pseudo-terminal where the system has them, else a loopback server."""
    return Loopback() if loopback or not hasattr(os, "openpty") else Pty()
