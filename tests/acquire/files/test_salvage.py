"""A damaged session gives all that can be read, and says what is lost."""

import random
import sqlite3
from collections.abc import Iterable
from contextlib import closing
from itertools import chain
from pathlib import Path

import pytest

from imucal_wizard.acquire.files import Batch
from imucal_wizard.acquire.files.session_file import read_batches
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


def separate(batches: Iterable[Batch]) -> list[tuple[bytes, float]]:
    """The pieces of batches that do not come as one."""
    return list(chain(*(batch for batch in batches if isinstance(batch, list))))


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """600 pieces of different lengths and three commands."""
    path = tmp_path_factory.mktemp("kept") / "a.imucal"
    with Session.create(path, {"asked": {}, "setup": {}, "settings": {}}) as kept:
        for number in range(1, 601):
            if number % 200 == 0:
                kept.write_command(number, "start")
            kept.write_pieces([(0.5 * number, b"piece %06d\n" % number * (1 + 7 * number % 60))])
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
    pieces, lost = read_session(path, lambda _, batches: separate(batches), 1000)
    assert {(arrival, data) for data, arrival in pieces} >= set(readable.values())
    with KeptSession.look(path) as kept:
        assert {number for number, _, data in kept.raw() if data} >= set(readable)
        kept.meta()
        kept.commands()
        assert bool(kept.damage) == bool(lost)


def test_pieces_come_as_one_unless_one_is_missing_empty_garbled_or_late(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    with Session.create(path, {"asked": {}, "setup": {}, "settings": {}}) as kept:
        for number in range(1, 3001):
            late = 1.0 * (number > 1500)
            kept.write_pieces(
                [(0.01 * number + late, b"" if number == 1200 else b"%08d\n" % number)]
            )
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("DELETE FROM raw WHERE id = 1800")
        connection.commit()
        whole = b"".join(data for (data,) in connection.execute("SELECT data FROM raw"))
        batches = list(read_batches(connection, 450, lambda: 0.5))
        joined = [batch for batch in batches if isinstance(batch, tuple)]
        each = [[one] if isinstance(one, tuple) else one for one in batches]
        assert b"".join(data for some in each for data, *_ in some) == whole
        assert len(joined) > 40
        for data, last, first in joined:
            numbers = [int(line) for line in data.split()]
            assert numbers == list(range(numbers[0], numbers[-1] + 1))
            assert not {1200, 1501, 1800} & set(numbers)
            late = 1.0 * (numbers[0] > 1500)
            assert (first, last) == (0.01 * numbers[0] + late, 0.01 * numbers[-1] + late)
        connection.execute("UPDATE raw SET data = 'text' WHERE id = 2900")
        with pytest.raises(sqlite3.DatabaseError, match="garbled"):
            list(read_batches(connection, 450, lambda: 0.5))


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
            kept.write_pieces([(float(number), b"piece %06d" % number * 20)])
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
