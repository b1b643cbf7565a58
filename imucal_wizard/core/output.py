"""Output of the commands: safe lines for the terminal, and files written atomically."""

import sys
import unicodedata
from pathlib import Path

from imucal_wizard.core.errors import UsageError

_OBEYED = ("Cc", "Cf", "Cs", "Co")
"""Control, format (direction marks), surrogate and private characters."""


def without_control_characters(text: str) -> str:
    """The text without control characters, except for line ends."""
    if text.replace("\n", "").isprintable():
        return text
    return "".join(
        c if c == "\n" or unicodedata.category(c) not in _OBEYED else "\N{REPLACEMENT CHARACTER}"
        for c in text
    )


def say(text: str) -> None:
    """Write lines to standard output."""
    print(without_control_characters(text))


def note(text: str) -> None:
    """Write lines to standard error."""
    print(without_control_characters(text), file=sys.stderr)


def replace_unencodable_output() -> None:
    """Print ``?`` for characters that the terminal or the file cannot encode."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="replace")


def sanitise(text: str | bytes, limit: int = 200) -> str:
    """Text from a device as one printable line without control characters.

    Args:
        text: text sent by a device, or its name; bytes are decoded as UTF-8 with replacements.
        limit: longest result; longer text ends in an ellipsis.
    """
    if isinstance(text, bytes):
        text = text.decode("utf-8", errors="replace")
    # unprintable characters (control, format, direction, private, unassigned) can steer a terminal
    shown = "".join(c if c.isprintable() else " " for c in text[: 4 * limit])
    shown = " ".join(shown.split())
    return shown if len(shown) <= limit else shown[: limit - 1] + "…"


def encode_json(document: object) -> bytes:
    """Indented JSON; the numbers read back to the same bits."""
    import msgspec

    return msgspec.json.format(msgspec.json.encode(document), indent=1) + b"\n"


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file completely or not at all.

    Raises:
        UsageError: the file cannot be written.
    """
    draft = path.with_name(path.name + ".part")
    try:
        draft.write_bytes(data)
        draft.replace(path)
    except OSError as error:
        raise UsageError(
            f"{path} cannot be written: {error.strerror or error}. Choose another place",
            settings=("save",),
        ) from error
