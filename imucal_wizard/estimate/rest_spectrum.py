"""The spectrum of a gyroscope at rest: its own noise apart from a hand's motion, and its filter.

A hand sways below 2 Hz and trembles somewhere between 4 and 12 Hz, each with far more power than
the noise of a gyroscope, which is white. So its noise is the power of the bands in which the device
moves least. A low-pass filter in the sensor lessens the noise above its corner: the fall of the
power from f/4 to f/2 shows it (f: sampling rate), and bands above the corner do not count. Nor do
they where the power is highest at the lowest frequencies and level there: a sway, which is slow,
falls from them on. A filter far below f/4, or the mean of many samples, shows itself in this way.

A hand that moves the device at all frequencies leaves no such band. The noise found is then an
upper limit, which the directions at rest (``noise.rest_of``) and the closures lower.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import FloatArray, IntArray, Readings
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.noise import pooled, rate_noise
from imucal_wizard.measurement.holds import Hold

HALF, QUARTER = (0.45, 0.5), (0.225, 0.275)
"""Bands below f/2 and around f/4, in units of f."""
BAND = 1.0
"""Width of the bands that are compared, Hz: what a hold of a second resolves."""
HIGHEST = 25.0
"""Hz, twice as fast as a hand trembles; a gyroscope is seldom filtered below."""
LOWEST_CORNER = 5.0
"""Hz, the lowest filter of usual gyroscopes; below it bands count in any case."""
HALF_POWER = 0.5
"""Share of the power that a filter passes at its corner."""
CORNERS = np.geomspace(0.08, 2.0, 60)
"""Corners of filters that are tried, in units of f."""
IMAGES = np.arange(-15, 16)
"""Multiples of f from which power is folded back."""
MIN_SPECTRUM_SAMPLES = 16
"""Of a hold or rotation, for a spectrum with something in each band."""
ENOUGH_AT_REST = 500_000
"""Samples at rest that give the spectrum of the noise to a per cent; later holds are not needed."""
LEAST_SLOPE = -0.5
"""Of the logarithm of the power over that of the frequency in the highest octave, from which on the
power is level there: that of a hand falls with the first power of the frequency at least."""
CLEAR = 3.0
"""Standard errors by which power exceeds the noise if it is more than noise."""


@dataclass(frozen=True, eq=False)
class RestSpectrum:
    """Power density on each axis, reading units² s or rad²/s, shape (3,) each.

    Attributes:
        quiet: where the device moves least, below the corner of a filter.
        half: around f/2.
        quarter: around f/4.
        count: independent values at f/2.
        level: the device moves least in the highest octave, and the power does not fall there: it
            is the noise of the sensor, and not of a hand.
    """

    quiet: FloatArray
    half: FloatArray
    quarter: FloatArray
    count: float = np.inf
    level: bool = False

    def of_rates(self, matrix: FloatArray) -> "RestSpectrum":
        """The spectrum of the corrected rates, rad²/s.

        Args:
            matrix: M, rad/s per reading.
        """
        gains = matrix**2
        quiet, half, quarter = (gains @ one for one in (self.quiet, self.half, self.quarter))
        return replace(self, quiet=quiet, half=half, quarter=quarter)

    @property
    def least(self) -> FloatArray:
        """In the band that has least: hardly any of it is a motion."""
        return np.asarray(np.minimum(np.minimum(self.quiet, self.half), self.quarter))

    def tremor(self, noise: float) -> float:
        """What a hand adds around f/2, mean of the axes; 0 where it is not clear.

        Args:
            noise: of the sensor at low frequencies, mean of the axes.
        """
        half = float(self.half.mean())
        return half - noise if self._exceeds(half, noise) else 0.0

    def corner(self, noise: float) -> float:
        """Corner of the sensor's filter in units of f; ∞ without one, and where a tremor hides it.

        Args:
            noise: see ``tremor``.
        """
        half, quarter = float(self.half.mean()), float(self.quarter.mean())
        return np.inf if self._exceeds(quarter, noise) else filter_corner(half, quarter, self.count)

    def _exceeds(self, power: float, noise: float) -> bool:
        """Whether power is clearly more than noise."""
        return power > noise * (1.0 + CLEAR / math.sqrt(max(self.count, 1.0)))


def with_quiet_noise(holds: Sequence[Hold], spectrum: RestSpectrum | None) -> list[Hold]:
    """The holds with the gyroscope's noise by its quietest frequencies, where these are known.

    Args:
        holds: still periods.
        spectrum: of the gyroscope's readings in them.
    """
    if spectrum is None:
        return list(holds)
    return [
        one
        if one.gyroscope is None
        else replace(one, gyroscope_quiet=spectrum.quiet / (one.end - one.start))
        for one in holds
    ]


def rest_spectrum(readings: Readings | None, holds: Sequence[Hold]) -> RestSpectrum | None:
    """The spectrum of the gyroscope's readings in holds; None where these do not show it.

    Args:
        readings: what the holds were found in, where it is at hand.
        holds: still periods.
    """
    series = None if readings is None else readings.gyroscope
    if series is None:
        return None
    levels, widths, ends, counts, seen = [], [], [], [], 0
    edges = BAND * np.arange(1.0, max(int(min(series.rate / 4.0, HIGHEST) / BAND), 2) + 1.0)
    for hold in holds:
        own = hold.readings(series)
        if seen > ENOUGH_AT_REST:
            break
        if len(own) < MIN_SPECTRUM_SAMPLES or not np.isfinite(own.values).all():
            continue
        seen += len(own)
        # Hann's window keeps a sway out of the bands far from it
        window = np.sin(np.pi * (np.arange(len(own)) + 0.5) / len(own)) ** 2
        values = window[:, None] * (own.values - own.values.mean(axis=0))
        density = np.abs(np.fft.rfft(values, axis=0)) ** 2 / float(window @ window) / own.rate
        share = np.fft.rfftfreq(len(own))
        inside = [density[(low <= share) & (share <= high)] for low, high in (HALF, QUARTER)]
        ends.append([one.sum(axis=0) for one in inside])
        counts.append([len(one) for one in inside])
        first = np.searchsorted(share * own.rate, edges)
        if (np.diff(first) > 0).all():
            sums = np.add.reduceat(density[: first[-1]], first[:-1])
            levels.append(sums / np.diff(first)[:, None])
            widths.append(np.diff(first))
    if not levels:
        return None
    many = np.maximum(np.sum(counts, axis=0), 1)
    half, quarter = np.sum(ends, axis=0) / many[:, None]
    # of three axes; Hann's window joins neighbouring values
    count = 1.5 * float(many[0])
    corner = filter_corner(float(half.mean()), float(quarter.mean()), count) * series.rate
    known = edges[1:] <= max(corner, LOWEST_CORNER)
    freedom = _band_freedom(np.array(widths)[:, known])
    quiet, level = _quietest(np.array(levels)[:, known], freedom, rate_noise(holds))
    # what falls like the noise of a filter may be a hand's motion as well
    return RestSpectrum(quiet, half, quarter, count, level and not np.isfinite(corner))


def _band_freedom(lines: IntArray) -> FloatArray:
    """Degrees of freedom of the mean of some lines of a spectrum under Hann's window.

    Lines next to one another have a correlation of 4/9, the ones after those of 1/36.
    """
    pairs = 8.0 / 9.0 * (lines - 1) + np.maximum(lines - 2, 0) / 18.0
    return np.asarray(2.0 * lines**2 / (lines + pairs))


def _quietest(
    levels: FloatArray, freedom: FloatArray, lowest: FloatArray | None
) -> tuple[FloatArray, bool]:
    """Power in the bands of least motion, shape (3,), and whether the highest octave is level.

    Args:
        levels: in each hold and band, shape (h, bands, 3).
        freedom: degrees of freedom of each axis, shape (h, bands).
        lowest: below these bands, by the means of the holds, shape (3,), where it is known.
    """
    # the median over the holds leaves out those that something moved
    bands = np.moveaxis(levels, 1, 0)
    usual = np.array(
        [[pooled(axis, own) for axis in band.T] for band, own in zip(bands, freedom.T, strict=True)]
    )
    whole = usual.sum(axis=1)
    # the variance of a median is π/2 times that of a mean
    doubt = np.sqrt(0.5 * np.pi * 2.0 / (3.0 * freedom.sum(axis=0).min()))
    quiet = whole <= whole.min() * (1.0 + CLEAR * doubt)
    frequency = np.arange(len(whole)) + 1.5  # each is as wide as the first begins above zero
    octave = frequency >= 0.5 * frequency[-1]
    level = bool(quiet[octave].mean() > 0.5 and whole.min() > 0.0)  # steps may hide all noise
    first = int(np.argmax(octave & quiet))
    if level and first < len(whole) - 1:  # above what a tremor reaches
        slope = np.polyfit(np.log(frequency[first:]), np.log(whole[first:]), 1)[0]
        level = bool(slope >= LEAST_SLOPE)
    most = 0.0 if lowest is None else float(lowest.sum())
    # no sway, and no tremor where no band shows more than the lowest: a filter makes the fall
    if whole[0] >= HALF_POWER * most and (whole <= most * (1.0 + CLEAR * doubt)).all():
        quiet = whole >= HALF_POWER * most
    return np.asarray(usual[quiet].mean(axis=0)), level


def filter_corner(half: float, quarter: float, count: float) -> float:
    """Corner of the filter by which noise falls as it does, in units of f; ∞ if it hardly falls.

    Args:
        half: power of the noise around f/2.
        quarter: around f/4.
        count: independent values of the first.
    """
    if half >= quarter * (1.0 - CLEAR / np.sqrt(max(count, 1.0))):
        return np.inf
    falls = np.array(
        [
            passed(np.abs(0.475 + IMAGES), one).sum() / passed(np.abs(0.25 + IMAGES), one).sum()
            for one in CORNERS
        ]
    )
    return float(np.interp(half / quarter, falls, CORNERS))


def passed(frequency: FloatArray, corner: float) -> FloatArray:
    """Share of the power that a usual digital output filter passes."""
    return np.asarray(1.0 / (1.0 + (frequency / corner) ** 4))
