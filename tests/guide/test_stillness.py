"""Blocks, windows and holds: the same samples give the same decisions, however they arrive."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.measurement.blocks import BlockCutter, Blocks, block_moments, join_blocks
from imucal_wizard.measurement.holds import (
    Hold,
    HoldBuilder,
    Rests,
    blocks_of_rests,
    hold_at_rest,
    hold_from,
    still_runs,
    trim_ends,
)
from imucal_wizard.measurement.stillness import Limits, Noise, WindowMaker, measure_noise

RATE = 100.0


def recording(seconds: float = 20.0, offset: float = 32768.0, seed: int = 3) -> Readings:
    """Rest, a shake of one second every five, rest; in counts around an offset."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 1.0 / RATE)
    shaken = (time % 5.0) > 4.0
    noise = rng.normal(0.0, 4.0, (len(time), 6))
    noise[shaken] += rng.normal(0.0, 300.0, (int(shaken.sum()), 6))
    values = np.round(offset + noise)
    temperature = Series(time[::7], 20.0 + time[::7, None], "degC")
    return Readings(
        Series(time, values[:, :3], "count"),
        Series(time, values[:, 3:], "count"),
        temperature=temperature,
    )


def pieces(readings: Readings, cuts: list[int]) -> list[Readings]:
    """The recording cut before the samples with these indices, as a stream would bring it."""
    bounds = [0, *sorted(set(cuts)), len(readings)]
    out = []
    for first, last in itertools.pairwise(bounds):
        if first == last:
            continue
        accelerometer, gyroscope = readings.accelerometer, readings.gyroscope
        temperature = readings.temperature
        assert gyroscope is not None
        assert temperature is not None
        ends = np.append(accelerometer.time, np.inf)
        out.append(
            Readings(
                Series(accelerometer.time[first:last], accelerometer.values[first:last], "count"),
                Series(gyroscope.time[first:last], gyroscope.values[first:last], "count"),
                temperature=temperature.between(ends[first], ends[last]),
            )
        )
    return out


def streamed(parts: list[Readings], limits: Limits) -> list[Hold]:
    """Holds of a stream, block by block."""
    cutter, maker, builder = BlockCutter(RATE), WindowMaker(), HoldBuilder()
    holds: list[Hold] = []
    for part in parts:
        blocks = cutter.feed(part)
        windows = maker.feed(blocks)
        for index, decision in enumerate(windows.still(limits)):
            if not decision and (hold := builder.hold(4096.0)) is not None:
                holds.append(hold)
            row = slice(index, index + 1)
            builder.add(blocks.select(row), windows.select(row), bool(decision))
    last = builder.hold(4096.0)
    return holds if last is None else [*holds, last]


def at_once(readings: Readings, limits: Limits) -> list[Hold]:
    """Holds of a file, all blocks together."""
    blocks = BlockCutter(RATE).feed(readings)
    windows = WindowMaker().feed(blocks)
    rests = Rests(windows)
    found = {rests.around(*run) for run in still_runs(windows.still(limits))}
    holds = [
        hold_at_rest(blocks.select(slice(*run)), 4096.0) for run in blocks_of_rests(sorted(found))
    ]
    return [hold for hold in holds if hold is not None]


LIMITS = Limits(np.full(3, 20.0), np.full(3, 20.0))


def same(a: Hold, b: Hold) -> bool:
    """Equal to the last bit."""
    assert a.gyroscope is not None
    assert b.gyroscope is not None
    return (
        a.start == b.start
        and a.end == b.end
        and a.temperature == b.temperature
        and np.array_equal(a.accelerometer, b.accelerometer)
        and np.array_equal(a.gyroscope, b.gyroscope)
        and np.array_equal(a.accelerometer_covariance, b.accelerometer_covariance, equal_nan=True)
    )


