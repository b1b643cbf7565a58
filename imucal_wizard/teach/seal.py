"""Sealing of a short text with a key: a protection against a glance, not against an attacker.

PBKDF2 (RFC 8018) derives two keys from the user's key and a random salt. The text is padded to a
fixed length and combined with a stream of HMAC-SHA256 blocks of the first key. Its digest,
HMAC-SHA256 (RFC 2104) with the second key, proves on opening that the key is right and the text
unchanged. A program that tries a dictionary can find the key; the seal is sufficient for a class.
"""

import hashlib
import hmac
from collections.abc import Iterator

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.records import dataclass

PBKDF2_ROUNDS = 200_000
"""Rounds of PBKDF2: a tenth of a second per guess of the key."""
PADDED_BYTES = 256
"""Bytes of the padded text."""


@dataclass(frozen=True)
class Sealed:
    """A sealed text.

    Attributes:
        salt: random, 16 bytes.
        digest: HMAC-SHA256 of salt and text, by the key.
        text: sealed, ``PADDED_BYTES`` bytes.
    """

    salt: bytes
    digest: bytes
    text: bytes


def seal_text(text: str, key: str, salt: bytes, rounds: int = PBKDF2_ROUNDS) -> Sealed:
    """Seal a text.

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
    """Open a sealed text.

    Raises:
        DataError: the key is wrong, or the text was changed.
    """
    sealing, proving = _keys(key, sealed.salt, rounds)
    plain = _combined(sealed.text, sealing)
    if not hmac.compare_digest(_digest(proving, sealed.salt, plain), sealed.digest):
        raise DataError(
            "the key does not open it: check its spelling (capitals count); it was "
            "given or printed when the exercise was made",
            settings=("key",),
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
    for block in range(PADDED_BYTES // 32):
        yield from hmac.digest(sealing, block.to_bytes(4, "big"), "sha256")
