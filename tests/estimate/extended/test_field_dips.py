"""The still poses of a magnetometer that lies at an angle, or whose clock is another one."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.quaternions import rotation_matrix, rotation_vector
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.magnetometer.dips import ALONG_AXES
from imucal_wizard.estimate.magnetometer.experiment import MagnetometerExperiment
from imucal_wizard.estimate.magnetometer.field_data import FieldData
from imucal_wizard.estimate.recording import fit_readings
from tests.estimate.whole_session import Session


def _measured(misalignment: FloatArray, clock: float) -> FieldData:
    session = replace(Session(rate=100.0), misalignment=misalignment, clock=clock)
    readings = session.readings(0)
    report = fit_readings(readings)
    assert report.second_stage is not None
    assert report.magnetic is not None
    up = report.sensors["accelerometer"].reference
    return report.magnetic.experiment(readings, report.holds, up, report.second_stage).data


def test_all_is_told_by_the_accelerometers_clock() -> None:
    """At 0.45 s apart: the same poses, the same readings, and each sample when it was taken."""
    small = np.array([0.02, -0.03, 0.05])
    same, late = _measured(small, 0.0), _measured(small, 0.45)
    assert late.dips.hold.tolist() == same.dips.hold.tolist()
    assert late.dips.reading == pytest.approx(same.dips.reading, abs=0.1)
    assert late.samples.time == pytest.approx(same.samples.time, abs=0.01)


def test_a_sensor_at_an_angle_errs_by_no_more_than_noise() -> None:
    """49° from the nearest axes: no sum of small rotations, and nothing that is missing."""
    data = _measured(np.array([0.9, -0.6, 0.4]), 0.0)
    found = fit(MagnetometerExperiment(data))
    dips = np.asarray(found.residuals)[len(data) :]
    assert np.sqrt(np.mean(dips**2)) < 0.15


def test_a_small_misalignment_is_left_to_be_found() -> None:
    """The poses are told by the nearest axes as long as the angle is small."""
    data = _measured(np.array([0.02, -0.03, 0.05]), 0.0)
    assert (data.dips.turn == np.eye(3)).all()
    large = 1.2 * ALONG_AXES * np.array([0.0, 1.0, 0.0])
    turn = _measured(large, 0.0).dips.turn
    assert np.linalg.norm(rotation_vector(turn @ rotation_matrix(large).T)) < np.radians(0.5)