@settings(max_examples=40, deadline=None)
@given(st.lists(st.integers(1, 1999), max_size=30))
def test_a_stream_cut_anywhere_gives_the_holds_of_the_file_to_the_last_bit(
    cuts: list[int],
) -> None:
    readings = recording()
    expected = at_once(readings, LIMITS)
    found = streamed(pieces(readings, cuts), LIMITS)
    assert len(found) == len(expected) == 4
    assert all(map(same, found, expected))


def test_a_hold_keeps_nothing_of_the_shake_that_ends_it() -> None:
    for hold in at_once(recording(), LIMITS):
        assert (hold.start % 5.0) < 4.0
        assert ((hold.end - 1.0 / RATE) % 5.0) < 4.0
        assert np.abs(hold.accelerometer - 32768.0).max() < 5 * 4.0 / np.sqrt(hold.samples)


@given(st.floats(5.0, 4000.0), st.floats(0.0, 1e4))
def test_a_hold_finds_its_own_samples_at_every_rate(rate: float, begin: float) -> None:
    """The end may round past the next sample."""
    cutter = BlockCutter(rate)
    time = begin + np.arange(7 * cutter.size) / rate
    series = Series(time, np.zeros((len(time), 3)), "m/s^2")
    blocks = cutter.feed(Readings(series))
    hold = hold_from(blocks.select(slice(1, 6)))
    np.testing.assert_array_equal(
        hold.readings(series).time, time[cutter.size : cutter.size + hold.samples]
    )


def test_moments_of_counts_far_from_zero_keep_their_variance() -> None:
    rng = np.random.default_rng(0)
    pieces = 32768.0 + rng.normal(0.0, 0.3, (50, 10, 3))
    mean, variance, _ = block_moments(pieces)
    np.testing.assert_allclose(mean, pieces.mean(axis=1), rtol=1e-15)
    np.testing.assert_allclose(variance, pieces.var(axis=1), rtol=1e-9)


@pytest.mark.parametrize("size", [10, 167, 800])
def test_moments_do_not_depend_on_how_many_blocks_are_formed_at_once(size: int) -> None:
    pieces = 32768.0 + np.random.default_rng(0).normal(0.0, 0.3, (30, size, 3))
    together = block_moments(np.concatenate([pieces] * 40))
    alone = zip(*(block_moments(piece[None]) for piece in pieces), strict=True)
    for whole, parts in zip(together, alone, strict=True):
        assert np.array_equal(whole, np.concatenate(parts * 40))


def test_the_window_counts_a_slow_drift_as_motion() -> None:
    """A ramp has no scatter within its blocks, only between them."""
    time = np.arange(0.0, 5.0, 1.0 / RATE)
    ramp = np.repeat(0.5 * time[:, None], 3, axis=1)
    blocks = BlockCutter(RATE).feed(Readings(Series(time, ramp, "m/s^2")))
    windows = WindowMaker().feed(blocks)
    np.testing.assert_allclose(windows.std_a[4:], 0.5 * 0.5 / np.sqrt(12.0), rtol=1e-3)
    assert windows.mean_g is None


def test_a_gap_as_long_as_a_block_breaks_every_window_it_touches() -> None:
    """In a shorter one a device does not leave its rest and come back."""
    readings = recording()
    gyroscope = readings.gyroscope
    assert gyroscope is not None
    keep = np.ones(len(readings), bool)
    keep[214:224] = False
    blocks = BlockCutter(RATE).feed(
        Readings(
            Series(readings.accelerometer.time[keep], readings.accelerometer.values[keep], "count"),
            Series(gyroscope.time[keep], gyroscope.values[keep], "count"),
        )
    )
    assert np.flatnonzero(blocks.gap).tolist() == [21]
    assert np.flatnonzero(~WindowMaker().feed(blocks).full).tolist() == [0, 1, 2, 3, *range(21, 26)]


def test_a_run_after_a_break_shares_no_block_with_the_run_before() -> None:
    still = np.array([0] * 5 + [1] * 10 + [0] + [1] * 10, bool)
    runs = blocks_of_rests(still_runs(still))
    assert runs == [(2, 14), (17, 25)]


