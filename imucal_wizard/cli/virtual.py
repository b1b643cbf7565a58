"""``imucal-wizard virtual``: the virtual IMU on a pseudo-terminal, for ``--port``."""

import argparse
import signal
import sys
import threading
from collections.abc import Sequence
from types import FrameType
from typing import TYPE_CHECKING

from imucal_wizard.cli.arguments import Parser, add_sensor, add_speed, positive
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.output import note, say

if TYPE_CHECKING:  # numpy is imported after the options are checked
    from imucal_wizard.simulate.hand import VirtualHand

USAGE = (("virtual", "the virtual IMU on a port, for --port in another terminal"),)
COMMANDS = """\
Lines on standard input move the device, one after the other:
  +x, +x-y, -x+y+z   bring this pose on top
  turn x 90          turn about x, y or z by so many degrees
  rest 5             lie still for so many seconds
  hold, lay          hold it in a trembling hand; lay it down
  steel              let something of steel pass by
  quit               stop
"""


def parser() -> Parser:
    """The options of ``virtual``."""
    made = Parser(
        prog="imucal-wizard virtual",
        description="Offer the virtual IMU on a pseudo-terminal until it is stopped.\n"
        "Its path is printed; open it in another terminal: imucal-wizard --port PATH",
        epilog=COMMANDS,
        formatter=argparse.RawDescriptionHelpFormatter,
    )
    add_sensor(made)
    made.add_argument(
        "--rate", type=positive, default=100.0, metavar="HZ", help="samples per second (100)"
    )
    add_speed(made, "the device")
    made.add_argument("--magnetometer", action="store_true", help="with a magnetometer")
    return made


def run(argv: Sequence[str]) -> int:
    """Serve the device until it is interrupted or gets ``quit``."""
    arguments = parser().parse_args(argv)
    # Ctrl+C is the usual way to stop: it ends the command with 0 wherever the main thread is
    signal.signal(signal.SIGINT, _stop)
    from imucal_wizard.simulate.imu import VirtualImu
    from imucal_wizard.simulate.terminal import Pty, serve

    imu = VirtualImu(
        arguments.rate,
        arguments.seed or 0,
        arguments.speed,
        hidden=arguments.hidden,
        magnetometer=arguments.magnetometer,
    )
    pty, stopping = Pty(), threading.Event()
    say(pty.path, flush=True)
    if sys.stdin.isatty():
        note(
            f"Open it in another terminal: imucal-wizard --port {pty.path}\n"
            "Move it with lines like: +x (that face on top), turn z 90, rest 5; quit ends. "
            "--help lists all."
        )
    threading.Thread(target=_listen, args=(imu.hand, stopping), daemon=True).start()
    serve(imu, pty, stopping)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    pty.close()
    return 0


def _stop(_signal: int, _frame: FrameType | None) -> None:
    """End the process; another Ctrl+C while it ends is ignored."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.exit(0)


def _listen(hand: "VirtualHand", stopping: threading.Event) -> None:
    """Carry out the lines on standard input until ``quit``."""
    for line in sys.stdin:
        if line.strip() == "quit":
            stopping.set()
            return
        try:
            _obey(hand, line.split())
        except UsageError as error:
            note(f"imucal-wizard: {error}")


def _obey(hand: "VirtualHand", words: list[str]) -> None:
    """Carry out a line.

    Raises:
        UsageError: the line is not understood.
    """
    match words:
        case []:
            return
        case ["turn", axis, degrees]:
            hand.turn(axis, _number(degrees))
        case ["rest", seconds]:
            hand.rest(_number(seconds))
        case ["hold"]:
            hand.tremble(True)
        case ["lay"]:
            hand.tremble(False)
        case ["steel"]:
            hand.pass_steel()
        case [pose]:
            hand.snap_to(pose)
        case _:
            raise UsageError(f"{' '.join(words)!r} is not understood; see --help")


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"{text!r} is not a number") from None
