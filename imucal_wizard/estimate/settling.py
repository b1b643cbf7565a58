"""What of the accelerometer's settling its holds still contain, as all of them together show it.

Each hold takes off the settling that it shows alone (``measurement.holds.settled``). Settling that
is small, or slower than a hold is long, is not seen in one of them, but many holds that settle
alike show it together, and what it leaves in their means is common to them: more holds do not make
it smaller. So the pieces of all holds are fitted by one exponential. What it leaves is taken off
the means, and the doubt about it counts among the errors of the parameters.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.limits.stillness import TAIL_DOUBT
from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import complement
from imucal_wizard.estimate.distributions import exceeded
from imucal_wizard.estimate.split import principal_steps
from imucal_wizard.measurement.holds import Hold

TIMES = np.geomspace(0.1, 30.0, 49)
"""Time constants that are tried, s: neighbours differ by less than settling fits can tell."""
MIN_COURSES = 11
"""Holds from which on a common course in them is looked for: with nine parameters of a calibration,
fewer hardly tell it from a drift."""
MIN_COURSES_FOR_SCALES = 14
"""The same in proportion to the force, too, whose three sizes need as many holds more."""
CHANCE = 1e-4
"""Probability by chance of a common course with one time constant, above which there is none; of
the best of all, noise exceeds it several times as often."""
MIN_SIGMAS = 3.0
"""Standard errors of the amplitude on an axis, above which that axis settles with the others."""
LONGEST = 0.1
"""Likelihood of the longest time constant over that of the best one, from which on no end of the
settling is known."""
EXACT = 1e-12
"""Of the squares of courses, what rounding leaves of those without noise."""
MIN_DRIFT = 0.3
"""Share of the drift between holds that the course in them would make if it never ended, above
which a drift of the session is what they show."""


@dataclass(frozen=True, eq=False)
class CommonSettling:
    """The settling that holds have in common.

    Attributes:
        seconds: its time constant, s: the middle one of all that agree with the holds; infinite
            where one longer than all that are tried may agree with them, too.
        left: what it leaves in the mean reading of each hold, shape (n, 3).
        alike: the part of that which any hold of the session has, on each axis and for each unit of
            its direction up there, shape (2, 3).
        errors: the doubt about the force along gravity in each hold, m/s², by independent steps of
            one standard deviation, shape (n, k).
    """

    seconds: float
    left: FloatArray
    alike: FloatArray
    errors: FloatArray

    def in_holds(self, up: FloatArray) -> FloatArray:
        """What it leaves in the mean readings of other holds with these directions, (m, 3)."""
        constant, in_proportion = self.alike
        return np.asarray(constant + in_proportion * up)


def common_settling(
    holds: Sequence[Hold], up: FloatArray, gain: float, error: FloatArray
) -> CommonSettling | None:
    """What settling leaves in the means of holds; None where they do not show any.

    Only the length of the force is judged: a device that still tilts is no sensor that settles. The
    time constant is the same in all holds. So is the amplitude on each axis, or it grows in
    proportion to the force there; beyond that it differs by chance.

    Args:
        holds: n of them.
        up: the direction of the force in each, unit vectors, shape (n, 3).
        gain: m/s² in one unit of the readings.
        error: of the length of the force in each hold by a first fit, m/s², shape (n,).
    """
    courses = {i: one.course for i, one in enumerate(holds) if one.course is not None}
    known = [i for i, course in courses.items() if len(course) > 2]
    if len(known) < MIN_COURSES:
        return None
    every = [_course_of(holds[i].accelerometer, courses[i], gain * up[i]) for i in known]
    sizes, left = np.array([one.size for one in every]), np.array([one.left for one in every])
    slopes = np.array([one.slope for one in every])
    columns = up if len(known) < MIN_COURSES_FOR_SCALES else np.hstack([up, up**2])
    alike = _alike(columns[known], sizes)
    if not alike.any() or _is_drift(holds, up, slopes, known, error):
        return None
    # all time constants as likely beforehand; what an exponential of any amplitude leaves of the
    # course in each hold tells them apart
    squares = sum(one.squares for one in every)
    misfit = np.maximum(squares - (sizes**2).sum(axis=0), EXACT * squares)
    pieces = sum(len(courses[i]) - 2 for i in known)
    likely = np.exp(-0.5 * pieces * (misfit / misfit.min() - 1.0))
    likely /= likely.sum()
    columns = columns[:, alike]
    found, variance, inverse = _nearest(columns[known], left)
    mean = found @ likely
    apart = found - mean[:, None]
    covariance = float(likely @ variance) * inverse + (apart * likely) @ apart.T
    # holds differ in what they still contain, by more than the noise of finding it
    own = (left - columns[known] @ found) @ likely
    by_size = np.mean([(one.lever @ likely) ** 2 for one in every])
    noise = float(misfit.min() / pieces * by_size)
    own *= max(1.0 - noise / max(float(likely @ variance), 1e-300), 0.0)
    # as much of it is taken off as is sure
    sure = float(mean @ mean / (mean @ mean + np.trace(covariance)))
    mean, rest = sure * mean, (1.0 - sure) * mean
    covariance += np.outer(rest, rest) + TAIL_DOUBT**2 * np.outer(mean, mean)
    of_axes = np.zeros(6)
    of_axes[: len(alike)][alike] = mean
    in_each = of_axes[:3] + of_axes[3:] * up
    in_each[known] += sure * own[:, None] * up[known]
    known_seconds = float(TIMES[np.searchsorted(np.cumsum(likely), 0.5)])
    return CommonSettling(
        seconds=known_seconds if likely[-1] < LONGEST * likely.max() else np.inf,
        left=in_each / gain,
        alike=of_axes.reshape(2, 3) / gain,
        errors=columns @ principal_steps(covariance),
    )


def _alike(columns: FloatArray, sizes: FloatArray) -> BoolArray:
    """Which of the columns settle alike in all holds, by the time constant that explains most.

    Args:
        columns: shape (n, p).
        sizes: amplitudes in the holds with each time constant, shape (n, t).
    """
    count, freedom = columns.shape[1], len(columns) - columns.shape[1]
    found, variance, inverse = _nearest(columns, sizes)
    explained = (sizes**2).sum(axis=0) / np.maximum(variance, 1e-300) - freedom
    best = int(explained.argmax())
    if exceeded(float(explained[best]) / count, count, freedom) > CHANCE:
        return np.zeros(count, bool)
    seen = found[:, best] ** 2 > MIN_SIGMAS**2 * variance[best] * np.diag(inverse)
    return np.asarray(seen if seen.any() else np.ones(count, bool))


def _nearest(columns: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The combinations of columns next to values, which scatter alike.

    Args:
        columns: shape (n, p).
        values: shape (n, t).

    Returns:
        The combinations, shape (p, t), the variance of the values about each, shape (t,), and the
        covariance of the combinations for a variance of one, shape (p, p).
    """
    inverse = np.linalg.pinv(columns.T @ columns)
    found = inverse @ columns.T @ values
    freedom = len(columns) - columns.shape[1]
    variance = np.asarray(((values - columns @ found) ** 2).sum(axis=0) / freedom, np.float64)
    return found, variance, np.asarray(inverse, np.float64)


