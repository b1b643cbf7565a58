"""A session is a recording like any other: its bytes are decoded again."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.long_recording import LongRecording
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.acquire.files.session_salvage import corrections_note
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.errors import RecordingError, SessionError
from imucal_wizard.core.readings import join_readings
from imucal_wizard.sessions import Session
from tests.acquire.files.lines import samples, write
from tests.acquire.test_stream_corrections import COUNTS


def _session(tmp_path: Path, data: bytes, setup: StreamSetup) -> Path:
    path = tmp_path / "a.imucal"
    with Session.create(path, {"setup": setup.to_json()}) as session:
        for number, start in enumerate(range(0, len(data), 300)):
            session.write_pieces([(number * 0.03, data[start : start + 300])])
    return path


def test_a_session_gives_the_same_samples_as_its_lines_in_a_file(tmp_path: Path) -> None:
    text = write(tmp_path / "a.csv", samples())
    session = _session(tmp_path, text.read_bytes(), StreamSetup())
    from_file, from_session = read_files([text]), read_files([session])
    np.testing.assert_array_equal(from_session.accelerometer.values, from_file.accelerometer.values)
    assert from_session.gyroscope is not None
    assert from_file.gyroscope is not None
    np.testing.assert_array_equal(from_session.gyroscope.values, from_file.gyroscope.values)
    np.testing.assert_allclose(
        from_session.accelerometer.time, from_file.accelerometer.time, atol=1e-9
    )
    assert from_session.warnings == ()


@pytest.mark.parametrize("kept", [True, False])
def test_signs_that_show_late_are_restored_from_the_first_sample_on(
    tmp_path: Path, kept: bool
) -> None:
    """One axis is below zero all the time; another one passes through zero after ten seconds."""
    values = samples(4000)
    values[:, 1:7] = np.random.default_rng(3).normal([200, -500, 16000] * 2, 20.0, (4000, 6))
    values[1000:, [1, 4]] -= 200.0
    values[:, 1:7] = np.mod(np.round(values[:, 1:7]), 2.0**16)
    text = write(tmp_path / "a.csv", values, COUNTS)
    path = _session(tmp_path, text.read_bytes(), StreamSetup()) if kept else text
    whole, long = read_files([path]), LongRecording(path, RecordingOptions())
    pieces = join_readings(list(long))
    for sensor in ("accelerometer", "gyroscope"):
        read, meant = getattr(pieces, sensor).values, getattr(whole, sensor).values
        assert meant.min() < 0.0
        np.testing.assert_array_equal(read, meant)
    assert any("were written as unsigned numbers" in text for text in long.warnings)


def test_a_session_without_device_time_gives_what_was_decoded_live(tmp_path: Path) -> None:
    header = "ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s]"
    text = write(tmp_path / "a.csv", samples(2000)[:, 1:7], header)
    path = _session(tmp_path, text.read_bytes(), StreamSetup())
    intake = Intake(StreamSetup())
    with Session.open(path) as session:
        parts = [intake.feed(data, arrival) for _, arrival, data in session.raw()]
    live = join_readings([part for part in (*parts, intake.flush()) if part is not None])
    again = read_files([path])
    np.testing.assert_array_equal(again.accelerometer.values, live.accelerometer.values)
    np.testing.assert_array_equal(again.accelerometer.time, live.accelerometer.time)


def test_what_the_user_says_goes_over_what_the_session_knows(tmp_path: Path) -> None:
    header = "t[s],ax,ay,az,gx,gy,gz"
    text = write(tmp_path / "a.csv", samples()[:, :7], header)
    path = _session(tmp_path, text.read_bytes(), StreamSetup())
    with pytest.raises(RecordingError, match="gyroscope unit"):
        read_files([path])
    readings = read_files([path], RecordingOptions(gyroscope_unit="deg/s"))
    assert readings.gyroscope is not None
    expected = np.radians(samples()[:, 4:7])
    np.testing.assert_allclose(readings.gyroscope.values, expected, atol=1e-7)


def test_what_was_taken_back_in_the_wizard_can_be_told(tmp_path: Path) -> None:
    """The samples are all there; only the commands know that they were not meant to count."""
    text = write(tmp_path / "a.csv", samples())
    path = _session(tmp_path, text.read_bytes(), StreamSetup())
    with Session.open(path) as session:
        session.write_command(100, "start")
        session.write_command(200, "undo")
        session.write_command(300, "repeat")
    (note,) = corrections_note(path)
    assert "taken back or repeated 2 times" in note
    assert corrections_note(text) == ()


def test_a_session_in_which_nothing_came_says_so(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    Session.create(path, {}).close()
    with pytest.raises(RecordingError, match="nothing was received"):
        read_files([path])


def test_a_damaged_session_is_named(tmp_path: Path) -> None:
    path = _session(tmp_path, b"x" * 100_000, StreamSetup())
    data = path.read_bytes()
    path.write_bytes(data[:5000] + b"\xff" * (len(data) - 5000))
    with pytest.raises(SessionError, match="is damaged"):
        read_files([path])
