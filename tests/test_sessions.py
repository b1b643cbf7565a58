"""A session on disk: what it keeps and what it survives."""

import datetime as dt
import os
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files import is_session
from imucal_wizard.core.errors import SessionError, SessionTakenError
from imucal_wizard.guide.kinds import EventKind
from imucal_wizard.guide.state import Event
from imucal_wizard.measurement.holds import Collected, Hold, Rotation
from imucal_wizard.sessions import Command, KeptSession, Session, new_session_path
from imucal_wizard.sessions.session import SPARE_BYTES
from imucal_wizard.sessions.session_list import session_info
from tests.cli.kept_sessions import listed


def _hold(start: float, pose: str) -> Hold:
    return Hold(
        start, start + 2.0, np.array([0.0, 0.0, 9.8]), np.eye(3) * 1e-8, None, None, 200, 25.0, pose
    )


def _on_disk(path: Path, table: str) -> int:
    with sqlite3.connect(path) as connection:
        count: int = connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0]  # noqa: S608 - names from the tests
    return count


def test_bytes_commands_and_settings_come_back_as_they_were_written(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "a.imucal"
    with Session.create(path, {"source": "a device", "setup": {"rate": 100.0}}) as session:
        session.write_pieces([(0.25, b"1,2,3\n\x00\xff")])
        session.write_command(3, "start")
        session.write_pieces([(0.5, b"4,5,6\n")])
        session.write_command(9, "goto", "poses")
        session.set_meta("step", "settle")
    with Session.open(path) as session:
        assert list(session.raw()) == [(1, 0.25, b"1,2,3\n\x00\xff"), (2, 0.5, b"4,5,6\n")]
        assert session.commands() == [Command(1, 3, "start", ""), Command(2, 9, "goto", "poses")]
        about = session.meta()
        assert (about["source"], about["setup"], about["step"]) == (
            "a device",
            {"rate": 100.0},
            "settle",
        )
        assert (session.last_raw, session.last_arrival) == (2, 0.5)


def test_what_is_written_after_opening_again_goes_on_where_it_ended(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    with Session.create(path, {}) as session:
        session.write_pieces([(0.0, b"one")])
    with Session.open(path) as session:
        session.write_pieces([(1.0, b"two")])
        assert [data for _, _, data in session.raw()] == [b"one", b"two"]


_WRITER = """
import sys
from pathlib import Path
from imucal_wizard.sessions import Session
session = Session.create(Path(sys.argv[1]), {})
number = 0
while True:
    number += 1
    session.write_pieces([(number / 100, b"line %d\\n" % number)])
    if number % 1000 == 0:
        session.commit()
        print(number, flush=True)
"""


def test_a_session_survives_the_sudden_death_of_its_program(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    process = subprocess.Popen([sys.executable, "-c", _WRITER, str(path)], stdout=subprocess.PIPE)
    assert process.stdout is not None
    while not path.exists() or _committed(path) < 100:
        assert process.stdout.readline()
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()
    with Session.open(path) as session:
        pieces = [data for _, _, data in session.raw()]
        assert pieces == [b"line %d\n" % number for number in range(1, len(pieces) + 1)]
        assert len(pieces) >= 100
        session.write_pieces([(session.last_arrival or 0.0, b"goes on")])


def _committed(path: Path) -> int:
    try:
        return _on_disk(path, "raw")
    except sqlite3.OperationalError:  # the tables are not there yet
        return 0


def test_holds_and_rotations_are_written_when_finished_and_forgotten_when_undone(
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.imucal"
    first, second = _hold(0.0, "+x"), _hold(5.0, "-x")
    turn = Rotation(first, second, np.arange(3.0), np.zeros((3, 3)), "z", None)
    with Session.create(path, {}) as session:
        session.write_findings(Collected((first, second), (turn,)))
        session.write_findings(Collected((first,), ()))
        session.write_events([Event(EventKind.UNDONE, 7.0, "taken back")])
    with sqlite3.connect(path) as connection:
        assert connection.execute("SELECT start, end, pose FROM hold").fetchall() == [
            (0.0, 2.0, "+x")
        ]
        assert connection.execute("SELECT count(*) FROM rotation").fetchone() == (0,)
        assert connection.execute("SELECT kind, text FROM event").fetchall() == [
            ("undone", "taken back")
        ]


def test_a_session_is_listed_with_the_holds_that_its_result_counts(tmp_path: Path) -> None:
    """The holds of the validation are kept with them, and are not fitted."""
    path, faces = tmp_path / "a.imucal", (_hold(0.0, "+x"), _hold(5.0, "-x"))
    with Session.create(path, {}) as session:
        session.write_findings(Collected(faces, (), (_hold(10.0, "+y"),)))
    assert session_info(path).holds == 2
    with sqlite3.connect(path) as connection:
        assert connection.execute("SELECT count(*) FROM hold").fetchone() == (3,)
        connection.execute("UPDATE hold SET value = '{' WHERE id = 0")
    assert session_info(path).holds == 2


@pytest.mark.skipif(sys.platform == "win32", reason="an open file cannot be removed there")
@pytest.mark.parametrize("ending", ["", "-wal"])
def test_a_session_that_is_removed_while_it_is_written_is_told_and_can_be_copied(
    tmp_path: Path, ending: str
) -> None:
    path, other = tmp_path / "a.imucal", tmp_path / "b.imucal"
    session = Session.create(path, {})
    session.write_pieces([(0.25, b"1,2,3\n")])
    session.commit()
    path.with_name(path.name + ending).unlink()
    session.write_pieces([(0.5, b"4,5,6\n")])
    with pytest.raises(SessionError, match="was removed or replaced"):
        session.commit()
    session.roll_back()
    with session.copied(other) as copy:
        assert [data for _, _, data in copy.raw()] == [b"1,2,3\n", b"4,5,6\n"]
    session.close()


@pytest.mark.skipif(sys.platform == "win32", reason="no limits of the size of files there")
def test_a_commit_leaves_room_for_the_index_of_the_log(tmp_path: Path) -> None:
    """Without room for that, a file system that copies on write kills the process."""
    import resource

    path, other = tmp_path / "a.imucal", tmp_path / "b.imucal"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    with Session.create(path, {}) as session:
        session.write_pieces([(0.25, b"1,2,3\n")])
        session.commit()
        session.write_pieces([(0.5, b"4,5,6\n")])
        try:
            resource.setrlimit(resource.RLIMIT_FSIZE, (SPARE_BYTES + 20_000, before[1]))
            session.commit()
            session.write_pieces([(0.75, b"7,8,9\n")])
            resource.setrlimit(resource.RLIMIT_FSIZE, (SPARE_BYTES // 2, before[1]))
            with pytest.raises(SessionError, match="the limit of the size of a file is reached"):
                session.commit()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        session.roll_back()
        with session.copied(other) as copy:
            assert [data for _, _, data in copy.raw()] == [b"1,2,3\n", b"4,5,6\n"]


def test_a_name_that_is_taken_is_not_written_over(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    Session.create(path, {}).close()
    with pytest.raises(SessionError, match="exists already; resume it"):
        Session.create(path, {})


def test_a_name_that_no_file_can_have_is_refused_with_the_reason(tmp_path: Path) -> None:
    path = tmp_path / f"{'a' * 300}.imucal"
    with pytest.raises(SessionError, match="cannot be written"):
        Session.create(path, {})
    with pytest.raises(SessionError, match="cannot be read"):
        Session.open(path)
    folder = tmp_path / ("a" * 300)
    assert listed(folder) == []
    assert new_session_path(folder, dt.datetime.now(dt.UTC)).parent == folder


def test_a_session_that_is_being_written_cannot_be_opened_twice(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    with Session.create(path, {}), pytest.raises(SessionError, match="another imucal-wizard"):
        Session.open(path)


def test_a_session_that_is_read_here_stays_open_for_other_programs(tmp_path: Path) -> None:
    """The wizard reads its own session for the fit; another program then looks at the session."""
    path = tmp_path / "a.imucal"
    with Session.create(path, {"source": "x"}) as session:
        session.write_pieces([(0.0, b"one")])
        session.commit()
        assert is_session(path)
        look = (
            "import sqlite3, sys; c = sqlite3.connect(sys.argv[1]); "
            "c.execute('SELECT count(*) FROM raw').fetchone(); c.close()"
        )
        subprocess.run([sys.executable, "-c", look, str(path)], check=True)
        session.write_pieces([(0.1, b"two")])
        session.commit()
    assert _on_disk(path, "raw") == 2


def test_a_session_that_is_being_written_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    with Session.create(path, {"source": "x"}) as session:
        session.write_pieces([(0.0, b"one")])
        session.commit()
        with KeptSession.look(path) as kept:
            assert (kept.last_raw, kept.commands()) == (1, [])
            assert list(kept.raw()) == [(1, 0.0, b"one")]
            assert kept.meta()["source"] == "x"


def test_a_session_in_a_folder_that_cannot_be_written_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its log would need a file beside it; without rows in the log it can be read as it is."""
    path = tmp_path / "a b%20#?.imucal"
    with Session.create(path, {"source": "x"}) as session:
        session.write_pieces([(0.0, b"one")])
    monkeypatch.setattr("os.access", lambda *_: False)
    (info,) = listed(tmp_path)
    assert (info.source, info.problem) == ("x", "")
    with KeptSession.look(path) as kept:
        assert list(kept.raw()) == [(1, 0.0, b"one")]
        assert not list(tmp_path.glob(f"{path.name}-*")), "nothing is written beside it"


def test_a_new_session_gets_a_name_of_its_own(tmp_path: Path) -> None:
    now = dt.datetime(2031, 5, 6, 7, 8, 9, tzinfo=dt.UTC)
    first = new_session_path(tmp_path, now)
    Session.create(first, {}).close()
    assert first.name == "2031-05-06_070809.imucal"
    assert new_session_path(tmp_path, now).name == "2031-05-06_070809-2.imucal"


def test_programs_that_begin_in_the_same_second_never_share_a_session(tmp_path: Path) -> None:
    """Both have found the same name unused; the second to create it is told so."""
    now = dt.datetime(2031, 5, 6, 7, 8, 9, tzinfo=dt.UTC)
    one, other = new_session_path(tmp_path, now), new_session_path(tmp_path, now)
    assert one == other
    with Session.create(one, {"source": "first"}):
        with pytest.raises(SessionTakenError):
            Session.create(other, {"source": "second"})
        assert new_session_path(tmp_path, now) != one
    with KeptSession.look(one) as kept:
        assert kept.meta()["source"] == "first"
