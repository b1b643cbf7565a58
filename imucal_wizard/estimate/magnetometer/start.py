"""What is known of a magnetometer's samples before the fit.

A robust ellipsoid, which neither disturbed nor saturated samples pull, tells the direction of every
sample, which samples are disturbed, and which parameters the directions determine. The fit begins
here, and what this chapter refuses is refused for every method.
"""

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.limits.data_quality import MIN_FIELD_SAMPLES
from imucal_wizard.core.readings import BoolArray, FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import robust_deviation
from imucal_wizard.estimate.ellipsoid.coverage import BINS, bin_of
from imucal_wizard.estimate.ellipsoid.robust import robust_start
from imucal_wizard.estimate.ellipsoid.surface import (
    ELLIPSOID_SIZE,
    Cloud,
    locate,
    make_cloud,
    orthogonal,
    radius_of,
)
from imucal_wizard.estimate.magnetometer.field_disturbances import (
    LeftOut,
    find_disturbances,
    noise_of,
)
from imucal_wizard.estimate.methods.algebraic import quadrics
from imucal_wizard.measurement.field_quality import (
    check_plane,
    check_readings,
    check_saturation,
    check_scatter,
    missing_shell,
    stuck_samples,
)
from imucal_wizard.measurement.rounding import resolution_of, rounding_shift
from imucal_wizard.model.identifiability import BIAS, SCALE, amplification, basis_of

MIN_UNDISTURBED = 0.6
"""Share of undisturbed samples below which nobody can say which of them the disturbed ones are."""
ANOTHER_SHAPE = 3.0
"""Scatter about an ellipsoid of all samples, over that about one of some, from which the rest is of
another shape."""
STEP_INSIDE = 0.05
"""Of the radius, that coarse steps may leave samples inside an ellipsoid of few others."""
REFINED_SAMPLES = 4000
"""Samples that the robust ellipsoid is refined with, about."""
DISTURBANCE_ROUNDS = 3
"""Passes of finding disturbed samples and refining the ellipsoid without them."""
EXACT_SPAN = 1e-9
"""Scatter below which readings are exact, in units of their span."""
MAX_FIELD_AMPLIFICATION = 6.0
"""Amplification up to which a model is determined: a misfit of 1 % is then nowhere more than 6 %.
Every direction counts as one reading that the model explains to a per cent or two of the field,
however many samples it holds: a thousand samples of one half circle say nothing of the other."""
MAX_BIAS_AMPLIFICATION = 2.5
"""The same for the bias alone, which leaves the largest errors unseen."""
MIN_IN_DIRECTION = 3
"""Samples from which a direction counts."""
CROSS_NAMES = ("soft_iron_xy", "soft_iron_xz", "soft_iron_yz")


@dataclass(frozen=True, eq=False)
class FieldModel:
    """The part of the model that the directions determine.

    Attributes:
        places: free places of θ: b and M's xx, xy, xz, yy, yz, zz.
        terms: names of the terms.
        dropped: names of parameters left at zero.
        reason: why, in one sentence, or "".
    """

    places: tuple[int, ...]
    terms: tuple[str, ...]
    dropped: tuple[str, ...] = ()
    reason: str = ""

    @property
    def cross(self) -> bool:
        """Whether the off-diagonal entries are free."""
        return len(self.places) == ELLIPSOID_SIZE

    @property
    def scales(self) -> bool:
        """Whether each axis has a scale of its own."""
        return set(SCALE) <= set(self.places)

    @property
    def quadrics(self) -> FloatArray:
        """The same for the algebraic fit, shape (10, q)."""
        return quadrics(self.places)


WHOLE = FieldModel(tuple(range(ELLIPSOID_SIZE)), ("bias", "soft-iron"))
"""All nine parameters."""


@dataclass(frozen=True, eq=False)
class FieldStart:
    """A robust ellipsoid and what follows from it.

    Attributes:
        series: the readings, each once, in the order of time.
        cloud: the same, dimensionless, without what is known to be no disturbance.
        theta: the ellipsoid ``|P (z − b)| = 1``, shape (9,).
        kept: which samples are undisturbed, shape (n,).
        left_out: the others, sizes in the readings' unit.
        areas: area of the sphere of directions in which each sample lies, shape (n,).
        model: what the directions determine.
    """

    series: Series
    cloud: Cloud
    theta: FloatArray
    kept: BoolArray
    left_out: tuple[LeftOut, ...]
    areas: NDArray[np.intp]
    model: FieldModel

    @property
    def radius(self) -> float:
        """Mean size of the field by the readings' own unit."""
        return self.cloud.span * radius_of(self.theta)

    def calibration(self, magnitude: float) -> tuple[FloatArray, FloatArray]:
        """M, symmetric, and b by which corrected readings have this magnitude."""
        return self.cloud.shape(self.theta) * magnitude, self.cloud.bias(self.theta)


def field_start(series: Series, known: FloatArray | None = None) -> FieldStart:
    """Robust ellipsoid, disturbed samples and model of the readings of a turned device.

    Args:
        series: readings in the order of time, each once.
        known: the part of the readings that is no disturbance, such as that of a current, (n, 3).

    Raises:
        DataError: the readings do not determine a calibration; the message says why.
    """
    check_readings(series.values)
    try:
        # what overflows or divides by nothing ends as a number that is none, and is refused
        with np.errstate(all="ignore"):
            still = series.values if known is None else series.values - known
            return _started(series, make_cloud(still))
    except np.linalg.LinAlgError:
        raise missing_shell(series.values) or DataError(NO_ELLIPSOID) from None


