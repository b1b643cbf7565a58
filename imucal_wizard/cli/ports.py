"""``imucal-wizard ports``: what is plugged in and what it sends."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from imucal_wizard.cli.arguments import Parser, add_json
from imucal_wizard.cli.outcome import answer

if TYPE_CHECKING:
    from imucal_wizard.acquire.listen import PortReport

USAGE = (("ports", "list the serial ports and the format of what arrives"),)


def parser() -> Parser:
    """The options of ``ports``."""
    made = Parser(
        prog="imucal-wizard ports",
        description="List the serial ports, what is plugged in, and the format that it sends.",
    )
    add_json(made)
    return made


def run(argv: Sequence[str]) -> int:
    """List the ports; listening takes about a second."""
    arguments = parser().parse_args(argv)
    from imucal_wizard.acquire.listen import listen_to_ports

    heard = listen_to_ports()
    ports = [
        {
            "device": one.port.device,
            "description": one.port.description,
            "baud": one.baud,
            "format": one.format or None,
            "rate": one.rate or None,
            "says": one.message,
        }
        for one in heard
    ]
    answer(arguments.json, {"schema": "imucal-wizard/ports/1", "ports": ports}, ports_text(heard))
    return 0


def ports_text(heard: "Sequence[PortReport]") -> str:
    """The ports in lines, with the reason for those that cannot be opened."""
    if not heard:
        return (
            "There is no serial port. Plug a device in, or use the virtual IMU: run "
            "imucal-wizard alone."
        )
    lines = []
    for one in heard:
        known = (one.port.vid_pid, one.port.description, one.port.hint)
        about = "  ".join(word for word in known if word)
        lines += [f"{one.port.device}  {about}".rstrip(), f"    {one.message}"]
    return "\n".join(lines)
