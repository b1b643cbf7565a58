"""Seals of checkpoints: which stored state may be loaded in place of a replay.

A state is a pickle, and loading a pickle can run code. So it is sealed (HMAC-SHA-256) with a key
that stays in the user's data folder, and only a state with a valid seal is loaded. The seal also
covers the source of the program and the versions of Python and NumPy: a checkpoint that is damaged,
or of another user, computer or version, is ignored, and the whole session is replayed.
"""

import hashlib
import hmac
import os
import platform
import sys
from functools import cache
from pathlib import Path

import numpy as np

from imucal_wizard.core import VERSION
from imucal_wizard.core.records import dataclass

_KEY_BYTES = 32


@dataclass(frozen=True)
class Checkpoint:
    """The state of the procedure after a part of a session.

    Attributes:
        after_raw: number of the last piece of bytes before it.
        commands: number of commands before it.
        state: the state, as ``run.engine.Engine.state`` makes it.
    """

    after_raw: int
    commands: int
    state: bytes

    def seal(self, created: float) -> bytes | None:
        """The seal of this state; None if the user's key can be neither read nor made.

        Args:
            created: start of the session that it belongs to, seconds since 1970.
        """
        key = _key()
        if key is None:
            return None
        place = f"{created!r} {self.after_raw} {self.commands} ".encode()
        return hmac.digest(key, _program() + place + self.state, "sha256")

    def fits(self, seal: bytes, created: float) -> bool:
        """Whether this program has made the state, for this session and on this computer."""
        own = self.seal(created)
        return own is not None and hmac.compare_digest(own, seal)


@cache
def _program() -> bytes:
    """Digest of everything that the meaning of a state depends on."""
    versions = (VERSION, sys.version, np.__version__, platform.machine())
    digest = hashlib.sha256(repr(versions).encode())
    for path in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()


@cache
def _key() -> bytes | None:
    """The user's key, made at its first use; None if that is not possible."""
    from platformdirs import user_data_path

    path = user_data_path("imucal-wizard", appauthor=False) / "checkpoint.key"
    try:
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(file, "wb") as made:
                made.write(os.urandom(_KEY_BYTES))
        key = path.read_bytes()
    except OSError:  # a home that cannot be written, or another program that has just made it
        return None
    return key if len(key) == _KEY_BYTES else None
