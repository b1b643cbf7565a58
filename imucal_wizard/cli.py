"""The commands. Each is imported when it is called, so that none pays for another's imports."""

import os
import sys
from collections.abc import Sequence
from importlib import import_module

from imucal_wizard.errors import ImucalError
from imucal_wizard.faults import watch
from imucal_wizard.output import harmless, never_fail_to_encode, note

COMMANDS = ("fit", "compare", "bench", "simulate", "ports", "wizard")

USAGE = """\
imucal-wizard: a guided calibration of MEMS IMUs by gravity and the Earth's field.

  imucal-wizard                    open the wizard (on the virtual IMU unless a port is given)
  imucal-wizard --magnetometer     the same with a magnetometer in the virtual IMU
  imucal-wizard --port PORT        the wizard on a serial port or URL
  imucal-wizard --replay FILE...   the wizard on a recording or session
  imucal-wizard --resume SESSION   go on where a session was left
  imucal-wizard --auto --quit      the virtual hand performs everything
  imucal-wizard --mystery          an exercise: find what chance has hidden in the virtual IMU
  imucal-wizard fit FILE...        fit a recording
  imucal-wizard compare FILE...    fit a recording by all methods, side by side
  imucal-wizard bench FILE...      find what the model lacks: compare, rank, add
  imucal-wizard simulate OUT.csv   write a recording of the virtual IMU
  imucal-wizard ports              what is plugged in and what speaks there

Options of each: imucal-wizard COMMAND --help; of the wizard: imucal-wizard wizard --help
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program; the exit status is 0 done, 1 the data do not carry it, 2 wrong usage."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if argv is None:
        # the matrices here are small: threads would spend more CPU on waiting for one another
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        never_fail_to_encode()
        watch()
    try:
        return _dispatch(arguments)
    except ImucalError as error:
        note(f"imucal-wizard: {_one_line(str(error))}")
        return error.exit_status
    except KeyboardInterrupt:
        print("imucal-wizard: stopped", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # the reader of our output has gone; there is nobody left to tell
        sys.stderr.close()
        return 0


def _dispatch(arguments: list[str]) -> int:
    if arguments[:1] in (["-h"], ["--help"], ["help"]):
        print(USAGE, end="")
        return 0
    if arguments[:1] == ["--version"]:
        from imucal_wizard import __version__

        print(f"imucal-wizard {__version__}")
        return 0
    command = "wizard"
    if arguments and arguments[0] in COMMANDS:
        command, *arguments = arguments
    run = import_module(f"imucal_wizard.commands.{command}").run
    return int(run(arguments))


def _one_line(text: str) -> str:
    """The message on one line, without control characters a device or file may have put in."""
    return harmless(" ".join(text.split()))


if __name__ == "__main__":
    sys.exit(main())
