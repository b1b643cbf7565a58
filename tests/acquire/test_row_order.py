"""Rows come in the order of their times, each once; those of a wrong time are left out."""

import time
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.row_order import LATE_ROWS, RowOrder
from imucal_wizard.core.readings import FloatArray

HEADER = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]\n"
LIMIT = 1.5


def whole(*ticks: float, values: Sequence[int] = (), coarse: bool = False) -> list[float]:
    """The times that come out one by one; without values, each row has its own."""
    order = RowOrder(0, LIMIT, 100, coarse=coarse)
    rows = np.column_stack([ticks, values or np.arange(len(ticks))]).astype(float)
    parts = [order.feed(row[None]) for row in rows]
    return [float(v) for part in [*parts, order.flush()] for v in part[:, 0]]


def test_a_time_that_stands_alone_is_left_out() -> None:
    """Too large or too small, with or without samples lost beside it."""
    assert whole(1, 2, 102, 3, 4) == [1, 2, 3, 4]
    assert whole(1, 2, 2121, 21, 22) == [1, 2, 21, 22]
    assert whole(8, 9, 1, 10, 11) == [8, 9, 10, 11]


@pytest.mark.parametrize(
    "ticks",
    [
        (1, 2, 50, 51, 52),  # samples are missing
        (1, 2, 50, 90, 91),  # twice in a row
        (100, 101, 0, 1, 2),  # a restart
        (254, 255, 0, 1, 2),  # a wrap
        *[[i % n for i in range(60)] for n in range(2, 10)],  # a wrap after a few rows
        [i * 10 % 65.536 / 10 for i in range(3000)],  # microseconds of 16 bits
        *[(*range(n), *range(20)) for n in range(1, 8)],  # a restart soon after the beginning
        (1, *range(20)),
        (*range(30), 0, 1, *range(20)),  # and soon after a restart
        (*range(5), 0, 1, *range(20)),
        (*range(7), 0, 1, 2, 5, 6, 7, 8, 9),  # with lost samples
        (*range(30), *(i - 1.8 for i in range(30, 50))),  # a clock that is set back
        (1, 2, 2, 3, 3, 4),  # a coarse clock
        (1, 2, 3, 50),  # the last sample of all
    ],
)
def test_an_honest_step_stays(ticks: Sequence[float]) -> None:
    """The sample after it goes on from it."""
    assert whole(*ticks) == list(ticks)


@pytest.mark.parametrize(
    "ticks",
    [
        [*range(30), *range(40)],  # the whole recording again
        [*range(5, 35), *range(40)],
        [*range(100, 130), *range(70, 140)],  # to less than five seconds before
        [i % 16 for i in range(60)],
        [i * 10 % 65.536 / 10 for i in range(500)],
    ],
)
@pytest.mark.parametrize("kinds", [1, 2, 3])
def test_a_restart_or_wrap_loses_no_rows_whose_readings_repeat(
    ticks: list[float], kinds: int
) -> None:
    """Coarse readings of a device at rest are equal at the same time before and after."""
    values = np.random.default_rng(7).integers(kinds, size=len(ticks)).tolist()
    assert whole(*ticks, values=values) == ticks


def test_rows_that_come_twice_cost_little_each() -> None:
    """Rows are compared with those of the same time only."""
    ticks = np.arange(60_000.0)
    rows = np.column_stack([ticks, np.random.default_rng(8).normal(size=(len(ticks), 6))])
    blocks = rows.reshape(-1, 30, 7)
    for twice in (np.repeat(rows, 2, axis=0), np.concatenate((blocks, blocks), axis=1)):
        order = RowOrder(0, LIMIT, 500)
        begin = time.process_time()
        found = np.concatenate((order.feed(twice.reshape(-1, 7)), order.flush()))
        assert time.process_time() - begin < 6.0
        np.testing.assert_array_equal(found, rows)
        assert order.copies == len(rows)


@pytest.mark.parametrize(("rate", "held"), [(2, 1), (10, 5), (100, 8)])
def test_lost_samples_hold_a_slow_stream_for_half_a_second(rate: int, held: int) -> None:
    """A fast one for eight samples."""
    order = RowOrder(0, LIMIT, 5 * rate)
    ticks = [*range(20), *range(21, 40)]
    passed = [len(order.feed(np.array([[float(t), t]]))) for t in ticks]
    assert passed == [1] * 20 + [0] * held + [held + 1] + [1] * (18 - held)


@pytest.mark.parametrize(
    "ticks",
    [
        (1, 2, 4, 3, 5, 6),  # neighbours
        (1, 2, 4, 3),  # at the end
        (1, 3, 2, 5, 4, 7, 6, 8),  # one after the other
        (1, 2, 6, 3, 4, 5, 7, 8),  # a row that came early
        (1, 2, 4, 5, 6, 3, 7, 8),  # a row that came late
        (1, 2, 50, 52, 51, 53),  # after a gap
    ],
)
def test_rows_in_exchanged_order_are_sorted(ticks: tuple[float, ...]) -> None:
    """As long as they are late by a few rows only."""
    assert whole(*ticks) == sorted(ticks)


@pytest.mark.parametrize(
    "rows",
    [
        (7, 9, 8, 10, 11),  # before it
        (7, 8, 10, 9, 11),  # across it
        (7, 8, 10, 11, 9),
        (7, 10, 8, 9, 11),
        (7, 8, 9, 11, 10),  # after it
        (7, 8, 9, 12, 10, 11),
    ],
)
def test_rows_exchanged_across_a_wrap_are_sorted(rows: tuple[int, ...]) -> None:
    """The counter has wrapped from 99 to 0 at the tenth row of these."""
    ticks = [*range(80, 97), *((row + 90) % 100 for row in rows)]
    ticks += [*range(max(rows) - 9, 40)]
    assert whole(*ticks) == [*range(80, 100), *range(40)]


