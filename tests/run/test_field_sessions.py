"""The magnetometer's step in a session: killed in the middle, taken up again, replayed, fitted."""

import functools
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.recording import FitOptions, fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import Procedure, standard
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.player import Player, ReadingsTape
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.review import fit_stream, review_session
from imucal_wizard.run.session_replay import begin_session, resume_session
from imucal_wizard.simulate.recording import simulate_recording
from tests.run.performance import pieces, same
from tests.waiting import wait_for

SIZE = 3000
CUT = 0.8
"""By then some circles have been turned and some have not."""


@functools.cache
def printed() -> bytes:
    """A rest, six faces, a turn about each axis, six circles; at 80 Hz the field in between."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "performed.csv"
        simulate_recording(path, rate=25.0, poses="6", rotations=1, hold=3.0, magnetometer=True)
        return path.read_bytes()


def settings() -> ProcedureSettings:
    """Settle, up/down, a rotation per axis, the field."""
    whole = standard(1, settle_seconds=5.0)
    steps = tuple(step for step in whole.steps if step.kind is not StepKind.POSES)
    return ProcedureSettings(Procedure(steps))


def feed(engine: Engine, first: int, past: int) -> None:
    """Some of the pieces."""
    for arrival, data in pieces(printed(), SIZE)[first:past]:
        engine.receive(data, arrival)


def cut() -> int:
    """Number of the piece at which it is cut off."""
    return round(CUT * len(pieces(printed(), SIZE)))


def alike(one: Collected, other: Collected) -> bool:
    """To the last bit, the magnetometer included."""
    assert one.magnetometer is not None
    assert other.magnetometer is not None
    return (
        same(one, other)
        and one.field_spans == other.field_spans
        and np.array_equal(one.magnetometer.time, other.magnetometer.time)
        and np.array_equal(one.magnetometer.values, other.magnetometer.values)
    )


def fitted(engine: Engine) -> FitReport:
    """The fit of what an engine has collected."""
    return fit_stream(engine.collected(), engine.snapshot().stream, FitOptions())


def parameters(report: FitReport) -> dict[str, tuple[float, float]]:
    """The magnetometer's parameters with their standard errors."""
    return {
        one.name: (one.value, one.standard_error or 0.0)
        for one in report.sensors["magnetometer"].parameters
    }


@functools.cache
def performed() -> tuple[Engine, bytes]:
    """All of it, at once; the engine, and the session's file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.imucal"
        live = begin_session(path, None, settings())
        live.command("start")
        feed(live, 0, len(pieces(printed(), SIZE)))
        live.journal.close()
        return live, path.read_bytes()


KILLED = """
import os, signal, sys, time
from pathlib import Path
from imucal_wizard.run.journal import COMMIT_SECONDS
from imucal_wizard.run.session_replay import begin_session
from tests.run.test_field_sessions import feed, settings
engine = begin_session(Path(sys.argv[1]), None, settings())
engine.command("start")
cut = int(sys.argv[2])
feed(engine, 0, cut - 10)
time.sleep(2.0 * COMMIT_SECONDS)  # as slow as a device: what came before is on the disk by now
feed(engine, cut - 10, cut)
print(engine.status().step, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.study
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no SIGKILL on this system")
def test_killed_in_the_middle_of_a_circle_it_goes_on_there(tmp_path: Path) -> None:
    """At most what came in the last half second is lost; the end is the same as without it."""
    path = tmp_path / "a.imucal"
    script = tmp_path / "killed.py"
    script.write_text(KILLED)
    ended = subprocess.run(
        [sys.executable, str(script), str(path), str(cut())],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    assert ended.stdout.strip() == "field"
    resumed = resume_session(path)
    engine = resumed.engine
    resumed.prepare(engine)
    status = engine.status()
    assert status.step is StepKind.FIELD
    assert status.field is not None
    assert 1 <= len(status.field.done) < 6
    kept = resumed.replay.session.last_raw
    assert cut() - 10 <= kept <= cut()
    feed(engine, kept, len(pieces(printed(), SIZE)))
    engine.journal.close()
    live, _ = performed()
    assert engine.status().step is live.status().step is StepKind.RESULT
    assert alike(engine.collected(), live.collected())


@pytest.mark.study
def test_a_session_is_fitted_with_its_magnetometer(tmp_path: Path) -> None:
    """``fit SESSION`` gives what the result's screen shows, to the last bit."""
    live, data = performed()
    path = tmp_path / "a.imucal"
    path.write_bytes(data)
    kept = review_session(path, RecordingOptions())
    assert alike(kept.collected, live.collected())
    report = fit_stream(kept.collected, kept.stream, FitOptions())
    expected = fitted(live).sensors["magnetometer"]
    found: FloatArray = report.sensors["magnetometer"].matrix
    np.testing.assert_array_equal(found, expected.matrix)
    assert report.sensors["magnetometer"].frame == "accelerometer"


def test_a_step_begun_again_counts_only_from_there(tmp_path: Path) -> None:
    """What was turned before ``repeat`` is in no fit."""
    engine = begin_session(tmp_path / "a.imucal", None, settings())
    engine.command("start")
    feed(engine, 0, cut())
    before = engine.collected()
    engine.command("repeat")
    feed(engine, cut(), cut() + 20)
    engine.journal.close()
    again = review_session(tmp_path / "a.imucal", RecordingOptions()).collected
    assert alike(again, engine.collected())
    assert again.field_spans
    assert again.field_spans[0][0] >= before.field_spans[-1][1]


@pytest.mark.study
def test_a_recording_replayed_ends_with_the_magnetometer_of_its_fit(tmp_path: Path) -> None:
    """Through the step to the result by itself; hard and soft iron within the standard errors."""
    path = tmp_path / "performed.csv"
    path.write_bytes(printed())
    readings = read_files([path])
    player = Player(ReadingsTape(readings), Engine(settings=settings()), float("inf"))
    player.start()
    player.command("start")
    wait_for(lambda: player.snapshot().finished)
    snapshot = player.snapshot()
    assert snapshot.status.step is StepKind.RESULT
    assert snapshot.status.skipped == ()
    report = fit_stream(player.collected(), snapshot.stream, FitOptions())
    player.stop()
    live, offline = parameters(report), parameters(fit_readings(readings))
    assert set(live) == set(offline)
    for name, (value, error) in live.items():
        assert abs(value - offline[name][0]) < 3.0 * error, name
