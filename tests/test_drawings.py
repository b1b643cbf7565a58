"""The drawings in ``assets/``: what the program says now is what is printed there."""

import re
from pathlib import Path

import numpy as np
import pytest

from assets.drawing.figures import pose_attitude, readings, view_of
from assets.drawing.poses import FOLDER, drawings
from assets.drawing.solid import faces
from imucal_wizard.core.poses import CORNERS, DIRECTIONS, EDGES, EIGHT_TILTS, FACES, NAMED
from imucal_wizard.guide.wording import label


@pytest.mark.parametrize("pose", [*DIRECTIONS, *EIGHT_TILTS])
def test_a_pose_is_drawn_with_what_is_named_on_top_and_in_sight(pose: str) -> None:
    """The attitude is a rotation with the pose's direction up, and its faces look at the eye."""
    attitude = np.array(pose_attitude(pose))
    assert attitude @ NAMED[pose] == pytest.approx([0.0, 0.0, 1.0])
    assert attitude @ attitude.T == pytest.approx(np.eye(3))
    assert np.linalg.det(attitude) == pytest.approx(1.0)
    seen = {face.name for face in faces(pose_attitude(pose), view_of(pose, 1.0))}
    faces_on_top = pose.replace("~", "")
    assert {faces_on_top[i : i + 2] for i in range(0, len(faces_on_top), 2)} <= seen
    assert len(seen) == 3


def test_the_readings_below_a_pose_are_its_direction_in_g() -> None:
    """Specific force points up: the face on top reads plus one."""
    assert readings("+x") == "+1 0 0"
    assert readings("+x-y") == "+0.71 −0.71 0"
    assert readings("-x+y-z") == "−0.58 +0.58 −0.58"


def test_the_sheet_holds_every_pose_and_the_rotations() -> None:
    """Twenty-six names, each once, and the pose in which each rotation begins."""
    sheet = drawings()["sheet.svg"]
    for name in (*FACES, *EDGES, *CORNERS):
        assert len(re.findall(f">{re.escape(label(name))}</text>", sheet)) == 1, name
    assert "about z: begin with +X up" in sheet


@pytest.mark.parametrize("name", drawings())
def test_the_drawings_in_the_repository_are_the_ones_that_the_script_draws(name: str) -> None:
    """``python -m assets.drawing.poses`` writes them anew after a change."""
    assert (FOLDER / name).read_text(encoding="utf-8") == drawings()[name]


@pytest.mark.parametrize(
    "place", sorted(FOLDER.parent.glob("*/*.svg")), ids=lambda place: place.name
)
def test_no_picture_loads_anything_from_elsewhere(place: Path) -> None:
    """It looks alike without a network, and tells nobody who looks at it."""
    text = place.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
    assert "://" not in text
    assert "@import" not in text
    assert "href" not in text
