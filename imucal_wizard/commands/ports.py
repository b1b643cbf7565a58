"""``imucal-wizard ports``: what is plugged in and what speaks there."""

from collections.abc import Sequence

from imucal_wizard.commands.arguments import Parser
from imucal_wizard.output import say


def run(argv: Sequence[str]) -> int:
    """List the ports; listening to each takes about a second."""
    made = Parser(
        prog="imucal-wizard ports",
        description="List the serial ports, what is plugged in, and what speaks there.",
    )
    made.parse_args(argv)
    from imucal_wizard.devices.ports import ports_report

    say(ports_report())
    return 0
