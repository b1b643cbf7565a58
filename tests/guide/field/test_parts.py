"""Angles covered, faces on the table, samples kept, motions advised."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.core.limits.procedure import (
    FACE_STEADY_SECONDS,
    MAX_SAMPLES_PER_AREA,
    SECTOR_DEG,
)
from imucal_wizard.core.poses import DIRECTIONS, FACES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.ellipsoid.coverage import BINS, bin_of, centres, gaps
from imucal_wizard.guide.field.coverage import gains, opposite, sentence
from imucal_wizard.guide.field.gathering import FaceWatch
from imucal_wizard.guide.field.samples import FieldBlock, Growing, Thinned
from imucal_wizard.guide.field.survey import Survey, covered, headings
from tests.estimate.field_truth import all_over

ANGLES = st.lists(st.floats(-2000.0, 2000.0), min_size=2, max_size=30)


@given(ANGLES)
def test_what_is_covered_is_what_was_passed_up_to_a_circle(angles: list[float]) -> None:
    """A path without a jump covers its range, to within a sector at each end."""
    path = np.array(angles)
    span = min(float(np.ptp(path)), 360.0)
    assert span - 2.0 * SECTOR_DEG <= covered(path[:-1], path[1:]) <= span + 2.0 * SECTOR_DEG


@given(ANGLES, st.floats(-720.0, 720.0))
def test_covering_a_direction_twice_adds_nothing(angles: list[float], turn: float) -> None:
    path = np.array(angles)
    once = covered(path[:-1], path[1:])
    there, back = np.append(path, path[::-1]), np.append(path[::-1], path)
    assert covered(there[:-1], there[1:]) == once
    assert covered(back[:-1], back[1:]) == once
    # a whole number of turns on, it is the same part of the circle
    whole = np.round(turn / 360.0) * 360.0
    assert covered(path[:-1] + whole, path[1:] + whole) == pytest.approx(once, abs=2.0 * SECTOR_DEG)


def test_the_angle_from_the_field_is_the_angle_of_the_device() -> None:
    """An arc of a circle off centre, with noise a fiftieth of its radius."""
    rng = np.random.default_rng(0)
    for arc in (60.0, 90.0, 180.0, 360.0):
        turn = np.radians(np.arange(0.0, arc, 2.0))
        flat = np.column_stack([20.0 * np.cos(turn) + 60.0, 20.0 * np.sin(turn) - 30.0])
        field = np.column_stack([flat, np.full(len(turn), -40.0)])
        field += 0.4 * rng.standard_normal(field.shape)
        found = headings(field, np.array([0.0, 0.0, 1.0]), 0.4)
        assert found is not None
        assert np.ptp(found) == pytest.approx(arc, rel=0.15)


def test_noise_alone_makes_no_angle() -> None:
    field = 0.4 * np.random.default_rng(0).standard_normal((200, 3))
    assert headings(field, np.array([0.0, 0.0, 1.0]), 0.4) is None


@pytest.mark.parametrize("face", FACES)
def test_the_face_that_points_down_is_the_one_on_the_table(face: str) -> None:
    watch = FaceWatch()
    watch.follow(-DIRECTIONS[face], 0.1)
    assert (watch.face, watch.steady) == (face, None)
    watch.follow(-DIRECTIONS[face], FACE_STEADY_SECONDS)
    assert watch.steady == face


def test_a_face_stays_while_it_tilts_a_little_and_goes_when_it_tilts_more() -> None:
    """At 30 degrees it is still there, but would not be taken for there by itself."""

    def tilted(degrees: float) -> FaceWatch:
        angle = np.radians(degrees)
        other.follow(np.array([0.0, np.sin(angle), np.cos(angle)]), 1.5)
        return other

    other = FaceWatch()
    assert tilted(30.0).face is None
    assert tilted(10.0).face == "-z"
    assert tilted(30.0).steady == "-z"
    assert tilted(45.0).face is None


def test_thinning_keeps_every_area_and_a_bounded_number_of_each() -> None:
    """A thousand samples in one place and one each everywhere else."""
    seen = np.concatenate([np.tile([[0.0, 0.0, 1.0]], (1000, 1)), centres()])
    kept = Thinned()
    for number, one in enumerate(np.array_split(seen, 50)):
        kept.add(one, number)
    areas = kept.thin(bin_of(kept.values.T))
    counts = np.bincount(areas, minlength=BINS)
    assert (counts >= 1).all()
    assert counts.max() <= MAX_SAMPLES_PER_AREA
    assert len(kept) == counts.sum()
    # they are from the whole time and not only from its beginning or end
    assert np.ptp(kept.block[areas == bin_of(np.array([[0.0], [0.0], [1.0]]))]) > 30


def test_before_anything_is_known_the_number_is_bounded_all_the_same() -> None:
    kept = Thinned()
    for number in range(2000):
        kept.add(np.full((20, 3), float(number)), number)
    assert len(kept) < 5000


def test_rows_handed_out_are_not_changed_by_later_ones() -> None:
    table = Growing(2)
    table.add(np.ones((200, 2)))
    early = table.rows
    for number in range(20):
        table.add(np.full((100, 2), float(number)))
    assert len(table) == 2200
    assert (early == 1.0).all()


@pytest.mark.parametrize("dip", [0.0, 30.0, -66.0, 66.0, 85.0])
@pytest.mark.parametrize("pose", ["-x", "+z", "+x-y", "-x+y+z"])
def test_the_advised_motion_fills_what_it_promises(pose: str, dip: float) -> None:
    """A field turned about the vertical with this side down runs through the promised areas."""
    counts = np.full(BINS, 9)
    down = DIRECTIONS[pose]
    across = np.cross(down, [0.3, -0.8, 0.5])
    across /= np.linalg.norm(across)
    turn = np.linspace(0.0, 2.0 * np.pi, 720)
    level = np.outer(np.cos(turn), across) + np.outer(np.sin(turn), np.cross(down, across))
    angle = np.radians(dip)
    path = np.cos(angle) * level + np.sin(angle) * down
    touched = np.unique(bin_of(path.T))
    counts[touched] = 0
    best = gains(counts, float(np.sin(angle)), DIRECTIONS)
    # a circle that touches the edge of an area may or may not be counted there
    assert best[pose] == pytest.approx(gaps(counts), abs=2.0)
    assert best[pose] == max(best.values())


CLOUDS = st.sampled_from(["grid", "line", "circle", "wild", "rails", "sphere", "one far off"])


def cloud(kind: str, count: int, size: float) -> FloatArray:
    """Readings of the kinds that devices and their cables produce, shape (count, 3)."""
    rng = np.random.default_rng(count)
    turn, ball = 0.1 * np.arange(count), all_over(rng, count)
    flat = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(count)])
    rails = np.full((count, 3), 1.0)
    rails[::7] = -1.0
    far = ball.copy()
    far[0] *= 1e9
    shapes = {
        "grid": rng.integers(0, 2, (count, 3)).astype(float),
        "line": np.outer(rng.standard_normal(count), [1.0, 2.0, 3.0]),
        "circle": flat,
        "wild": rng.standard_cauchy((count, 3)),
        "rails": rails,
        "sphere": ball,
        "one far off": far,
    }
    return size * shapes[kind]


@settings(max_examples=40, deadline=None)
@given(CLOUDS, st.integers(1, 250), st.sampled_from([1e-9, 1.0, 48.0, 32768.0, 1e12]))
def test_whatever_is_read_the_survey_goes_on(kind: str, count: int, size: float) -> None:
    """Nothing is raised, and what it counts adds up."""
    survey, readings = Survey(), cloud(kind, count, size)
    up = np.array([0.0, 0.0, 1.0])
    for number in range(0, count, 10):
        start = 0.01 * number
        values = readings[number : number + 10]
        survey.add(FieldBlock(start, start + 0.1, values, 0, True, np.nan, np.nan, up))
        survey.update([0])
    assert survey.kept + survey.left_out == count
    assert 0.0 <= survey.turned(0) <= 360.0
    assert (survey.here is None) == (survey.fit is None)
    times = [time for span in survey.spans() for time in span]
    assert times == sorted(times)


def test_a_full_sphere_needs_no_motion() -> None:
    """All over, thousands of directions: no circle would fill anything."""
    seen = all_over(np.random.default_rng(0), 5000)
    counts = np.bincount(bin_of(seen.T), minlength=BINS)
    assert set(gains(counts, 0.9, DIRECTIONS).values()) == {0.0}


def test_advice_is_in_plain_words() -> None:
    assert sentence("-x") == "put −X on the table and turn it once round"
    assert sentence("+x-y") == "hold it with the edge between +X and −Y down and turn it once round"
    assert "the corner of −X, +Y and +Z" in sentence("-x+y+z")
    assert opposite("+x-y") == "-x+y"
