"""``imucal-wizard ports``: what is plugged in and what it sends."""

from collections.abc import Sequence

from imucal_wizard.cli.arguments import Parser, add_json
from imucal_wizard.cli.outcome import write_json
from imucal_wizard.core.output import say

USAGE = (("ports", "list what is plugged in and what it sends"),)


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
    from imucal_wizard.acquire.listen import listen_to_ports, ports_report

    if not arguments.json:
        say(ports_report())
        return 0
    ports = [
        {
            "device": one.port.device,
            "description": one.port.description,
            "baud": one.baud,
            "format": one.format or None,
            "rate": one.rate or None,
            "says": one.message,
        }
        for one in listen_to_ports()
    ]
    write_json({"schema": "imucal-wizard/ports/1", "ports": ports}, arguments.json)
    return 0
