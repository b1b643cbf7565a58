"""The field in the holds: where it stood still, by whichever clock."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.readings import Series
from imucal_wizard.estimate.gravity_and_field import END_SHARE, field_at, undisturbed
from imucal_wizard.estimate.magnetometer.fit import MagnetometerFit, fit_magnetometer
from tests.estimate.field_truth import MAGNITUDE, NOISE, RATE, recorded, six_circles
from tests.estimate.truth import hold

HOLDS = [hold(np.zeros(3), 10.0 * index, 4.0) for index in range(3)]
"""From 0 to 4 s, from 10 to 14 s and from 20 to 24 s."""


@cache
def _calibrated() -> MagnetometerFit:
    rng = np.random.default_rng(0)
    return fit_magnetometer(recorded(six_circles(rng), rng).series)


def _stream(turned: float = 0.0, clock: float = 0.0) -> Series:
    """A field that stands during the holds and moves between; in the second one it turns, too."""
    time = np.arange(0.0, 24.0, 1.0 / RATE)
    angle = 60.0 * np.interp(time, [0.0, 4.0, 10.0, 14.0, 20.0], [0.0, 0.0, 1.0, 1.0, 2.0])
    angle += turned * np.interp(time, [10.0, 14.0], [0.0, 1.0])
    directions = Attitude.from_euler("z", angle[:, None], degrees=True).apply([0.6, 0.0, 0.8])
    series = recorded(directions, np.random.default_rng(1)).series
    return Series(time + clock, series.values, series.unit)


def _directions(means: np.ndarray) -> np.ndarray:
    """About which way each mean looks, degrees about z."""
    found = _calibrated().fit
    vectors = (means - found.bias) @ found.matrix.T
    return np.degrees(np.unwrap(np.arctan2(vectors[:, 1], vectors[:, 0])))


def test_each_hold_gives_its_mean_reading() -> None:
    places, means, _ = field_at(HOLDS, _stream(), _calibrated(), 0.0)
    assert places == [0, 1, 2]
    assert np.diff(_directions(means)) == pytest.approx([60.0, 60.0], abs=1.0)


def test_a_hold_in_which_the_field_turned_gives_none() -> None:
    """Twenty degrees about the vertical, which gravity does not show."""
    places, means, _ = field_at(HOLDS, _stream(turned=20.0), _calibrated(), 0.0)
    assert places == [0, 2]
    assert len(means) == 2


@pytest.mark.parametrize("clock", [1.5, -1.5])
def test_by_another_clock_the_same_samples_belong_to_a_hold(clock: float) -> None:
    """Where the offset is known nothing is cut off; with a wrong one the field seems to move."""
    stream = _stream(clock=clock)
    places, means, _ = field_at(HOLDS, stream, _calibrated(), clock)
    assert places == [0, 1, 2]
    plain = field_at(HOLDS, _stream(), _calibrated(), 0.0)[1]
    assert means == pytest.approx(plain, abs=NOISE / 2.0)
    assert 1 not in field_at(HOLDS, stream, _calibrated(), -clock)[0]


def test_before_the_clocks_are_compared_the_ends_of_a_hold_do_not_count() -> None:
    """So that a clock that is off by less brings no motion in."""
    for clock in (0.9 * 4.0 * END_SHARE, -0.9 * 4.0 * END_SHARE):
        places, means, _ = field_at(HOLDS, _stream(clock=clock), _calibrated())
        assert places == [0, 1, 2]
        assert np.diff(_directions(means)) == pytest.approx([60.0, 60.0], abs=1.0)


def test_too_few_samples_are_no_mean() -> None:
    stream = _stream()
    few = (stream.time < 10.0) | (stream.time > 13.97)
    places, _, _ = field_at(
        HOLDS, Series(stream.time[few], stream.values[few], "count"), _calibrated()
    )
    assert places == [0, 2]


def test_disturbed_samples_are_not_among_the_calm_ones() -> None:
    """What passed while the device turned."""
    rng = np.random.default_rng(2)
    directions = six_circles(rng)
    extra = np.zeros_like(directions)
    extra[3000:3400] = 0.3 * MAGNITUDE
    series = recorded(directions, rng, extra=extra).series
    calm = undisturbed(series, fit_magnetometer(series))
    assert not np.isin(series.time[3000:3400], calm.time).any()
    assert len(calm) > 0.9 * len(series)
