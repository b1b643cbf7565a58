"""The compass that a fit makes, held against attitudes that the fit has not seen."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.fitting import fit_readings
from imucal_wizard.fitting.compass import compass_of
from imucal_wizard.solver.second_stage.heading import turned
from tests.solver.field_truth import CORRECTION, OFFSET
from tests.solver.truth import typical_accelerometer
from tests.solver.whole_session import GRAVITY, Session

SESSION = Session(rate=100.0)


def test_the_heading_of_any_attitude_is_as_good_as_it_says() -> None:
    """200 new attitudes without noise: errors within 4 of their standard deviations."""
    compass = compass_of(fit_readings(SESSION.readings(1)))
    assert compass is not None
    body = Attitude.random(200, random_state=7)
    force = typical_accelerometer().readings(body.inv().apply([0.0, 0.0, GRAVITY]))
    dip = np.radians(SESSION.dip)
    world = SESSION.magnitude * np.array([0.0, np.cos(dip), -np.sin(dip)])
    seen = Attitude.from_rotvec(SESSION.misalignment).inv().apply(body.inv().apply(world))
    readings = seen @ np.linalg.inv(CORRECTION).T + 0.1 * OFFSET
    forward = body.apply([1.0, 0.0, 0.0])
    true = np.arctan2(forward[:, 0], forward[:, 1])  # clockwise from north, which is y
    found = compass.bearings(force, readings)
    level = np.isfinite(found.after)
    assert level.sum() > 150
    off = turned(found.after[level], true[level])
    assert np.abs(off / found.error[level]).max() < 4.0
    assert np.degrees(found.error[level]).max() < 1.5
    before = turned(found.before[level], true[level])
    assert np.sqrt(np.mean(off**2)) < 0.05 * np.sqrt(np.mean(before**2))


def test_without_a_magnetometer_there_is_no_compass() -> None:
    readings = replace(SESSION.readings(1), magnetometer=None)
    assert compass_of(fit_readings(readings)) is None
