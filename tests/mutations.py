"""Real input of every kind, mutated, and what reads it: a result or one clear sentence."""

import contextlib
import lzma
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from imucal_wizard.acquire.decode import format_names
from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.diagnose.grade import read_limits
from imucal_wizard.model.formula import FormulaEffect
from imucal_wizard.report.calibration_file import read_calibration
from imucal_wizard.report.differences import named_parameters
from imucal_wizard.sessions import KeptSession
from imucal_wizard.simulate.hidden import parse_hidden
from imucal_wizard.teach.exercise import cover_answer, reveal
from tests.acquire.firmware import FIRMWARE
from tests.cli.kept_sessions import listed, sat

GOLDEN = Path(__file__).parent / "golden" / "data"
MAX_SECONDS = 5.0
"""CPU time of one case; a clean one takes some milliseconds."""
SHOWN_BYTES = 6000
"""Bytes of each recording that are mutated: a header and a hundred lines."""
NASTY = tuple(
    b"nan|inf|-inf|1e999|-1e-999|0|-0|99999999999999999999|1.7976931348623157e308|null|true|\x00|"
    b"\xff\xfe|\xef\xbb\xbf|[[[[|{{{{|]]]]|\"|'|#|,|,,|;|\t|\n|\r\n|\r|--|1.2.3|0x10|1_000|"
    b"\xe2\x88\x92|\xf0\x9f\xa6\x8a|\x1b[2J|9**9**9|__import__|t[s]|ax[g]|gx[furlong]".split(b"|")
)
FORMULAS = (
    b"k*a**2",
    b"x: k1*ay*az; y: k2*T",
    b"k*where(a > 0, a, 0)",
    b"k*exp(-t/60) + j*tanh(ax)",
    b"z: q*min(abs(ax), 1)*sign(ay)",
)


@cache
def corpus(kind: str) -> tuple[bytes, ...]:
    """Real input of a kind."""
    return tuple(_CORPORA[kind]())


def _recordings() -> list[bytes]:
    golden = [lzma.decompress(one.read_bytes()) for one in sorted(GOLDEN.glob("*.csv.xz"))]
    printed = [line * 60 for _, line, *_ in FIRMWARE.values()]
    jsons = [b'[{"ax": 0.1, "ay": 0.2, "az": 9.8, "t": 0.01}, {"ax": 0, "ay": 1, "az": 2, "t": 1}]']
    return [one[:SHOWN_BYTES] for one in (*golden, *printed, *jsons)]


def _sessions() -> list[bytes]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.imucal"
        sat(path, share=0.2)
        return [path.read_bytes()]


def _answers() -> list[bytes]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mystery"
        cover_answer(path, "a.csv", "consumer", parse_hidden("second-order:3:x"), "key")
        return [path.read_bytes()]


_CORPORA: dict[str, Callable[[], list[bytes]]] = {
    "recording": _recordings,
    "stream": _recordings,
    "session": _sessions,
    "calibration": lambda: [(GOLDEN / "calibration.json").read_bytes()],
    "limits": lambda: [b'grade = "industrial"\n', b'accelerometer = "2 mg"\ngyroscope = "1 deg"\n'],
    "reference": lambda: [
        b'[accelerometer]\nbias_x = 0.1\nscale_y = { value = 1.0, standard_error = 0.1, unit = ""}'
    ],
    "answer": _answers,
    "formula": lambda: list(FORMULAS),
}
KINDS = tuple(_CORPORA)


def mutated(data: bytes, rng: np.random.Generator, other: bytes) -> bytes:
    """The bytes with one to four changes."""
    most = 4 * SHOWN_BYTES + len(other)
    for _ in range(int(rng.integers(1, 5))):
        data = _changed(data, rng, other)[:most]
    return data


