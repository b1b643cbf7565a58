"""A virtual IMU on a real pseudo-terminal or socket, served by a thread of the test."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from imucal_wizard.simulate.imu import VirtualImu
from imucal_wizard.simulate.terminal import Pty, serve


@contextmanager
def served(imu: VirtualImu) -> Iterator[str]:
    """The path of the port on which the device prints meanwhile."""
    pty, stopping = Pty(), threading.Event()
    thread = threading.Thread(target=serve, args=(imu, pty, stopping), daemon=True)
    thread.start()
    try:
        yield pty.path
    finally:
        stopping.set()
        thread.join()
        pty.close()


@contextmanager
def served_on_a_socket(imu: VirtualImu) -> Iterator[str]:
    """The URL of a loopback server that prints the device's lines to one client."""
    stopping = threading.Event()

    def serve_one(server: socket.socket) -> None:
        client, _ = server.accept()
        with client, suppress(OSError):  # the client has gone
            while not stopping.is_set():
                client.sendall(imu.read())

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=serve_one, args=(server,), daemon=True).start()
        try:
            yield f"socket://127.0.0.1:{server.getsockname()[1]}"
        finally:
            stopping.set()
