"""Two programs at once, copies of what is being written, clocks that jump, permissions, names.

Lost is a sample or a file of the first program, a row of a copy that nobody wrote, a hold that the
clock of the machine has changed, a file that others may read although ``umask`` says no, and any
output that is no sentence.
"""

import os
import shutil
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from benchmarks.attacks import Outcome
from imucal_wizard.acquire.intake import LINK_BREAK
from imucal_wizard.core.errors import ImucalError, UsageError
from imucal_wizard.run.session_replay import resume_session
from imucal_wizard.sessions import KeptSession, Session
from imucal_wizard.sessions.catalogue import Catalogue
from imucal_wizard.simulate.recording import simulate_recording
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.services import WizardServices
from imucal_wizard.tui.sources import SourceChoice, SourceKind
from tests.acquire.ports import Pty
from tests.cli.kept_sessions import printed, sat

NUMBER = 12
ATTACK = "two programs at once, copies, clocks, permissions, names"

PATIENCE = 60.0
"""Seconds after which what has not happened will not happen, however busy the machine is."""
LINES = 600
"""Lines that the device prints while the second program tries to open its port."""
JUMPS = (60.0, -60.0, 0.0, -1.7e9, 1.7e9, 1e15, -1e300, float("inf"))
"""Seconds by which the clock is away from the begin of a session when it is resumed."""
NAMES = (
    "a\x1b[2J", "a\x1b]0;title\x07", "\x9b31mred", "a\nb", "a\r\x08b", "\u202eright to left",
    "\u2028line", "\udcff", "a\x00b", "%s%n{0}", "'; DROP TABLE device; --", "../../up", "x" * 300,
)  # fmt: skip
"""Names of devices, sessions and recordings."""


def run(full: bool) -> Outcome:
    """Each kind of attempt, ten times as often with ``full``."""
    times, outcome = (10 if full else 1), Outcome()
    chance = np.random.default_rng(12)
    for _ in range(times):
        outcome.add(on_one_port())
        outcome.add(on_one_session())
        outcome.add(on_one_catalogue(3))
        outcome.add(copies(12, chance))
        outcome.add(umasks())
    outcome.add(clocks())
    outcome.add(read_only())
    outcome.add(names())
    return outcome


