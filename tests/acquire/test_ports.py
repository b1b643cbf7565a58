"""What speaks on each port is told without sending a byte, and nothing there makes it fail."""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from imucal_wizard.acquire.listen import listen_to_port, listen_to_ports
from imucal_wizard.acquire.ports import PortInfo
from imucal_wizard.cli.ports import ports_text
from tests.acquire.ports import Pty
from tests.acquire.streams import HEADER, at_rest, printed


@contextmanager
def printing(data: bytes) -> Iterator[Pty]:
    """A device that prints these lines again and again, ten times a second."""
    pty = Pty()
    os.set_blocking(pty.master, False)
    stop = threading.Event()

    def work() -> None:
        while not stop.wait(0.02):
            try:
                pty.send(data)
            except BlockingIOError:
                continue

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield pty
    finally:
        stop.set()
        thread.join()
        pty.unplug()


def test_a_speaking_port_is_told_with_format_and_columns() -> None:
    with printing(HEADER + printed(at_rest(2))) as pty:
        heard = listen_to_port(PortInfo(pty.path, "a board"), seconds=0.4)
    assert heard.format == "csv"
    assert "ax,ay,az,gx,gy,gz" in heard.message


def test_a_silent_and_a_missing_port_say_so_and_fail_nothing() -> None:
    silent = Pty()
    ports = [PortInfo(silent.path, "quiet board"), PortInfo("/dev/ttyNOTHERE")]
    report = ports_text(listen_to_ports(lambda: ports))
    assert "silent" in report
    assert "There is no port /dev/ttyNOTHERE" in report
    assert "quiet board" in report
    silent.unplug()


def test_nothing_is_sent_to_a_port_that_is_only_listened_to() -> None:
    pty = Pty()
    os.set_blocking(pty.master, False)
    listen_to_port(PortInfo(pty.path), seconds=0.1)
    try:
        sent = os.read(pty.master, 100)
    except BlockingIOError:
        sent = b""
    assert sent == b""
    pty.unplug()


def test_garbage_is_tried_at_other_speeds_and_then_explained() -> None:
    with printing(bytes(range(128, 256))) as pty:
        heard = listen_to_port(PortInfo(pty.path, vid_pid="1A86:7523"), seconds=0.3)
    assert heard.garbled
    assert "speed is probably wrong" in heard.message


def test_without_ports_the_virtual_imu_is_named() -> None:
    assert listen_to_ports(list) == []
    assert "virtual IMU" in ports_text([])
