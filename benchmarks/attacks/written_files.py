"""Commands that write a file where something else is, or where the disk is full."""

import os
import resource
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

from benchmarks.attacks import Outcome
from imucal_wizard.cli.main import main
from imucal_wizard.simulate.recording import simulate_recording

NUMBER = 4
ATTACK = "results written over folders, devices, links, other files"

COMMANDS = (
    ("fit", "{recording}", "--save", "{place}"),
    ("fit", "{recording}", "--json", "{place}"),
    ("bench", "{recording}", "--save", "{place}"),
    ("simulate", "{place}", "--poses", "6"),
    ("export", "{calibration}", "--to", "numpy", "-o", "{place}"),
)
FREE_BYTES = 16
MINE = b"a measurement that nobody can repeat\n"


def _folder(place: Path) -> None:
    place.mkdir()


def _fifo(place: Path) -> None:
    os.mkfifo(place)


def _device(place: Path) -> None:
    """A device that refuses every byte; a FIFO where only root may create one."""
    try:
        os.mknod(place, stat.S_IFCHR | 0o666, os.makedev(1, 7))
    except PermissionError:
        os.mkfifo(place)


def _other(place: Path) -> None:
    place.write_bytes(MINE)


def _link(place: Path) -> None:
    (place.parent / "behind").write_bytes(MINE)
    place.symlink_to(place.parent / "behind")


PLACES: tuple[Callable[[Path], None], ...] = (_folder, _fifo, _device, _other, _link)


def run(full: bool) -> Outcome:
    """Every command at every place, then on a full disk; ``full`` makes no difference."""
    del full
    outcome = Outcome()
    with tempfile.TemporaryDirectory() as folder:
        recording, calibration = Path(folder) / "a.csv", Path(folder) / "a.json"
        simulate_recording(recording, rate=25.0)
        _status("fit", str(recording), "--save", str(calibration))
        for command in COMMANDS:
            words = {"recording": recording, "calibration": calibration}
            for make in PLACES:
                outcome.count(_refused(command, make, words))
            outcome.count(_survives_a_full_disk(command, words))
    return outcome


def _refused(command: tuple[str, ...], make: Callable[[Path], None], words: dict[str, Path]) -> str:
    """What a command destroyed that was given a place where something else is."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "place.csv"
        make(place)
        before, inside = place.lstat(), _content(place)
        status = _status(*(one.format(place=place, **words) for one in command))
        after = place.lstat()
        same = (before.st_ino, before.st_mode) == (after.st_ino, after.st_mode)
        what = f"{' '.join(command[:3])} to {make.__name__.strip('_')}"
        if status != 2:
            return f"{what}: exit status {status}"
        return "" if same and _content(place) == inside else f"{what}: replaced"


def _survives_a_full_disk(command: tuple[str, ...], words: dict[str, Path]) -> str:
    """What a command left that found the disk full."""
    with tempfile.TemporaryDirectory() as folder:
        place, other = Path(folder) / "place.csv", Path(folder) / "place.csv.part"
        other.write_bytes(MINE)
        with _full_disk():
            status = _status(*(one.format(place=place, **words) for one in command))
        left = sorted(one.name for one in Path(folder).iterdir())
        if status == 0 or left != [other.name] or other.read_bytes() != MINE:
            return f"{' '.join(command[:3])} on a full disk: status {status}, left {left}"
        return ""


@contextmanager
def _full_disk() -> Iterator[None]:
    """No file can grow beyond a few bytes, as where a quota is used up."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (FREE_BYTES, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def _content(place: Path) -> bytes:
    return place.read_bytes() if place.is_file() else b""


def _status(*arguments: str) -> int:
    """The exit status of a command; its output is not shown."""
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        return main(arguments)