def _changed(data: bytes, rng: np.random.Generator, other: bytes) -> bytes:
    """The bytes with one change: of a part, or at its beginning."""
    first, past = sorted(rng.integers(0, len(data) + 1, 2).tolist())
    begin, part, end = data[:first], data[first:past], data[past:]
    nasty = NASTY[int(rng.integers(len(NASTY)))]
    way = int(rng.integers(10))
    if way == 0:
        return begin + rng.bytes(int(rng.integers(1, 20))) + part + end
    if way == 1:
        return begin + rng.bytes(min(len(part), 40)) + part[40:] + end
    if way == 2:
        return begin + end
    if way == 3:
        return begin + part
    if way == 4:
        return begin + part + part + end
    if way == 5:
        return begin + other[first:past] + end
    if way == 6:
        return begin + nasty * int(rng.choice((1, 1, 1, 3000))) + part + end
    if way == 7:
        return data.replace(part[:1] or b",", nasty, 3)
    if way == 8:
        return _field_replaced(data, first, nasty)
    return part + end + begin


def _field_replaced(data: bytes, place: int, new: bytes) -> bytes:
    """The number around a place replaced."""
    kept = b"0123456789.-+eE"
    first = last = place
    while first > 0 and data[first - 1 : first] in kept:
        first -= 1
    while last < len(data) and data[last : last + 1] in kept:
        last += 1
    return data[:first] + new + data[last:]


def read(kind: str, data: bytes, folder: Path, rng: np.random.Generator) -> None:
    """Read input of a kind.

    Raises:
        ImucalError: it cannot be read.
    """
    if kind == "stream":
        _read_stream(data, rng)
        return
    if kind == "formula":
        FormulaEffect(data.decode(errors="replace"), ("accelerometer", "gyroscope")[len(data) % 2])
        return
    path = folder / f"a{_SUFFIXES.get(kind, '')}"
    path.write_bytes(data)
    if kind == "recording":
        read_files([path], RecordingOptions(rate=100.0))
    elif kind == "session":
        listed(folder)
        with contextlib.suppress(ImucalError), KeptSession.look(path) as session:
            session.meta()
            session.commands()
            list(session.raw())
        read_files([path])
    elif kind == "calibration":
        listed(folder)
        found = read_calibration(path)
        for sensor in found.sensors.values():
            sensor.apply(np.ones((2, 3)))
    elif kind == "limits":
        read_limits(path)
    elif kind == "reference":
        named_parameters(path)
    else:
        reveal(path, "key")


_SUFFIXES = {"session": ".imucal", "reference": ".toml", "limits": ".toml", "recording": ".csv"}


def _read_stream(data: bytes, rng: np.random.Generator) -> None:
    """Feed bytes to the decoder of a random format, or to the search for one, in pieces."""
    names = ("auto", *format_names())
    intake = Intake(StreamSetup(format=names[int(rng.integers(len(names)))]))
    start, arrival = 0, 0.0
    while start < len(data):
        size = int(rng.integers(1, 700))
        intake.feed(data[start : start + size], arrival)
        start, arrival = start + size, arrival + 0.02
    intake.flush()
    str((intake.problem, intake.warnings, intake.preview, intake.needs))


def judged(kind: str, data: bytes, folder: Path, rng: np.random.Generator) -> tuple[str, bool]:
    """What is wrong with how the program reads an input, "" if nothing is; whether it refuses it.

    Args:
        kind: of the input.
        data: the input.
        folder: for files.
        rng: for the cuts of a stream.
    """
    begin, refused = time.process_time(), False
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            read(kind, data, folder, rng)
    except ImucalError as error:
        text, refused = str(error), True
        if len(text.split()) < 3 or "Traceback" in text:
            return f"no sentence: {text[:80]!r}", refused
    except Exception as error:  # noqa: BLE001 - any other error is what this looks for
        last = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} in {last.filename}:{last.lineno}: {error}", refused
    seconds = time.process_time() - begin
    return f"{seconds:.1f} s of CPU" if seconds > MAX_SECONDS else "", refused


def mutated_case(kind: str, number: int, folder: Path) -> tuple[str, bool]:
    """A mutated real input, read and judged; the same number is the same input."""
    rng = np.random.default_rng([number, KINDS.index(kind)])
    samples = corpus(kind)
    base, other = (samples[int(rng.integers(len(samples)))] for _ in range(2))
    problem, refused = judged(kind, mutated(base, rng, other), folder, rng)
    return f"{kind} {number}: {problem}" if problem else "", refused
