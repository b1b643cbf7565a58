"""The readings behind a fit, read from a session that is still being written."""

from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.readings import Readings
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.sessions import Session, stored_readings
from tests.waiting import PATIENCE

HEADER = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]\n"


def _lines(first: int, last: int) -> bytes:
    return "".join(f"{k / 100:.2f},0.0,0.0,9.8\n" for k in range(first, last)).encode()


def _hold(start: float) -> Hold:
    up = np.array([0.0, 0.0, 9.8])
    return Hold(start, start + 2.0, up, np.eye(3) * 1e-8, None, None, 200)


def test_the_last_samples_are_waited_for_where_they_are_not_written_yet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who writes the session does so in batches; the bench may be opened between two of them."""
    path, looked = tmp_path / "a.imucal", Event()
    with Session.create(path, {}) as session:
        session.write_pieces([(0.0, HEADER.encode() + _lines(0, 500))])
        session.commit()

    def read_once(paths: list[Path]) -> Readings:
        readings = read_files(paths)
        looked.set()
        return readings

    def write_the_rest() -> None:
        assert looked.wait(PATIENCE)
        with Session.open(path) as session:
            session.write_pieces([(10.0, _lines(500, 1000))])

    monkeypatch.setattr(stored_readings, "read_files", read_once)
    writer = Thread(target=write_the_rest)
    writer.start()
    readings = stored_readings.session_readings(path, [_hold(1.0), _hold(7.0)])
    writer.join()
    assert readings is not None
    assert len(readings) == 1000


def test_readings_of_other_holds_are_ignored(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    with Session.create(path, {}) as session:
        session.write_pieces([(0.0, HEADER.encode() + _lines(0, 500))])
    other = Hold(1.0, 3.0, np.array([0.0, 9.8, 0.0]), np.eye(3) * 1e-8, None, None, 200)
    assert stored_readings.session_readings(path, [other]) is None
