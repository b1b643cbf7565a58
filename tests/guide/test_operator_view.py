"""Left, right, towards and away are what the operator sees: every attitude and pose, independently.

The check shares no code with the program: rotations are SciPy's, and the eye's place is read from
where the program draws three known points.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imucal_wizard.core.poses import NAMED
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.guide.instruction import present
from imucal_wizard.guide.kinds import Act, StepKind
from imucal_wizard.guide.operator_view import Matrix, matrix_of, seen, turn_about
from imucal_wizard.guide.state import RotationStatus, Status
from imucal_wizard.tui.drawing import ARROW_HEADS, cube_rows

UP = np.array([0.0, 0.0, 1.0])
RIGHT, HIGHER, NEAR = np.array([seen((1, 0, 0)), seen((0, 1, 0)), seen((0, 0, 1))]).T
"""What the drawing shows to the right, higher and nearer, as world directions."""
SAID = {"right": RIGHT, "left": -RIGHT, "towards": NEAR, "away": -NEAR}


WORD = 32.5
"""Largest angle between a turn and its words as the eye sees both, degrees."""


def said_axis(words: str) -> FloatArray:
    """The level axis about which the top moves in the direction that the words say."""
    named = [SAID[word] for word in re.findall(r"right|left|towards|away", words)]
    across = np.sum([one / np.linalg.norm(one[:2]) for one in named], axis=0)
    across = np.array([across[0], across[1], 0.0])
    across /= np.linalg.norm(across)
    axis = np.cross(UP, across)
    top = Rotation.from_rotvec(0.3 * axis).apply(UP)
    assert top @ across > 0.0
    return np.asarray(axis)


def starts() -> list[FloatArray]:
    """The 24 attitudes of a cube, and 16 random ones."""
    square = Rotation.create_group("O").as_matrix()
    return [*square, *Rotation.random(16, random_state=7).as_matrix()]


def shown(attitude: FloatArray, status: Status) -> Status:
    """What the operator is told of a device in this attitude."""
    rows: Matrix = matrix_of(attitude.tolist())
    up = attitude.T @ UP
    return present(status_with_up(status, up), rows)


def status_with_up(status: Status, up: FloatArray) -> Status:
    """The status of a device with this direction up."""
    aim = status.aim
    off = None if aim is None else float(np.degrees(np.arccos(np.clip(up @ np.array(aim), -1, 1))))
    return replace(status, up=tuple(up.tolist()), off_by=off)


@pytest.mark.parametrize("pose", NAMED)
def test_tipping_it_as_told_brings_the_wanted_pose_up(pose: str) -> None:
    """The words name one of eight directions: 22.5°, and half the angle at which the eye looks."""
    aim = NAMED[pose]
    for attitude in starts():
        asked = Status(step=StepKind.POSES, act=Act.POSE, aim=tuple(aim.tolist()))
        status = shown(attitude, asked)
        away = status.off_by
        assert away is not None
        if away < 5.0:
            continue
        found = re.fullmatch(r"(\d+)° away: tip it (.+)", status.guidance)
        assert found is not None, status.guidance
        assert float(found[1]) == pytest.approx(away, abs=0.51)
        axis = said_axis(found[2])

        def left(share: float, axis: FloatArray = axis, attitude: FloatArray = attitude) -> float:
            turned = Rotation.from_rotvec(np.radians(share) * axis).as_matrix() @ attitude
            return float(np.degrees(np.arccos(np.clip((turned @ aim) @ UP, -1.0, 1.0))))

        assert left(1.0) < away - 0.8
        # two points as far from the top, as many degrees apart in azimuth as two words differ
        apart = np.sin(np.radians(away)) * np.sin(np.radians(WORD / 2.0))
        assert left(away) <= np.degrees(2.0 * np.arcsin(apart)) + 0.1


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("axis", "xyz")
def test_a_rotation_about_a_body_axis_is_told_as_the_operator_sees_it(
    axis: str, sense: float
) -> None:
    """Turned as told, the gyroscope reads the wanted sign about the wanted axis."""
    body = np.eye(3)["xyz".index(axis)]
    for attitude in starts():
        level = attitude @ body
        if abs(level[2]) > 0.4:
            continue
        rotation = RotationStatus(axis, "+z", wanted_angle=sense * 120.0)
        status = shown(attitude, Status(step=StepKind.ROTATIONS, act=Act.ROTATE, rotation=rotation))
        found = re.fullmatch(r"tip it (.+), 120°, medium", status.guidance)
        assert found is not None, status.guidance
        rate = attitude.T @ said_axis(found[1])
        assert sense * rate @ body > 0.75


def test_an_upright_axis_moves_the_top_nowhere() -> None:
    """A rotation about the vertical is neither to the left nor to the right."""
    assert turn_about(matrix_of(np.eye(3).tolist()), (0.0, 0.0, 1.0), 1.0) is None


@pytest.mark.parametrize("yaw", [-10.0, -2.5, 0.0, 2.5, 10.0])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_device_that_lies_nearly_square_is_tipped_straight_and_the_arrow_says_the_same(
    yaw: float, sense: float
) -> None:
    turned = Rotation.from_rotvec(np.radians(yaw) * UP).as_matrix()
    for square in Rotation.create_group("O").as_matrix():
        rows = matrix_of((turned @ square).tolist())
        for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
            turn = turn_about(rows, axis, sense)
            if turn is None:
                continue
            drawn = "".join(cube_rows(rows, 60, 30, "", turn))
            (head,) = set(ARROW_HEADS) & set(drawn)
            assert head == STRAIGHT[turn.words]


@pytest.mark.parametrize("yaw", [-10.0, 0.0, 10.0])
def test_a_corner_of_a_device_that_lies_nearly_square_is_tipped_between_two_sides(
    yaw: float,
) -> None:
    square = matrix_of(Rotation.from_rotvec(np.radians(yaw) * UP).as_matrix().tolist())
    for sense in (1.0, -1.0):
        for side in (1.0, -1.0):
            turn = turn_about(square, (np.sqrt(0.5), side * np.sqrt(0.5), 0.0), sense)
            assert turn is not None
            assert " and " in turn.words


STRAIGHT = {"to the right": "→", "away from you": "↑", "to the left": "←", "towards you": "↓"}


def test_the_arrow_points_where_the_words_say() -> None:
    """The head of the arrow over the cube lies on the side to which the top is tipped."""
    for attitude in starts():
        asked = Status(step=StepKind.POSES, act=Act.POSE, aim=(0.0, 0.6, -0.8))
        status = shown(attitude, asked)
        if status.turn is None or status.turn.angle < 0.05:
            continue
        rows = cube_rows(matrix_of(attitude.tolist()), 60, 30, "", status.turn)
        (head,) = [sign for row in rows for sign in row if sign in ARROW_HEADS]
        angle = np.radians(45.0 * ARROW_HEADS.index(head))
        across = np.cross(status.turn.axis, UP)
        eye = np.array([across @ RIGHT, across @ HIGHER])
        if np.linalg.norm(eye) > 0.1:
            assert np.array([np.cos(angle), np.sin(angle)]) @ eye > 0.0
