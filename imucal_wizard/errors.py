"""The errors a user can meet. Every message says what happened, to what, and what to do next.

::

    ImucalError                 anything this program can explain; never shown as a traceback
    ├── InputError              what was given cannot be read           (exit status 2)
    │   ├── UsageError          the options contradict one another
    │   ├── RecordingError      a file is missing, garbled or lacks columns
    │   ├── FormatError         a stream speaks no format known here
    │   ├── LinkError           a port cannot be opened or was lost
    │   └── SessionError        a session file cannot be read or written
    └── DataError               the data do not carry the answer        (exit status 1)
"""


class ImucalError(Exception):
    """Anything this program can explain in one line."""

    exit_status = 1


class InputError(ImucalError):
    """What was given cannot be read."""

    exit_status = 2


class UsageError(InputError):
    """The options contradict one another or one is missing."""


class RecordingError(InputError):
    """A recording is missing, garbled, or lacks columns."""


class FormatError(InputError):
    """A stream speaks no format that is known here."""


class LinkError(InputError):
    """A port cannot be opened, or was lost."""


class SessionError(InputError):
    """A session file cannot be read or written."""


class DataError(ImucalError):
    """The data do not carry what was asked of them."""
