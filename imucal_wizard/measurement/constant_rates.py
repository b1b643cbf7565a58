"""Stretches of constant rate of a gyroscope on a rate table, rests included.

Only the gyroscope is used. A window of half a second is steady if no axis scatters by more than a
table's ripple. Each steady stretch is then bounded by its own noise, as a rest is (``rests``), so
that it does not contain the ramps of the table.
"""

import numpy as np

from imucal_wizard.core.limits.stillness import (
    MIN_HOLD_SECONDS,
    TIME_TOLERANCE,
    WINDOW_BLOCKS,
)
from imucal_wizard.core.readings import BoolArray, FloatArray, Readings, Series
from imucal_wizard.core.statistics import median, median_of_rows, true_on_all_axes
from imucal_wizard.measurement.blocks import BlockCutter, Blocks
from imucal_wizard.measurement.holds import (
    Hold,
    Rests,
    blocks_of_rests,
    fewest_windows,
    hold_from,
    still_runs,
    trim_ends,
)
from imucal_wizard.measurement.rounding import resolution_of, rounding_noise
from imucal_wizard.measurement.stillness import WindowMaker, Windows

MAX_RIPPLE = 0.005
"""Standard deviation of half a second at constant rate, as a share of the largest rate:
record players flutter by 0.2 %, rate tables by less."""
STEADY_FACTOR = 4.0
"""The same over the noise of the quietest windows; the larger of both limits counts."""
MAX_RAMP = 0.004
"""Largest change within a second at constant rate, as a share of the largest rate ..."""
NOISE_OF_RAMP = 1.0
"""... and over the noise of single samples; a mean of half a second has a fifth of it."""
QUIETEST = 20
"""Windows whose median noise is that of the sensor (two seconds)."""
MAX_DRIFT = 0.002
"""Largest change between the halves of a steady stretch at constant rate, as a share of the largest
rate ..."""
MIN_DRIFT_SIGMA = 6.0
"""... and in standard errors."""


def constant_rates(series: Series) -> list[Hold]:
    """The steady stretches of a gyroscope, in the order of time.

    Args:
        series: its readings.

    Returns:
        Holds with the gyroscope's mean, covariance and scatter in the fields of both sensors.
    """
    if series.rate <= 0.0:
        return []
    blocks = BlockCutter(series.rate).feed(Readings(series))
    windows = WindowMaker().feed(blocks)
    if not windows.full.any():
        return []
    step = resolution_of(series.values)
    shown = windows.std_a[windows.full]
    quiet = shown[np.argsort((shown**2).sum(axis=1))[:QUIETEST]]
    noise = np.maximum(median_of_rows(quiet), rounding_noise(step))
    # a hand that mounts the device turns it faster than the table does
    fastest, found = float(np.ptp(blocks.mean_a, axis=0).max()) / 2.0, list[Hold]()
    for _ in range(2):
        found = _steady(blocks, windows, step, noise, fastest)
        if len(found) < 2:
            break
        means = np.array([one.accelerometer for one in found])
        fastest = float(np.ptp(means, axis=0).max()) / 2.0
    return found


def _steady(
    blocks: Blocks, windows: Windows, step: FloatArray, noise: FloatArray, fastest: float
) -> list[Hold]:
    """The steady stretches on a table of this largest rate.

    Args:
        blocks: of the gyroscope.
        windows: one per block.
        step: resolution of each axis, shape (3,).
        noise: standard deviation of single samples, shape (3,).
        fastest: reading units.
    """
    limit = np.maximum(STEADY_FACTOR * np.maximum(noise, noise.max() / 3.0), MAX_RIPPLE * fastest)
    still: BoolArray = windows.full & true_on_all_axes(windows.std_a <= limit)
    still &= ~_ramps(blocks, np.maximum(MAX_RAMP * fastest, NOISE_OF_RAMP * noise))
    rests, seconds = Rests(windows, step, None), median(blocks.end - blocks.start)
    found = {
        (max(begin, first), min(end, past))
        for first, past in still_runs(still)
        for begin, end in rests.within(first, past, fewest_windows(seconds))
    }
    pieces = (blocks.select(slice(*rest)) for rest in blocks_of_rests(sorted(found)))
    holds = [_constant(trim_ends(piece, step), fastest) for piece in pieces]
    return [hold for hold in holds if hold is not None]


def _ramps(blocks: Blocks, limit: FloatArray) -> BoolArray:
    """Which blocks differ from those a second before and after by more than a limit.

    The scatter within half a second does not show such a slow change.
    """
    lag = max(round(1.0 / median(blocks.end - blocks.start)), 1)
    found = np.zeros(len(blocks), bool)
    if len(blocks) <= 2 * lag:
        return found
    means = np.array(
        [
            np.convolve(one, np.ones(WINDOW_BLOCKS) / WINDOW_BLOCKS, "same")
            for one in blocks.mean_a.T
        ]
    ).T
    moved = np.abs(means[lag:] - means[:-lag]) > limit
    found[lag:-lag] = (moved[:-lag] & moved[lag:]).any(axis=1)
    return found


def _constant(blocks: Blocks, fastest: float) -> Hold | None:
    """The mean of a stretch; None if it is too short or its rate is not constant."""
    if blocks.end[-1] - blocks.start[0] < MIN_HOLD_SECONDS - TIME_TOLERANCE:
        return None
    half = len(blocks) // 2
    early, late = blocks.mean_a[:half], blocks.mean_a[half:]
    change = late.mean(axis=0) - early.mean(axis=0)
    error = np.sqrt(sum(_variance_of_mean(part) for part in (early, late)))
    moved = (np.abs(change) > MIN_DRIFT_SIGMA * error) & (np.abs(change) > MAX_DRIFT * fastest)
    if moved.any():
        return None
    hold = hold_from(blocks)
    return Hold(
        start=hold.start,
        end=hold.end,
        accelerometer=hold.accelerometer,
        accelerometer_covariance=hold.accelerometer_covariance,
        gyroscope=hold.accelerometer,
        gyroscope_covariance=hold.accelerometer_covariance,
        samples=hold.samples,
        accelerometer_scatter=hold.accelerometer_scatter,
        gyroscope_scatter=hold.accelerometer_scatter,
        noise_freedom=hold.noise_freedom,
    )


def _variance_of_mean(means: FloatArray) -> FloatArray:
    return np.asarray(means.var(axis=0) / max(len(means) - 1, 1))
