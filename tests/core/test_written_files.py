"""Files are written completely or not at all, and nothing else is lost by it."""

import errno
import os
import resource
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from imucal_wizard.cli.main import main
from imucal_wizard.core.errors import PlaceError, SessionError, UsageError
from imucal_wizard.core.output import replacing, write_atomically
from imucal_wizard.sessions import Session


def test_a_file_is_replaced_with_its_mode_and_nothing_lies_beside_it(tmp_path: Path) -> None:
    place = tmp_path / "cal.json"
    place.write_text("old")
    place.chmod(0o640)
    (tmp_path / "cal.json.part").write_text("mine")
    write_atomically(place, b"new")
    assert place.read_bytes() == b"new"
    assert stat.S_IMODE(place.stat().st_mode) == 0o640
    assert (tmp_path / "cal.json.part").read_text() == "mine"
    assert sorted(one.name for one in tmp_path.iterdir()) == ["cal.json", "cal.json.part"]


def test_a_symbolic_link_stays_and_its_target_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    target, link = tmp_path / "there" / "cal.json", tmp_path / "link.json"
    target.write_text("old")
    link.symlink_to(target)
    write_atomically(link, b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


def test_a_full_disk_leaves_the_old_file_and_names_the_cause(tmp_path: Path) -> None:
    place = tmp_path / "cal.json"
    place.write_text("old")

    def fill() -> None:
        with replacing(place) as file:
            file.write(b"half")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(UsageError, match="the disk is full"):
        fill()
    assert place.read_text() == "old"
    assert list(tmp_path.iterdir()) == [place]


@contextmanager
def size_limit(size: int) -> Iterator[None]:
    """No file can become larger than this, bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_limit_of_the_size_is_named_for_a_result_and_for_a_session(tmp_path: Path) -> None:
    with size_limit(100_000):
        with pytest.raises(PlaceError, match="the limit of the size of a file is reached"):
            write_atomically(tmp_path / "cal.json", bytes(200_000))
        with pytest.raises(SessionError, match="the limit of the size of a file is reached"):
            too_long(tmp_path / "a.imucal")
        with pytest.raises(SessionError, match="the limit of the size of a file is reached"):
            Session.create(tmp_path / "b.imucal", {"much": "x" * 200_000})
    assert not list(tmp_path.glob("*cal.json*"))
    assert not list(tmp_path.glob("b.imucal*"))


def too_long(path: Path) -> None:
    """A session of 200 kB."""
    session = Session.create(path, {})
    for arrival in range(20):
        session.write_pieces([(arrival, bytes(10_000))])
        session.commit()


@pytest.mark.parametrize(
    "arguments",
    [
        ["fit", "{recording}", "--save", "{place}"],
        ["fit", "{recording}", "--json", "{place}"],
        ["bench", "{recording}", "--auto", "--save", "{place}"],
        ["simulate", "{place}"],
    ],
)
@pytest.mark.parametrize("kind", ["folder", "fifo", "device", "other"])
def test_no_command_writes_over_what_is_no_file_of_its_kind(
    tmp_path: Path, arguments: list[str], kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, place = tmp_path / "recording.csv", tmp_path / "place"
    recording.write_text("t[s],ax[g]\n")
    if kind == "folder":
        place.mkdir()
    elif kind == "fifo":
        os.mkfifo(place)
    elif kind == "other":
        place.write_text("a measurement that nobody can repeat\n")
    else:
        place = Path("/dev/null")
    words = [one.format(recording=recording, place=place) for one in arguments]
    before = place.stat()
    assert main(words) == 2
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    assert str(place) in said
    after = place.stat()
    assert (after.st_ino, after.st_mode, after.st_size) == (
        before.st_ino,
        before.st_mode,
        before.st_size,
    )