def _python(
    script: str, *arguments: str, before: Sequence[str] = (), home: Path | None = None
) -> "subprocess.Popen[str]":
    """A second program, with a home of its own if one is given."""
    known = {key: value for key, value in os.environ.items() if home is None or "XDG" not in key}
    return subprocess.Popen(
        [*before, sys.executable, "-c", script, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
        env=known if home is None else known | {"HOME": str(home)},
    )


_OPENS_A_PORT = """
import sys, time
from pathlib import Path
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.services import WizardServices
from imucal_wizard.tui.sources import SourceChoice, SourceKind
workshop = WizardServices(WizardOptions(sessions=Path(sys.argv[2])))
source = workshop.open_source(SourceChoice(SourceKind.PORT, sys.argv[1]))
source.start()
end = time.monotonic() + 60.0
while "in use" not in source.snapshot().stream.problem and time.monotonic() < end:
    time.sleep(0.02)  # until the other program holds the port
print(source.snapshot().stream.problem)
source.stop()
time.sleep(0.5)  # while the other program reads on
"""


def on_one_port() -> Iterator[str]:
    """The second wizard is told who has the port; the first one loses no line."""
    pty = Pty()
    with tempfile.TemporaryDirectory() as place:
        first, second = Path(place) / "first", Path(place) / "second"
        workshop = WizardServices(WizardOptions(sessions=first))
        source = workshop.open_source(SourceChoice(SourceKind.PORT, pty.path))
        source.start()
        try:
            _until(lambda: source.snapshot().stream.connected)
            other = _python(_OPENS_A_PORT, pty.path, str(second))
            pty.send(b"t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]\n")
            for k in range(LINES):
                pty.send(b"%.2f,0.1,0.2,9.%03d\n" % (0.01 * k, k))
                time.sleep(0.005)  # at the pace of a device
            said = other.communicate(timeout=PATIENCE)[0]
            _until(lambda: source.snapshot().stream.samples >= LINES)
            kept = source.snapshot().stream
        finally:
            source.stop()
            pty.unplug()
        yield "" if "is in use by" in said else f"the second wizard on a port says {said!r}"
        yield "" if not list(second.glob("*")) else "it left a session behind"
        lost = LINES - kept.samples + kept.lost + kept.malformed
        yield f"the first wizard on a port lost {lost} lines" if lost else ""


def _until(true: Callable[[], bool]) -> None:
    """Wait, but not for ever."""
    end = time.monotonic() + PATIENCE
    while not true() and time.monotonic() < end:
        time.sleep(0.02)  # between two looks


_RESUMES = """
import sys
from pathlib import Path
from imucal_wizard.core.errors import SessionError
from imucal_wizard.run.session_replay import resume_session
try:
    resume_session(Path(sys.argv[1]))
except SessionError as error:
    print(error)
"""


def on_one_session() -> Iterator[str]:
    """The second program is refused; nothing of the first one's is changed."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "a.imucal"
        sat(path, share=0.3)
        with Session.open(path) as session:
            before = len(list(session.raw()))
            said = _python(_RESUMES, str(path)).communicate(timeout=PATIENCE)[0]
            session.write_pieces([(1e3, b"1,2,3\n")])
            session.commit()
        pieces = _pieces(path)
        yield "" if "another imucal-wizard" in said else f"the second on a session says {said!r}"
        yield "" if len(pieces) == before + 1 else "a piece of a session was lost"


_ADDS = """
import sys
from pathlib import Path
from imucal_wizard.sessions.catalogue import Catalogue
for number in range(5):
    with Catalogue(Path(sys.argv[1])) as catalogue:
        said = {"schema": "imucal-wizard/recheck/1", "verdict": "go", "number": number}
        catalogue.add_recheck({"name": sys.argv[2]}, said)
        assert catalogue.history(sys.argv[2]).rechecks
"""


def on_one_catalogue(programs: int) -> Iterator[str]:
    """Every program adds results; one of them finds the catalogue deleted."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "sessions"
        names = [f"device {k}" for k in range(programs)]
        running = [_python(_ADDS, str(folder), name) for name in names]
        time.sleep(0.3)  # some of them have begun to add
        (folder / "catalogue.sqlite").unlink(missing_ok=True)
        for name, one in zip(names, running, strict=True):
            problems = one.communicate(timeout=PATIENCE)[1]
            yield f"a program on a catalogue: {problems[-200:]}" if one.returncode else ""
            with Catalogue(folder) as catalogue:
                kept = {r.document["number"] for r in catalogue.history(name).rechecks}
            yield "" if kept == set(range(5)) else f"results {kept} of five are in the catalogue"


_WRITES = """
import sys, time
from pathlib import Path
from imucal_wizard.sessions import Session
session, number = Session.create(Path(sys.argv[1]), {"source": "x"}), 0
while True:
    number += 1
    session.write_pieces([(number / 100.0, b"line %d\\n" % number * 40)])
    if number % 7 == 0:
        session.commit()
    if number == 7:
        print("kept", flush=True)
    time.sleep(0.0005)  # so that the copies fall between two writes
"""


def copies(count: int, chance: np.random.Generator) -> Iterator[str]:
    """A copy made meanwhile holds the first pieces, or is refused in a sentence."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "a.imucal"
        writer = _python(_WRITES, str(path))
        try:
            for k in range(count):
                time.sleep(chance.uniform(0.05, 0.4))  # at any moment of the writing
                folder = Path(place) / f"copy {k}"
                folder.mkdir()
                ends = (("",), ("", "-wal"), ("-wal", ""), ("", "-wal", "-shm"))[k % 4]
                for end in ends:
                    there = Path(f"{path}{end}")
                    if there.exists():
                        shutil.copyfile(there, f"{folder / path.name}{end}")
                yield _copied(folder / path.name)
            if writer.stdout is not None:
                writer.stdout.readline()  # on a busy machine nothing may be kept yet
        finally:
            writer.kill()
            writer.communicate()
        pieces = _pieces(path)
        yield "" if _in_order(pieces) and pieces else "the session that was copied is damaged"


def _copied(path: Path) -> str:
    """What is wrong with a copy."""
    if not path.exists():
        return ""
    try:
        with Catalogue(path.parent) as catalogue:
            catalogue.sessions()
        pieces = _pieces(path)
    except ImucalError as error:
        return "" if str(path.name) in str(error) else f"a copy says {error}"
    except Exception as error:  # noqa: BLE001 - whatever it is, it is lost
        return f"a copy raises {error!r}"
    return "" if _in_order(pieces) else "a copy holds pieces that nobody wrote"


def _pieces(path: Path) -> list[tuple[float, bytes]]:
    """Arrivals and bytes of a session."""
    with KeptSession.look(path) as session:
        return [(arrival, data) for _, arrival, data in session.raw()]


def _in_order(pieces: Sequence[tuple[float, bytes]]) -> bool:
    return all(data == b"line %d\n" % n * 40 for n, (_, data) in enumerate(pieces, 1))


def clocks() -> Iterator[str]:
    """A session is resumed while the clock says anything; by the arrivals alone, too."""
    with tempfile.TemporaryDirectory() as place:
        for timed in (True, False):
            data = printed() if timed else _without_time(printed())
            cut = data.index(b"\n", int(0.6 * len(data))) + 1
            first = None
            for jump in JUMPS:
                path = Path(place) / "a.imucal"
                sat(path, share=cut / len(data), data=data)
                holds = _resumed_holds(path, jump, data[cut:])
                first = holds if first is None else first
                same = len(holds) == len(first) and np.allclose(holds, first, atol=1e-9)
                yield "" if same else f"a clock {jump:g} s away: {len(holds)} of {len(first)} holds"


def _without_time(data: bytes) -> bytes:
    """The same lines without the device's own time."""
    rows = [row.partition(b",")[2] for row in data.splitlines() if not row.startswith(b"#")]
    return b"\n".join(rows) + b"\n"


def _resumed_holds(path: Path, jump: float, rest: bytes) -> list[list[float]]:
    """The means of all holds of a session that is resumed with such a clock."""
    resumed = resume_session(path)
    engine = resumed.engine
    start = resumed.prepare(engine, now=lambda: resumed.created + jump)
    engine.receive(LINK_BREAK, start)
    pieces = [rest[k : k + 400] for k in range(0, len(rest), 400)]
    for k, piece in enumerate(pieces):
        engine.receive(piece, start + 0.05 * k)
    engine.end()
    holds = [hold.accelerometer.tolist() for hold in engine.collected().holds]
    engine.close()
    return holds


_USES_THE_HOME = """
import sys
from imucal_wizard.cli.main import main
sys.exit(main(sys.argv[1:]))
"""
_OPENS_THE_VIRTUAL_IMU = """
import sys
from imucal_wizard.core.errors import ImucalError, UsageError
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.screens.source import VIRTUAL
from imucal_wizard.tui.services import WizardServices
workshop = WizardServices(WizardOptions())
print([one.title for one in workshop.earlier()])
try:
    workshop.open_source(VIRTUAL)
except ImucalError as error:
    print(error)
    sys.exit(error.exit_status)
"""


def read_only() -> Iterator[str]:
    """A home that cannot be written, empty or with a session and a catalogue in it."""
    mortal = ("setpriv", "--bounding-set=-dac_override,-dac_read_search")
    before = mortal if os.geteuid() == 0 else ()
    if before and shutil.which(before[0]) is None:
        return  # for root every home can be written
    for filled in (False, True):
        with tempfile.TemporaryDirectory() as place:
            home, recording = Path(place) / "home", Path(place) / "a.csv"
            folder = home / ".local" / "share" / "imucal-wizard" / "sessions"
            home.mkdir()
            simulate_recording(recording, rate=25.0)
            if filled:
                folder.mkdir(parents=True)
                sat(folder / "a.imucal", share=0.3)
                with Catalogue(folder) as catalogue:
                    catalogue.add_recheck({"name": "arm"}, {"schema": "imucal-wizard/recheck/1"})
            places = [home, *sorted(home.rglob("*"))]
            for one in places:
                one.chmod(0o500 if one.is_dir() else 0o400)
            save = ["--save", str(Path(place) / "a.json"), "--device", "leg", "--no-verdict"]
            for script, arguments, status, says in (
                (_USES_THE_HOME, ["sessions"], 0, "Poses" if filled else "no sessions"),
                (_USES_THE_HOME, ["devices"], 0, "arm" if filled else "no devices"),
                (_USES_THE_HOME, ["fit", str(recording), *save], 0, "not kept in the history"),
                (_OPENS_THE_VIRTUAL_IMU, [], 2, "give another folder"),
            ):
                program = _python(script, *arguments, before=before, home=home)
                printed = "".join(program.communicate(timeout=PATIENCE))
                fine = (
                    program.returncode == status and says in printed and "Traceback" not in printed
                )
                what = arguments[:1] or ["the wizard"]
                yield "" if fine else f"{what[0]} in a read-only home: {printed[-300:]!r}"
            for one in places:
                one.chmod(0o700)


def umasks() -> Iterator[str]:
    """Sessions, catalogue and calibrations are as private as ``umask`` says, also while written."""
    for mask in (0o077, 0o027, 0o022):
        with tempfile.TemporaryDirectory() as place:
            folder, before = Path(place) / "deep" / "sessions", os.umask(mask)
            try:
                session = Session.create(folder / "a.imucal", {"source": "x"})
                session.write_pieces([(1.0, b"x")])
                session.commit()
                with Catalogue(folder) as catalogue:
                    catalogue.add_recheck({"name": "arm"}, {"schema": "imucal-wizard/recheck/1"})
                for one in (folder.parent, folder, *folder.iterdir()):
                    mode = stat.S_IMODE(one.stat().st_mode)
                    yield f"{one.name} has mode {mode:o}" if mode & mask else ""
                session.close()
            finally:
                os.umask(before)


def names() -> Iterator[str]:
    """No name makes a command fail, write elsewhere, or print what a terminal obeys."""
    with tempfile.TemporaryDirectory() as place:
        folder, recording = Path(place) / "sessions", Path(place) / "a.csv"
        simulate_recording(recording, rate=25.0)
        for name in NAMES:
            with Catalogue(folder) as catalogue, suppress(UsageError):  # no printable character
                catalogue.add_recheck({"name": name}, {"schema": "imucal-wizard/recheck/1"})
            if "\x00" not in name and "/" not in name and len(name) < 200:
                path = folder / f"{name}.imucal"
                Session.create(path, {"source": name, "description": {"device": name}}).close()
            for command in (["sessions"], ["devices"], ["devices", name.replace("\x00", "")]):
                arguments = [*command, "--sessions", str(folder)]
                one = _python(_USES_THE_HOME, *arguments)
                printed = "".join(one.communicate(timeout=PATIENCE))
                bad = {c for c in printed if c != "\n" and not c.isprintable()}
                fine = not bad and "Traceback" not in printed and one.returncode in (0, 2)
                yield "" if fine else f"{command[0]} of {name!r}: {bad or printed[-200:]!r}"
        outside = {one.name for one in Path(place).iterdir()} - {"sessions", "a.csv"}
        yield f"written outside: {outside}" if outside else ""
