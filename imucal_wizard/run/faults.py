"""Unexpected errors: the traceback is written to a file, one line goes to the user."""

import sys
import threading
import time
from pathlib import Path
from types import TracebackType

from imucal_wizard.core.output import note


def write_traceback(error: BaseException) -> Path | None:
    """Write the traceback of a fault to a new file; None if that is not possible."""
    import traceback

    from platformdirs import user_log_path

    lines = traceback.format_exception(error)
    try:
        folder = user_log_path("imucal-wizard", appauthor=False, ensure_exists=True)
        path = folder / f"fault-{time.strftime('%Y-%m-%d_%H%M%S')}.txt"
        path.write_text("".join(lines), encoding="utf-8", errors="backslashreplace")
    except OSError:
        return None
    return path


def fault_text(error: BaseException, path: Path | None) -> str:
    """One line for the user: the fault and what to do next."""
    what = f"{type(error).__name__}: {error}".strip(": ").replace("\n", " ")[:200]
    where = f"the traceback in {path}" if path is not None else "the steps that led to it"
    return (
        f"imucal-wizard has a fault ({what}). The measurements are saved. Please report it with "
        f"{where}"
    )


def hide_tracebacks() -> None:
    """Write tracebacks of all threads to files from now on, and tell the user in one line."""
    sys.excepthook = _unforeseen
    threading.excepthook = _unforeseen_in_thread


def _unforeseen(
    _kind: type[BaseException], error: BaseException, _trace: TracebackType | None
) -> None:
    note(fault_text(error, write_traceback(error)))


def _unforeseen_in_thread(fault: threading.ExceptHookArgs) -> None:
    if fault.exc_value is not None:
        write_traceback(
            fault.exc_value
        )  # the thread's owner reports on the screen that it has stopped
