"""What is said of session files that cannot be used, and of those there are."""

import sqlite3
import threading
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.core.errors import SessionError
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.run.session_replay import begin_session, resume_session
from imucal_wizard.sessions import KeptSession, Session
from tests.cli.kept_sessions import listed
from tests.estimate.truth import hold


def _foreign(path: Path) -> None:
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE raw (id)")


def _newer(path: Path) -> None:
    Session.create(path, {}).close()
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA user_version = 99")


def _damaged(path: Path) -> None:
    with Session.create(path, {}) as session:
        for number in range(200):
            session.write_pieces([(float(number), b"x" * 1000)])
    data = path.read_bytes()
    path.write_bytes(data[:4096] + b"\xff" * (len(data) - 4096))


def _garbled_names(path: Path) -> None:
    """The database quotes the damage in its message, and that is no text."""
    Session.create(path, {}).close()
    path.write_bytes(path.read_bytes().replace(b"TABLE raw (id", b"TABLE raw \xff\xfe\xfd"))


def _text(path: Path) -> None:
    path.write_text("t,ax,ay,az\n")


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (_foreign, "a database of another program"),
        (_newer, "written by a newer imucal-wizard .session version 99"),
        (_damaged, "is damaged .* write what can be read of it to a new file"),
        (_garbled_names, "is damaged"),
        (_text, "is not a session of this program"),
        (lambda _: None, "no such session"),
    ],
)
def test_a_file_that_is_no_usable_session_is_refused_with_the_reason(
    tmp_path: Path, make: object, says: str
) -> None:
    path = tmp_path / "a.imucal"
    assert callable(make)
    make(path)
    with pytest.raises(SessionError, match=says):
        Session.open(path)


def test_the_list_of_sessions_says_how_far_each_came_and_why_one_cannot_be_read(
    tmp_path: Path,
) -> None:
    with Session.create(tmp_path / "old.imucal", {"source": "IMU", "created": 1.0}) as session:
        session.write_pieces([(10.0, b"a")])
        session.write_pieces([(25.0, b"b")])
        session.write_findings(Collected((hold(np.array([0.0, 0.0, 9.8]), 0.0),), ()))
        session.set_meta("step", "poses")
    Session.create(tmp_path / "new.imucal", {"created": 2.0, "step": "save"}).close()
    _text(tmp_path / "broken.imucal")
    broken, new, old = listed(tmp_path)
    assert "is not a session" in broken.problem
    assert (new.path.name, new.finished) == ("new.imucal", True)
    assert (old.source, old.step, old.seconds, old.holds) == ("IMU", "poses", 15.0, 1)
    assert not old.finished


def test_a_session_that_is_being_written_cannot_be_taken_up(tmp_path: Path) -> None:
    with Session.create(tmp_path / "a.imucal", {}):
        (info,) = listed(tmp_path)
        assert "is being written by another" in info.problem
    (info,) = listed(tmp_path)
    assert info.problem == ""


def test_a_session_is_being_written_between_two_commits_as_well(tmp_path: Path) -> None:
    """A commit releases the lock of the file for a moment."""
    with Session.create(tmp_path / "a.imucal", {}) as session:
        connection = session._connection
        connection.execute("COMMIT")
        begin = threading.Timer(0.05, lambda: connection.execute("BEGIN IMMEDIATE"))
        begin.start()
        (info,) = listed(tmp_path)
        begin.join()
        assert info.busy


def test_a_session_is_not_taken_from_its_writer_between_two_commits(tmp_path: Path) -> None:
    """Two writers would alternate, and each would go on from what it had itself."""
    with Session.create(tmp_path / "a.imucal", {}) as session:
        connection = session._connection
        connection.execute("COMMIT")
        begin = threading.Timer(0.05, lambda: connection.execute("BEGIN IMMEDIATE"))
        begin.start()
        with pytest.raises(SessionError, match="is being written by another"):
            Session.open(session.path)
        begin.join()


def test_a_session_that_is_only_read_elsewhere_can_be_taken_up(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    Session.create(path, {}).close()
    with KeptSession.look(path):
        (info,) = listed(tmp_path)
        assert not info.busy


@pytest.mark.parametrize(
    "sql",
    [
        "UPDATE raw SET arrival = 'x'",
        "UPDATE raw SET arrival = -9e999",
        "UPDATE raw SET data = 'text'",
        "INSERT INTO command VALUES (NULL, 'x', 0, 'start', '')",
        "INSERT INTO command VALUES (NULL, 1, 0, x'00', '')",
        "UPDATE meta SET value = '\"x\"' WHERE key = 'created'",
        "UPDATE meta SET value = '[]' WHERE key = 'asked'",
    ],
)
def test_values_of_a_wrong_type_do_not_break_the_list_of_sessions(tmp_path: Path, sql: str) -> None:
    path = tmp_path / "a.imucal"
    begin_session(path).close()
    with Session.open(path) as session:
        session.write_pieces([(0.5, b"1,2,3\n")])
        session.write_pieces([(1.0, b"1,2,3\n")])
    with sqlite3.connect(path) as connection:
        connection.execute(sql)
    assert len(listed(tmp_path)) == 1
    with pytest.raises(SessionError):
        _taken_up(path)


def _taken_up(path: Path) -> None:
    again = resume_session(path)
    again.prepare(again.engine)


def test_an_invalid_time_does_not_break_the_list_of_sessions(tmp_path: Path) -> None:
    Session.create(tmp_path / "a.imucal", {"created": 1e300}).close()
    (info,) = listed(tmp_path)
    assert "is damaged" in info.problem
