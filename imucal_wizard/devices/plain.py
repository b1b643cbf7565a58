"""Text from devices, made safe to show: no control characters, no escapes, one line."""


def plain(text: str | bytes, limit: int = 200) -> str:
    """The text on one line without anything a terminal would obey.

    Args:
        text: what a device sent or called itself; bytes are read as UTF-8 with replacements.
        limit: longest result; what is longer ends in an ellipsis.
    """
    if isinstance(text, bytes):
        text = text.decode("utf-8", errors="replace")
    # what is not printable (control, format, direction, private, unassigned) can steer a terminal
    shown = "".join(c if c.isprintable() else " " for c in text[: 4 * limit])
    shown = " ".join(shown.split())
    return shown if len(shown) <= limit else shown[: limit - 1] + "…"
