"""Device time is trusted, wraps are undone, restarts begin a new segment, drops are counted."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.acquire.clock import DeviceClock, SampleCounter
from imucal_wizard.acquire.host_clock import (
    BurstClock,
    HostClock,
    RateFit,
    sampling_period,
    time_quantum,
)
from imucal_wizard.core.limits.data_quality import RESTART_GAP_SECONDS
from imucal_wizard.core.readings import FloatArray

MICROS = 2.0**32


def in_pieces(clock: DeviceClock, ticks: FloatArray, cuts: list[int]) -> FloatArray:
    """Times of ticks that come in pieces."""
    return np.concatenate([clock.feed(piece) for piece in np.split(ticks, sorted(cuts))])


@pytest.mark.parametrize(
    ("factor", "modulus"),
    [(1e-6, MICROS), (1e-3, MICROS), (1e-3, MICROS / 1e3), (1.0, MICROS / 1e6), (1.0, 86400.0)],
)
def test_a_wrapping_counter_runs_on(factor: float, modulus: float) -> None:
    true = modulus - 0.5 / factor + np.arange(100) * 0.01 / factor
    clock = DeviceClock(factor, 0.01)
    times = clock.feed(np.mod(true, modulus))
    np.testing.assert_allclose(times, np.arange(100) * 0.01, atol=1e-5)
    assert (clock.wraps, clock.restarts, clock.lost) == (1, 0, 0)


def test_missing_samples_are_counted_and_leave_a_gap() -> None:
    ticks = np.delete(np.arange(100) * 10.0, [20, 50, 51, 52])
    clock = DeviceClock(1e-3, 0.01)
    times = clock.feed(ticks)
    assert clock.lost == 4
    np.testing.assert_allclose(times, ticks / 1000, atol=1e-12)


def test_a_restart_begins_a_new_segment_after_a_gap() -> None:
    ticks = np.concatenate((90_000 + np.arange(50) * 10.0, 300 + np.arange(50) * 10.0))
    clock = DeviceClock(1e-3, 0.01)
    times = clock.feed(ticks)
    assert clock.restarts == 1
    assert times[50] - times[49] == pytest.approx(RESTART_GAP_SECONDS)
    assert np.all(np.diff(times) > 0)


def test_a_garbled_time_moves_nothing_by_hours() -> None:
    ticks = np.arange(100, dtype=np.float64) * 0.01
    ticks[40] += 1e7
    clock = DeviceClock(1.0, 0.01)
    times = clock.feed(ticks)
    assert clock.jumps == 1
    assert times[-1] < 4
    assert np.all(np.diff(times) > 0)


@settings(deadline=None)
@given(
    ticks=st.lists(st.floats(-1e12, 1e12), min_size=1, max_size=40),
    cuts=st.lists(st.integers(0, 40), max_size=5),
    quantum=st.sampled_from([0.0, 0.02]),
)
def test_any_ticks_give_times_that_never_go_back_however_they_are_cut(
    ticks: list[float], cuts: list[int], quantum: float
) -> None:
    array = np.array(ticks)
    whole = DeviceClock(1e-3, 0.01, quantum).feed(array)
    assert np.all(np.diff(whole) >= 0)
    pieces = in_pieces(DeviceClock(1e-3, 0.01, quantum), array, [c for c in cuts if c < len(ticks)])
    np.testing.assert_array_equal(pieces, whole)


def test_time_printed_too_coarsely_is_made_even() -> None:
    true = np.arange(8000) / 1666.0
    coarse = np.floor(true * 1000) / 1000
    clock = DeviceClock(1.0, sampling_period(coarse[:900]), time_quantum(coarse[:900]))
    times = clock.feed(coarse)
    steps = np.diff(times[1000:]) * 1666
    assert np.all((steps > 0.9) & (steps < 1.1))
    assert abs(times[-1] - true[-1]) < 0.001
    assert clock.lost == 0


def test_missing_samples_are_seen_in_coarse_time_too() -> None:
    true = np.delete(np.arange(8000), slice(5000, 5200)) / 1666.0
    coarse = np.floor(true * 1000) / 1000
    clock = DeviceClock(1.0, sampling_period(coarse[:900]), time_quantum(coarse[:900]))
    times = clock.feed(coarse)
    assert clock.lost == pytest.approx(200, abs=3)
    assert abs(times[-1] - true[-1]) < 0.002


def test_the_period_leaves_out_gaps_and_restarts() -> None:
    times = np.concatenate((np.arange(30) * 0.01, 5 + np.arange(30) * 0.01, np.arange(30) * 0.01))
    assert sampling_period(times) == pytest.approx(0.01)
    assert sampling_period(np.zeros(10)) == 0.0


@pytest.mark.parametrize("modulus", [256, 65536, 2**32])
def test_a_sample_counter_of_any_width_runs_on_and_shows_drops(modulus: int) -> None:
    true = np.delete(np.arange(modulus - 20, modulus + 30), [25])
    counter = SampleCounter()
    indices = counter.feed(np.mod(true, modulus).astype(float))
    np.testing.assert_array_equal(indices, true - true[0])
    assert counter.lost == 1


def bursts(rate: float, seconds: float, burst: float, seed: int = 0) -> list[tuple[int, float]]:
    """How many samples arrive when, in bursts with jitter, as over Bluetooth."""
    rng = np.random.default_rng(seed)
    ends = np.arange(burst, seconds, burst)
    seen = 0
    chunks = []
    for end in ends:
        count = int(end * rate) - seen
        seen += count
        if count:
            chunks.append((count, float(end + rng.uniform(0, 0.02))))
    return chunks


def host_times(clock: HostClock, chunks: list[tuple[int, float]], first: int = 0) -> FloatArray:
    """Times of chunks of samples."""
    parts = []
    for count, arrival in chunks:
        parts.append(clock.feed(np.arange(first, first + count, dtype=float), arrival))
        first += count
    return np.concatenate([*parts, clock.flush()])


def test_the_rate_of_a_bursty_stream_is_found_to_a_part_in_a_thousand() -> None:
    clock = HostClock()
    times = host_times(clock, bursts(203.0, 20.0, 0.039))
    assert 1 / clock.period == pytest.approx(203.0, rel=5e-4)
    assert np.all(np.diff(times) > 0)
    assert clock.lost == 0


def test_the_same_arrivals_give_the_same_times() -> None:
    chunks = bursts(100.0, 10.0, 0.03)
    np.testing.assert_array_equal(host_times(HostClock(), chunks), host_times(HostClock(), chunks))


def test_a_late_but_complete_chunk_is_not_counted_as_lost() -> None:
    chunks = bursts(100.0, 10.0, 0.02)
    late = [(c, a) for c, a in chunks if not 5.0 < a < 6.0]
    held = sum(c for c, a in chunks if 5.0 < a < 6.0)
    place = next(i for i, (_, a) in enumerate(late) if a > 6.0)
    late[place] = (late[place][0] + held, late[place][1])
    clock = HostClock()
    times = host_times(clock, late)
    assert clock.lost == 0
    assert float(np.max(np.diff(times))) < 0.015


def test_samples_lost_in_a_silence_leave_a_gap_of_its_length() -> None:
    chunks = [(c, a) for c, a in bursts(100.0, 10.0, 0.02) if not 5.0 < a < 6.0]
    clock = HostClock()
    times = host_times(clock, chunks)
    assert clock.lost == pytest.approx(100, abs=5)
    assert float(np.max(np.diff(times))) == pytest.approx(1.0, abs=0.06)
    assert times[-1] == pytest.approx(9.9, abs=0.1)


@pytest.mark.parametrize("tick", [0.05, 0.11, 1.0])
def test_a_recording_may_end_within_a_tick_and_lacks_nothing(tick: float) -> None:
    """The samples of the last tick are fewer, and seem to be late for those to come."""
    even = np.arange(3003) / 100.0
    clock = BurstClock(1.0, 0.5 * tick, None)
    times = np.concatenate([clock.feed(np.floor(even / tick) * tick), clock.flush()])
    assert clock.lost == 0
    np.testing.assert_allclose(np.diff(times), 0.01, rtol=0.02)


def test_a_known_rate_needs_no_warming_up() -> None:
    clock = HostClock(100.0)
    times = clock.feed(np.arange(5.0), 0.0)
    np.testing.assert_allclose(times, np.arange(5) / 100)


def test_the_rate_fit_agrees_with_a_straight_line_from_numpy() -> None:
    rng = np.random.default_rng(2)
    index = np.cumsum(rng.integers(1, 9, 200)).astype(float)
    arrival = 1e6 + index / 97.3 + rng.uniform(0, 0.03, 200)
    fit = RateFit()
    for i, a in zip(index, arrival, strict=True):
        fit.add(i, a)
    slope = np.polynomial.Polynomial.fit(index, arrival - 1e6, 1).convert().coef[1]
    assert fit.period == pytest.approx(slope, rel=1e-9)
