"""A few kills and losses of power; the whole study is an attack."""

import os
import select
import shutil
import termios
import time
from pathlib import Path

import pytest

from benchmarks.attacks.kills import Sitting, study
from benchmarks.attacks.performed import Device
from benchmarks.attacks.power_loss import Call, Disk, cut_power
from imucal_wizard.simulate.terminal import OPEN_SECONDS


@pytest.mark.study
def test_nothing_that_the_screen_has_confirmed_is_lost_by_a_kill() -> None:
    at_random = Sitting(1, 20.0, confirmed=False, commands=False, seed=7)
    at_once = Sitting(1, 20.0, confirmed=True, commands=True, seed=8)
    outcome = study([at_random, at_once])
    assert outcome.tries == 2
    assert outcome.lost == []


@pytest.mark.study
@pytest.mark.skipif(shutil.which("cc") is None, reason="the recorder needs a C compiler")
def test_nothing_that_the_screen_has_confirmed_is_lost_with_the_power() -> None:
    assert cut_power(20.0, 2.0, 12) == [""] * 12


def test_no_line_is_lost_to_a_program_that_empties_its_port_late() -> None:
    lines = [b"header\r\n", *(b"%d\r\n" % number for number in range(1, 200))]
    device = Device(20.0, lines)
    with device.sending(50):
        port = os.open(device.port.path, os.O_RDWR | os.O_NOCTTY)
        time.sleep(2.0 * OPEN_SECONDS)
        termios.tcflush(port, termios.TCIFLUSH)
        received = b""
        while received.count(b"\n") < 3 and select.select([port], [], [], 5.0)[0]:
            received += os.read(port, 4096)
        os.close(port)
    device.port.close()
    assert received.startswith(b"header\r\n50\r\n51\r\n")


def test_the_simulated_disk_keeps_what_was_synced_and_nothing_else(tmp_path: Path) -> None:
    folder = Path("/sessions")
    disk = Disk()

    def call(kind: str, name: str = "a", offset: int = 0, data: bytes = b"") -> None:
        path = folder / name if name else folder
        disk.take(Call(0.0, kind, path, offset, len(data), data))

    def left() -> dict[str, bytes]:
        for old in tmp_path.iterdir():
            old.unlink()
        disk.lose(tmp_path, None)
        return {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    call("C")
    call("W", data=b"one")
    call("S")
    assert left() == {}  # the file is safe, its name is not
    call("S", "")
    call("W", offset=3, data=b"two")
    assert left() == {"a": b"one"}
    call("T", offset=1)
    call("S")
    assert left() == {"a": b"o"}
    call("U")
    assert left() == {"a": b"o"}
    call("S", "")
    assert left() == {}
