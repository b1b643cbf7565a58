"""Listening to every port for a moment to find devices and their formats."""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from imucal_wizard.acquire.decode import is_binary
from imucal_wizard.acquire.detect import (
    BAUDS,
    MAX_UNREADABLE_SHARE,
    unreadable_share,
    wrong_speed_text,
)
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.ports import PortInfo, list_ports
from imucal_wizard.acquire.transport import Transport
from imucal_wizard.core.errors import LinkError
from imucal_wizard.core.records import dataclass

_LISTEN_SECONDS = 1.2
"""Time to listen at one speed, s: a slow device sends a dozen samples."""
_MAX_SPEEDS = 3
"""Other speeds that are tried if a port sends garbage."""
_USUAL_BAUD = BAUDS[0]


@dataclass(frozen=True)
class PortReport:
    """The result of listening to one port.

    Attributes:
        port: the port.
        baud: the speed of reception.
        format: name of the format, or ``""``.
        rate: samples per second, 0 if unknown.
        line: the newest line, safe to show.
        message: one sentence for the user.
        garbled: whether the received bytes were not text.
    """

    port: PortInfo
    baud: int = _USUAL_BAUD
    format: str = ""
    rate: float = 0.0
    line: str = ""
    message: str = ""
    garbled: bool = False


def listen_to_port(port: PortInfo, seconds: float = _LISTEN_SECONDS) -> PortReport:
    """Listen to one port without sending anything; if it sends garbage, try other speeds."""
    heard = _hear_at(port, _USUAL_BAUD, seconds)
    if not heard.garbled or not port.vid_pid:
        return heard
    others = BAUDS[1 : 1 + _MAX_SPEEDS]
    found = (_hear_at(port, speed, seconds / 2) for speed in others)
    return next((other for other in found if other.format), heard)


def listen_to_ports(find: Callable[[], list[PortInfo]] = list_ports) -> list[PortReport]:
    """Listen to all ports at the same time."""
    ports = find()
    if not ports:
        return []
    with ThreadPoolExecutor(max_workers=min(16, len(ports))) as pool:
        return list(pool.map(listen_to_port, ports))


def _hear_at(port: PortInfo, baud: int, seconds: float) -> PortReport:
    transport = Transport(port.device, baud, find=lambda: [port])
    intake = Intake()
    data = b""
    try:
        transport.open()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            piece = transport.read(timeout=0.05)
            data += piece
            if piece:
                intake.feed(piece, time.monotonic())
    except LinkError as error:
        return PortReport(port, baud, message=str(error))
    finally:
        transport.close()
    return _judged(port, baud, data, intake, seconds)


def _judged(port: PortInfo, baud: int, data: bytes, intake: Intake, seconds: float) -> PortReport:
    line = intake.preview.line
    if not data:
        message = "open, but silent: it sends nothing by itself, or another program has its data."
        return PortReport(port, baud, message=message)
    if not intake.format:
        garbled = unreadable_share(data) > MAX_UNREADABLE_SHARE
        text = f"text at {baud} baud, no samples known here: {line}"
        message = (
            (intake.problem or wrong_speed_text(unreadable_share(data), baud)) if garbled else text
        )
        return PortReport(port, baud, line=line, message=message, garbled=garbled)
    rows = data.count(b"\n") / seconds
    rate = intake.measured_rate
    about = f"{rate:.1f} samples/s" if rate else f"about {rows:.0f} lines/s"
    if not rate and is_binary(intake.format):
        about = "rate not known yet"
    asks = f"; asks for {' and '.join(intake.needs)}" if intake.needs else ""
    names = ",".join(c.channel for c in intake.columns if c.channel)
    message = f"speaks {intake.format} at {baud} baud, {about}, {names or 'columns unknown'}{asks}"
    return PortReport(port, baud, intake.format, rate, line, message)
