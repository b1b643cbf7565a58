"""Samples of a turning magnetometer as means: few, by time and direction, and nothing is lost."""

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.magnetometer.pieces import (
    MOST_GROUPS,
    Pieces,
    cut,
    piece_noise,
    slices,
    visits_of,
)

RATE = 80.0
FIELD = 48.0


def tumbling(seconds: float) -> tuple[FloatArray, FloatArray]:
    """Times and field of a device turned about two axes at different speeds."""
    time = np.arange(0.0, seconds, 1.0 / RATE)
    a, b = 0.9 * time, 0.17 * time
    field = np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=1)
    return time, FIELD * field


def pieces_of(time: FloatArray, field: FloatArray) -> Pieces:
    return cut(time, field, field, np.full((len(time), 2), np.nan))


@pytest.mark.parametrize("seconds", [20.0, 120.0, 900.0])
def test_however_long_the_session_the_groups_are_few_and_hold_all_samples(seconds: float) -> None:
    time, field = tumbling(seconds)
    pieces = pieces_of(time, field)
    assert 0.8 * min(MOST_GROUPS, len(pieces.count)) < len(pieces.cell) <= MOST_GROUPS
    assert pieces.samples.sum() == len(time)


def test_the_mean_magnitude_survives_the_averaging_along_an_arc() -> None:
    """A mean of vectors is too short by up to a per cent; what is missing is remembered."""
    pieces = pieces_of(*tumbling(120.0))
    short = np.linalg.norm(pieces.reading, axis=1)
    assert short.min() < FIELD - 0.02
    np.testing.assert_allclose(short + pieces.extra, FIELD, atol=1e-9)


def test_slices_are_cut_where_something_changes() -> None:
    """Three steps in three levels, whatever their lengths."""
    values = np.repeat([0.0, 1.0, 0.4], [50, 7, 90])[:, None]
    rng = np.random.default_rng(0)
    noisy = values + 0.05 * rng.standard_normal(values.shape)
    np.testing.assert_array_equal(slices(noisy, np.ones(147), 3), [0, 50, 57, 147])


@pytest.mark.parametrize(("more", "begins"), [(1.0, [0.0]), (3.0, [0.0, 4.0])])
def test_a_row_ends_where_the_noise_changes(more: float, begins: list[float]) -> None:
    """In a rest of ten seconds the noise triples: two rows, each of one noise."""
    time = np.arange(0.0, 10.0, 1.0 / RATE)
    noise = 0.1 * np.where(time < 4.0, 1.0, more)[:, None]
    field = [FIELD, 0.0, 0.0] + noise * np.random.default_rng(3).standard_normal((len(time), 3))
    np.testing.assert_allclose(pieces_of(time, field).span[:, 0], begins, atol=0.05)


def test_a_rest_is_one_group_and_a_change_of_the_current_makes_two() -> None:
    """A minute of rest amid circles: one long group, or one for either current."""
    time, field = tumbling(240.0)
    rest = (time >= 100.0) & (time < 110.0)
    field[rest] = field[np.flatnonzero(rest)[0]]
    steady = cut(time, field, field, np.zeros((len(time), 2)))
    current = np.where(time < 105.0, 0.0, 8.0)
    switched = cut(time, field, field, np.column_stack([np.zeros(len(time)), current]))

    def within(pieces: Pieces) -> list[tuple[float, float]]:
        first, last = pieces.time[pieces.offsets[:-1]], pieces.time[pieces.offsets[1:] - 1]
        return [(a, b) for a, b in zip(first, last, strict=True) if a < 109.5 and b > 100.5]

    assert len(within(steady)) == 1
    assert len(within(switched)) == 2


def test_each_of_few_still_poses_is_one_group() -> None:
    """Whatever their lengths, and however few groups there are."""
    rng = np.random.default_rng(3)
    poses = rng.standard_normal((14, 3))
    poses *= FIELD / np.linalg.norm(poses, axis=1)[:, None]
    lengths = rng.integers(100, 2000, 14)
    field = np.repeat(poses, lengths, axis=0) + 0.4 * rng.standard_normal((lengths.sum(), 3))
    pieces = pieces_of(np.arange(len(field)) / RATE, field)
    # a piece in which the device goes from one pose to the next is a group of its own
    long = pieces.samples > 0.2 * RATE
    assert long.sum() == 14
    np.testing.assert_allclose(pieces.samples[long], lengths, atol=0.4 * RATE)


def test_the_noise_is_that_of_the_samples_whatever_drifts_and_jumps() -> None:
    """The bias itself drifts, as of a corrected field: the true magnitude is the same."""
    rng = np.random.default_rng(1)
    time, field = tumbling(300.0)
    slowly = 0.002 * time[:, None] + 1.5 * (time > 150.0)[:, None]
    noisy = field * (1.0 + slowly / FIELD) + 0.4 * rng.standard_normal(field.shape)
    pieces = pieces_of(time, noisy)
    found, _ = piece_noise(pieces, np.linalg.norm(pieces.reading, axis=1))
    # 1500 differences, each piece in three of them, know the variance to 5 %
    assert found == pytest.approx(0.16, rel=0.2)


def test_the_noise_does_not_contain_what_a_wrong_bias_makes_of_a_turn() -> None:
    """A drift that the first fit does not know leaves the bias wrong by many times the noise."""
    time, field = tumbling(300.0)
    noisy = field + [3.0, 0.0, 0.0] + 0.4 * np.random.default_rng(6).standard_normal(field.shape)
    pieces = pieces_of(time, noisy)
    single, freedom = pieces.noise(np.linalg.norm(noisy, axis=1))
    # some 24,000 degrees of freedom know the variance to 1 %, a group of 200 samples to 10 %
    assert (freedom @ single) / freedom.sum() == pytest.approx(0.16, rel=0.04)
    assert single.max() < 0.16 * 1.5
    found, _ = piece_noise(pieces, np.linalg.norm(pieces.reading, axis=1))
    assert found == pytest.approx(0.16, rel=0.2)


def test_a_direction_seen_again_later_is_another_visit() -> None:
    """Rests in one direction, a minute apart, each cut in slices of time."""
    time = np.concatenate([np.arange(0.0, 10.0, 0.0125), np.arange(70.0, 80.0, 0.0125)])
    field = np.tile([0.0, 0.0, FIELD], (len(time), 1))
    pieces = pieces_of(time, field)
    visits = visits_of(pieces, pieces.cell)
    early = pieces.time[pieces.offsets[:-1]] < 40.0
    assert len(np.unique(visits[early])) == 1
    assert len(np.unique(visits[~early])) == 1
    assert set(visits[early]).isdisjoint(visits[~early])
