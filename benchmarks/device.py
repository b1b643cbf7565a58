"""A device for the measurements: a process of its own that writes prepared lines to a pty.

``python -m benchmarks.device RATE SECONDS [SCRIPT]`` prints what to open, waits until that is
open, writes by the clock whether anybody reads or not, and then says how many lines it sent.
Like a real port it never waits: what the line's buffer does not take is lost.
"""

import json
import os
import select
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import Self

import numpy as np

from benchmarks.measure import PYTHON
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Rotate
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.imu import HEADER_PERIOD_SECONDS, LinePrinter
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.scripts import FACE_NAMES
from imucal_wizard.simulate.sensor import SensorModel
from imucal_wizard.simulate.terminal import Pty

SEED = 0
REST = 20.0
"""Seconds of rest at the beginning: the settle step needs ten."""
TURNING = 15.0
"""Seconds of turning without a pause after it, in ``turning``."""
GRACE = 0.05
"""Whoever opens a port sets it up and empties it first, s."""
TICK = 0.001
"""The device writes once in a millisecond, as a USB port does."""
_LATE = 4
"""A writer that was held up sends at most so many milliseconds' lines at once."""
_LINE = ",".join(["%.6f", *["%.8f"] * 3, *["%.10f"] * 3, "%.3f"]) + "\r\n"


def poses() -> Iterator[Action]:
    """A rest and then pose after pose."""
    yield LieStill(REST)
    while True:
        for name in FACE_NAMES:
            yield PlacePose(name)
            yield LieStill(3.0)


def turning() -> Iterator[Action]:
    """A rest, turning to and fro without a pause, then pose after pose."""
    yield LieStill(REST)
    for index in range(round(TURNING / 2.0)):
        yield Rotate("xyz"[index % 3], 120.0 if index % 2 else -120.0, 112.0)
    yield from poses()


SCRIPTS: dict[str, Callable[[], Iterator[Action]]] = {"poses": poses, "turning": turning}


def prepared(rate: float, seconds: float, script: str) -> list[bytes]:
    """All lines of the stream, plain bytes; a header before the first and every five seconds."""
    sensor = SensorModel.drawn(SEED)
    hand = VirtualHand(rate, SEED)
    actions = SCRIPTS[script]()
    stream = VirtualStream(hand, sensor, rate=rate, seed=SEED)
    lines: list[bytes] = []
    while len(lines) < rate * seconds:
        while not (count := hand.remaining(4096)):
            hand.perform([next(actions)])
        part = stream.take(count)
        table = np.column_stack([part.time, part.accelerometer, part.gyroscope, part.temperature])
        lines += [(_LINE % tuple(row)).encode() for row in table.tolist()]
    lines = lines[: round(rate * seconds)]
    header = LinePrinter(sensor).header
    for index in range(0, len(lines), round(HEADER_PERIOD_SECONDS * rate)):
        lines[index] = header + lines[index]
    return lines


def send(endpoint: Pty, lines: list[bytes], rate: float) -> int:
    """Write by the clock; how many bytes were lost because nobody fetched those before them."""
    most = max(1, round(_LATE * TICK * rate))
    start, sent, refused = time.monotonic(), 0, 0
    while sent < len(lines):
        due = min(round((time.monotonic() - start) * rate), sent + most, len(lines))
        data = b"".join(lines[sent:due])
        refused += len(data) - endpoint.write(data) if data else 0
        sent = due
        time.sleep(TICK)  # the device's own clock: it writes by time, as a USB port does
    return refused


class Device:
    """The process that writes, seen from the side that reads.

    Attributes:
        port: what to open.
    """

    def __init__(self, rate: float, seconds: float, script: str = "poses") -> None:
        command = [PYTHON, "-m", "benchmarks.device", str(rate), str(seconds), script]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
        self.port = self._said().strip()

    def _said(self) -> str:
        return self._process.stdout.readline() if self._process.stdout else ""

    @property
    def sending(self) -> bool:
        """Whether there are lines left to be written."""
        said = self._process.stdout
        if said is None or self._process.poll() is not None:
            return False
        return not select.select([said], [], [], 0.0)[0]

    def sent(self) -> tuple[int, int, float]:
        """Lines written, bytes that the line's buffer refused, mean length of a line.

        Waits until everything has been written; the port stays open.
        """
        said = json.loads(self._said())
        return said["lines"], said["refused"], said["length"]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.communicate()


def main() -> None:
    """Be the device."""
    rate, seconds, script = float(sys.argv[1]), float(sys.argv[2]), sys.argv[3]
    lines = prepared(rate, seconds, script)
    endpoint = Pty()
    print(endpoint.path, flush=True)
    parent = os.getppid()
    while not endpoint.connected():
        time.sleep(TICK)  # a pty tells nobody that its other end was opened
        if os.getppid() != parent:
            return
    time.sleep(GRACE)  # until whoever opened it has emptied it; nothing tells when that is done
    endpoint.read()
    refused = send(endpoint, lines, rate)
    length = sum(map(len, lines)) / len(lines)
    print(json.dumps({"lines": len(lines), "refused": refused, "length": length}), flush=True)
    sys.stdin.read()  # what was written last is still being read: stay until the reader has gone


if __name__ == "__main__":
    main()
