"""The device's end of the line: a pseudo-terminal, or a socket where there is none."""

import os
import select
import socket
import struct
import sys
import time
from typing import Protocol

if sys.platform != "win32":
    import fcntl
    import termios
    import tty


class Endpoint(Protocol):
    """Where the virtual device writes. Nothing here ever blocks."""

    @property
    def url(self) -> str:
        """What the other side opens: a device path or ``socket://host:port``."""

    def connected(self) -> bool:
        """Whether somebody has the other side open, and has had since this was last asked."""

    def wait(self, wake: socket.socket, seconds: float, *, to_write: bool = False) -> None:
        """Wait so long, or until ``wake`` has something, or until there is room to write."""

    def settle(self, wake: socket.socket, seconds: float) -> None:
        """Wait until the other side has set itself up, at most so long, or until ``wake``."""

    def read(self) -> bytes:
        """What the other side sent; empty when nothing."""

    def write(self, data: bytes) -> int:
        """Send as much as goes now; how many bytes went."""

    def close(self) -> None:
        """Close this side."""


class Pty:
    """A pseudo-terminal whose slave is opened like any serial port.

    It works in packet mode: the master is told when the slave's input is emptied, as every serial
    library does on opening a port, even if the port was closed and opened in the same instant.
    """

    def __init__(self) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        fcntl.ioctl(self._master, termios.TIOCPKT, struct.pack("i", 1))
        os.set_blocking(self._master, False)
        self.url = os.ttyname(slave)
        # Linux says with POLLHUP that nobody holds the slave, if this side does not hold it either.
        self._slave = slave
        self._emptied = False
        if sys.platform == "linux":
            os.close(slave)

    def connected(self) -> bool:
        """Whether the slave is open; once False when it has been emptied since."""
        emptied, self._emptied = self._emptied, False
        return not emptied and not self._hung_up()

    def wait(self, wake: socket.socket, seconds: float, *, to_write: bool = False) -> None:
        """Wait."""
        poll = select.poll()
        poll.register(wake, select.POLLIN)
        if to_write:
            poll.register(self._master, select.POLLOUT)
        poll.poll(seconds * 1000.0)

    def settle(self, wake: socket.socket, seconds: float) -> None:
        """Wait until the slave's input is emptied: what is written before that is lost."""
        end = time.monotonic() + seconds
        poll = select.poll()
        poll.register(wake, select.POLLIN)
        poll.register(self._master, select.POLLIN)
        while not self._emptied and not self._hung_up() and (left := end - time.monotonic()) > 0.0:
            if any(fd == wake.fileno() for fd, _ in poll.poll(left * 1000.0)):
                return
            self.read()
        self._emptied = False

    def read(self) -> bytes:
        """Bytes written to the slave."""
        data = b""
        while packet := self._packet():
            if packet[0] == termios.TIOCPKT_DATA:
                data += packet[1:]
            elif packet[0] & termios.TIOCPKT_FLUSHREAD:
                self._emptied = True
        return data

    def _packet(self) -> bytes:
        try:
            return os.read(self._master, 4096)
        except OSError:  # nothing there, or nobody
            return b""

    def _hung_up(self) -> bool:
        poll = select.poll()
        poll.register(self._master, 0)
        return any(event & select.POLLHUP for _, event in poll.poll(0))

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

    def connected(self) -> bool:
        """Whether a client is there; takes the next one if not."""
        if self._client is None:
            try:
                self._client, _ = self._server.accept()
            except OSError:  # nobody calls
                return False
            self._client.setblocking(False)
        return True

    def wait(self, wake: socket.socket, seconds: float, *, to_write: bool = False) -> None:
        """Wait; a client that calls or speaks ends it too."""
        line = self._client or self._server
        select.select([wake, line], [line] if to_write else [], [], seconds)

    def settle(self, wake: socket.socket, seconds: float) -> None:
        """Wait all the time: a socket does not tell when it is emptied."""
        self.wait(wake, seconds)

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
