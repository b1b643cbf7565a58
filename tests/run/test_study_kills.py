"""A few kills and losses of power; the whole study is an attack."""

import shutil
from pathlib import Path

import pytest

from benchmarks.attacks.kills import Sitting, study
from benchmarks.attacks.power_loss import Call, Disk, cut_power


@pytest.mark.study
def test_nothing_that_the_screen_has_confirmed_is_lost_by_a_kill() -> None:
    at_random = Sitting(1, 20.0, confirmed=False, commands=False, seed=7)
    at_once = Sitting(1, 20.0, confirmed=True, commands=True, seed=8)
    outcome = study([at_random, at_once])
    assert outcome.tries == 2
    assert outcome.lost == []


@pytest.mark.study
@pytest.mark.skipif(shutil.which("cc") is None, reason="the recorder needs a C compiler")
def test_nothing_that_the_screen_has_confirmed_is_lost_with_the_power() -> None:
    assert cut_power(20.0, 2.0, 12) == [""] * 12


def test_the_simulated_disk_keeps_what_was_synced_and_nothing_else(tmp_path: Path) -> None:
    folder = Path("/sessions")
    disk = Disk()

    def call(kind: str, name: str = "a", offset: int = 0, data: bytes = b"") -> None:
        path = folder / name if name else folder
        disk.take(Call(0.0, kind, path, offset, len(data), data))

    def left() -> dict[str, bytes]:
        for old in tmp_path.iterdir():
            old.unlink()
        disk.lose(tmp_path, None)
        return {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    call("C")
    call("W", data=b"one")
    call("S")
    assert left() == {}  # the file is safe, its name is not
    call("S", "")
    call("W", offset=3, data=b"two")
    assert left() == {"a": b"one"}
    call("T", offset=1)
    call("S")
    assert left() == {"a": b"o"}
    call("U")
    assert left() == {"a": b"o"}
    call("S", "")
    assert left() == {}
