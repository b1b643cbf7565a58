"""A log of what a device printed: lines with words, JSON, the formats of well-known firmware."""

import json
import re
from collections.abc import Iterator

from imucal_wizard.devices.detect import Detector
from imucal_wizard.devices.setup import StreamSetup
from imucal_wizard.recordings.columns import Samples
from imucal_wizard.recordings.decoded import decoded
from imucal_wizard.recordings.options import RecordingOptions
from imucal_wizard.recordings.session import with_options

_LOOKED_AT = 400
"""Lines in which a format must be plain."""
_PIECE = 65_536
_STAMP = re.compile(
    r"^(?:\[[^\]\n]{0,40}?\d{1,2}:\d{2}:\d{2}[^\]\n]{0,16}\] ?|\d{1,2}:\d{2}:\d{2}[.,]\d{3} -> ?)",
    re.MULTILINE,
)
"""What serial monitors put in front of a line: ``[10:00:00.123]``, ``10:00:00.123 ->``."""
_MONITORED = 0.5
_BEFORE = b"#\n"
"""A live stream begins in the middle of a line, which is therefore not trusted; a file does not."""


def format_of(text: str) -> str:
    """The format in which a device printed these lines, where it is no plain table; else ``""``."""
    detector = Detector()
    for number, line in enumerate(_lines(text)):
        name = detector.feed(line.encode())
        if name or number == _LOOKED_AT:
            return "" if name == "csv" else name
    return ""


def read_log(text: str, name: str, options: RecordingOptions) -> Samples:
    """The samples in the lines of a device.

    Args:
        text: the lines.
        name: their format.
        options: what the user said of them.

    Raises:
        UnknownColumnsError: nothing says which number is what.
        RecordingError: something else about them is not known; the message says what to give.
    """
    data = _BEFORE + text.encode()
    setup = with_options(StreamSetup(format=name), options)
    pieces = ((0.0, data[start : start + _PIECE]) for start in range(0, len(data), _PIECE))
    return decoded(pieces, setup, live=False)


def without_stamps(text: str) -> tuple[str, tuple[str, ...]]:
    """The lines without the times that a serial monitor put in front of them, and a warning."""
    start = text[:_PIECE]
    lines = start.count("\n") + 1
    if len(_STAMP.findall(start)) < _MONITORED * lines:
        return text, ()
    says = "the times that the serial monitor put in front of the lines were not used"
    return _STAMP.sub("", text), (says,)


def one_object_per_line(text: str) -> str:
    """A JSON document that is a list of objects, as lines; any other text unchanged."""
    if not text.lstrip().startswith(("[{", "[\n", "[ ")):
        return text
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return text
    if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
        return text
    return "\n".join(map(json.dumps, found)) + "\n"


def _lines(text: str) -> Iterator[str]:
    start = 0
    while start < len(text):
        end = text.find("\n", start) + 1 or len(text)
        yield text[start:end]
        start = end
