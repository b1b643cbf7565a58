"""A calibration on its way to a board: a pseudo-terminal that behaves as Adafruit's sketch does."""

import os
import select
import struct
import threading
from pathlib import Path

import pytest

from imucal_wizard.acquire import write_back
from imucal_wizard.acquire.transport import Transport
from imucal_wizard.cli import main as cli
from imucal_wizard.core.errors import LinkError
from imucal_wizard.report.exports import adafruit
from tests.acquire.ports import Pty
from tests.report.devices import calibration

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
LOOP = 0.002


class Board:
    """The sketch ``calibration.ino``: a byte in each loop, ``Cal1`` and ``Cal2`` now and then.

    Args:
        loses: how many packets lose a byte on their way.
        prints: whether it says what it has.
    """

    def __init__(self, loses: int = 0, *, prints: bool = True) -> None:
        self.pty, self._loses, self._prints = Pty(), loses, prints
        self.values = [0.0] * 10 + [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        data, loops = b"", 0
        while not self._stop.wait(LOOP):
            self.pty.send(
                b"Raw:1,-2,8192,0,0,0,120,-40,430\r\nUni:0.00,0.00,9.81,0,0,0,12,-4,43\r\n"
            )
            if select.select([self.pty.master], [], [], 0.0)[0]:
                data += os.read(self.pty.master, 8)
            data = self._received(data[data.find(b"\x75") :] if b"\x75" in data else b"")
            loops += 1
            if self._prints and loops % 40 == 20:
                numbers = ",".join(f"{value:.3f}" for value in self.values[:10])
                self.pty.send(f"Cal1:{numbers}\r\n".encode())
            if self._prints and loops % 40 == 0:
                rows = [self.values[10 + k] for k in (0, 3, 4, 3, 1, 5, 4, 5, 2)]
                self.pty.send(("Cal2:" + ",".join(f"{one:.4f}" for one in rows) + "\r\n").encode())

    def _received(self, data: bytes) -> bytes:
        if len(data) < 68:
            return data
        packet, rest = data[:68], data[68:]
        if self._loses:
            self._loses -= 1
            packet = packet[:30] + packet[31:] + b"\0"
        crc = 0xFFFF
        for byte in packet:  # bit by bit, the lowest first
            for k in range(8):
                bit = (crc ^ byte >> k) & 1
                crc = (crc >> 1) ^ (0xA001 * bit)
        if packet[:2] == b"uT" and crc == 0:
            self.values = list(struct.unpack("<16f", packet[2:66]))
        return rest

    def off(self) -> None:
        """Switch it off."""
        self._stop.set()
        self._thread.join()
        self.pty.unplug()


def test_the_board_gets_the_calibration_and_its_echo_confirms_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first packet loses a byte: the board ignores it, and it is sent again."""
    monkeypatch.setattr(write_back, "ECHO_SECONDS", 1.0)
    saved, board = calibration(felt=False).save(tmp_path / "my.json"), Board(loses=1)
    command = ["export", str(saved), "--port", board.pty.path, "--to"]
    try:
        assert cli.main([*command, "px4"]) == 2
        assert "px4 has no board" in capsys.readouterr().err
        assert cli.main([*command, "adafruit"]) == 0
    finally:
        board.off()
    assert "its echo says the same" in capsys.readouterr().out
    sent = (tmp_path / "my.adafruit-packet.bin").read_bytes()
    assert board.values == list(struct.unpack("<16f", sent[2:66]))
    assert board.values[6:9] == pytest.approx([12.0, -30.0, 7.0], rel=1e-6)


PACKET = bytes.fromhex(
    "7554cdcc4c3dcdccccbd9a99193e6f12833a6f1203bba69b443b000048410000e8c00000f041000042"
    "42ae47813f48e17a3f5c8f823fa69b443b6f1283bb0ad7a33bfe0d"
)
"""One of the wire format's description."""


@pytest.mark.parametrize(
    ("loses", "prints", "says"),
    [
        (9, True, "did not take the calibration: it echoes Cal1:0.000"),
        (0, False, "does not echo its calibration: load the calibration sketch"),
        (0, None, "prints no lines"),
    ],
)
def test_a_board_that_does_not_confirm_is_named_with_what_to_do(
    loses: int, prints: bool | None, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that never gets a whole packet, one with another sketch, and one that is silent."""
    monkeypatch.setattr(write_back, "ECHO_SECONDS", 0.6)
    monkeypatch.setattr(write_back, "BOOT_SECONDS", 0.6)
    board = Pty() if prints is None else Board(loses, prints=prints)
    port = board if isinstance(board, Pty) else board.pty
    link, files = Transport(port.path), {"-packet.bin": PACKET}
    link.open()
    try:
        with pytest.raises(LinkError, match=says):
            write_back.write_back(link, PACKET, lambda lines: adafruit.TARGET.echoed(files, lines))
    finally:
        link.close()
        board.unplug() if isinstance(board, Pty) else board.off()
