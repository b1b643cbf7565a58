"""Files that are read are bounded, and no pipe makes the program wait for ever."""

import gzip
import os
import threading
from pathlib import Path

import pytest

from imucal_wizard.cli.main import main
from imucal_wizard.core import input as reading
from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.model.catalogue import load_effect

EFFECT = b"""
from imucal_wizard.model.effects.second_order import SecondOrder

class MySquare(SecondOrder):
    name = "my-square"

open(__file__ + ".ran", "a").write("x")
"""


def test_a_pipe_without_a_writer_is_refused_in_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reading, "MAX_SILENCE_OF_PIPE_SECONDS", 0.1)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for words in (
        ["fit", str(pipe)],
        ["diff", str(pipe), str(pipe)],
        ["fit", str(pipe), "--limits", str(pipe)],
    ):
        assert main(words) == 2
        said = capsys.readouterr().err
        assert "nothing was written into it for 0.1 s" in said
        assert len(said.splitlines()) == 1


def test_a_pipe_that_a_program_fills_is_read_to_its_last_byte(tmp_path: Path) -> None:
    pipe, sent = tmp_path / "pipe", bytes(range(256)) * 2000
    os.mkfifo(pipe)
    writer = threading.Thread(target=lambda: pipe.write_bytes(sent))
    writer.start()
    assert reading.read_document(pipe) == sent
    writer.join()


def test_a_device_is_no_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diff", "/dev/zero", "/dev/zero"]) == 2
    assert "is a device and no file" in capsys.readouterr().err


def test_what_is_unpacked_is_bounded_in_size_and_in_ratio() -> None:
    noise = os.urandom(300_000)
    assert reading.unpacked(gzip.compress(noise) + gzip.compress(noise), 10**6) == 2 * noise
    constant = gzip.compress(b"0,0.01,0.02,1.0\n" * 1_000_000, 1)
    assert len(reading.unpacked(constant, 10**8)) == 16_000_000
    with pytest.raises(RecordingError, match=r"larger than 15 MB"):
        reading.unpacked(constant, 15_000_000)
    with pytest.raises(RecordingError, match="50 times as large as packed"):
        reading.unpacked(gzip.compress(bytes(40_000_000), 1), 10**9)


@pytest.mark.parametrize(("mode", "folder"), [(0o666, 0o700), (0o602, 0o700), (0o600, 0o777)])
def test_code_that_others_can_write_is_not_run(tmp_path: Path, mode: int, folder: int) -> None:
    place = tmp_path / "shared"
    place.mkdir()
    path = place / "mine.py"
    path.write_bytes(EFFECT)
    path.chmod(mode)
    place.chmod(folder)
    with pytest.raises(UsageError, match="can be written by others"):
        load_effect(path)
    assert not (place / "mine.py.ran").exists()
    path.chmod(0o644)
    place.chmod(0o755)
    assert load_effect(path).name == "my-square"


def test_a_file_of_code_is_named_and_run_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, recording = tmp_path / "mine.py", tmp_path / "a.csv"
    path.write_bytes(EFFECT)
    recording.write_text("t[s],ax[g],ay[g],az[g]\n")
    assert main(["bench", str(recording), *["--effects", str(path)] * 2]) == 2
    assert capsys.readouterr().err.count(f"runs the Python code in {path}\n") == 1
    assert (tmp_path / "mine.py.ran").read_text() == "x"


def test_what_is_nested_too_deeply_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, deep = tmp_path / "a.csv", tmp_path / "deep.toml"
    recording.write_text("t[s],ax[g],ay[g],az[g]\n")
    deep.write_text("grade = " + "[" * 100_000)
    json = tmp_path / "deep.json"
    json.write_text("[" * 100_000)
    for words in (
        ["fit", str(recording), "--limits", str(deep)],
        ["diff", str(deep), str(deep)],
        ["diff", str(json), str(json)],
        ["export", str(json), "--to", "numpy"],
    ):
        assert main(words) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1
