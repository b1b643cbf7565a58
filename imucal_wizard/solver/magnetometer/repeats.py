"""A slow magnetometer in the lines of a faster sensor, where each of its readings stands often.

A sketch that prints all sensors in one loop repeats the last field until the next is measured.
Counted as samples, the repeats make noise look smaller than it is and the steps between them look
like disturbances. Coarse readings repeat too, but then runs of one alone are common; where a faster
stream repeats them, a run is hardly ever shorter than the time between two measurements.
"""

import numpy as np

from imucal_wizard.readings import Series

FEWEST = 50
"""Runs from which on their lengths say anything."""
SHORT = 0.05
"""Share of runs of one that a loop's jitter makes."""
LOWEST = 0.1
"""Quantile of the runs that are one measurement: longer ones may be several equal ones ..."""
ONE = 1.6
"""... where they are so many times as long."""


def measured(series: Series) -> Series:
    """The readings as they were measured, each once; the series itself where none is repeated."""
    changed = (np.diff(series.values, axis=0) != 0.0).any(axis=1)
    starts = np.concatenate([[0], np.flatnonzero(changed) + 1])
    lengths = np.diff(np.append(starts, len(series)))
    whole = lengths[1:-1]
    if len(whole) < FEWEST or np.mean(whole == 1) > SHORT:
        return series
    shortest = float(np.quantile(whole, LOWEST))
    period = float(whole[whole <= ONE * shortest].mean())
    if period < 1.5:
        return series
    # equal readings that follow one another stay as many as were measured
    counts = np.maximum(np.round(lengths / period).astype(np.int64), 1)
    first = np.repeat(starts, counts)
    place = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    rows = first + (place * np.repeat(lengths / counts, counts)).astype(np.int64)
    return Series(series.time[rows], series.values[rows], series.unit)


def repeats_note(series: Series, once: Series) -> tuple[str, ...]:
    """What the user should know of readings that were repeated; nothing where none was."""
    if len(once) == len(series):
        return ()
    says = (
        f"each reading of the magnetometer stands {len(series) / len(once):.2g} times in the "
        "recording: it is slower than the lines, and each counts once"
    )
    return (says,)
