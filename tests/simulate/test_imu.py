"""The virtual IMU, pulled and on a real pseudo-terminal: what a reader gets."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import numpy as np
import pytest
import serial

from imucal_wizard.core.errors import UsageError
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Rotate
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.imu import LinePrinter, VirtualImu
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.sensor import SensorModel
from tests.simulate.sensors import ideal, offset_binary
from tests.simulate.served import served
from tests.waiting import AT_ONCE, received

HEADER = b"t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s],temp[degC]"
SCRIPT: list[Action] = [
    LieStill(1.0),
    PlacePose("+x"),
    LieStill(1.0),
    Rotate("z", 90.0),
    LieStill(1.0),
]
UNHURRIED = float("inf")

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")


@contextmanager
def _port(url: str) -> Iterator[serial.Serial]:
    port = serial.serial_for_url(url, timeout=0.05)
    try:
        yield port
    finally:
        port.close()


def _read(port: serial.Serial, enough: Callable[[bytes], bool]) -> bytes:
    """Read until there is enough; fail if it never comes."""
    return received(lambda: port.read(1024), enough)


def _lines(url: str, count: int) -> list[bytes]:
    """The first complete lines that come, headers included."""
    with _port(url) as port:
        data = _read(port, lambda data: data.count(b"\n") >= count)
    return data.split(b"\r\n")[:count]


def _samples(url: str, count: int) -> list[bytes]:
    lines = _lines(url, count + count // 400 + 2)
    return [line for line in lines if not line.startswith(b"t")][:count]


def test_a_port_gives_the_samples_of_the_same_seed() -> None:
    """What pyserial reads is what hand and sensor of that seed make, from the first sample."""
    imu = VirtualImu(seed=4, speed=UNHURRIED)
    imu.hand.perform(SCRIPT)
    with served(imu) as path:
        got = _samples(path, 600)
    hand, sensor = VirtualHand(seed=4), SensorModel.drawn(4)
    hand.perform(SCRIPT)
    expected = LinePrinter(sensor).lines(VirtualStream(hand, sensor, seed=4).take(600))
    assert got == expected.split(b"\r\n")[:600]


def test_speed_changes_nothing_in_the_samples() -> None:
    """At 20 times and 200 times the speed the same lines come."""
    runs = []
    for speed in (20.0, 200.0):
        imu = VirtualImu(seed=9, speed=speed)
        imu.hand.perform(SCRIPT)
        with served(imu) as path:
            runs.append(_samples(path, 500))
    assert runs[0] == runs[1]


def test_lines_come_at_their_rate() -> None:
    """100 Hz at 10 times the speed: 1,000 lines in a second, not in ten; device time follows."""
    with served(VirtualImu(speed=10.0)) as path, _port(path) as port:
        _read(port, lambda data: data.count(b"\n") > 10)
        begin = time.monotonic()
        data = _read(port, lambda data: data.count(b"\n") > 1000)
        seconds = time.monotonic() - begin
    times = [float(line.split(b",")[0]) for line in data.split(b"\r\n")[1:-1] if line[:1] != b"t"]
    assert 0.7 < seconds < 10.0
    np.testing.assert_allclose(np.diff(times), 0.01, atol=1e-9)


def test_the_header_comes_first_and_again_every_five_seconds() -> None:
    """Whoever opens the port is told the columns at once, and again later."""
    with served(VirtualImu(rate=20.0, speed=UNHURRIED)) as path:
        lines = _lines(path, 310)
    headers = [index for index, line in enumerate(lines) if line == HEADER]
    assert headers == [0, 101, 202, 303]


def test_who_opens_the_port_later_gets_a_header_and_whole_lines() -> None:
    """Time has stood still meanwhile. What was on its way just then may come before the header."""
    with served(VirtualImu(speed=20.0)) as path:
        first = _samples(path, 100)
        lines = _lines(path, 150)
    lines = lines[lines.index(HEADER) :]
    assert len(lines) > 50
    assert all(line.count(b",") == 7 for line in lines)
    gap = float(lines[1].split(b",")[0]) - float(first[-1].split(b",")[0])
    assert 0.0 < gap < 20.0


def test_what_the_host_sends_asks_for_the_header() -> None:
    """Any byte brings the header, long before it comes by itself after 500 lines."""
    with served(VirtualImu(speed=1.0)) as path, _port(path) as port:
        _read(port, lambda data: data.count(b"\n") >= 3)
        port.write(b"h")
        data = _read(port, lambda data: HEADER in data)
    assert data[: data.index(HEADER)].count(b"\n") < 400


def test_a_slow_reader_loses_nothing() -> None:
    """The device waits for a reader that takes 512 bytes at a time."""
    with served(VirtualImu(speed=UNHURRIED)) as path, _port(path) as port:
        data = received(
            lambda: port.read(min(512, max(1, port.in_waiting))),
            lambda data: data.count(b"\n") >= 700,
        )
    lines = [line for line in data.split(b"\r\n")[:-1] if line != HEADER]
    times = [float(line.split(b",")[0]) for line in lines]
    np.testing.assert_allclose(times, np.arange(len(times)) * 0.01, atol=1e-9)
    assert len(times) > 600


@pytest.mark.parametrize("listening", [False, True], ids=["nobody listens", "nobody reads"])
def test_it_stops_at_once(listening: bool) -> None:
    """Whether nobody has opened the port or the line is full."""
    with ExitStack() as stack:
        with served(VirtualImu(speed=UNHURRIED)) as path:
            if listening:
                port = stack.enter_context(_port(path))
                _read(port, lambda data: len(data) > 10_000)
            begin = time.monotonic()
        assert time.monotonic() - begin < AT_ONCE


def test_keys_move_the_device_while_it_streams() -> None:
    """After a turn by 90° about x, gravity is read on the y axis."""
    imu = VirtualImu(speed=20.0, sensor=ideal())
    with served(imu) as path, _port(path) as port:
        _read(port, lambda data: data.count(b"\n") > 20)
        imu.hand.turn("x", 90.0)
        data = _read(port, lambda data: data.count(b"\n") > 400)
    row = data.split(b"\r\n")[-2].split(b",")
    assert [float(value) for value in row[1:4]] == pytest.approx([0.0, 9.8, 0.0], abs=0.5)


def test_raw_counts_are_printed_as_whole_numbers() -> None:
    """The header says count, and no decimals follow."""
    imu = VirtualImu(speed=UNHURRIED, sensor=offset_binary(SensorModel.drawn(1)))
    lines = imu.read().split(b"\r\n")
    assert lines[0] == HEADER.replace(b"m/s^2", b"count").replace(b"rad/s", b"count")
    assert all(32768 - 6000 < int(field) < 32768 + 6000 for field in lines[1].split(b",")[1:7])


def test_a_hidden_effect_reaches_the_line() -> None:
    """A sensor with 50 mg of warm-up reads that much more on that axis when it is switched on."""
    runs = []
    for hidden in ((), ("warm-up:50:x",)):
        line = VirtualImu(speed=UNHURRIED, hidden=hidden).read().split(b"\r\n")[1]
        runs.append([float(field) for field in line.split(b",")])
    difference = np.subtract(runs[1], runs[0])
    assert difference[1] == pytest.approx(0.05 * 9.80665, rel=0.06)
    assert not difference[4:7].any()
    with pytest.raises(UsageError, match="no effect"):
        VirtualImu(hidden=["wobble:1:x"])


def test_an_impossible_speed_is_refused() -> None:
    """Zero, negative and not-a-number speeds are told apart from slow ones."""
    for speed in (0.0, -1.0, float("nan")):
        with pytest.raises(UsageError, match="is impossible"):
            VirtualImu(speed=speed)
