"""Readings that a stream repeats because the sensor is slower than the lines.

A sketch that prints all sensors in one loop repeats the last reading until the next measurement.
Counted as samples, the repeats make the noise look too small, the steps between them look like
disturbances, and the repeats themselves like the end of the range.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray, IntArray, Series
from imucal_wizard.core.statistics import sample_quantile, true_on_all_axes

MIN_RUNS = 50
"""Runs needed to judge their lengths."""
MAX_SINGLE_RUN_SHARE = 0.05
"""Share of runs of length one that the jitter of a loop produces."""
SHORTEST_RUN_QUANTILE = 0.1
"""Quantile of the run lengths that corresponds to one measurement ..."""
MAX_SINGLE_RUN_RATIO = 1.6
"""... and the ratio to it above which a run contains several equal measurements."""


def without_repeats(series: Series) -> Series:
    """The readings without repeats; the series itself if none is repeated."""
    rows = measured_rows(series.values)
    return series if rows is None else Series(series.time[rows], series.values[rows], series.unit)


def measured_rows(*values: FloatArray) -> IntArray | None:
    """Which readings to keep so that each measurement counts once; None if none is repeated.

    Args:
        values: readings of each of the sensors that are measured together, shape (n, 3).
    """
    starts = run_starts(*values)
    lengths = np.diff(np.append(starts, len(values[0])))
    period = repeat_period(lengths[1:-1])
    if period is None:
        return None
    # consecutive equal measurements keep their number
    counts = np.maximum(np.round(lengths / period).astype(np.int64), 1)
    first = np.repeat(starts, counts)
    place = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.asarray(first + (place * np.repeat(lengths / counts, counts)).astype(np.int64))


def run_starts(*values: FloatArray) -> IntArray:
    """Where runs of equal readings begin; the arguments are those of ``measured_rows``."""
    equal = [true_on_all_axes(one[1:] == one[:-1]) for one in values]
    return np.concatenate([[0], np.flatnonzero(~np.logical_and.reduce(equal)) + 1])


def repeat_period(lengths: IntArray, *, at_rest: bool = False) -> float | None:
    """Samples from one measurement to the next; None if none is repeated.

    Coarse readings repeat as well, but with many runs of length one; if a faster stream repeats a
    reading, a run is hardly ever shorter than the time between two measurements.

    Args:
        lengths: of whole runs of equal readings, shape (n,).
        at_rest: the device may rest all the time. Coarse readings then have runs of all lengths
            without short ones; nearly all runs must be of one measurement.
    """
    if len(lengths) < MIN_RUNS or np.mean(lengths == 1) > MAX_SINGLE_RUN_SHARE:
        return None
    shortest = sample_quantile(lengths, SHORTEST_RUN_QUANTILE)
    single = lengths <= MAX_SINGLE_RUN_RATIO * shortest
    if at_rest and single.mean() < 1.0 - MAX_SINGLE_RUN_SHARE:
        return None
    period = float(lengths[single].mean())
    return None if period < 1.5 else period


def repeats_note(sensor: str, times: float) -> tuple[str, ...]:
    """A message about repeated readings; empty if there are none.

    Args:
        sensor: its name.
        times: how often each reading is repeated.
    """
    if times == 1.0:
        return ()
    message = (
        f"each reading of the {sensor} is repeated {times:.3g} times, because the sensor is "
        "slower than the lines; each counts once"
    )
    return (message,)
