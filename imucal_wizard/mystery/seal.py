"""Sealing a short text with a word: against a look, not against an attacker.

From the word and a random salt PBKDF2 (RFC 8018) makes two keys. The text, filled up so that its
length says nothing, is combined with a stream of HMAC-SHA256 blocks of the first key; its digest,
HMAC-SHA256 (RFC 2104) by the second, proves on opening that word and text are the true ones, and
binds whoever sealed it to what was sealed. A word can be guessed by a program that tries a
dictionary; it keeps a class honest, no more.
"""

import hashlib
import hmac
from collections.abc import Iterator
from dataclasses import dataclass

from imucal_wizard.errors import DataError

ROUNDS = 200_000
LENGTH = 256
"""Bytes of the sealed text, whatever it says."""


@dataclass(frozen=True)
class Sealed:
    """A sealed text.

    Attributes:
        salt: random, 16 bytes.
        digest: HMAC-SHA256 of salt and text, by the key.
        text: sealed, ``LENGTH`` bytes.
    """

    salt: bytes
    digest: bytes
    text: bytes


def seal(text: str, key: str, salt: bytes, rounds: int = ROUNDS) -> Sealed:
    """Seal a text.

    Args:
        text: at most ``LENGTH`` bytes of UTF-8.
        key: the word that opens it.
        salt: random, new for every text.
        rounds: of PBKDF2; each guess of the word costs as many.
    """
    plain = text.encode().ljust(LENGTH)
    sealing, proving = _keys(key, salt, rounds)
    return Sealed(salt, _digest(proving, salt, plain), _combined(plain, sealing))


def unseal(sealed: Sealed, key: str, rounds: int = ROUNDS) -> str:
    """The text, opened with as many rounds as it was sealed with.

    Raises:
        DataError: the word is another one, or the text was changed.
    """
    sealing, proving = _keys(key, sealed.salt, rounds)
    plain = _combined(sealed.text, sealing)
    if not hmac.compare_digest(_digest(proving, sealed.salt, plain), sealed.digest):
        raise DataError(
            "the key does not open it: check its spelling (capitals count); it is the word that "
            "was given with --key, or printed, when the exercise was made"
        )
    return plain.decode().rstrip()


def _keys(key: str, salt: bytes, rounds: int) -> tuple[bytes, bytes]:
    both = hashlib.pbkdf2_hmac("sha256", key.strip().encode(), salt, rounds, dklen=64)
    return both[:32], both[32:]


def _digest(proving: bytes, salt: bytes, plain: bytes) -> bytes:
    return hmac.digest(proving, salt + plain, "sha256")


def _combined(text: bytes, sealing: bytes) -> bytes:
    return bytes(a ^ b for a, b in zip(text, _stream(sealing), strict=False))


def _stream(sealing: bytes) -> Iterator[int]:
    for block in range(LENGTH // 32):
        yield from hmac.digest(sealing, block.to_bytes(4, "big"), "sha256")