def _started(series: Series, cloud: Cloud) -> FieldStart:
    theta = _robust(cloud, series)
    steps = resolution_of(series.values) / cloud.span
    kept = np.ones(len(series), bool)
    for _ in range(DISTURBANCE_ROUNDS):
        distance, seen = locate(theta, cloud.points)
        sigma = max(robust_deviation(distance[kept]), EXACT_SPAN)
        areas, before = bin_of(seen), kept
        shift = rounding_shift(sigma, steps)
        kept, runs = find_disturbances(distance, series.time, areas, sigma, shift)
        if not kept.any() or (kept == before).all():
            break
        # what was disturbed no longer pulls, so that its weaker flanks come to light
        theta = _refined(cloud.points[:, kept], series.time[kept], theta, sigma)
    if kept.mean() < MIN_UNDISTURBED:
        raise DataError(
            f"{100.0 * (1.0 - kept.mean()):.0f} % of the magnetometer's samples do not agree with "
            "the others: the field changed while the device turned. Measure again, away from iron, "
            "magnets, loudspeakers and currents"
        )
    check_scatter(float(distance[kept].std()), radius_of(theta), series.values)
    if not kept.all():
        check_plane(series.values[kept])
    model = determined_model(seen[:, kept], areas[kept])
    if model is not WHOLE:
        theta, _ = robust_start(cloud.points[:, kept], model.quadrics)
        areas = bin_of(locate(theta, cloud.points)[1])
    left_out = tuple(run.scaled(cloud.span) for run in runs)
    return FieldStart(series, cloud, theta, kept, left_out, areas, model)


def _robust(cloud: Cloud, series: Series) -> FloatArray:
    """θ that neither disturbed nor saturated samples pull.

    Raises:
        DataError: an axis is saturated, the readings are no shell, or no ellipsoid fits.
    """
    readings = series.values
    stuck = stuck_samples(readings)
    points, time = cloud.points, series.time
    if stuck:
        free = ~np.any(list(stuck.values()), axis=0)
        if free.sum() >= MIN_UNDISTURBED * len(free):
            points, time = points[:, free], time[free]
        else:
            # so many at the ends are the few places where the device was, or a range far too small
            _check_many(cloud, free, stuck, resolution_of(readings) / cloud.span)
            stuck = {}
    try:
        theta, sigma = robust_start(points, WHOLE.quadrics)
    except DataError as error:
        raise missing_shell(readings) or error from None
    if stuck:
        steps = resolution_of(readings) / cloud.span
        check_saturation(stuck, locate(theta, cloud.points)[0], steps)
    check_scatter(sigma, radius_of(theta), readings)
    try:
        return _refined(points, time, theta, sigma)
    except DataError as error:
        raise missing_shell(readings) or error from None


def _check_many(
    cloud: Cloud, free: BoolArray, stuck: dict[str, BoolArray], steps: FloatArray
) -> None:
    """Judge many samples at the ends by the ellipsoid of the few others, where there is one.

    Raises:
        DataError: an axis is saturated.
    """
    if free.sum() < MIN_FIELD_SAMPLES:
        return
    try:
        theta, sigma = robust_start(cloud.points[:, free], WHOLE.quadrics)
        _, together = robust_start(cloud.points, WHOLE.quadrics)
    except (DataError, np.linalg.LinAlgError):
        return
    if together > ANOTHER_SHAPE * sigma:
        inside = locate(theta, cloud.points)[0] + STEP_INSIDE * radius_of(theta)
        check_saturation(stuck, inside, steps)


def _refined(points: FloatArray, time: FloatArray, theta: FloatArray, sigma: float) -> FloatArray:
    """θ by the orthogonal fit to some thousand samples that lie near, by the noise of each.

    Raises:
        DataError: it does not converge.
    """
    some = slice(None, None, max(1, points.shape[1] // REFINED_SAMPLES))
    points, time = points[:, some], time[some]
    distance = locate(theta, points)[0]
    noise = noise_of(distance, time, max(sigma, EXACT_SPAN))
    near = np.abs(distance) < 5.0 * noise
    return orthogonal(points[:, near], theta, noise[near])


def determined_model(directions: FloatArray, areas: NDArray[np.intp]) -> FieldModel:
    """The richest model that the directions determine.

    Args:
        directions: unit vectors, shape (3, n).
        areas: area of each, shape (n,).

    Raises:
        DataError: they do not determine even the bias.
    """
    count = np.bincount(areas, minlength=BINS)
    sums = np.array([np.bincount(areas, axis, BINS) for axis in directions])
    means = sums[:, count >= min(MIN_IN_DIRECTION, max(1, len(areas) // BINS))].T
    means = means[np.linalg.norm(means, axis=1) > 0.0]
    seen = np.asarray(means / np.linalg.norm(means, axis=1)[:, None])
    if amplification(seen, np.eye(ELLIPSOID_SIZE)).max() <= MAX_FIELD_AMPLIFICATION:
        return WHOLE
    advice = "Turn the device with each of its six faces up, a whole circle each"
    upright = (*BIAS, *SCALE)
    if amplification(seen, basis_of(upright)).max() <= MAX_FIELD_AMPLIFICATION:
        why = (
            f"{len(seen)} directions do not determine the off-diagonal soft iron: it is left at "
            "zero. "
        )
        return FieldModel(upright, ("bias", "scale"), CROSS_NAMES, why + advice)
    if amplification(seen, basis_of(BIAS, common_scale=True)).max() <= MAX_BIAS_AMPLIFICATION:
        why = f"{len(seen)} directions determine the hard iron only: the soft iron is left out. "
        return FieldModel(BIAS, ("bias",), CROSS_NAMES, why + advice)
    raise DataError(
        f"the readings cover {len(seen)} of {BINS} directions, too few for a calibration. {advice}"
    )


NO_ELLIPSOID = (
    "the magnetometer's readings determine no ellipsoid: turn the device through a circle with "
    "each of its six faces up, away from iron and magnets"
)
