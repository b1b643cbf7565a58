"""The virtual IMU on a real pseudo-terminal, read like any serial port."""

import os
import select
import struct
import sys
import threading
import time

from imucal_wizard.core.errors import LinkError
from imucal_wizard.simulate.imu import READ_TICK_SECONDS, VirtualImu

if sys.platform != "win32":
    import fcntl
    import termios
    import tty

OPEN_SECONDS = 0.3
"""Longest time in which a program that opens the port configures and empties it, s."""


class Pty:
    """A pseudo-terminal whose slave is opened like a serial port. No method blocks.

    It works in packet mode: the master is notified when the slave's input is emptied, as every
    serial library does on opening a port, even if the port was closed and reopened at once.

    Attributes:
        path: path that the other side opens.

    Raises:
        LinkError: the system cannot provide a pseudo-terminal.
    """

    def __init__(self) -> None:
        if sys.platform == "win32":
            raise LinkError("no pseudo-terminals on this system; use the wizard's virtual IMU")
        try:
            self._master, slave = os.openpty()
        except OSError as error:
            raise LinkError(
                f"no pseudo-terminal for the virtual IMU ({error.strerror}); close some programs"
            ) from None
        tty.setraw(slave)
        fcntl.ioctl(self._master, termios.TIOCPKT, struct.pack("i", 1))
        os.set_blocking(self._master, False)
        self.path = os.ttyname(slave)
        # Linux reports with POLLHUP that nobody has the slave open, if this side does not.
        self._slave = slave
        self._emptied = False
        if sys.platform == "linux":
            os.close(slave)

    def connected(self) -> bool:
        """Whether the slave is open; False once after it has been emptied."""
        emptied, self._emptied = self._emptied, False
        return not emptied and not self._hung_up()

    def settle(self, seconds: float) -> None:
        """Wait until the slave's input is emptied: bytes written before that are lost."""
        end = time.monotonic() + seconds
        poll = select.poll()
        poll.register(self._master, select.POLLIN)
        while not self._emptied and not self._hung_up() and (left := end - time.monotonic()) > 0.0:
            poll.poll(min(left, READ_TICK_SECONDS) * 1000.0)
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
        except OSError:  # no data, or nobody connected
            return b""

    def _hung_up(self) -> bool:
        poll = select.poll()
        poll.register(self._master, 0)
        return any(event & select.POLLHUP for _, event in poll.poll(0))

    def write(self, data: bytes) -> int:
        """Write as many bytes as the buffer holds; returns their number."""
        try:
            return os.write(self._master, data)
        except OSError:  # full, or nobody connected
            return 0

    def wait_for_room(self, seconds: float) -> None:
        """Wait until there is room to write."""
        poll = select.poll()
        poll.register(self._master, select.POLLOUT)
        poll.poll(seconds * 1000.0)

    def close(self) -> None:
        """Hang up."""
        os.close(self._master)
        if sys.platform != "linux":
            os.close(self._slave)


def serve(imu: VirtualImu, pty: Pty, stopping: threading.Event) -> None:
    """Print the device's lines to the program that has the port open, until stopped.

    Device time stops while nobody reads or the reader is slow, so no sample is ever lost.

    Args:
        imu: the device.
        pty: its port.
        stopping: event that ends the function within a tick.
    """
    cut = False
    while not stopping.is_set():
        if not pty.connected():
            stopping.wait(READ_TICK_SECONDS)
            continue
        pty.settle(OPEN_SECONDS)
        imu.open()
        # the rest of a cut line may still be in the buffer of a program that has just opened the
        # port
        pending = b"\r\n" if cut else b""
        while not stopping.is_set():
            if pty.read():  # any byte requests the header
                imu.print_header()
            if not pty.connected():
                break
            pending = pending or imu.read()
            sent = pty.write(pending)
            cut = pending[sent - 1 : sent] != b"\n" if sent else cut
            pending = pending[sent:]
            if pending:
                pty.wait_for_room(READ_TICK_SECONDS)
