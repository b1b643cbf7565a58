"""The mean force in a hold in the hand, by the attitude that the gyroscope follows in it.

The mean of a direction that sways is shorter than the direction by half the variance of the sway:
0.1 mg at 0.8°. All holds in a hand are shorter alike, so no repetition shows it, and the fit takes
it for the scale. Where the device turns about a point beside the sensor, the force towards that
point adds to the bias. Neither is left if each sample is turned into the mean attitude of the hold
before the mean is taken: then the mean of gravity is gravity, and the mean of the acceleration is
the change of the velocity over the duration. From that attitude a rotation begins, and at that of
the next hold it ends; the order of the turns up to there counts, too.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median_of_rows
from imucal_wizard.measurement.holds import Hold

ANOTHER_FIT = 0.1
"""Change of a mean over its noise, below which it is not worth another fit."""
AVERAGED = 0.2
"""Seconds of averages that leave a sway and little of a tremor."""
MIN_AVERAGES = 4
"""Of a hold that shows a sway."""
LONGEST_IN_HAND = 60.0
"""Seconds of a hold beyond which the device lies on something."""
BEYOND_NOISE = 4.0
"""Variance of the angle, without a parabola, over that by white noise of the gyroscope, up to which
the device rests: the noise is known to a factor of two, and the bias wanders as well."""
LARGEST = 0.1
"""Root mean square of a sway, rad, from which on the gyroscope does not have the unit it is said to
have: a device that sways so is not held still."""


@dataclass(frozen=True, eq=False)
class _Sway:
    """How a hold sways.

    Attributes:
        force: readings of the accelerometer, shape (n, 3).
        place: place of each in the hold, s, 0 on average, shape (n,).
        angle: integral of the rate less its mean, less its own mean, rad, shape (n, 3).
        noise: variance of the angle by the gyroscope's noise, shape (3,).
    """

    force: FloatArray
    place: FloatArray
    angle: FloatArray
    noise: FloatArray

    def trends(self, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Even change of the force beside that by the angle, and what a rate makes, per second.

        Args:
            rate: rad/s, shape (3,).
        """
        mean, share = self.force.mean(axis=0), self.place / (self.place @ self.place)
        # a body that turns by φ sees up move by up × φ
        return share @ self.force - np.cross(mean, share @ self.angle), np.cross(mean, rate)

    def change(self, rate: FloatArray) -> FloatArray:
        """Of the mean force once each sample is turned into the mean attitude, shape (3,).

        To second order in the angle θ to that attitude, the mean is that of
        f + θ × f + ½ θ × (θ × f).

        Args:
            rate: mean rate in the hold, rad/s, shape (3,).
        """
        angle, mean = self._whole(rate), self.force.mean(axis=0)
        squares = angle.T @ angle / len(angle) - np.diag(self.noise)
        first = np.cross(angle, self.force).mean(axis=0)
        return np.asarray(first + 0.5 * (squares @ mean - np.trace(squares) * mean))

    def order(self, rate: FloatArray) -> FloatArray:
        """Turn from the beginning to the mean attitude beyond the angle, and from that to the end.

        To second order, the attitude since the beginning is φ = θ + ½ ∫ θ × dθ, and the turn from
        its mean to its end is φ − φ̄ − ½ φ̄ × φ.

        Args:
            rate: mean rate in the hold, rad/s, shape (3,).

        Returns:
            Rotation vectors, rad, shape (2, 3).
        """
        angle = self._whole(rate)
        angle = angle - angle[0]
        added = 0.5 * np.cross(angle[:-1], np.diff(angle, axis=0)).cumsum(axis=0)
        begun = added.sum(axis=0) / len(angle)
        return np.array([begun, added[-1] - begun - 0.5 * np.cross(angle.mean(axis=0), angle[-1])])

    def _whole(self, rate: FloatArray) -> FloatArray:
        """The angle to the mean attitude with that of a mean rate, rad, shape (n, 3)."""
        return self.angle + self.place[:, None] * rate


