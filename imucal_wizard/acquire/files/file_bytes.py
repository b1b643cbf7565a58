"""The content of a file as the bytes that a device would have sent.

Encodings, compression, timestamps of serial monitors and JSON lists are removed; the rest goes
through the decoders of streams.
"""

import codecs
import re
from pathlib import Path

from imucal_wizard.acquire.decode.delimited import split_fields
from imucal_wizard.acquire.detect import binary_protocol
from imucal_wizard.core.errors import RecordingError
from imucal_wizard.core.input import is_port, open_unpacked, read_bounded, readable_bytes
from imucal_wizard.core.output import sanitise

_EXAMINED_BYTES = 65_536
"""Bytes at the beginning of a file that are examined."""
_MAX_GARBAGE = 0.05
"""Share of control characters above which a file is not text."""
_TEXT_BYTES = bytes([7, 8, 9, 10, 12, 13, 27, *range(32, 127), *range(128, 256)])
MAX_BYTES = 2_000_000_000
"""Bytes of a recording: ten hours at 1,000 samples/s."""
_MIN_WIDE_SHARE = 0.7
"""Share of zeros in every second byte of a text with two bytes per character."""
_UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_EXAMINED_LINES = 400
"""Lines at the beginning of a file whose times are examined."""
_STAMP = re.compile(
    rb"^(?:\[[^\]\n]{0,40}?\d{1,2}:\d{2}:\d{2}[^\]\n]{0,16}\] ?|\d{1,2}:\d{2}:\d{2}[.,]\d{3} -> ?)",
    re.MULTILINE,
)
"""Timestamps of serial monitors: ``[10:00:00.123]``, ``10:00:00.123 ->``."""
_MIN_STAMPED_SHARE = 0.5
"""Share of lines with a timestamp from which a serial monitor is assumed."""
_RESULT = re.compile(rb'\s*\{\s*"schema":\s*"imucal-wizard/')
"""Beginning of a calibration, and of every JSON document of this program."""
_MILLISECONDS = re.compile(rb"(\d{1,2}:\d{1,2}:\d{1,2}\.)(\d{1,3})(?!\d)")

_AS_TEXT = "switch the device to text (ASCII) output, or export the log as CSV with its own program"

