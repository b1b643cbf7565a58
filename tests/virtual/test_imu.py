"""The virtual IMU on its line: what a reader on a real port gets."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest
import serial

from imucal_wizard.devices.virtual import SensorModel, VirtualImu
from imucal_wizard.devices.virtual.actions import Action, Place, Rest, Turn
from imucal_wizard.devices.virtual.hand import VirtualHand
from imucal_wizard.devices.virtual.line import LinePrinter
from imucal_wizard.devices.virtual.stream import VirtualStream
from imucal_wizard.errors import LinkError, UsageError
from tests.virtual.sensors import ideal, offset_binary

HEADER = b"t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s],temp[degC]"
SCRIPT: list[Action] = [Rest(1.0), Place("+x"), Rest(1.0), Turn("z", 90.0), Rest(1.0)]
DEADLINE = 15.0
UNHURRIED = float("inf")

needs_pty = pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
lines_of_both_kinds = pytest.mark.parametrize(
    "loopback", [pytest.param(False, marks=needs_pty), True], ids=["pty", "socket"]
)


@contextmanager
def _port(url: str) -> Iterator[serial.Serial]:
    port = serial.serial_for_url(url, timeout=0.05)
    try:
        yield port
    finally:
        port.close()


def _read(port: serial.Serial, enough: Callable[[bytes], bool]) -> bytes:
    """Read until there is enough, or fail at the deadline."""
    data, end = b"", time.monotonic() + DEADLINE
    while not enough(data):
        assert time.monotonic() < end, f"only {len(data)} bytes came"
        data += port.read(1024)
    return data


def _lines(url: str, count: int) -> list[bytes]:
    """The first complete lines that come, headers included."""
    with _port(url) as port:
        data = _read(port, lambda data: data.count(b"\n") >= count)
    return data.split(b"\r\n")[:count]


def _samples(url: str, count: int) -> list[bytes]:
    lines = _lines(url, count + count // 400 + 2)
    return [line for line in lines if not line.startswith(b"t")][:count]


@lines_of_both_kinds
def test_a_port_gives_the_samples_of_the_same_seed(loopback: bool) -> None:
    """What pyserial reads is what hand and sensor of that seed make, from the first sample."""
    with VirtualImu(seed=4, speed=UNHURRIED, loopback=loopback) as imu:
        imu.hand.perform(SCRIPT)
        got = _samples(imu.start(), 600)
    hand, sensor = VirtualHand(seed=4), SensorModel.drawn(4)
    hand.perform(SCRIPT)
    expected = LinePrinter(sensor).lines(VirtualStream(hand, sensor, seed=4).take(600))
    assert got == expected.split(b"\r\n")[:600]


@lines_of_both_kinds
def test_speed_changes_nothing_in_the_samples(loopback: bool) -> None:
    """At 20 times and 200 times the speed the same lines come."""
    runs = []
    for speed in (20.0, 200.0):
        with VirtualImu(seed=9, speed=speed, loopback=loopback) as imu:
            imu.hand.perform(SCRIPT)
            runs.append(_samples(imu.start(), 500))
    assert runs[0] == runs[1]


@needs_pty
def test_lines_come_at_their_rate() -> None:
    """100 Hz at 10 times the speed is about 1,000 lines a second, and device time follows."""
    with VirtualImu(speed=10.0) as imu, _port(imu.start()) as port:
        _read(port, lambda data: data.count(b"\n") > 10)
        begin = time.monotonic()
        data = _read(port, lambda data: data.count(b"\n") > 1000)
        seconds = time.monotonic() - begin
    times = [float(line.split(b",")[0]) for line in data.split(b"\r\n")[1:-1] if line[:1] != b"t"]
    assert 0.7 < seconds < 2.5
    np.testing.assert_allclose(np.diff(times), 0.01, atol=1e-9)


@lines_of_both_kinds
def test_the_header_comes_first_and_again_every_five_seconds(loopback: bool) -> None:
    """Whoever opens the port is told the columns at once, and again later."""
    with VirtualImu(rate=20.0, speed=UNHURRIED, loopback=loopback) as imu:
        lines = _lines(imu.start(), 310)
    headers = [index for index, line in enumerate(lines) if line == HEADER]
    assert headers == [0, 101, 202, 303]


@lines_of_both_kinds
def test_who_opens_the_port_later_gets_a_header_and_whole_lines(loopback: bool) -> None:
    """Time has stood still meanwhile. What was on its way just then may come before the header."""
    with VirtualImu(speed=20.0, loopback=loopback) as imu:
        url = imu.start()
        first = _samples(url, 100)
        lines = _lines(url, 150)
    lines = lines[lines.index(HEADER) :]
    assert len(lines) > 50
    assert all(line.count(b",") == 7 for line in lines)
    gap = float(lines[1].split(b",")[0]) - float(first[-1].split(b",")[0])
    assert 0.0 < gap < 20.0


@lines_of_both_kinds
def test_what_the_host_sends_asks_for_the_header(loopback: bool) -> None:
    """Any byte brings the header."""
    with VirtualImu(speed=1.0, loopback=loopback) as imu, _port(imu.start()) as port:
        _read(port, lambda data: data.count(b"\n") >= 3)
        port.write(b"h")
        _read(port, lambda data: HEADER in data)


@needs_pty
def test_a_slow_reader_loses_nothing() -> None:
    """The device waits for a reader that takes 512 bytes at a time."""
    with VirtualImu(speed=UNHURRIED) as imu, _port(imu.start()) as port:
        data, end = b"", time.monotonic() + DEADLINE
        while data.count(b"\n") < 700 and time.monotonic() < end:
            data += port.read(min(512, max(1, port.in_waiting)))
    lines = [line for line in data.split(b"\r\n")[:-1] if line != HEADER]
    times = [float(line.split(b",")[0]) for line in lines]
    np.testing.assert_allclose(times, np.arange(len(times)) * 0.01, atol=1e-9)
    assert len(times) > 600


@lines_of_both_kinds
@pytest.mark.parametrize("listening", [False, True], ids=["nobody listens", "nobody reads"])
def test_it_stops_at_once(loopback: bool, listening: bool) -> None:
    """Within 100 ms, whether nobody has opened the port or the line is full."""
    imu = VirtualImu(speed=UNHURRIED, loopback=loopback)
    url = imu.start()
    port = serial.serial_for_url(url, timeout=0.05) if listening else None
    if port is not None:
        _read(port, lambda data: len(data) > 10_000)
    begin = time.monotonic()
    imu.stop()
    assert time.monotonic() - begin < 0.1
    imu.stop()
    if port is not None:
        port.close()


def test_it_runs_once_at_a_time_and_can_start_again() -> None:
    """Starting twice is refused; after a stop it goes on."""
    with VirtualImu(speed=UNHURRIED) as imu:
        imu.start()
        with pytest.raises(LinkError, match="runs already"):
            imu.start()
        imu.stop()
        assert _lines(imu.start(), 3)[0] == HEADER


@needs_pty
def test_keys_move_the_device_while_it_streams() -> None:
    """After a turn by 90° about x, gravity is read on the y axis."""
    with VirtualImu(speed=20.0, sensor=ideal()) as imu, _port(imu.start()) as port:
        _read(port, lambda data: data.count(b"\n") > 20)
        imu.hand.turn("x", 90.0)

        def upright(data: bytes) -> bool:
            rows = [line.split(b",") for line in data.split(b"\r\n")[:-1]]
            return any(len(row) == 8 and row[2][:2] == b"9." for row in rows)

        _read(port, upright)


def test_raw_counts_are_printed_as_whole_numbers() -> None:
    """The header says count, and no decimals follow."""
    with VirtualImu(speed=UNHURRIED, sensor=offset_binary(SensorModel.drawn(1))) as imu:
        lines = _lines(imu.start(), 3)
    assert lines[0] == HEADER.replace(b"m/s^2", b"count").replace(b"rad/s", b"count")
    assert all(32768 - 6000 < int(field) < 32768 + 6000 for field in lines[1].split(b",")[1:7])


def test_a_hidden_effect_reaches_the_line() -> None:
    """A sensor with 50 mg of warm-up reads that much more on that axis when it is switched on."""
    runs = []
    for hidden in ((), ("warm-up:50:x",)):
        with VirtualImu(speed=UNHURRIED, hidden=hidden) as imu:
            line = _samples(imu.start(), 1)[0]
        runs.append([float(field) for field in line.split(b",")])
    difference = np.subtract(runs[1], runs[0])
    assert difference[1] == pytest.approx(0.05 * 9.80665, rel=0.06)
    assert not difference[4:7].any()
    with pytest.raises(UsageError, match="no effect"):
        VirtualImu(hidden=["wobble:1:x"])


def test_a_speed_that_stands_still_is_refused() -> None:
    """Zero, negative and not-a-number speeds are told apart from slow ones."""
    for speed in (0.0, -1.0, float("nan")):
        with pytest.raises(UsageError, match="stands still"):
            VirtualImu(speed=speed)
