"""Entry point: runs a command and reports errors in one line. It imports only that command."""

import atexit
import gc
import os
import sys
import threading
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from imucal_wizard.core.errors import ImucalError, UsageError
from imucal_wizard.core.output import (
    note,
    readers_may_leave,
    replace_unencodable_output,
    say,
    without_control_characters,
)
from imucal_wizard.run.faults import hide_tracebacks, print_faults

OPTIONS = {
    "accelerometer_unit": "--accel-unit",
    "as_format": "--as",
    "gyroscope_unit": "--gyro-unit",
    "magnetometer_unit": "--mag-unit",
    "repair": "imucal-wizard sessions --repair",
}
"""The option for a setting that an error names, if the option has another name."""


_SHARED = ("arguments", "main", "outcome")
"""Files of this folder that are not commands."""
OBJECTS_BETWEEN_COLLECTIONS = 100_000
"""Python looks for garbage after every 700 new objects. A fit makes 50,000 in all, nearly all of
them by importing, and none of those is garbage."""


def command_names() -> list[str]:
    """Names of the commands, the wizard first: every file of this folder except the shared ones.

    A command's file has ``USAGE`` (pairs of what to type and what it does), ``parser`` and ``run``.
    """
    found = {module.name for module in iter_modules([str(Path(__file__).parent)])}
    return sorted(found - set(_SHARED), key=lambda name: (name != "wizard", name))


def usage() -> str:
    """The help of the program: a line for each way of calling each command."""
    pairs = [
        pair
        for name in command_names()
        for pair in import_module(f"imucal_wizard.cli.{name}").USAGE
    ]
    width = max(len(call) for call, _ in pairs)
    return "\n".join(
        [
            "imucal-wizard: a guided calibration of MEMS IMUs by gravity and the Earth's field.",
            "",
            *(f"  imucal-wizard {call:<{width}}  {does}" for call, does in pairs),
            "",
            "Options: imucal-wizard COMMAND --help; of the wizard: imucal-wizard wizard --help",
        ]
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program; the exit status is 0 done, 1 insufficient data, 2 wrong usage."""
    if argv is not None:
        return _status(argv)
    gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
    # threads would slow down operations on small matrices
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    replace_unencodable_output()
    hide_tracebacks(secret=("--key",))
    try:
        status = _status(sys.argv[1:])
    finally:
        print_faults()
        gc.freeze()  # else Python would look for garbage among all it has loaded before it ends
    _end_at_once(status)
    return status


def _end_at_once(status: int) -> None:
    """End the process if nothing waits for its end; Python would first free all it has loaded.

    A second thread, a function registered for the end or an open database waits for it; so does
    output that cannot be written, which Python reports.
    """
    waiting = threading.active_count() > 1 or "sqlite3" in sys.modules
    if waiting or atexit._ncallbacks():  # there is no public name for it
        return
    try:
        for stream in (sys.stdout, sys.stderr):
            with readers_may_leave(stream):
                stream.flush()
    except (OSError, ValueError):
        return
    os._exit(status)


def _status(arguments: Sequence[str]) -> int:
    try:
        return _dispatch(list(arguments))
    except ImucalError as error:
        note(f"imucal-wizard: {_one_line(str(error))}{_options(error)}")
        return error.exit_status
    except KeyboardInterrupt:
        print("imucal-wizard: stopped", file=sys.stderr)
        return 130


def _dispatch(arguments: list[str]) -> int:
    if arguments[:1] in (["-h"], ["--help"], ["help"]):
        say(usage())
        return 0
    if arguments[:1] == ["--version"]:
        from imucal_wizard import __version__

        say(f"imucal-wizard {__version__}")
        return 0
    command, names = "wizard", command_names()
    if arguments and arguments[0] in names:
        command, *arguments = arguments
    elif arguments and not arguments[0].startswith("-"):
        raise UsageError(_no_command(arguments[0], names))
    run = import_module(f"imucal_wizard.cli.{command}").run
    return int(run(arguments))


def _no_command(name: str, names: Sequence[str]) -> str:
    from difflib import get_close_matches

    near = get_close_matches(name, names, n=1)
    meant = f"did you mean '{near[0]}'?" if near else f"the commands are {', '.join(names)}."
    return f"there is no command '{name}'; {meant} See: imucal-wizard --help"


def _options(error: ImucalError) -> str:
    """The options for the settings that an error names, in brackets."""
    parts = (setting.partition(" ") for setting in error.settings)
    options = [
        OPTIONS.get(name, "--" + name.replace("_", "-")) + space + value
        for name, space, value in parts
    ]
    return f" ({' '.join(options)})" if options else ""


def _one_line(text: str) -> str:
    """The message on one line, without control characters from a device or file."""
    return without_control_characters(" ".join(text.split()))


if __name__ == "__main__":
    sys.exit(main())
