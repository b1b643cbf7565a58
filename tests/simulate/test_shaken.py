"""A machine idles near the device: the wizard copes with it, and vibration rectification shows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.api import calibrate, diagnose, read
from imucal_wizard.core.readings import FloatArray, Readings, Series, join_readings
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import Procedure, standard
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.hidden import needs_shaking, parse_hidden
from imucal_wizard.simulate.recording import simulate_recording
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.scripts import FACE_NAMES, SHAKE_RMS
from tests.guide.device import holds_of
from tests.simulate.sensors import ideal

RECTIFICATION = 500.0
"""mg/g², five times that of consumer parts: what the mean of a hold keeps of a vibration, up to
0.3 mg, is then a tenth of the rectification."""
NOISE = 1.5e-3
"""White noise of the accelerometer, m/s²/√Hz."""
LONGEST = 900.0


def _held() -> tuple[StateMachine, Readings]:
    """Settle and six poses on a sensor with noise and no other error; two poses are shaken."""
    perfect = ideal()
    sensor = replace(perfect, accelerometer=replace(perfect.accelerometer, density=NOISE))
    hand = VirtualHand(seed=3, shaken=True)
    hidden = [f"vibration-rectification:{RECTIFICATION}:{axis}" for axis in "xyz"]
    stream = VirtualStream(hand, sensor, hidden, seed=3)
    kinds = (StepKind.SOURCE, StepKind.SETTLE, StepKind.POSES, StepKind.RESULT)
    steps = tuple(
        replace(standard().step(kind), poses=FACE_NAMES if kind is StepKind.POSES else ())
        for kind in kinds
    )
    machine = StateMachine(Procedure(steps), rate=100.0, listener=hand.follow)
    machine.command("start")
    parts = []
    while hand.time < LONGEST and machine.status().step is not StepKind.RESULT:
        samples = stream.take(50)
        t = samples.time
        force = Series(t, samples.accelerometer, "m/s^2")
        parts.append(Readings(force, Series(t, samples.gyroscope, "rad/s")))
        machine.feed(parts[-1])
    return machine, join_readings(parts)


def _vibration(hold: Hold, readings: Readings) -> FloatArray:
    return np.asarray(readings.accelerometer.between(hold.start, hold.end).values.var(axis=0))


def test_every_third_pose_is_taken_from_a_shaking_support_and_errs_by_its_mean_square() -> None:
    """The wizard loosens its limits for it, and takes them back for the next calm pose."""
    machine, readings = _held()
    assert machine.status().step is StepKind.RESULT
    poses = holds_of(machine, StepKind.POSES)
    square = np.array([_vibration(hold, readings).sum() for hold in poses])
    shaken = square > 0.1 * SHAKE_RMS**2
    assert len(poses) == 6
    assert shaken.sum() == 2
    np.testing.assert_allclose(np.sqrt(square[shaken] / 3.0), SHAKE_RMS, rtol=0.25)
    mean = np.array([hold.accelerometer for hold in poses])
    size = np.linalg.norm(mean, axis=1)
    error = (size - STANDARD_GRAVITY) / STANDARD_GRAVITY * 1000.0
    expected = RECTIFICATION * square / STANDARD_GRAVITY**2 * mean.sum(axis=1) / size
    slope = (error @ expected) / (expected @ expected)
    assert slope == pytest.approx(1.0, abs=0.15)
    assert np.abs(expected).max() > 2.5


@pytest.mark.parametrize(
    ("hidden", "shaken"), [((), False), (("vibration-rectification:1:x",), True)]
)
def test_the_support_shakes_only_where_that_is_to_be_seen(
    hidden: tuple[str, ...], shaken: bool
) -> None:
    assert needs_shaking([parse_hidden(one) for one in hidden]) is shaken


def test_a_recording_keeps_its_shaken_holds_although_vibration_spoils_them(tmp_path: Path) -> None:
    """The calibration from the quiet holds alone is better, but only the others show the effect."""
    path = tmp_path / "shaken.csv"
    simulate_recording(path, hidden=[f"vibration-rectification:{RECTIFICATION}:y"], seed=4)
    found = calibrate(read(path))
    square = [_vibration(hold, found.recording.readings).sum() for hold in found.report.holds]
    assert np.count_nonzero(np.array(square) > 0.1 * SHAKE_RMS**2) == 6
    assert diagnose(found)["accelerometer"].explanations == (("vibration-rectification",),)
