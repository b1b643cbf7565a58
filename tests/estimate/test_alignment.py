"""How a magnetometer lies in the accelerometer's frame, whatever way it was soldered on."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.second_stage.alignment import align
from tests.estimate.field_truth import FACES


def _seen(body: Attitude, dip: float, mounted: Attitude) -> tuple[FloatArray, FloatArray]:
    """Up in the body's axes, and the unit field in those of a sensor mounted so, no noise."""
    world = [0.0, np.cos(np.radians(dip)), -np.sin(np.radians(dip))]
    return body.inv().apply([0.0, 0.0, 1.0]), mounted.inv().apply(body.inv().apply(world))


def _noisy(field: FloatArray, size: float, rng: np.random.Generator) -> FloatArray:
    field = field + size * rng.standard_normal(field.shape)
    return np.asarray(field / np.linalg.norm(field, axis=1)[:, None])


@pytest.mark.parametrize("dip", [-3.0, 30.0, 75.0])
def test_any_rotation_between_the_sensors_is_found(dip: float) -> None:
    """Fifteen sensors at any angle, in 13 positions each: the nearest axes are often no start."""
    rng = np.random.default_rng(0)
    for seed in range(15):
        mounted = Attitude.random(random_state=seed)
        up, field = _seen(Attitude.random(13, random_state=1000 + seed), dip, mounted)
        found = align(up, _noisy(field, 2e-3, rng))
        off = (Attitude.from_matrix(found.rotation) * mounted.inv()).magnitude()
        assert np.degrees(off) < 3.0
        assert np.degrees(found.dip) == pytest.approx(dip, abs=1.0)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ([[1, 0, 0], [0, 1, 0], [0, 0, 1]], ""),
        ([[0, 1, 0], [1, 0, 0], [0, 0, -1]], "x and y are swapped, z points the other way"),
        ([[1, 0, 0], [0, -1, 0], [0, 0, -1]], "y points the other way, z points the other way"),
        (
            [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
            "x lies along the accelerometer's +y, y lies along the accelerometer's −x",
        ),
    ],
)
def test_swapped_and_turned_axes_are_said_in_words(columns: list[list[int]], words: str) -> None:
    """A column is an axis of the magnetometer in the accelerometer's frame; it is 5° off there."""
    mounted = Attitude.from_rotvec([0.05, -0.05, 0.05]) * Attitude.from_matrix(columns)
    up, field = _seen(Attitude.random(20, random_state=4), 60.0, mounted)
    assert align(up, _noisy(field, 2e-3, np.random.default_rng(1))).axes == words


def test_one_position_beside_iron_decides_no_rotation() -> None:
    """A dip 20° off moves neither the choice among the rotations nor the angles."""
    for seed in range(10):
        mounted, body = Attitude.random(random_state=seed), Attitude.random(14, random_state=seed)
        up, field = _seen(body, 20.0, mounted)
        field[3] = _seen(body, 40.0, mounted)[1][3]
        found = align(up, _noisy(field, 1e-3, np.random.default_rng(seed)))
        off = (Attitude.from_matrix(found.rotation) * mounted.inv()).magnitude()
        assert np.degrees(off) < 1.0
        assert np.flatnonzero(~found.used).tolist() == [3]


def test_positions_that_fit_two_rotations_are_refused() -> None:
    """Six faces, poorly measured where the field is flat: no answer in twelve is far off."""
    refused = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        turned = Attitude.from_euler("z", rng.uniform(0.0, 360.0, 6)[:, None], degrees=True)
        body = turned * Attitude.concatenate(FACES)
        mounted = Attitude.random(random_state=seed)
        up, field = _seen(body, 3.0, mounted)
        try:
            found = align(up, _noisy(field, 0.01, rng))
        except DataError as error:
            refused += "two rotations" in str(error)
            continue
        off = (Attitude.from_matrix(found.rotation) * mounted.inv()).magnitude()
        assert np.degrees(off) < 15.0
    assert refused >= 4
