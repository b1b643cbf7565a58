"""A damaged session gives all that can be read, and says what is lost."""

import random
import sqlite3
from contextlib import closing
from itertools import chain
from pathlib import Path

import pytest

from imucal_wizard.acquire.files.session_salvage import read_session, repair, salvage
from imucal_wizard.cli.main import main
from imucal_wizard.core.errors import SessionError
from imucal_wizard.sessions import KeptSession, Session
from tests.cli.kept_sessions import sat

PAGE = 4096


def pieces_of(path: Path) -> dict[int, tuple[float, bytes]]:
    """Arrival and bytes of each piece by its number, as SQLite reads them."""
    with closing(sqlite3.connect(path)) as connection:
        rows = connection.execute("SELECT id, arrival, data FROM raw")
        return {number: (arrival, data) for number, arrival, data in rows}


def pages_of(data: bytes) -> dict[int, int]:
    """The page in which each piece of a session lies that fits into one."""
    return {number: data.find(b"piece %06d" % number) // PAGE for number in range(1, 601)}


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """600 pieces of different lengths and three commands."""
    path = tmp_path_factory.mktemp("kept") / "a.imucal"
    with Session.create(path, {"asked": {}, "setup": {}, "settings": {}}) as kept:
        for number in range(1, 601):
            if number % 200 == 0:
                kept.write_command(number, "start")
            kept.write_raw(0.5 * number, b"piece %06d\n" % number * (1 + 7 * number % 60))
    return path


@pytest.mark.parametrize("seed", range(12))
def test_every_piece_outside_the_damaged_pages_is_read(
    session: Path, tmp_path: Path, seed: int
) -> None:
    data, rng = bytearray(session.read_bytes()), random.Random(seed)  # noqa: S311 - seeded damage
    where, whole = pages_of(bytes(data)), pieces_of(session)
    damaged = rng.sample(range(len(data) // PAGE), rng.choice([1, 2, 5]))
    for page in damaged:
        start = PAGE * page + (0 if seed % 3 else rng.randrange(PAGE))
        length = PAGE * (page + 1) - start
        data[start : start + length] = bytes(length) if seed % 2 else rng.randbytes(length)
    path = tmp_path / "a.imucal"
    path.write_bytes(data)
    readable = {number: one for number, one in whole.items() if where[number] not in damaged}
    pieces, lost = read_session(path, lambda _, batches: list(chain(*batches)), 1000)
    assert {(arrival, data) for data, arrival in pieces} >= set(readable.values())
    with KeptSession.look(path) as kept:
        assert {number for number, _, data in kept.raw() if data} >= set(readable)
        kept.meta()
        kept.commands()
        assert bool(kept.damage) == bool(lost)


def test_an_interruption_stands_where_pieces_are_lost(session: Path, tmp_path: Path) -> None:
    """Otherwise the beginning of one line would be joined to the end of another."""
    data = bytearray(session.read_bytes())
    page = pages_of(bytes(data))[300]
    data[PAGE * page : PAGE * (page + 1)] = bytes(PAGE)
    path = tmp_path / "a.imucal"
    path.write_bytes(data)
    gone = {number for number, one in pages_of(session.read_bytes()).items() if one == page}
    found = salvage(path)
    with closing(found.connection):
        rows = found.connection.execute("SELECT id, data FROM raw WHERE data = x''").fetchall()
    assert rows == [(max(gone), b"")]
    assert (found.lost, found.pieces) == (len(gone), 600 - len(gone))
    assert f"from {0.5 * (min(gone) - 1):.1f} to {0.5 * (max(gone) + 1):.1f} s" in found.says


def test_pages_of_the_log_that_were_committed_count(session: Path, tmp_path: Path) -> None:
    """A process that was killed leaves them beside the file."""
    path = tmp_path / "a.imucal"
    with Session.create(tmp_path / "b.imucal", {"asked": {}, "setup": {}, "settings": {}}) as kept:
        for number in range(1, 601):
            kept.write_raw(float(number), b"piece %06d" % number * 20)
        kept.commit()
        data = bytearray((tmp_path / "b.imucal").read_bytes())
        log = (tmp_path / "b.imucal-wal").read_bytes()
    del session
    path.write_bytes(data[:PAGE] + bytes(len(data[PAGE:])))
    path.with_name("a.imucal-wal").write_bytes(log)
    found = salvage(path)
    with closing(found.connection):
        assert (found.pieces, found.lost) == (600, 0)


def test_a_repaired_session_is_a_new_file_that_fits_like_the_whole_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.imucal"
    sat(path)
    assert main(["sessions", "--repair", str(path)]) == 0
    assert "is whole" in capsys.readouterr().out
    data = bytearray(path.read_bytes())
    place = data.find(pieces_of(path)[100][1][:500]) // PAGE * PAGE
    data[place : place + PAGE] = b"\xa5" * PAGE
    path.write_bytes(data)
    before = path.read_bytes()
    assert main(["fit", str(path), "--no-verdict", "--all-samples"]) == 0
    assert "pieces of the received bytes (from" in " ".join(capsys.readouterr().out.split())
    assert main(["sessions", "--repair", str(path)]) == 0
    assert "lost are" in capsys.readouterr().out
    new = tmp_path / "a-repaired.imucal"
    assert repair(new) is None
    assert path.read_bytes() == before
    with pytest.raises(SessionError, match="is damaged"), Session.open(path) as damaged:
        list(damaged.raw())
    with Session.open(new) as again:
        assert len(list(again.commands())) == 1


def test_what_holds_nothing_of_a_session_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, data in (("a.imucal", bytes(8192)), ("b.csv", b"t,ax\n")):
        (tmp_path / name).write_bytes(data)
        assert main(["sessions", "--repair", str(tmp_path / name)]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1
