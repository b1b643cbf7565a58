"""A serial port on another machine: a loopback server that speaks RFC 2217 before a real stream."""

import select
import socket
import threading
from contextlib import suppress
from typing import Any, Self

import serial
from serial.rfc2217 import PortManager

from tests.waiting import PATIENCE

_TURN = 0.01
"""Seconds that the port is listened to before the client is looked at again."""


class RemotePort:
    """What a terminal server does: one client at a time, told of and obeyed by pyserial's own side.

    Args:
        device: what stands behind it, anything that pyserial opens.

    Attributes:
        url: where it is reached.
        port: the port behind it, whose speed the client sets.
    """

    def __init__(self, device: str) -> None:
        self.port = serial.serial_for_url(device, timeout=_TURN)
        self._server = socket.create_server(("127.0.0.1", 0))
        self._server.settimeout(_TURN)
        port = self._server.getsockname()[1]
        self.url = f"rfc2217://127.0.0.1:{port}?timeout={PATIENCE:g}"
        self._hung_up = threading.Event()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._work)

    def hang_up(self) -> None:
        """Drop the client; the next one is served again."""
        self._hung_up.set()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join()
        self._server.close()
        self.port.close()

    def _work(self) -> None:
        while not self._stopping.is_set():
            try:
                client, _ = self._server.accept()
            except TimeoutError:
                continue
            self._hung_up.clear()
            with client, suppress(OSError):  # the client has gone
                _serve(client, self.port, (self._stopping, self._hung_up))


class _Answers:
    """What pyserial's side of the protocol writes its answers to."""

    def __init__(self, client: socket.socket) -> None:
        self.write = client.sendall


def _serve(client: socket.socket, port: Any, ends: tuple[threading.Event, ...]) -> None:
    answers: Any = _Answers(client)  # the stubs ask for more than either side uses
    manager = PortManager(port, answers)
    while not any(end.is_set() for end in ends):
        if select.select([client], [], [], 0.0)[0]:
            asked = client.recv(4096)
            if not asked:
                return
            port.write(b"".join(manager.filter(asked)))
        client.sendall(b"".join(manager.escape(port.read(4096))))