@pytest.mark.parametrize(
    ("ticks", "coarse"),
    [
        ((1, 2, 3, 4.1, 3.9, 5, 6), False),  # neighbours of times that jitter
        ((*range(30), *(i - 1.2 for i in range(30, 50))), False),  # a clock that is set back
        ((1, 1, 2, 2, 3, 3, 2, 3, 4, 4, 5, 5), True),  # neighbours of a coarse clock
        ((1, 1, 1, 2, 2, 3, 3, 2, 2, 3, 4, 4, 4), True),
        ((1, 1, 2, 2, 1, 1, 2, 2, 3, 3, 4, 4), True),  # its restart after one tick
    ],
)
def test_a_row_that_goes_back_by_little_has_the_newest_time(
    ticks: tuple[float, ...], coarse: bool
) -> None:
    """The one before it has passed; neither is it lost, nor does the clock restart."""
    assert whole(*ticks, coarse=coarse) == np.maximum.accumulate(ticks).tolist()


@pytest.mark.parametrize("jitter", [0.2, 0.3, 0.4])
@pytest.mark.parametrize("seed", range(3))
def test_times_that_jitter_so_that_they_go_back_are_no_restart(jitter: float, seed: int) -> None:
    """By up to two fifths of a step; a restart among them is one, whatever the time after it."""
    rng = np.random.default_rng([25901, seed])
    ticks = np.arange(5000.0) + jitter * rng.standard_normal(5000)
    assert (np.diff(ticks) < 0.0).any() or jitter < 0.3
    found = np.array(whole(*ticks))
    assert len(found) == len(ticks)
    assert (np.diff(found) >= 0.0).all()
    ticks[3000:] -= rng.uniform(3.0, 3000.0)
    found = np.array(whole(*ticks))
    assert len(found) == len(ticks)
    back = np.flatnonzero(np.diff(found) < 0.0)
    # rows that go back right before the restart are taken for its first ones
    assert back[-1] == 2999
    assert back[0] > 2999 - LATE_ROWS


def test_a_coarse_clock_restarts_and_has_wrong_times_as_others_do() -> None:
    """By more than a tick."""
    ticks = (1, 1, 2, 2, 3, 3, 1, 1, 2, 2, 3, 3, 4, 4)
    assert whole(*ticks, coarse=True) == list(ticks)
    wrong = (10, 10, 11, 11, 3, 11, 12, 12, 13, 13)
    assert whole(*wrong, coarse=True) == [tick for tick in wrong if tick > 3]


@pytest.mark.parametrize(
    ("ticks", "values"),
    [
        ((1, 2, 3, 3, 4), (7, 8, 9, 9, 6)),  # a line twice
        ((1, 2, 3, 4, 2, 5, 6), (7, 8, 9, 6, 8, 5, 4)),  # a line that comes again later
        ((1, 2, 3, 4, 1, 2, 3, 4, 5), (7, 8, 9, 6, 7, 8, 9, 6, 5)),  # a buffer twice
        ((1, 2, 4, 1, 3, 5), (7, 8, 9, 7, 6, 5)),  # while others are in exchanged order
    ],
)
def test_a_copy_is_left_out(ticks: tuple[float, ...], values: tuple[int, ...]) -> None:
    """A row of the same time and the same values was there before."""
    assert whole(*ticks, values=values) == sorted(set(ticks))


@settings(deadline=None)
@given(
    rows=st.lists(
        st.tuples(st.integers(0, 60) | st.integers(0, 20), st.integers(0, 1)),
        min_size=1,
        max_size=40,
    ),
    cuts=st.lists(st.integers(0, 30), max_size=6),
)
def test_what_comes_out_does_not_depend_on_the_cuts(
    rows: list[tuple[int, int]], cuts: list[int]
) -> None:
    """One row at a time, all at once, or anything between."""
    given: FloatArray = np.array(rows, float)
    order = RowOrder(0, LIMIT, 100)
    parts = [order.feed(part) for part in np.split(given, sorted(min(c, len(rows)) for c in cuts))]
    found = np.concatenate([*parts, order.flush()])
    times, values = zip(*rows, strict=True)
    assert found[:, 0].tolist() == whole(*times, values=values)
    assert len(found) + order.wrong + order.copies == len(rows)


def test_bytes_lost_within_two_times_cost_these_samples_and_no_more() -> None:
    """``21`` and ``21.345`` do not make the 2121st second, nor a loss of 200,000 samples."""
    lines = [f"{20 + i / 100:.3f},0.1{i % 7},-0.2{i % 3},9.8{i % 5}\n" for i in range(400)]
    whole_stream = HEADER + "".join(lines)
    start = whole_stream.index("\n21.500,") + 3  # behind the "21" of this line
    lost = whole_stream[:start] + whole_stream[whole_stream.index("\n21.600,") + 1 :]
    intake = Intake()
    times = [r.accelerometer.time for r in (intake.feed(lost.encode(), 0.0), intake.flush()) if r]
    found = np.concatenate(times)
    assert found[-1] - found[0] == pytest.approx(3.99)
    assert (intake.lost, intake.malformed) == (11, 1)
