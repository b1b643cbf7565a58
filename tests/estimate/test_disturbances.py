"""Disturbed samples, told by how they follow in time."""

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.estimate.magnetometer.field_disturbances import LeftOut, find_disturbances

RATE = 80.0
COUNT = 8000
TIME = np.arange(COUNT) / RATE
MIDDLE = 50.0


def _noise(seed: int) -> FloatArray:
    return np.random.default_rng(seed).standard_normal(COUNT)


def _areas(seconds: float = 0.3) -> IntArray:
    """A device that turns to another direction every so often, a hundred of them in turn."""
    return (TIME / seconds).astype(np.int64) % 100


def _bump(size: float, width: float) -> FloatArray:
    return np.asarray(size * np.exp(-(((TIME - MIDDLE) / width) ** 2)))


def test_noise_alone_leaves_nothing_out() -> None:
    for seed in range(5):
        kept, runs = find_disturbances(_noise(seed), TIME, _areas(), 1.0, 0.0)
        assert kept.all()
        assert runs == ()


def test_a_weak_disturbance_shows_in_the_mean_of_two_seconds() -> None:
    """1.2 standard deviations for 8 s: no sample stands out, and no short block."""
    during = np.abs(TIME - MIDDLE) < 4.0
    kept, (run,) = find_disturbances(_noise(1) + 1.2 * during, TIME, _areas(), 1.0, 0.0)
    assert (~kept)[during].mean() > 0.8
    assert kept[~during].mean() > 0.98
    assert run.start == pytest.approx(MIDDLE - 4.0, abs=2.1)
    assert run.end == pytest.approx(MIDDLE + 4.0, abs=2.1)


def test_a_strong_short_one_is_cut_out_to_the_block() -> None:
    """Half a second of 4 standard deviations costs no more than a second and a half."""
    during = np.abs(TIME - MIDDLE) < 0.25
    kept, (run,) = find_disturbances(_noise(2) + 4.0 * during, TIME, _areas(), 1.0, 0.0)
    assert not kept[during].any()
    assert run.start < MIDDLE < run.end
    assert (~kept).sum() < 4.1 * RATE
    assert run.samples == (~kept).sum()
    assert 4.0 < run.size < 9.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_both_flanks_of_a_disturbance_are_left_out(sign: float) -> None:
    """Blocks that are off by half as much count as disturbed beside one that is."""
    kept, (run,) = find_disturbances(
        0.1 * _noise(3) + sign * _bump(10.0, 2.0), TIME, _areas(), 0.1, 0.0
    )
    assert not kept[np.abs(_bump(10.0, 2.0)) > 0.2].any()
    assert run.start + run.end == pytest.approx(2.0 * MIDDLE, abs=2.1)
    assert run.end - run.start < 12.0


def test_single_wild_samples_are_one_entry_with_first_and_last_time() -> None:
    rows = np.array([400, 3000, 7500])
    distance = _noise(4)
    distance[rows] = [12.0, -15.0, 9.0]
    kept, (run,) = find_disturbances(distance, TIME, _areas(), 1.0, 0.0)
    assert np.flatnonzero(~kept).tolist() == rows.tolist()
    assert run == LeftOut(float(TIME[400]), float(TIME[7500]), 3, 15.0, single=True)


def test_a_noisier_pose_is_no_disturbance_but_its_mean_may_be_one() -> None:
    """Five times the noise for three seconds; with a mean that is off by three of its sigmas."""
    during = np.abs(TIME - MIDDLE) < 1.5
    noise = np.where(during, 5.0, 1.0) * _noise(8)
    kept, runs = find_disturbances(noise, TIME, _areas(), 1.0, 0.0)
    assert kept.all()
    assert runs == ()
    kept, (run,) = find_disturbances(noise + 15.0 * during, TIME, _areas(), 1.0, 0.0)
    assert (~kept)[during].mean() > 0.9
    assert run.start < MIDDLE < run.end


def test_what_the_model_lacks_in_every_direction_is_no_disturbance() -> None:
    """Each direction is off by 1.5 standard deviations for as long as the device looks there.

    Were all of them one direction, the same would be taken for disturbances.
    """
    areas = _areas(1.0)
    distance = _noise(6) + 1.5 * np.random.default_rng(5).standard_normal(100)[areas]
    distance -= distance.mean()
    assert find_disturbances(distance, TIME, areas, 1.8, 0.0)[0].mean() > 0.99
    assert find_disturbances(distance, TIME, np.zeros_like(areas), 1.8, 0.0)[0].mean() < 0.8


def test_two_disturbances_are_two_stretches_in_order() -> None:
    first, second = np.abs(TIME - 20.0) < 1.0, np.abs(TIME - 70.0) < 1.0
    _, runs = find_disturbances(_noise(7) + 8.0 * first - 5.0 * second, TIME, _areas(), 1.0, 0.0)
    one, other = runs
    assert one.start < 20.0 < one.end < other.start < 70.0 < other.end
    assert one.size > other.size
