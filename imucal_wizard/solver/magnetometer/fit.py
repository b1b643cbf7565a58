"""The magnetometer's calibration from samples of a device turned in the Earth's field."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.ellipsoid.bins import bin_of
from imucal_wizard.ellipsoid.checks import (
    FEWEST_SAMPLES,
    check_field,
    check_plane,
    check_readings,
    check_scatter,
    no_shell,
)
from imucal_wizard.ellipsoid.orthogonal import orthogonal
from imucal_wizard.ellipsoid.robust import robust_start, spread
from imucal_wizard.ellipsoid.saturation import check_saturation, stuck_samples
from imucal_wizard.ellipsoid.shape import Cloud, look, make_cloud, radius_of, symmetric_matrix
from imucal_wizard.errors import DataError, UsageError
from imucal_wizard.procedure.rounding import rounding_shift, steps_of
from imucal_wizard.readings import BoolArray, FloatArray, Series
from imucal_wizard.solver.magnetometer.disturbances import LeftOut, find
from imucal_wizard.solver.magnetometer.methods import METHODS, by_method, by_orthogonal
from imucal_wizard.solver.magnetometer.model import WHOLE, FieldModel, decide
from imucal_wizard.solver.magnetometer.report import MagnetometerFit, Measured, report

FEWEST_KEPT = 0.6
"""Share of undisturbed samples below which nobody can say which of them the disturbed ones are."""
DIFFERENT = 3.0
"""Scatter about an ellipsoid of all samples, over that about one of some, from which the rest is of
another shape."""
LITTLE = 0.05
"""Of the radius, that coarse steps may leave samples inside an ellipsoid of few others."""
SUBSET = 4000
ROUNDS = 3
SMALLEST = 1e-9
"""Scatter below which readings are exact, in units of their span."""


@dataclass(frozen=True, eq=False)
class _Start:
    """A robust ellipsoid, what it tells of the samples, and the model that they carry."""

    theta: FloatArray
    variance: float
    kept: BoolArray
    left_out: tuple[LeftOut, ...]
    areas: NDArray[np.intp]
    model: FieldModel


def fit_magnetometer(
    series: Series, field: float | None = None, method: str = "orthogonal"
) -> MagnetometerFit:
    """Fit ``|M (y − b)| = B``, M symmetric, to the samples.

    Args:
        series: readings in the order of time, ``uT`` or ``count``.
        field: magnitude of the local field, µT; without it ``det M = 1``.
        method: ``orthogonal``, ``algebraic``, ``two-step`` or ``numeric``.

    Raises:
        DataError: the readings do not carry a calibration; the message says why.
        UsageError: no method of that name.
    """
    return fit_methods(series, field, (method,))[0]


def fit_methods(
    series: Series, field: float | None = None, methods: Sequence[str] = METHODS
) -> tuple[MagnetometerFit, ...]:
    """The same samples by several methods, judged on the same undisturbed ones.

    Raises:
        DataError: the readings do not carry a calibration, or a method finds none.
        UsageError: no method of that name.
    """
    unknown = [name for name in methods if name not in METHODS]
    if unknown:
        raise UsageError(f"{unknown[0]!r} is no method; choose one of {', '.join(METHODS)}")
    check_readings(series.values)
    try:
        # what overflows or divides by nothing ends as a number that is none, and is refused
        with np.errstate(all="ignore"):
            return _fitted(series, field, methods)
    except np.linalg.LinAlgError:
        raise no_shell(series.values) or DataError(_SINGULAR) from None


def _fitted(
    series: Series, field: float | None, methods: Sequence[str]
) -> tuple[MagnetometerFit, ...]:
    cloud = make_cloud(series.values)
    start = _start(cloud, series)
    radius = cloud.span * radius_of(start.theta)
    warning = check_field(radius, series.unit, field)
    measured = Measured(
        series, cloud, start.kept, start.left_out, start.areas, start.model, field, warning
    )
    kept = np.ascontiguousarray(cloud.points[:, start.kept])
    fits = []
    for name in methods:
        if name == "orthogonal":
            estimate = by_orthogonal(kept, start.theta, start.variance, start.model)
        else:
            estimate = by_method(name, cloud.points, start.kept, start.model, start.theta)
        if not np.isfinite([*estimate.theta, *estimate.square]).all():
            raise DataError(_SINGULAR)
        if not np.linalg.eigvalsh(symmetric_matrix(estimate.theta))[0] > 0.0:
            raise DataError(_SINGULAR)
        fits.append(report(measured, name, estimate))
    return tuple(fits)


def _start(cloud: Cloud, series: Series) -> _Start:
    """Robust ellipsoid, disturbed samples and model.

    Raises:
        DataError: nothing turns, an axis is saturated, or too much is disturbed.
    """
    theta = _robust(cloud, series.values)
    steps = steps_of(series.values) / cloud.span
    kept = np.ones(len(series), bool)
    for _ in range(ROUNDS):
        distance, seen = look(theta, cloud.points)
        sigma = max(spread(distance[kept]), SMALLEST)
        areas, before = bin_of(seen), kept
        kept, runs = find(distance, series.time, areas, sigma, rounding_shift(sigma, steps))
        if not kept.any() or (kept == before).all():
            break
        # what was disturbed no longer pulls, so that its weaker flanks come to light
        theta = _refined(cloud.points[:, kept], theta, sigma)
    if kept.mean() < FEWEST_KEPT:
        raise DataError(
            f"{100.0 * (1.0 - kept.mean()):.0f} % of the magnetometer's samples do not fit with "
            "the others: the field changed while the device turned. Measure again, away from iron, "
            "magnets, loudspeakers and currents"
        )
    check_scatter(float(distance[kept].std()), radius_of(theta), series.values)
    if not kept.all():
        check_plane(series.values[kept])
    model = decide(seen[:, kept], areas[kept])
    if model is not WHOLE:
        theta, sigma = robust_start(cloud.points[:, kept], model.quadrics)
        areas = bin_of(look(theta, cloud.points)[1])
    return _Start(theta, sigma**2, kept, runs, areas, model)


def _robust(cloud: Cloud, readings: FloatArray) -> FloatArray:
    """θ that neither disturbed nor saturated samples pull.

    Raises:
        DataError: an axis is saturated, the readings are no shell, or no ellipsoid fits.
    """
    stuck = stuck_samples(readings)
    points = cloud.points
    if stuck:
        free = ~np.any(list(stuck.values()), axis=0)
        if free.sum() >= FEWEST_KEPT * len(free):
            points = points[:, free]
        else:
            # so many at the ends are the few places where the device was, or a range far too small
            _check_many(cloud, free, stuck)
            stuck = {}
    try:
        theta, sigma = robust_start(points, WHOLE.quadrics)
    except DataError as error:
        raise no_shell(readings) or error from None
    if stuck:
        check_saturation(stuck, look(theta, cloud.points)[0])
    check_scatter(sigma, radius_of(theta), readings)
    try:
        return _refined(points, theta, sigma)
    except DataError as error:
        raise no_shell(readings) or error from None


def _check_many(cloud: Cloud, free: BoolArray, stuck: dict[str, BoolArray]) -> None:
    """Look at many samples at the ends by the ellipsoid of the few others, where they carry one.

    Raises:
        DataError: an axis is saturated.
    """
    if free.sum() < FEWEST_SAMPLES:
        return
    try:
        theta, sigma = robust_start(cloud.points[:, free], WHOLE.quadrics)
        _, together = robust_start(cloud.points, WHOLE.quadrics)
    except (DataError, np.linalg.LinAlgError):
        return
    if together > DIFFERENT * sigma:
        check_saturation(stuck, look(theta, cloud.points)[0] + LITTLE * radius_of(theta))


def _refined(points: FloatArray, theta: FloatArray, sigma: float) -> FloatArray:
    """θ by the orthogonal fit to some thousand samples that lie near.

    Raises:
        DataError: it does not converge.
    """
    some = points[:, :: max(1, points.shape[1] // SUBSET)]
    near = np.abs(look(theta, some)[0]) < 5.0 * max(sigma, SMALLEST)
    return orthogonal(some[:, near], theta)


_SINGULAR = (
    "the magnetometer's readings determine no ellipsoid: turn the device through a circle with "
    "each of its six faces up, away from iron and magnets"
)
