"""Sessions: one SQLite file each, written as the bytes arrive, and their list."""

from imucal_wizard.acquire.files.session_file import SUFFIX, Command
from imucal_wizard.sessions.session import KeptSession, Session
from imucal_wizard.sessions.session_list import (
    SessionInfo,
    default_directory,
    list_sessions,
    new_session_path,
)

__all__ = [
    "SUFFIX",
    "Command",
    "KeptSession",
    "Session",
    "SessionInfo",
    "default_directory",
    "list_sessions",
    "new_session_path",
]
