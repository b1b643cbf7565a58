"""A line of which the middle was lost is left out when its time betrays it; honest jumps stay."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.acquire.clock import SplitLineFilter
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.core.readings import FloatArray

HEADER = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]\n"
LIMIT = 1.5


def whole(*ticks: float) -> list[float]:
    """The times that come out, the last one flushed."""
    torn = SplitLineFilter(0, LIMIT)
    parts = [torn.feed(np.array([[tick]])) for tick in ticks]
    held = torn.flush()
    return [float(v) for part in [*parts, *([] if held is None else [held])] for v in part[:, 0]]


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
        (1, 2, 2, 3, 3, 4),  # a coarse clock
        (1, 2, 3, 50),  # the last sample of all
    ],
)
def test_an_honest_step_stays(ticks: tuple[float, ...]) -> None:
    """The sample after it goes on from it."""
    assert whole(*ticks) == list(ticks)


@settings(deadline=None)
@given(
    times=st.lists(st.integers(0, 60), min_size=1, max_size=30),
    cuts=st.lists(st.integers(0, 30), max_size=6),
)
def test_what_comes_out_does_not_depend_on_the_cuts(times: list[int], cuts: list[int]) -> None:
    """One row at a time, all at once, or anything between."""
    rows: FloatArray = np.array(times, float)[:, None]
    torn = SplitLineFilter(0, LIMIT)
    parts = [torn.feed(part) for part in np.split(rows, sorted(min(c, len(rows)) for c in cuts))]
    held = torn.flush()
    found = np.concatenate([*parts, *([] if held is None else [held])])
    assert found[:, 0].tolist() == whole(*times)


def test_bytes_lost_within_two_times_cost_these_samples_and_no_more() -> None:
    """``21`` and ``21.345`` do not make the 2121st second, nor a loss of 200,000 samples."""
    lines = [f"{20 + i / 100:.3f},0.1{i % 7},-0.2{i % 3},9.8{i % 5}\n" for i in range(400)]
    whole_stream = HEADER + "".join(lines)
    start = whole_stream.index("\n21.500,") + 3  # behind the "21" of this line
    lost = whole_stream[:start] + whole_stream[whole_stream.index("\n21.600,") + 1 :]
    intake = Intake()
    times = [r.accelerometer.time for r in (intake.feed(lost.encode(), 0.0), intake.flush()) if r]
    time = np.concatenate(times)
    assert time[-1] - time[0] == pytest.approx(3.99)
    assert (intake.lost, intake.malformed) == (11, 1)