@dataclass(frozen=True, eq=False)
class _Course:
    """The force of one hold along its direction, by an exponential of each of t time constants.

    Attributes:
        size: its amplitude, in units in which white noise is alike in all holds, shape (t,).
        left: what it leaves in the mean of the hold, m/s², shape (t,).
        lever: by how much an error of the amplitude moves that, shape (t,).
        slope: of a straight line, m/s³.
        squares: about the mean, in the unit of the amplitude squared.
    """

    size: FloatArray
    left: FloatArray
    lever: FloatArray
    slope: float
    squares: float


def _course_of(reading: FloatArray, course: FloatArray, along: FloatArray) -> _Course:
    """The course of a hold along a direction.

    Args:
        reading: mean of the hold, shape (3,).
        course: see ``Hold``.
        along: the direction times the gain, shape (3,).
    """
    seconds, read = course[:, 0], course[:, 1:] @ along
    share, ends = seconds / seconds.sum(), np.cumsum(seconds)
    each, middle = TIMES[:, None], ends - 0.5 * seconds
    # the mean of exp(−t/τ) over each piece
    fading = np.exp((seconds - ends) / each) * -np.expm1(-seconds / each) * each / seconds
    mean, level = fading @ share, float(share @ read)
    fading -= mean[:, None]
    norm = np.sqrt(fading**2 @ seconds)
    size, lever = fading @ (seconds * read) / norm, mean / norm
    line = seconds * (middle - share @ middle)
    return _Course(
        size=size,
        left=float(reading @ along) - level + size * lever,
        lever=lever,
        slope=float(line @ read / (line @ middle)),
        squares=float(seconds @ (read - level) ** 2),
    )


def _is_drift(
    holds: Sequence[Hold],
    up: FloatArray,
    slopes: FloatArray,
    known: Sequence[int],
    error: FloatArray,
) -> bool:
    """Whether the course goes on between the holds: then the sensor drifts and does not settle.

    Args:
        holds: n of them.
        up: shape (n, 3).
        slopes: of the force in the k holds known, m/s³.
        known: places of these, shape (k,).
        error: see ``common_settling``.
    """
    rate, *_ = np.linalg.lstsq(up[known], slopes, rcond=None)
    time = np.array([0.5 * (one.start + one.end) for one in holds])
    products = up[:, [0, 0, 0, 1, 1, 2]] * up[:, [0, 1, 2, 1, 2, 2]]
    unseen = complement(np.hstack([up, products]))  # by the parameters of a calibration
    moved = unseen.T @ (up @ rate * (time - time.mean()))
    return bool(moved @ (unseen.T @ error) > MIN_DRIFT * (moved @ moved))
