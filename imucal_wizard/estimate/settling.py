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
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import complement
from imucal_wizard.estimate.distributions import exceeded
from imucal_wizard.estimate.split import principal_steps
from imucal_wizard.measurement.holds import Hold

TIMES = np.geomspace(0.1, 30.0, 49)
"""Time constants that are tried, s: neighbours differ by less than settling fits can tell."""
MIN_COURSES = 8
"""Holds from which on a common course in them is looked for."""
MIN_COURSES_FOR_SCALES = 14
"""The same in proportion to the force, too, whose three sizes need as many holds more."""
CHANCE = 1e-4
"""Probability by chance of a common course, above which there is none."""
MIN_SIGMAS = 3.0
"""Standard errors of the amplitude on an axis, above which that axis settles with the others."""
MIN_DRIFT = 0.3
"""Share of the drift between holds that the course in them would make if it never ended, above
which a drift of the session is what they show."""


@dataclass(frozen=True, eq=False)
class CommonSettling:
    """The settling that holds have in common.

    Attributes:
        seconds: its time constant, s: the middle one of all that agree with the holds.
        left: what it leaves in the mean reading of each hold, shape (n, 3).
        doubt: standard deviation of what it leaves in the reading of an axis that points up, (3,).
        errors: the doubt about the force along gravity in each hold, m/s², by independent steps of
            one standard deviation, shape (n, k).
    """

    seconds: float
    left: FloatArray
    doubt: FloatArray
    errors: FloatArray


def common_settling(
    holds: Sequence[Hold], up: FloatArray, gain: float, error: FloatArray
) -> CommonSettling | None:
    """What settling leaves in the means of holds; None where they do not show any.

    Only the length of the force is judged: a device that still tilts is no sensor that settles. The
    amplitude is the same in all holds on each axis, or grows in proportion to the force there.

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
    columns = up if len(known) < MIN_COURSES_FOR_SCALES else np.hstack([up, up**2])
    each = [_of_hold(holds[i].accelerometer, courses[i], gain * up[i]) for i in known]
    sizes, left, levers, slopes, whole = (np.array(one) for one in zip(*each, strict=True))
    if _is_drift(holds, up, slopes, known, error):
        return None
    # which axes settle, by the time constant that explains most
    count, freedom = columns.shape[1], len(known) - columns.shape[1]
    found, variance, inverse = _nearest(columns[known], sizes)
    explained = (sizes**2).sum(axis=0) / np.maximum(variance, 1e-300) - freedom
    best = int(explained.argmax())
    if exceeded(float(explained[best]) / count, count, freedom) > CHANCE:
        return None
    seen = found[:, best] ** 2 > MIN_SIGMAS**2 * variance[best] * np.diag(inverse)
    seen = seen if seen.any() else np.ones(count, bool)
    columns = columns[:, seen]
    # all time constants as likely beforehand; what an exponential of any amplitude leaves of the
    # course in each hold tells them apart
    misfit = whole.sum() - (sizes**2).sum(axis=0)
    pieces = sum(len(courses[i]) - 2 for i in known)
    likely = np.exp(-0.5 * pieces * (misfit / misfit.min() - 1.0))
    likely /= likely.sum()
    found, variance, inverse = _nearest(columns[known], left)
    mean = found @ likely
    apart = found - mean[:, None]
    covariance = float(likely @ variance) * inverse + (apart * likely) @ apart.T
    # holds differ in what they still contain, by more than the noise of finding it
    own = (left - columns[known] @ found) @ likely
    noise = misfit.min() / max(pieces, 1) * float(((levers @ likely) ** 2).mean())
    own *= max(1.0 - noise / max(float(likely @ variance), 1e-300), 0.0)
    # as much of it is taken off as is sure
    sure = float(mean @ mean / (mean @ mean + np.trace(covariance)))
    mean, rest = sure * mean, (1.0 - sure) * mean
    covariance += np.outer(rest, rest) + TAIL_DOUBT**2 * np.outer(mean, mean)
    middle = int(np.searchsorted(np.cumsum(likely), 0.5))
    of_axes, of_doubt = np.zeros(6), np.zeros(6)
    of_axes[:count][seen], of_doubt[:count][seen] = mean, np.diag(covariance)
    in_each = of_axes[:3] + of_axes[3:] * up
    in_each[known] += sure * own[:, None] * up[known]
    return CommonSettling(
        seconds=float(TIMES[middle]),
        left=in_each / gain,
        doubt=np.sqrt(of_doubt[:3] + of_doubt[3:]) / gain,
        errors=columns @ principal_steps(covariance),
    )


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


def _of_hold(
    reading: FloatArray, course: FloatArray, along: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, float, float]:
    """Settling of one hold along a direction with each time constant.

    Args:
        reading: mean of the hold, shape (3,).
        course: see ``Hold``.
        along: the direction times the gain, shape (3,).

    Returns:
        The amplitude in units in which white noise is alike in all holds, shape (t,), what settling
        leaves in the mean of the hold, shape (t,), by how much an error of the amplitude moves
        that, shape (t,), the slope of a straight line, per second, and the sum of squares about the
        mean in the units of the amplitude.
    """
    seconds, read = course[:, 0], course[:, 1:] @ along
    share, ends = seconds / seconds.sum(), np.cumsum(seconds)
    starts = ends - seconds
    # the mean of exp(−t/τ) over each piece
    fading = np.exp(-starts / TIMES[:, None]) * -np.expm1(-seconds / TIMES[:, None])
    fading *= TIMES[:, None] / seconds
    mean, middle = fading @ share, 0.5 * (starts + ends)
    fading -= mean[:, None]
    norm = np.sqrt(fading**2 @ seconds)
    size = fading @ (seconds * read) / norm
    lever = mean / norm
    asymptote = share @ read - size * lever
    line = seconds * (middle - share @ middle)
    slope = float(line @ read / (line @ middle))
    whole = seconds @ (read - share @ read) ** 2
    return size, reading @ along - asymptote, lever, slope, whole


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
    unseen = complement(np.hstack([up, products]))
    moved = unseen.T @ (up @ rate * (time - time.mean()))
    return bool(moved @ (unseen.T @ error) > MIN_DRIFT * (moved @ moved))
