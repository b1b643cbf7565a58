"""Two sensors whose clocks run at different rates, by the motions that both of them feel.

Each file has the times of its own clock. Where one clock is faster than the other, the motions that
both sensors show are farther apart at the end of the session than at its beginning, and an angle
summed up from the rates is wrong by the same share.
"""

import numpy as np

from imucal_wizard.core.notices import Notice, NoticeKind
from imucal_wizard.core.quantities import number
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.statistics import median, root_mean_square

STEP_SECONDS = 0.05
"""Within which a motion begins."""
WINDOW_SECONDS = 15.0
"""Of the session in which both sensors are compared: some motions are in each."""
MAX_LAG_SECONDS = 6.0
"""That one sensor's motions may lie behind the other's."""
MIN_CORRELATION = 0.5
"""Of the motions of both in a window, below which their lag is chance."""
MIN_WINDOWS = 5
"""Lags that a straight line is laid through."""
MAX_LAG_ERROR_SECONDS = 1.0
"""Distance of a lag from the straight line beyond which other motions were taken for the same."""
MAX_UNEVEN_DRIFT = 0.1
"""Rms of the distances, over the whole drift: a straight line through one jump leaves more."""
MIN_DRIFT_SECONDS = 0.25
"""By which the motions move apart during the session: several steps."""


def clock_drift(readings: Readings) -> list[Notice]:
    """A warning if the gyroscope's clock runs at another rate than the accelerometer's."""
    own, gyroscope = readings.accelerometer, readings.gyroscope
    if gyroscope is None or gyroscope.time is own.time:
        return []
    moments, lags = _lags(own, gyroscope)
    if len(lags) < MIN_WINDOWS:
        return []
    first, second = np.triu_indices(len(lags), 1)
    slope = median((lags[second] - lags[first]) / (moments[second] - moments[first]))
    left = lags - slope * moments
    left -= median(left)
    near = np.abs(left) <= MAX_LAG_ERROR_SECONDS
    apart = abs(slope) * float(own.time[-1] - own.time[0])
    uneven = root_mean_square(left[near]) > MAX_UNEVEN_DRIFT * apart
    if near.sum() < max(MIN_WINDOWS, len(lags) / 2.0) or apart < MIN_DRIFT_SECONDS or uneven:
        return []
    share, way = number(100.0 * abs(slope), 2), "slow" if slope < 0.0 else "fast"
    text = (
        f"the gyroscope's clock is {share} % {way} against the accelerometer's: the motions that "
        f"both feel move {apart:.1f} s apart during the session. The gyroscope's scale is right by "
        "its own clock only; correct the times of one of the files"
    )
    return [Notice(text, NoticeKind.CLOCKS, "gyroscope")]


def _lags(accelerometer: Series, gyroscope: Series) -> tuple[FloatArray, FloatArray]:
    """Middles of windows, s, and by how much the gyroscope's motions come later there, s."""
    first = max(accelerometer.time[0], gyroscope.time[0])
    last = min(accelerometer.time[-1], gyroscope.time[-1])
    if not first < last:
        return np.zeros(0), np.zeros(0)
    edges = np.arange(first, last, STEP_SECONDS)
    size, most = round(WINDOW_SECONDS / STEP_SECONDS), round(MAX_LAG_SECONDS / STEP_SECONDS)
    if len(edges) < MIN_WINDOWS * size:
        return np.zeros(0), np.zeros(0)
    force, rate = (_means(one, edges) for one in (accelerometer, gyroscope))
    turned = np.linalg.norm(np.gradient(force, axis=0), axis=1)
    usual = np.array([median(axis) for axis in rate.T])
    felt, seen = (_moving(one) for one in (turned, np.linalg.norm(rate - usual, axis=1)))
    moments, lags = [], []
    for start in range(most, len(felt) - size - most, size):
        own = felt[start : start + size] - felt[start : start + size].mean()
        around = seen[start - most : start + size + most]
        each = np.lib.stride_tricks.sliding_window_view(around, size)
        each = each - each.mean(axis=1)[:, None]
        lengths = np.linalg.norm(each, axis=1) * np.linalg.norm(own)
        alike = each @ own / np.maximum(lengths, np.finfo(float).tiny)
        best = int(alike.argmax())
        if alike[best] > MIN_CORRELATION:
            moments.append(float(edges[start + size // 2]))
            lags.append((best - most) * STEP_SECONDS)
    return np.array(moments), np.array(lags)


def _means(series: Series, edges: FloatArray) -> FloatArray:
    """Means of the readings from each edge to the next; the nearest reading where there is none."""
    finite = np.isfinite(series.values).all(axis=1)
    places = np.searchsorted(series.time[finite], edges)
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(series.values[finite], axis=0)])
    high = np.minimum(np.maximum(places[1:], places[:-1] + 1), len(sums) - 1)
    low = np.minimum(places[:-1], high - 1)
    return np.asarray((sums[high] - sums[low]) / (high - low)[:, None])


def _moving(size: FloatArray) -> FloatArray:
    """How much the device moves, in which a fast motion does not outweigh the others."""
    usual = median(size)
    return np.asarray(np.log1p(size / usual) if usual > 0.0 else (size > 0.0).astype(float))