_MAGIC: tuple[tuple[bytes, str, str], ...] = (
    (
        b"PK\x03\x04",
        "a ZIP archive, an Excel sheet or a NumPy .npz",
        "unpack it, or save it as CSV",
    ),
    (b"\x93NUMPY", "a NumPy array", "write it as text with numpy.savetxt and a header of names"),
    (b"MATLAB 5.0", "a MATLAB file", "write it as text with writetable or writematrix"),
    (b"MATLAB 7.3", "a MATLAB 7.3 file", "write it as text with writetable or writematrix"),
    (b"version https://git-lfs", "a pointer of Git LFS, not the file", "get it with git lfs pull"),
    (b"\x89HDF", "an HDF5 or MATLAB 7.3 file", "export its arrays as CSV"),
    (b"BZh91AY", "compressed by bzip2", "unpack it with bunzip2"),
    (b"\xfd7zXZ", "compressed by xz", "unpack it with unxz"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it"),
    (b"\x28\xb5\x2f\xfd", "compressed by zstd", "unpack it with unzstd"),
    (b"\xd0\xcf\x11\xe0", "an old Excel sheet", "save it as CSV"),
    (b"PAR1\x15", "a Parquet file", "export it as CSV"),
    (b"#ROSBAG", "a ROS bag", "export the topic with rostopic echo -b FILE -p TOPIC"),
    (b"\x89MCAP", "an MCAP file of ROS 2", "export the topic as CSV"),
    (b"ULog\x01", "a PX4 log", "export it with ulog2csv and give the sensor_combined file"),
    (b"\xa3\x95", "an ArduPilot log", "export its IMU messages as CSV with mavlogdump.py"),
    (b"H Product:Blackbox", "a Betaflight log", "export it with blackbox_decode"),
    (b"\xfa\xff", "a capture of the Xsens protocol", _AS_TEXT),
    (b"\xff\x5a", "a capture of the SBG protocol", _AS_TEXT),
    (b"\x89PNG", "a picture", "give the recording instead"),
    (b"%PDF", "a PDF", "give the recording instead"),
)


def read_start(path: Path) -> bytes:
    """The beginning of a regular file, unpacked if it is packed by gzip.

    Raises:
        RecordingError: it cannot be read, is empty, or damaged.
    """
    import zlib

    try:
        with open_unpacked(path) as file:
            start = file.read(_EXAMINED_BYTES)
    except (OSError, EOFError, zlib.error) as error:
        raise RecordingError(f"{path} cannot be read: {error}") from error
    if not start or (start.isspace() and len(start) < _EXAMINED_BYTES):
        raise RecordingError(f"{path} is empty; record again")
    return start


def read_bytes(path: Path) -> bytes:
    """The content of a file.

    Raises:
        RecordingError: it cannot be read, is empty, too large, or not a file.
    """
    if is_port(path):
        raise RecordingError(
            f"{path} is a port and not a recording; open it as the source of the wizard",
            settings=(f"port {path}",),
        )
    data = read_bounded(path, readable_bytes(MAX_BYTES))
    if not data or data.isspace():
        raise RecordingError(f"{path} is empty; record again")
    return data


class NotTextError(RecordingError):
    """The file is not text; it may contain frames of a binary protocol."""


def decode_text(data: bytes) -> tuple[bytes, tuple[str, ...]]:
    """The lines of a text file in UTF-8, and warnings about removed parts.

    Raises:
        NotTextError: the bytes are not text.
        RecordingError: they are a result of this program.
    """
    if _RESULT.match(data):
        raise RecordingError("this is a result of this program; give the recording it was made of")
    if message := _foreign_format_text(data):
        raise NotTextError(message)
    if encoding := _utf16(data):
        data = data.decode(encoding, errors="replace").encode()
    data = data.removeprefix(codecs.BOM_UTF8).rstrip(b"\0")
    start = data[:_EXAMINED_BYTES]
    if len(start.translate(None, _TEXT_BYTES)) > _MAX_GARBAGE * len(start):
        raise NotTextError(_no_text(start))
    data = data.replace(b"\0", b"")
    try:
        data.isascii() or data.decode("utf-8")
    except UnicodeDecodeError:
        data = data.decode("latin-1").encode()
    data = _one_object_per_line(data)
    stamped: tuple[str, ...] = ()
    if b":" in data[:_EXAMINED_BYTES]:  # else there are no times of day
        data, stamped = _without_stamps(data)
        data = _padded_milliseconds(data)
    data, cut = _without_cut_line(data)
    return data, (*stamped, *cut)


def _without_stamps(data: bytes) -> tuple[bytes, tuple[str, ...]]:
    """The lines without the timestamps of a serial monitor, and a warning."""
    start = data[:_EXAMINED_BYTES]
    if len(_STAMP.findall(start)) < _MIN_STAMPED_SHARE * (start.count(b"\n") + 1):
        return data, ()
    message = "the timestamps of the serial monitor in front of the lines were not used"
    return _STAMP.sub(b"", data), (message,)


def _one_object_per_line(data: bytes) -> bytes:
    """The lines of a JSON list of objects; any other text is unchanged."""
    if not data[:_EXAMINED_BYTES].lstrip().startswith((b"[{", b"[\n", b"[ ", b"[\r")):
        return data
    import json

    try:
        found = json.loads(data)
    except (ValueError, RecursionError):
        return data
    if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
        return data
    return ("\n".join(map(json.dumps, found)) + "\n").encode()


def _padded_milliseconds(data: bytes) -> bytes:
    """Restore leading zeros of milliseconds, which WitMotion's program omits.

    Decimals sometimes begin with a zero, and do not end with one if they are shortened; then ``.6``
    is 0.6 s. Otherwise it is 6 ms.
    """
    start = b"\n".join(data[:_EXAMINED_BYTES].split(b"\n")[:_EXAMINED_LINES])
    found = [digits for _, digits in _MILLISECONDS.findall(start)]
    sizes = {len(digits) for digits in found}
    begun = any(len(digits) > 1 and digits.startswith(b"0") for digits in found)
    ended = any(len(digits) > 1 and digits.endswith(b"0") for digits in found)
    if len(sizes) < 2 or begun or not ended:
        return data
    return _MILLISECONDS.sub(lambda match: match[1] + match[2].zfill(3), data)


def _without_cut_line(data: bytes) -> tuple[bytes, tuple[str, ...]]:
    """The text without a last line that may be incomplete, and a warning about it.

    Only a line without a line end can be incomplete. It is kept if it fits and its last number has
    as many characters as the one above it.
    """
    if data.endswith((b"\n", b"\r")):
        return data, ()
    lines = data.replace(b"\r", b"\n").rstrip(b" \t").rsplit(b"\n", 2)
    if len(lines) == 1 or not lines[-1].strip() or lines[-1].lstrip().startswith(b"#"):
        return data + b"\n", ()
    last, above = split_fields(lines[-1]), split_fields(lines[-2])
    if last and len(last) == len(above) and len(last[-1]) >= len(above[-1]):
        return data + b"\n", ()
    body = data[: len(data) - len(lines[-1])]
    return body, (f"the last line may have been cut short: '{sanitise(lines[-1], 48)}'; left out",)


def _utf16(data: bytes) -> str:
    """The encoding of text with two bytes per character, with or without a mark; or ""."""
    if data.startswith(_UTF16):
        return "utf-16"
    start = data[: _EXAMINED_BYTES & ~1]
    even, odd = start[::2].count(0), start[1::2].count(0)
    for few, many, encoding in ((even, odd, "utf-16-le"), (odd, even, "utf-16-be")):
        if many > _MIN_WIDE_SHARE * len(start) / 2 and few < _MAX_GARBAGE * len(start) / 2:
            return encoding
    return ""


def _no_text(start: bytes) -> str:
    """Message about bytes that are not text."""
    if protocol := binary_protocol(start):
        return (
            f"this looks like the binary protocol of {protocol}, which is not supported; switch the"
            " device to text (ASCII) output and record again"
        )
    return (
        "this is not text; give a CSV or a session file. If it was recorded from a serial port, the"
        " speed was probably wrong: record again"
    )


def _foreign_format_text(data: bytes) -> str:
    """Description of a known non-text file and what to do; ``""`` if unknown."""
    for magic, what, remedy in _MAGIC:
        if data.startswith(magic):
            return f"it is {what}; {remedy}"
    return ""
