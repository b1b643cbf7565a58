"""The errors that a user can see.

::

    ImucalError                 any error with an explanation; never shown as a traceback
    ├── InputError              the input cannot be read                (exit status 2)
    │   ├── UsageError          options contradict each other, or one is missing
    │   │   └── PlaceError          a file cannot be written at its place
    │   ├── RecordingError      a file is missing, garbled or lacks columns
    │   ├── FormatError         the format of a stream is not known
    │   ├── LinkError           a port cannot be opened, or the link was lost
    │   └── SessionError        a session file cannot be read or written
    │       ├── DamagedSessionError  a part of it cannot be read
    │       └── SessionTakenError    a new session has the name of a file
    └── DataError               the data cannot determine the result    (exit status 1)
"""

from pathlib import Path


class ImucalError(Exception):
    """An error that is explained in one line.

    Args:
        message: what happened, to what, and what to do next; it names no option and no key.
        settings: names of the settings that the user can change, like ``rate`` or ``columns``, with
            an example value after a blank (``rate 100``). The command line adds its options for
            them, the screen its keys.
    """

    exit_status = 1

    def __init__(self, message: str, *, settings: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.settings = settings


class InputError(ImucalError):
    """The input cannot be read."""

    exit_status = 2


class UsageError(InputError):
    """Options contradict each other, or one is missing."""


class PlaceError(UsageError):
    """A file cannot be written at its place.

    Args:
        message: what happened, to what, and what to do next.
        other: a place on another disk where there is room, or None.
    """

    def __init__(self, message: str, other: Path | None = None) -> None:
        super().__init__(message)
        self.other = other


class RecordingError(InputError):
    """A recording is missing, garbled, or lacks columns."""


class FormatError(InputError):
    """The format of a stream is not known."""


class LinkError(InputError):
    """A port cannot be opened, or the link was lost."""


class SessionError(InputError):
    """A session file cannot be read or written."""


class DamagedSessionError(SessionError):
    """A part of a session file cannot be read."""


class SessionTakenError(SessionError):
    """A new session has the name of a file."""


class DataError(ImucalError):
    """The data cannot determine the requested result."""
