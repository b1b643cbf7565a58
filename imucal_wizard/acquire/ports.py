"""The serial ports of this machine, each with a hint of the device."""

import contextlib
import os

from imucal_wizard.core.output import sanitise
from imucal_wizard.core.records import dataclass

_HINTS: dict[str, str] = {
    "2341": "Arduino",
    "2A03": "Arduino",
    "1A86": "CH340 USB bridge (Arduino clone, ESP board)",
    "10C4": "CP210x USB bridge (ESP board)",
    "0403": "FTDI USB bridge",
    "16C0": "Teensy",
    "239A": "Adafruit board",
    "2E8A": "Raspberry Pi RP2040 or RP2350",
    "303A": "Espressif board with native USB",
    "1B4F": "SparkFun board",
    "2639": "Xsens",
    "1209": "ArduPilot or another open-hardware board",
    "26AC": "PX4 flight controller",
    "2DAE": "CubePilot flight controller",
    "0483": "STM32 board (often a flight controller)",
    "199B": "MicroStrain",
}


@dataclass(frozen=True)
class PortInfo:
    """One serial port of this machine.

    Attributes:
        device: name to open, ``/dev/ttyACM0`` or ``COM5``.
        description: name given by the system.
        vid_pid: USB vendor and product as ``2341:0043``, or ``""`` if it is not on USB.
        serial_number: the USB serial number, or ``""``.
        hint: the usual device of this vendor, or ``""``.
    """

    device: str
    description: str = ""
    vid_pid: str = ""
    serial_number: str = ""
    hint: str = ""


def hint_for(vid_pid: str) -> str:
    """The usual device of this vendor; ``""`` if the vendor is unknown."""
    return _HINTS.get(vid_pid.partition(":")[0].upper(), "")


def list_ports() -> list[PortInfo]:
    """Every serial port that the system lists, USB devices first."""
    from serial.tools.list_ports import comports

    found: list[PortInfo] = []
    with contextlib.suppress(OSError):
        for port in comports():
            known = port.vid is not None and port.pid is not None
            vid_pid = f"{port.vid:04X}:{port.pid:04X}" if known else ""
            words = port.description if port.description not in (None, "n/a") else ""
            found.append(
                PortInfo(
                    port.device,
                    sanitise(words or ""),
                    vid_pid,
                    sanitise(port.serial_number or ""),
                    hint_for(vid_pid),
                )
            )
    return sorted(found, key=lambda info: (not info.vid_pid, info.device))


def same_device(port: str, ports: list[PortInfo]) -> PortInfo | None:
    """The listed port behind this path; a link such as ``/dev/serial/by-id/…`` is followed."""
    real = os.path.realpath(port)
    return next((p for p in ports if p.device in (port, real)), None)
