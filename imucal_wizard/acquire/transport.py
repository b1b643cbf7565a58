"""Transport: a port, a pseudo-terminal or a URL that is opened, read, lost and found again."""

import os
import select
import sys
import time
from collections.abc import Callable
from typing import Any

from imucal_wizard.acquire import link_errors
from imucal_wizard.acquire.ports import PortInfo, list_ports, same_device
from imucal_wizard.core.errors import LinkError
from imucal_wizard.core.output import sanitise

_GATHER = 0.025
"""Seconds for which a continuing flow of bytes is gathered into one chunk."""
_PAUSE = 0.002
"""Seconds between two reads while gathering; a tty holds 4 KiB, 5 ms at 8,000 lines/s."""
_MAX_SLOW_BYTES = 512
"""Fewer bytes in ``_PAUSE`` are a slow stream: waiting for more gains nothing."""

_SCHEMES = ("", "socket", "rfc2217")
"""Supported URL schemes: a local port, a plain connection, a terminal server."""

if sys.platform == "win32":
    _LOST: tuple[type[Exception], ...] = (OSError, TypeError, ValueError)
else:
    import termios

    _LOST = (OSError, TypeError, ValueError, termios.error)
    # TypeError and ValueError: another thread has closed the port meanwhile


class Transport:
    """A stream of bytes from a device.

    Args:
        port_or_url: ``/dev/ttyACM0``, ``COM5``, a pseudo-terminal, ``socket://HOST:PORT``,
            ``rfc2217://HOST:PORT``.
        baud: speed; ignored by native USB, pseudo-terminals and sockets.
        find: function that lists the ports when the device is searched for again.
    """

    def __init__(
        self,
        port_or_url: str,
        baud: int = 115200,
        *,
        find: Callable[[], list[PortInfo]] = list_ports,
    ) -> None:
        self.port = port_or_url
        self.baud = baud
        self._find = find
        self._serial: Any = None
        self._fd: int | None = None
        self._identity: PortInfo | None = None

    @property
    def description(self) -> str:
        """The port and the device, in words."""
        info = self._identity
        words = (info.hint or info.description) if info else ""
        return sanitise(f"{self.port}, {words}" if words else self.port)

    def open(self) -> None:
        """Open the port, exclusively if the system supports that.

        Raises:
            LinkError: the port is missing, busy, forbidden, refused or no port at all.
        """
        self.close()
        scheme = _scheme(self.port)
        ports = [] if scheme else self._find()
        self._serial = self._opened(self.port, ports)
        self._identity = same_device(self.port, ports) or self._identity
        if scheme == "socket" or (not scheme and sys.platform != "win32"):
            self._fd = self._serial.fileno()

    def _opened(self, port: str, ports: list[PortInfo]) -> Any:
        import serial

        scheme = _scheme(port)
        options: dict[str, Any] = {"timeout": 0.05}
        if scheme != "rfc2217":  # not supported there
            options["write_timeout"] = 1.0
        if not scheme and sys.platform != "win32":
            options["exclusive"] = True
        try:
            if scheme not in _SCHEMES:
                raise ValueError(port)  # pyserial accepts others, with various failures
            opened: Any = serial.serial_for_url(port, self.baud, do_not_open=True, **options)
            if scheme == "socket":
                # pyserial would drop the first bytes: a server's header, sent once on connecting
                opened.reset_input_buffer = lambda: None
            opened.open()
            return opened
        except (*_LOST, OverflowError) as error:  # OverflowError: an excessive speed
            known = [info.device for info in ports]
            raise LinkError(link_errors.open_error_text(sanitise(port), error, known)) from error

    def read(self, timeout: float = 0.05) -> bytes:
        """All bytes that have arrived; waits at most ``timeout`` seconds for the first one.

        Returns:
            The bytes; ``b""`` if none arrived.

        Raises:
            LinkError: the device is gone. The port is closed; ``reopen`` searches for it.
        """
        if self._serial is None:
            raise LinkError(f"{sanitise(self.port)} is not open: open it first.")
        try:
            if self._fd is not None:
                return _read_burst(self._fd, timeout)
            return self._read_any(timeout)
        except _LOST as error:
            self.close()
            raise LinkError(link_errors.link_lost_text(sanitise(self.port), error)) from error

    def _read_any(self, timeout: float) -> bytes:
        """Read through pyserial alone: Windows and remote ports."""
        if self._serial.timeout != timeout:  # setting it is negotiated with a server
            self._serial.timeout = timeout
        data: bytes = self._serial.read(1)
        return data + bytes(self._serial.read(self._serial.in_waiting)) if data else b""

    def write(self, data: bytes) -> None:
        """Send bytes to the device.

        Raises:
            LinkError: the device is gone or accepts nothing.
        """
        if self._serial is None:
            raise LinkError(f"{sanitise(self.port)} is not open: open it first.")
        try:
            self._serial.write(data)
        except _LOST as error:
            self.close()
            raise LinkError(link_errors.link_lost_text(sanitise(self.port), error)) from error

    def reopen(self) -> bool:
        """Search once for the same device, under its old name or another, and open it.

        A USB device is recognised by vendor, product and serial number; another device with the old
        name is not opened.

        Returns:
            True if it is open again. Bytes before and after must not be joined.
        """
        self.close()
        identity = self._identity
        if identity is not None and identity.vid_pid:
            found = _again(identity, self._find())
            if found is None:
                return False
            self.port = found.device
        try:
            self.open()
        except LinkError:
            return False
        return True

    def close(self) -> None:
        """Close the port; closing a closed or lost port does nothing."""
        port, self._serial, self._fd = self._serial, None, None
        if port is None:
            return
        try:
            port.close()
        except _LOST:
            return  # the device is gone, so there is nothing to close


def _scheme(port: str) -> str:
    """The scheme of a URL (``socket`` for ``socket://HOST:PORT``); "" for a local port."""
    scheme, found, _ = port.partition("://")
    return scheme.lower() if found else ""


def _again(identity: PortInfo, ports: list[PortInfo]) -> PortInfo | None:
    """The current port of the same device; a twin without serial number only at the old name."""
    same = [p for p in ports if p.vid_pid == identity.vid_pid]
    same = [p for p in same if p.serial_number == identity.serial_number]
    at_old_name = [p for p in same if p.device == identity.device]
    if at_old_name:
        return at_old_name[0]
    return same[0] if len(same) == 1 else None


def _read_burst(fd: int, timeout: float) -> bytes:
    """Wait for the first bytes; while they arrive fast, gather them for a moment.

    A slow stream is returned at once. A fast one is returned in few large chunks, which costs a
    third of the CPU; no read is later than ``_PAUSE``, so the terminal's buffer never overflows.

    Raises:
        OSError: the stream has ended and all its bytes have been handed over.
    """
    if not select.select([fd], [], [], timeout)[0]:
        return b""
    data = _taken(fd)
    end = time.monotonic() + _GATHER
    while time.monotonic() < end:
        time.sleep(_PAUSE)  # select would wake for every few bytes
        try:
            data += _taken(fd)
        except BlockingIOError:  # polling first would release the interpreter lock again
            if len(data) < _MAX_SLOW_BYTES:
                break
        except OSError:
            break  # the device is gone: return its last bytes; the next call raises
    return data


def _taken(fd: int) -> bytes:
    data = os.read(fd, 65536)
    if not data:
        raise OSError("end of the stream")
    return data
