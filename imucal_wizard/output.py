"""What goes to the terminal outside the app: nothing in it may steer the terminal."""

import sys
import unicodedata

_OBEYED = ("Cc", "Cf", "Cs", "Co")
"""Control, format (direction marks), surrogate and private characters."""


def harmless(text: str) -> str:
    """The text without characters that a terminal would obey; line ends stay."""
    if text.isprintable():
        return text
    return "".join(
        c if c == "\n" or unicodedata.category(c) not in _OBEYED else "\N{REPLACEMENT CHARACTER}"
        for c in text
    )


def say(text: str) -> None:
    """Write lines to standard output."""
    print(harmless(text))


def note(text: str) -> None:
    """Write lines to standard error."""
    print(harmless(text), file=sys.stderr)


def never_fail_to_encode() -> None:
    """Let a terminal or file of a small alphabet show ``?`` where it lacks a letter."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="replace")