def without_sway(
    holds: Sequence[Hold], readings: Readings | None, size: float, noise: FloatArray | None
) -> list[Hold]:
    """The holds with the mean of the force in their mean attitude.

    Args:
        holds: still periods.
        readings: what they were found in, where it is at hand.
        size: rad/s in one unit of the gyroscope's readings.
        noise: power density of the gyroscope's noise on each axis, reading units² s, shape (3,),
            where it is known.
    """
    if readings is None:
        return list(holds)
    if readings.gyroscope is None:
        return [_by_direction(hold, readings.accelerometer) for hold in holds]
    density = np.zeros(3) if noise is None else size**2 * noise
    known = {
        k: sway
        for k, hold in enumerate(holds)
        if (sway := _sway_of(hold, readings.accelerometer, readings.gyroscope, size, density))
    }
    if not known:
        return list(holds)
    # a mean rate is that of a turn, which the direction of gravity shows, or a change of the bias
    rates = size * np.array([holds[k].gyroscope for k in known])
    rates -= median_of_rows(rates)
    both = [sway.trends(rate) for sway, rate in zip(known.values(), rates, strict=True)]
    seen, made = (np.array(one) for one in zip(*both, strict=True))
    turned = float((seen * made).sum()) / max(float((made**2).sum()), 1e-300)
    rates *= np.sqrt(min(max(turned, 0.0), 1.0))
    found = list(holds)
    for (k, sway), rate in zip(known.items(), rates, strict=True):
        found[k] = replace(
            holds[k],
            accelerometer=holds[k].accelerometer + sway.change(rate),
            gyroscope_order=sway.order(rate) / size,
        )
    return found


def _by_direction(hold: Hold, accelerometer: Series) -> Hold:
    """A hold with the length of the force without the sway that the force itself shows.

    Slower than about 2 Hz, what the force changes by across its mean is mostly how gravity turns in
    the device; the acceleration of a hand is faster, and averages over a fifth of a second leave
    little of it.
    """
    force = hold.readings(accelerometer).values
    size = max(round(AVERAGED * accelerometer.rate), 1)
    count = len(force) // size
    if count < MIN_AVERAGES or hold.end - hold.start > LONGEST_IN_HAND:
        return hold
    pieces = force[: count * size].reshape(count, size, 3)
    mean, averages = force.mean(axis=0), pieces.mean(axis=1)
    up = mean / np.linalg.norm(mean)

    def across(values: FloatArray) -> float:
        return float((values**2).sum() - ((values @ up) ** 2).sum())

    slow = across(averages - mean) / count
    noise = across((pieces - averages[:, None]).reshape(-1, 3)) / (count * max(size - 1, 1)) / size
    swayed = max(slow - noise, 0.0)
    return replace(
        hold, accelerometer=hold.accelerometer + 0.5 * swayed / np.linalg.norm(mean) * up
    )


def _sway_of(
    hold: Hold, accelerometer: Series, gyroscope: Series, size: float, density: FloatArray
) -> _Sway | None:
    """How a hold sways; None where the gyroscope does not show it."""
    if hold.gyroscope is None or hold.end - hold.start > LONGEST_IN_HAND:
        return None
    force, turned = hold.readings(accelerometer), hold.readings(gyroscope)
    if min(len(force), len(turned)) < 2:
        return None
    steps = np.diff(turned.time)[:, None]
    rate = size * (turned.values - turned.values.mean(axis=0))
    ends = np.cumsum(0.5 * steps * (rate[1:] + rate[:-1]), axis=0)
    angle = np.vstack([np.zeros(3), ends])
    if len(turned) != len(force) or not np.array_equal(turned.time, force.time):
        angle = np.column_stack([np.interp(force.time, turned.time, axis) for axis in angle.T])
    angle -= angle.mean(axis=0)
    # the integral of white noise less its mean rate and less its own mean
    noise = density * (hold.end - hold.start) / 12.0
    place = force.time - force.time.mean()
    # a bias that drifts evenly makes a parabola
    bow = place**2 - (place @ place) / len(place)
    swayed = angle - np.outer(bow, bow @ angle / max(float(bow @ bow), 1e-300))
    least, most = (float((one**2).mean(axis=0).sum()) for one in (swayed, angle))
    if not (least > BEYOND_NOISE * noise.sum() and most < LARGEST**2):  # or not all are numbers
        return None
    return _Sway(force.values, place, angle, noise)


def sways(holds: Sequence[Hold], without: Sequence[Hold]) -> bool:
    """Whether what the sway of some holds changes is worth another fit.

    Args:
        holds: still periods.
        without: the same without their sway.
    """
    return any(
        bool((change**2 > ANOTHER_FIT**2 * np.diag(one.accelerometer_covariance)).any())
        for one, other in zip(holds, without, strict=True)
        if (change := other.accelerometer - one.accelerometer).any()
    )
