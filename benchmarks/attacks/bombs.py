"""Input that grows when it is read, that never comes, or that is code of somebody else."""

import gzip
import io
import os
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks.attacks import Outcome
from benchmarks.measure import PYTHON

NUMBER = 6
ATTACK = "bombs, pipes that stay silent, code that others can write"

MEMORY_MIB, SECONDS = 700.0, 60.0
"""What reading may take at most before it is refused."""
ROW = b"12.345678,0.01,-0.02,0.98,1.5,-0.25,0.125\n"
EFFECT = """
from imucal_wizard.model.effects.second_order import SecondOrder
class MySquare(SecondOrder):
    name = "my-square"
open(__file__ + ".ran", "a").write("x")
"""


def run(full: bool) -> Outcome:
    """Give every kind of hostile input to a process of its own; ``full`` takes large bombs."""
    outcome, worst = Outcome(), 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for words in (*_bombs(folder, full), *_silent(folder), *_foreign_code(folder)):
            problem, memory = _refused(words)
            worst = max(worst, memory)
            outcome.count(problem)
        if ran := sorted(one.name for one in folder.rglob("*.ran")):
            outcome.lost.append(f"code was run: {ran}")
    outcome.notes.append(f"peak memory {worst:.0f} MiB, allowed {MEMORY_MIB:.0f}")
    return outcome


def _bombs(folder: Path, full: bool) -> Iterator[list[str]]:
    """Lines, zeros, one endless line, packed packs, and what a reader of JSON or TOML unfolds."""
    size = 1_900_000_000 if full else 100_000_000
    header = b"t[s],ax[g],ay[g],az[g],gx[deg/s],gy[deg/s],gz[deg/s]\n"
    for name, begin, unit in (
        ("lines.csv.gz", header, ROW * 1000),
        ("zeros.csv.gz", b"", bytes(1 << 20)),
        ("line.csv.gz", header, b"1," * (1 << 19)),
    ):
        with gzip.open(folder / name, "wb", 9 if full else 1) as file:
            file.write(begin)
            for _ in range(size // len(unit)):
                file.write(unit)
        yield ["fit", str(folder / name)]
    inner = (folder / "zeros.csv.gz").read_bytes()
    (folder / "twice.csv.gz").write_bytes(gzip.compress(inner))
    yield ["fit", str(folder / "twice.csv.gz")]
    for name, text in (
        ("deep.json", b"[" * 10_000_000),
        ("deep.toml", b"a = " + b"[" * 1_000_000),
        ("number.json", b"1" * 50_000_000),
    ):
        (folder / name).write_bytes(text)
        yield ["fit", str(folder / name)]
        yield ["diff", str(folder / name), str(folder / name)]
    (folder / "limits.toml").write_bytes(b"grade = " + b"[" * 1_000_000)
    (folder / "a.csv").write_bytes(header + ROW)
    yield ["fit", str(folder / "a.csv"), "--limits", str(folder / "limits.toml")]
    yield ["bench", str(folder / "a.csv"), "--formula", "9**9**9**9*ax"]


def _silent(folder: Path) -> Iterator[list[str]]:
    """A pipe into which nobody writes, and devices without an end, in every place for a file."""
    os.mkfifo(folder / "pipe")
    for place in (str(folder / "pipe"), "/dev/zero"):
        yield ["fit", place]
        yield ["diff", place, place]
        yield ["export", place, "--to", "numpy"]
        yield ["fit", str(folder / "a.csv"), "--limits", place]
        yield ["simulate", "--reveal", place, "--key", "word"]


def _foreign_code(folder: Path) -> Iterator[list[str]]:
    """Effects in files, and in folders, that anyone can write."""
    for number, (mode, around) in enumerate(((0o666, 0o755), (0o602, 0o755), (0o644, 0o777))):
        place = folder / f"effects-{number}"
        place.mkdir()
        (place / "mine.py").write_text(EFFECT)
        (place / "mine.py").chmod(mode)
        place.chmod(around)
        yield ["bench", str(folder / "a.csv"), "--effects", str(place / "mine.py")]


def _refused(words: list[str]) -> tuple[str, float]:
    """What was not as it must be, and the peak memory of the process in MiB.

    It must end in time, with exit status 2 and one line that says why, in bounded memory.
    """
    begin = time.monotonic()
    with subprocess.Popen(
        [PYTHON, "-m", "imucal_wizard", *words], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        said = io.TextIOWrapper(process.stderr or io.BytesIO()).read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    memory, seconds = usage.ru_maxrss / 1024.0, time.monotonic() - begin
    lines = [one for one in said.splitlines() if not one.startswith("runs the Python code")]
    what = f"{' '.join(words[:2])}"
    if process.returncode != 2 or len(lines) != 1:
        return f"{what}: exit status {process.returncode}, {len(lines)} lines", memory
    if seconds > SECONDS or memory > MEMORY_MIB:
        return f"{what}: {seconds:.0f} s and {memory:.0f} MiB", memory
    return "", memory
