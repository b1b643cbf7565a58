"""Unexpected errors: a report is written to a file, and one line says where it is.

A report holds versions, options, the last events and the place in the program; no reading, no
result and no key of a class is in it, so that it can be shared.
"""

import re
import sys
import threading
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from imucal_wizard.core import VERSION
from imucal_wizard.core.output import note

MAX_EVENTS = 60
"""Events that a report lists."""
MAX_MESSAGE = 200
"""Characters of an error's own message; a longer one quotes what was read."""
_NUMBER = re.compile(r"[-+−]?\d+\.\d*(?:[eE][-+]?\d+)?|\d{3,}")
"""A reading or a result. Numbers of one or two digits are indices and counts."""
_LIBRARIES = ("numpy", "scipy", "textual", "rich", "serial", "msgspec", "sqlite3")
"""Libraries whose versions are reported if they are imported."""

_events: deque[tuple[float, str]] = deque(maxlen=MAX_EVENTS)
_secret: list[str] = []
"""Options whose values are not reported."""
_unprinted: list[str] = []
"""Lines about faults in threads, which are printed when the screen is closed."""


def remember(event: str) -> None:
    """Note what happens for a possible report.

    Args:
        event: kind of an event, or name of a step or command; no reading.
    """
    _events.append((time.monotonic(), event))


def write_report(error: BaseException) -> Path | None:
    """Write the report of a fault to a new file; None if that is not possible."""
    import tempfile

    from platformdirs import user_log_path

    text = report_text(error)
    name = f"fault-{time.strftime('%Y-%m-%d_%H%M%S')}-{time.monotonic_ns() % 1_000_000:06d}.txt"
    for folder in (user_log_path("imucal-wizard", appauthor=False), Path(tempfile.gettempdir())):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with (folder / name).open("x", encoding="utf-8", errors="backslashreplace") as file:
                file.write(text)
        except OSError:
            continue
        return folder / name
    return None


def report_text(error: BaseException) -> str:
    """The report of a fault."""
    import platform

    now = time.monotonic()
    versions = [f"imucal-wizard {VERSION}", f"Python {platform.python_version()}"]
    versions += [platform.platform(), *_library_versions()]
    events = [f"  {at - now:8.2f} s  {event}" for at, event in _events]
    return "\n".join(
        [
            *versions,
            f"options: {' '.join(_options(sys.argv[1:])) or 'none'}",
            f"thread: {threading.current_thread().name}",
            f"last events, the newest at the end ({len(events)}):",
            *events,
            "",
            *_traceback(error),
            "",
        ]
    )


def fault_text(error: BaseException, path: Path | None) -> str:
    """One line for the user: the fault and what to do next."""
    where = str(path) if path is not None else "the steps that led to it"
    return f"imucal-wizard has a fault ({_described(error)}). Please report it with {where}"


def hide_tracebacks(secret: Sequence[str] = ()) -> None:
    """Write the faults of all threads to files from now on, and one line for the user.

    Args:
        secret: options whose values no report has; a user may shorten them.
    """
    _secret[:] = secret
    sys.excepthook = _unforeseen
    threading.excepthook = _unforeseen_in_thread


def print_faults() -> None:
    """Print the lines about faults in threads, once."""
    while _unprinted:
        note(_unprinted.pop(0))


def _library_versions() -> list[str]:
    found = []
    for name in _LIBRARIES:
        module = sys.modules.get(name)
        version = getattr(module, "sqlite_version" if name == "sqlite3" else "__version__", None)
        if version is not None:
            found.append(f"{name} {version}")
    return found


def _options(arguments: list[str]) -> list[str]:
    """The command line without secrets."""
    shown, hide = [], False
    for one in arguments:
        option, equals, _ = one.partition("=")
        secret = len(option) > len("--") and any(name.startswith(option) for name in _secret)
        shown.append("…" if hide else f"{option}=…" if secret and equals else one)
        hide = secret and not equals
    return shown


def _traceback(error: BaseException) -> list[str]:
    """The places in the program, of this error and those that led to it, without values."""
    import traceback

    lines: list[str] = []
    found: BaseException | None = error
    while found is not None:
        frames = traceback.format_tb(found.__traceback__)
        lines = [*(line.rstrip("\n") for line in frames), _described(found), *lines]
        earlier = found.__cause__ or (None if found.__suppress_context__ else found.__context__)
        lines = ["led to:", *lines] if earlier is not None else lines
        found = earlier
    return lines


def _described(error: BaseException) -> str:
    """Kind and message of an error, without readings."""
    message = " ".join(str(error).split())[:MAX_MESSAGE]
    return f"{type(error).__name__}: {_NUMBER.sub('#', message)}".rstrip(": ")


def _unforeseen(
    _kind: type[BaseException], error: BaseException, _trace: TracebackType | None
) -> None:
    note(fault_text(error, write_report(error)))


def _unforeseen_in_thread(fault: threading.ExceptHookArgs) -> None:
    """Write the report; the owner of the thread shows on the screen that it has stopped."""
    if fault.exc_value is not None:
        _unprinted.append(fault_text(fault.exc_value, write_report(fault.exc_value)))