def test_noise_is_the_median_and_an_axis_without_noise_gets_a_limit_it_can_meet() -> None:
    blocks = BlockCutter(RATE).feed(recording(4.0))
    noise = measure_noise(WindowMaker().feed(blocks))
    assert noise is not None
    assert noise.std_a == pytest.approx(4.0, rel=0.2)
    quiet = Noise(np.array([0.0, 0.0, 3.0]), None, None).limits(2.0)
    assert quiet.accelerometer.tolist() == [2.0, 2.0, 6.0]


def test_the_covariance_of_an_average_is_that_of_white_noise() -> None:
    """Over many holds the batch means reproduce σ²/n within the scatter of 4 degrees of freedom."""
    rng = np.random.default_rng(8)
    variances = []
    for _ in range(200):
        time = np.arange(0.0, 2.0, 1.0 / RATE)
        series = Series(time, rng.normal(0.0, 2.0, (200, 3)), "count")
        blocks = BlockCutter(RATE).feed(Readings(series))
        variances.append(np.diag(hold_from(blocks).accelerometer_covariance))
    # 600 estimates of 4 degrees of freedom: standard error 0.7 / sqrt(600) = 3 %
    assert np.mean(variances) == pytest.approx(4.0 / 200.0, rel=0.1)


def test_blocks_joined_are_the_blocks_cut_at_once() -> None:
    readings = recording()
    whole = BlockCutter(RATE).feed(readings)
    cutter = BlockCutter(RATE)
    parts: list[Blocks] = [cutter.feed(part) for part in pieces(readings, [333, 334, 1500])]
    joined = join_blocks(parts)
    np.testing.assert_array_equal(joined.variance, whole.variance)
    np.testing.assert_array_equal(joined.temperature, whole.temperature)
    np.testing.assert_array_equal(joined.gap, whole.gap)


@pytest.mark.parametrize("size", [4, 10, 100, 800])
def test_a_block_has_the_same_bits_alone_and_among_thousands(size: int) -> None:
    """A stream brings one block at a time, a file thousands; both are summed in the same order."""
    pieces = np.random.default_rng(5).normal(32768.0, 4.0, (size + 1, size, 3))
    together = block_moments(pieces)
    for index in (0, size // 2, size):
        for alone, whole in zip(block_moments(pieces[index : index + 1]), together, strict=True):
            np.testing.assert_array_equal(alone[0], whole[index])


def test_the_slow_beginning_of_a_turn_is_taken_off_the_hold() -> None:
    """A turn that gathers speed over a second stays within the limits long after it began."""
    rng = np.random.default_rng(9)
    time = np.arange(0.0, 5.0, 1.0 / RATE)
    rate = rng.normal(0.0, 0.001, (len(time), 3))
    rate[:, 0] += np.where(time > 4.3, 0.01 * (time - 4.3), 0.0)
    force = rng.normal((0.0, 0.0, 9.81), 0.01, (len(time), 3))
    blocks = BlockCutter(RATE).feed(
        Readings(Series(time, force, "m/s^2"), Series(time, rate, "rad/s"))
    )
    whole, trimmed = hold_from(blocks), hold_from(trim_ends(blocks))
    assert trimmed.start == 0.0
    assert 4.2 <= trimmed.end <= 4.5
    assert whole.gyroscope is not None
    assert trimmed.gyroscope is not None
    assert abs(trimmed.gyroscope[0]) < 5 * 0.001 / np.sqrt(420) < whole.gyroscope[0]


def test_a_hold_that_is_still_to_its_ends_keeps_them() -> None:
    """False trims are rare: less than one block of fifty in each of 200 holds of pure noise."""
    rng = np.random.default_rng(2)
    lost = 0
    for _ in range(200):
        time = np.arange(0.0, 5.0, 1.0 / RATE)
        series = Series(time, rng.normal(0.0, 1.0, (len(time), 3)), "count")
        blocks = BlockCutter(RATE).feed(Readings(series, series))
        lost += len(blocks) - len(trim_ends(blocks))
    assert lost < 200
