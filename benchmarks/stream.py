"""Bytes to stillness through a pseudo-terminal: ``python -m benchmarks.stream``.

The device is another process. What is measured is the reading process with the program's own
thread: port, decoder, clock, checks, blocks, stillness and procedure; then with the session file
written as in real use; then with a snapshot for the screen twenty times a second as well.
"""

import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from benchmarks.device import Device
from benchmarks.measure import machine, own_cpu
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.acquire.transport import Transport
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.reader import Pump, Reader
from imucal_wizard.run.session_replay import begin_session
from imucal_wizard.sessions import Session

RATES = (1666.0, 8000.0)
WAYS = ("decode + stillness", "+ session file", "+ 20 snapshots/s")
SECONDS = 12.0
WARM = 2.0
"""Seconds at the beginning that are not measured: the format is being recognised."""
RUNS = 3
_LOOK = 1.0 / 20.0
_LAST = 0.5
"""Seconds in which what was written last is read."""


@dataclass(frozen=True)
class Outcome:
    """One run.

    Attributes:
        share: CPU of the reading process, parts of a core.
        sent: lines written.
        lost: lines written that never became samples.
        length: mean bytes per line.
    """

    share: float
    sent: int
    lost: int
    length: float


def run(rate: float, way: str) -> Outcome:
    """Read one stream to its end."""
    with tempfile.TemporaryDirectory() as folder, Device(rate, SECONDS) as device:
        engine = Engine(StreamSetup())
        if way != WAYS[0]:
            engine = begin_session(Path(folder) / "stream.imucal")
        reader = Reader(Pump(Transport(device.port)), engine)
        reader.start()
        reader.command("start")
        share = _share(engine, reader, rate, looking=way == WAYS[2])
        sent, refused, length = device.sent()
        time.sleep(_LAST)  # the last bytes are under way; nothing tells when they are all in
        _still_reads(reader)
        reader.stop()
        if way != WAYS[0]:
            _all_kept(Path(folder) / "stream.imucal", round(sent * length) - refused)
        return Outcome(share, sent, sent - engine.samples, length)


def _still_reads(reader: Reader) -> None:
    """A reader that has given up costs nothing: no figure must be made of that.

    Raises:
        SystemExit: it has ended, or lost the port.
    """
    stream = reader.snapshot().stream
    if reader.finished or stream.problem:
        raise SystemExit(f"the reader has given up: {stream.problem or 'it has ended by itself'}")


def _all_kept(path: Path, came: int) -> None:
    """The session file must hold every byte that the line has taken.

    Raises:
        SystemExit: it does not.
    """
    session = Session.open(path)
    kept = sum(len(data) for *_, data in session.raw())
    session.close()
    if kept != came:
        raise SystemExit(f"the session file holds {kept:,} bytes of the {came:,} that came")


def _share(engine: Engine, reader: Reader, rate: float, *, looking: bool) -> float:
    """Parts of a core used between two moments of the stream."""
    while engine.samples < WARM * rate:
        _still_reads(reader)
        time.sleep(_LOOK)  # looking without a pause would take its CPU from the reader
    cpu, wall, first = own_cpu(), time.monotonic(), engine.samples
    end = wall + SECONDS - WARM - 1.0
    while time.monotonic() < end:
        time.sleep(_LOOK)  # as often as a screen looks; the CPU used between is the reader's
        if looking:
            _still_reads(reader)
    spent, passed = own_cpu() - cpu, time.monotonic() - wall
    if engine.samples - first < 0.9 * rate * passed:
        raise SystemExit(f"only {engine.samples - first:,} samples in {passed:.1f} s")
    return spent / passed


def main() -> None:
    """Print CPU share and lost samples at both rates."""
    print(machine())
    print(
        f"{'samples/s':>10}  {'reading process':20}{'% of a core':>12}{'each run':>20}"
        f"{'sent':>10}{'lost':>6}{'bytes/line':>12}"
    )
    for rate in RATES:
        for way in WAYS:
            runs = [run(rate, way) for _ in range(RUNS)]
            shares = [100.0 * one.share for one in runs]
            each = " ".join(f"{share:.1f}" for share in shares)
            print(
                f"{rate:10,.0f}  {way:20}{statistics.median(shares):12.1f}{each:>20}"
                f"{sum(one.sent for one in runs):10,}{sum(one.lost for one in runs):6}"
                f"{runs[0].length:12.1f}",
                flush=True,
            )
    print("wanted: at 8,000 samples/s under 15 % of a core, none lost")


if __name__ == "__main__":
    main()
