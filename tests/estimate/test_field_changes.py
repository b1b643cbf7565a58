"""A field that turns about the vertical, told from a gyroscope that reads a rotation wrongly."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.second_stage.field_changes import (
    FieldChange,
    changes_text,
    field_angles,
    where_field_turned,
)
from tests.estimate.closures import closures, headings, turned
from tests.estimate.field_truth import all_over

COUNT = 12
TIME = np.arange(0.0, 1.2, 0.01)
UP = np.tile([0.0, 0.0, 1.0], (COUNT, 1))
FIELD = np.tile([0.0, 0.4, -0.9165], (COUNT, 1))


def _found(
    rates: FloatArray, field_turn: float = 0.0, gain: float = 1.0
) -> tuple[list[int], FloatArray]:
    """Rotations said to have seen the field turn, and by how much it turned in each, rad.

    Args:
        rates: steady rate of each rotation in the body frame, rad/s, shape (12, 3).
        field_turn: by how much the field turns about the vertical in rotation 5, rad.
        gain: of the gyroscope in this rotation.
    """
    ends = Attitude.from_rotvec(rates * TIME[-1])
    turn = np.zeros((COUNT, 3))
    turn[5, 2] = field_turn
    read = rates * np.where(np.arange(COUNT) == 5, gain, 1.0)[:, None]
    samples = [TIME] * COUNT, [np.tile(rate, (len(TIME), 1)) for rate in read]
    noise = np.full(COUNT, np.radians(0.02) ** 2)
    after = ends.inv().apply(Attitude.from_rotvec(turn).apply(FIELD))
    by_gravity, by_field = (
        replace(closures(*samples, before, end), noise=noise)
        for before, end in ((UP, ends.inv().apply(UP)), (FIELD, after))
    )
    source = replace(headings(by_gravity, by_field), noise=noise)
    rows = turned(source, np.eye(3), np.zeros(3))
    found, _ = where_field_turned(source, rows)
    return np.flatnonzero(found).tolist(), field_angles(source, rows)


def test_a_field_that_turns_is_told_with_its_angle() -> None:
    """Up to half a turn, where the closure of a rotation is no measure of it."""
    rates = 2.0 * all_over(np.random.default_rng(0), COUNT)
    for degrees in (0.5, 30.0, -150.0):
        found, angle = _found(rates, np.radians(degrees))
        assert found == [5]
        assert np.degrees(angle[5]) == pytest.approx(degrees, abs=0.01)
    assert _found(rates)[0] == []


@pytest.mark.parametrize("axis", [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
def test_a_gyroscope_that_reads_a_rotation_wrongly_is_no_change_of_the_field(
    axis: list[float],
) -> None:
    """About a leaning axis gravity shows it; about the vertical nothing tells which it is."""
    rates = 2.0 * all_over(np.random.default_rng(0), COUNT)
    rates[5] = 2.0 * np.array(axis)
    assert _found(rates, gain=0.9)[0] == []


def test_a_field_that_turns_for_one_hold_is_said_of_that_hold() -> None:
    """Two rotations that it spoils alike; a turn back later is one of its own."""
    size, error = np.radians(3.0), np.radians(0.1)
    there, back = FieldChange(3, 4, size, error), FieldChange(4, 5, -size, error)
    assert "vertical in hold 5 by 3.0°:" in changes_text([there, back], sensor_fits=True)
    later = replace(back, before=7, after=8)
    said = changes_text([there, later], sensor_fits=False)
    assert "between holds 4 and 5 by 3.0° and between holds 8 and 9 by 3.0°:" in said
    assert "or the magnetometer itself" in said
