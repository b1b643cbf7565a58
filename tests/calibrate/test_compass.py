"""The compass that a fit makes, held against attitudes that the fit has not seen."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.magnitude import up_moved
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.estimate.second_stage.alignment import align
from imucal_wizard.estimate.second_stage.error_modes import ErrorModes, field_moved
from imucal_wizard.estimate.second_stage.heading import Compass, compass_of, heading, turned
from tests.calibrate.collecting import SESSION, offline
from tests.estimate.field_truth import CORRECTION, OFFSET
from tests.estimate.truth import typical_accelerometer
from tests.estimate.whole_session import GRAVITY


@cache
def calibrated() -> Compass:
    """The compass of this session."""
    compass = compass_of(offline(1))
    assert compass is not None
    return compass


def test_the_heading_error_of_any_attitude_is_as_stated() -> None:
    """200 new attitudes without noise: errors within 4 of their standard deviations."""
    compass = calibrated()
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


def test_an_error_mode_turns_heading_and_alignment_together() -> None:
    """Each doubt in turn taken for true, the still poses aligned anew, the heading read again."""
    compass = calibrated()
    poses, body = Attitude.random(20, random_state=1), Attitude.random(40, random_state=2)
    rotation, dip = compass.alignment.rotation, np.radians(60.0)
    world = np.array([0.0, np.cos(dip), -np.sin(dip)])

    def vectors(attitudes: Attitude) -> tuple[FloatArray, FloatArray]:
        """Up, and the field in the magnetometer's own axes."""
        up = attitudes.inv().apply([0.0, 0.0, 1.0])
        return up, 40.0 * attitudes.inv().apply(world) @ rotation

    def headings(iron: FloatArray, bent: FloatArray) -> FloatArray:
        """By calibrations that are wrong by these, and by the alignment that follows."""
        turned_so = [
            (up_moved(up, bent), field_moved(compass.magnetometer, field, iron))
            for up, field in (vectors(poses), vectors(body))
        ]
        up, field = (unit_vectors(part) for part in turned_so[0])
        found = align(up, field).rotation
        return heading(turned_so[1][0], turned_so[1][1] @ found.T)

    # an accelerometer so poor that its part is the larger one
    doubts = ErrorModes(compass.modes.magnetometer, 20.0 * compass.modes.accelerometer)
    up, field = vectors(poses)
    alignment = align(
        up, unit_vectors(field), doubts.of_field(compass.magnetometer, field), doubts.of_up(up)
    )
    nothing, square = np.zeros(9), np.zeros(len(body))
    for doubt in doubts.magnetometer.T:
        square += turned(headings(doubt, nothing), headings(nothing, nothing)) ** 2
    for doubt in doubts.accelerometer.T:
        square += turned(headings(nothing, doubt), headings(nothing, nothing)) ** 2
    up, field = vectors(body)
    force = GRAVITY * up @ np.linalg.inv(compass.accelerometer.matrix).T
    force += compass.accelerometer.bias
    readings = field @ np.linalg.inv(compass.magnetometer.matrix).T + compass.magnetometer.bias
    error = replace(compass, alignment=alignment, modes=doubts).bearings(force, readings).error
    level = np.isfinite(error)
    assert level.sum() > 30
    assert error[level] == pytest.approx(np.sqrt(square[level]), rel=0.1, abs=2e-5)


def test_the_errors_of_the_dip_alone_turn_headings_too() -> None:
    """Without any doubt about the calibrations a poorly known angle is left."""
    compass = calibrated()
    none = ErrorModes(np.zeros((9, 0)), np.zeros((9, 0)))
    about_up = np.diag([0.0, 0.0, np.radians(2.0) ** 2])
    alignment = replace(compass.alignment, own=about_up, shifts=np.zeros((3, 0)))
    flat = compass.accelerometer.bias + np.linalg.inv(compass.accelerometer.matrix) @ [
        0,
        0,
        GRAVITY,
    ]
    north = compass.alignment.rotation.T @ np.array([20.0, 0.0, -35.0])
    readings = compass.magnetometer.bias + np.linalg.inv(compass.magnetometer.matrix) @ north
    found = replace(compass, alignment=alignment, modes=none).bearings(flat[None], readings[None])
    assert np.degrees(found.after[0]) == pytest.approx(0.0, abs=1e-6)
    assert np.degrees(found.error[0]) == pytest.approx(2.0, rel=1e-3)
