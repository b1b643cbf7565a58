"""A slow magnetometer whose readings a faster loop prints again and again."""

import numpy as np
import pytest

from imucal_wizard.core.readings import Series
from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
from imucal_wizard.measurement.repeats import without_repeats
from tests.estimate.field_truth import (
    NOISE,
    RATE,
    TEN_BITS,
    recorded,
    six_circles,
    true_parameters,
)


def _printed(series: Series, times: float, jitter: float, rng: np.random.Generator) -> Series:
    """The lines of a loop so many times as fast as the sensor."""
    lines = series.time[0] + (np.arange(int(len(series) * times)) + 0.5) / (RATE * times)
    late = series.time + jitter / RATE * rng.random(len(series))
    row = np.searchsorted(late, lines, side="right") - 1
    kept = row >= 0
    return Series(lines[kept], series.values[row[kept]], series.unit)


@pytest.mark.parametrize("times", [2.0, 2.5, 5.2, 41.0])
def test_each_reading_counts_once_however_often_it_was_printed(times: float) -> None:
    """The same readings in the same order, a line at most after they were measured."""
    rng = np.random.default_rng(0)
    series = recorded(six_circles(rng, 4.0), rng).series
    found = without_repeats(_printed(series, times, 0.0, rng))
    assert len(found) == pytest.approx(len(series), abs=3)
    first = int(np.argmax((series.values == found.values[0]).all(axis=1)))
    same = series.values[first : first + len(found)]
    assert np.mean((same == found.values[: len(same)]).all(axis=1)) > 0.99
    assert np.abs(found.time[: len(same)] - series.time[first : first + len(same)]).max() < 2 / RATE


def test_a_loop_that_jitters_is_seen_through() -> None:
    """A reading is late by up to a third of its own interval."""
    rng = np.random.default_rng(1)
    series = recorded(six_circles(rng, 4.0), rng).series
    found = without_repeats(_printed(series, 8.0, 0.33, rng))
    assert len(found) == pytest.approx(len(series), rel=0.02)


@pytest.mark.parametrize("step", [1.0, TEN_BITS, 10.0 * TEN_BITS])
def test_coarse_readings_that_happen_to_be_equal_are_all_kept(step: float) -> None:
    """Every sample was measured, and in a rest most are equal."""
    rng = np.random.default_rng(2)
    turning = six_circles(rng, 5.0)
    directions = np.concatenate([np.repeat(turning[:1], 400, axis=0), turning])
    series = recorded(directions, rng, step=step).series
    assert without_repeats(series) is series


def test_coarse_readings_printed_again_keep_as_many_as_were_measured() -> None:
    """A rest of equal ones counts as long as it was."""
    rng = np.random.default_rng(3)
    turning = six_circles(rng, 5.0)
    directions = np.concatenate([np.repeat(turning[:1], 200, axis=0), turning])
    series = recorded(directions, rng, noise=0.3 * NOISE, step=4.0).series
    found = without_repeats(_printed(series, 6.0, 0.0, rng))
    assert len(found) == pytest.approx(len(series), rel=0.02)
    rest = np.searchsorted(found.time, 200 / RATE)
    assert rest == pytest.approx(200, abs=4)


def test_repeats_make_no_errors_smaller_and_no_disturbances() -> None:
    """Ten fits of every reading five times over: parameters where their errors say."""
    off = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        once = recorded(six_circles(rng, 8.0), rng).series
        found = fit_magnetometer(without_repeats(_printed(once, 5.0, 0.0, rng)))
        assert found.left_out == ()
        true = true_parameters()
        off += [(p.value - true[p.name]) / (p.standard_error or 1.0) for p in found.fit.parameters]
    assert np.mean(np.abs(off) < 3.0) >= 0.98
    assert np.sqrt(np.mean(np.square(off))) < 1.25
