"""The recheck as the virtual hand does it: poses by power, then a verdict."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from imucal_wizard.api import Recording, calibrate, read
from imucal_wizard.estimate.hold_search import find_holds
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import RECHECK_STEPS, Procedure
from imucal_wizard.guide.steps.recheck import Planner
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.measurement.segmentation import rotations_between
from imucal_wizard.report.calibrated_device import (
    CalibratedDevice,
    RecheckSettings,
    recheck_collected,
)
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.reader import Reader
from imucal_wizard.run.session_replay import begin_session, resume_session
from imucal_wizard.sessions.stored_readings import session_readings
from imucal_wizard.simulate.imu import VirtualImu
from imucal_wizard.simulate.recording import simulate_recording
from tests.waiting import wait_for

SEED = 4


@pytest.fixture(scope="module")
def device(tmp_path_factory: pytest.TempPathFactory) -> CalibratedDevice:
    """A virtual device that is calibrated."""
    path = tmp_path_factory.mktemp("calibrated") / "recording.csv"
    simulate_recording(path, seed=SEED)
    calibration = calibrate(read(path)).calibration
    return CalibratedDevice(calibration, RecheckSettings(datetime.now(UTC)))


def performed(planner: Planner, session: Path) -> Reader:
    """The whole recheck by the virtual hand, up to the verdict."""
    imu = VirtualImu(speed=float("inf"), seed=SEED, following=True)
    settings = ProcedureSettings(Procedure(RECHECK_STEPS))
    reader = Reader(imu, begin_session(session, None, settings, planner=planner))
    reader.start()
    try:
        wait_for(lambda: reader.snapshot().stream.samples > 0)
        reader.command("start")
        wait_for(lambda: reader.snapshot().status.step is StepKind.VERDICT)
    finally:
        reader.stop()
    return reader


def test_a_hand_that_follows_is_done_within_a_minute_and_every_axis_is_seen(
    device: CalibratedDevice, tmp_path: Path
) -> None:
    """And the command finds in the session what the screen has shown."""
    path = tmp_path / "a.imucal"
    reader = performed(device.next_pose, path)
    snapshot, kept = reader.snapshot(), reader.collected()
    seconds = snapshot.status.elapsed
    assert seconds < 60.0
    readings = session_readings(path, kept.holds)
    found = recheck_collected(device, kept, snapshot.stream, seconds, readings)
    assert found.verdict == "go"
    powers = [one.power for sensor in found.sensors.values() for one in sensor.seen]
    assert len(powers) == 12
    assert min(powers) > 0.99
    again = Recording([path], planner=device.next_pose).rechecked(device)
    assert again == found


def test_a_recheck_that_is_resumed_asks_for_what_its_calibration_needs(
    device: CalibratedDevice, tmp_path: Path
) -> None:
    simulate_recording(tmp_path / "today.csv", seed=SEED, poses="6", hold=2.5, rotations=0)
    settings, path = ProcedureSettings(Procedure(RECHECK_STEPS)), tmp_path / "a.imucal"
    live = begin_session(path, None, settings, planner=device.next_pose)
    live.command("start")
    for number, line in enumerate((tmp_path / "today.csv").read_bytes().splitlines(keepends=True)):
        if number < 1800:
            live.receive(line, 0.01 * number)
    live.journal.close()
    resumed = resume_session(path, lambda _about: device.next_pose)
    resumed.prepare(resumed.engine)
    resumed.engine.journal.close()
    status = resumed.engine.status()
    assert status == live.status()
    assert status.holds > 0
    assert status.progress[1] == 12.0


def test_a_recheck_of_exchanged_axes_ends_once_the_exchange_explains_all(
    device: CalibratedDevice, tmp_path: Path
) -> None:
    """With the axes as they are read, no pose shows anything of the gyroscope."""
    path = tmp_path / "today.csv"
    simulate_recording(path, seed=SEED, rate=50.0, poses="8", hold=2.5, rotations=0)
    text = path.read_text().replace("ax[", "other[").replace("ay[", "ax[").replace("other[", "ay[")
    path.write_text(text)
    readings = read(path).readings
    assert readings.gyroscope is not None
    holds, _, _ = find_holds(readings, 9.80665)
    rotations = rotations_between(holds, readings.gyroscope, readings.accelerometer)
    units = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}
    proposal = device.next_pose(Collected(tuple(holds), tuple(rotations)), units)
    assert proposal.pose is None
    assert proposal.seen == proposal.wanted == 12
