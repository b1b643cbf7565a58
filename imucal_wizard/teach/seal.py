"""Sealing of a short text with a key: of an exercise in files, and of a live one.

The answer to an exercise in files is locked: scrypt (RFC 7914) derives a key from the class's word,
and AES-256-GCM (NIST SP 800-38D) encrypts and authenticates the text, both by the package
``cryptography``. What remains is to guess the word; a guess costs a tenth of a second and 32 MB.

The computer that runs a live exercise must know its answer, so that answer is no secret there. It
is only covered against a glance: PBKDF2 (RFC 8018) derives two keys from a word and a random salt,
the text is padded and combined with a stream of HMAC-SHA256 blocks of the first key, and
HMAC-SHA256 (RFC 2104) with the second key proves on opening that the word is right. Earlier
versions sealed every answer so.
"""

import hashlib
import hmac
import secrets
from collections.abc import Iterator
from typing import TYPE_CHECKING

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.records import dataclass

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.ciphers.aead import AESGCM

SCRYPT_COST = 1 << 15
"""Cost n of scrypt, with blocks of r = 8: 32 MB and a tenth of a second per guess of the key."""
PBKDF2_ROUNDS = 200_000
"""Rounds of PBKDF2: a tenth of a second per guess of the key."""
PADDED_BYTES = 256
"""Bytes of the padded text."""


@dataclass(frozen=True)
class Locked:
    """An encrypted text.

    Attributes:
        salt: random, 16 bytes.
        nonce: random, 12 bytes.
        text: encrypted and authenticated.
    """

    salt: bytes
    nonce: bytes
    text: bytes


def lock_text(text: str, key: str, about: str, cost: int = SCRYPT_COST) -> Locked:
    """Encrypt a text.

    Args:
        text: at most ``PADDED_BYTES`` bytes of UTF-8; its length does not show.
        key: the word that opens it.
        about: a text in clear that belongs to it and cannot be changed either.
        cost: n of scrypt.
    """
    salt, nonce = secrets.token_bytes(16), secrets.token_bytes(12)
    plain = text.encode().ljust(PADDED_BYTES)
    sealed = _cipher(key, salt, cost).encrypt(nonce, plain, about.encode())
    return Locked(salt, nonce, sealed)


def unlock_text(locked: Locked, key: str, about: str, cost: int = SCRYPT_COST) -> str:
    """Decrypt a text.

    Raises:
        DataError: the key is wrong, or the file was changed.
    """
    cipher = _cipher(key, locked.salt, cost)
    from cryptography.exceptions import InvalidTag

    try:
        return cipher.decrypt(locked.nonce, locked.text, about.encode()).decode().rstrip()
    except (InvalidTag, ValueError) as error:  # ValueError: a nonce of a wrong length
        raise _wrong_key() from error


def _cipher(key: str, salt: bytes, cost: int) -> "AESGCM":
    from cryptography.hazmat.primitives.ciphers.aead import AESGCM
    from cryptography.hazmat.primitives.kdf.scrypt import Scrypt

    return AESGCM(Scrypt(salt=salt, length=32, n=cost, r=8, p=1).derive(key.strip().encode()))


def _wrong_key() -> DataError:
    return DataError(
        "the key does not open it: check its spelling (capitals count); it was "
        "given or printed when the exercise was made",
        settings=("key",),
    )


@dataclass(frozen=True)
class Sealed:
    """A text covered against a glance.

    Attributes:
        salt: random, 16 bytes.
        digest: HMAC-SHA256 of salt and text, by the key.
        text: sealed, ``PADDED_BYTES`` bytes.
    """

    salt: bytes
    digest: bytes
    text: bytes


def seal_text(text: str, key: str, salt: bytes, rounds: int = PBKDF2_ROUNDS) -> Sealed:
    """Cover a text against a glance.

    Args:
        text: at most ``PADDED_BYTES`` bytes of UTF-8.
        key: the key that opens it.
        salt: random, new for every text.
        rounds: rounds of PBKDF2, which determine the cost of each guess.
    """
    plain = text.encode().ljust(PADDED_BYTES)
    sealing, proving = _keys(key, salt, rounds)
    return Sealed(salt, _digest(proving, salt, plain), _combined(plain, sealing))


def unseal_text(sealed: Sealed, key: str, rounds: int = PBKDF2_ROUNDS) -> str:
    """Open a text covered against a glance.

    Raises:
        DataError: the key is wrong, or the text was changed.
    """
    sealing, proving = _keys(key, sealed.salt, rounds)
    plain = _combined(sealed.text, sealing)
    if not hmac.compare_digest(_digest(proving, sealed.salt, plain), sealed.digest):
        raise _wrong_key()
    return plain.decode().rstrip()


def _keys(key: str, salt: bytes, rounds: int) -> tuple[bytes, bytes]:
    both = hashlib.pbkdf2_hmac("sha256", key.strip().encode(), salt, rounds, dklen=64)
    return both[:32], both[32:]


def _digest(proving: bytes, salt: bytes, plain: bytes) -> bytes:
    return hmac.digest(proving, salt + plain, "sha256")


def _combined(text: bytes, sealing: bytes) -> bytes:
    return bytes(a ^ b for a, b in zip(text, _stream(sealing), strict=False))


def _stream(sealing: bytes) -> Iterator[int]:
    for block in range(PADDED_BYTES // 32):
        yield from hmac.digest(sealing, block.to_bytes(4, "big"), "sha256")
