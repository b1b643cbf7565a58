"""Messages about ports that cannot be opened or read."""

import errno
import os
import sys
from pathlib import Path

_MISSING = (errno.ENOENT, errno.ENODEV, errno.ENXIO)
_DENIED = (errno.EACCES, errno.EPERM)
_BUSY = (errno.EAGAIN, errno.EBUSY)


def open_error_text(port: str, error: BaseException, known: list[str]) -> str:
    """Message about a port that cannot be opened.

    Args:
        port: the path or URL.
        error: the exception.
        known: the existing ports, for the advice.
    """
    if "://" in port:
        return _cannot_open_url(port, error)
    code = _code(error)
    if code in _MISSING or "FileNotFoundError" in str(error):
        there = ", ".join(known) if known else "none"
        return (
            f"There is no port {port} (ports now: {there}). Plug the device in, or start again "
            "with the port that it has now."
        )
    if code in _DENIED or "PermissionError" in str(error):
        return _denied(port)
    if code in _BUSY:
        return (
            f"{port} is in use by {_user_of(port)}. Close that program (serial monitor, another "
            f"imucal-wizard, ModemManager) and try again."
        )
    if code == errno.EISDIR:
        return f"{port} is a folder, not a serial port. Give a port such as /dev/ttyACM0."
    if code in (errno.ENOTTY, errno.EINVAL):
        return f"{port} is not a serial port. To read a file, open it as a recording."
    return f"{port} cannot be opened: {error}. Check the cable and the name of the port."


def link_lost_text(port: str, error: BaseException) -> str:
    """Message about a port that was lost while it was read."""
    what = f"{port} is gone: the device was unplugged or switched off. Plug it in again"
    if "://" in port:
        what = f"The connection to {port} has ended ({error}). Check the server and the network"
    return f"{what}: finished measurements are kept, an unfinished one begins again by itself."


def _cannot_open_url(url: str, error: BaseException) -> str:
    text = str(error)
    if isinstance(error, ValueError):
        return (
            f"{url} is not an address that can be read. Use socket://HOST:PORT or "
            f"rfc2217://HOST:PORT."
        )
    if "refused" in text:
        return f"The connection to {url} was refused. Start the server there, then try again."
    if "timed out" in text or "unreachable" in text or "Name or service" in text:
        return f"{url} cannot be reached. Check the host, the port and the network ({text})."
    return f"{url} cannot be opened: {text}. Use socket://HOST:PORT or rfc2217://HOST:PORT."


def _denied(port: str) -> str:
    if sys.platform == "win32":
        return f"{port} is in use by another program. Close that program and try again."
    return permission_error_text(port, *_group_of(port))


def permission_error_text(port: str, group: str, may: bool) -> str:
    """Message about a port that this user may not open.

    Args:
        port: the device node.
        group: the group that owns it.
        may: whether that group may read and write it.
    """
    message = f"No permission to open {port}: it belongs to the group {group}"
    if may and group != "root":  # nobody should join that one for a serial port
        join = f"'sudo usermod -a -G {group} {_me()}'"
        return f"{message}. Run {join}, log in again, and try again."
    return (
        f"{message}, which does not grant access. Run 'sudo chmod a+rw {port}' and try again; that "
        f"lasts until it is unplugged."
    )


def _group_of(port: str) -> tuple[str, bool]:
    """The group that owns the device node, and whether it may read and write."""
    import grp

    try:
        status = Path(port).stat()
        return grp.getgrgid(status.st_gid).gr_name, status.st_mode & 0o060 == 0o060
    except (OSError, KeyError):
        return "dialout", True


def _me() -> str:
    return os.environ.get("USER") or "$USER"


def _user_of(port: str) -> str:
    """The program that has the port open, if the system shows it; otherwise "another program"."""
    real = os.path.realpath(port)
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if int(process.name) != os.getpid() and any(
                os.path.realpath(fd) == real for fd in (process / "fd").iterdir()
            ):
                name = (process / "comm").read_text().strip()
                return f"'{name}' (process {process.name})"
        except OSError:
            continue  # another user's process, or one that has just ended
    return "another program"


def _code(error: BaseException) -> int | None:
    """The system's error number, also if pyserial has wrapped it."""
    inner = error.__cause__ or error.__context__
    candidates = [getattr(error, "errno", None), getattr(inner, "errno", None)]
    candidates += list(inner.args[:1]) if inner is not None else []  # termios.error has no errno
    return next((number for number in candidates if isinstance(number, int)), None)
