"""Sessions: one SQLite file each, written as the bytes arrive, and their list."""

from imucal_wizard.acquire.files import SUFFIX
from imucal_wizard.acquire.files.session_file import Command
from imucal_wizard.sessions.checkpoint import Checkpoint
from imucal_wizard.sessions.session import KeptSession, Session
from imucal_wizard.sessions.session_list import (
    SessionInfo,
    default_directory,
    new_session_path,
    remove_session,
)

__all__ = [
    "SUFFIX",
    "Checkpoint",
    "Command",
    "KeptSession",
    "Session",
    "SessionInfo",
    "default_directory",
    "new_session_path",
    "remove_session",
]
