"""The ellipsoid while its readings still come in: where it lies, how well each direction is known.

A flat circle, half a sphere and a whole one go the same way: least squares of the distances under a
prior that says what iron and sensors do (a soft iron of some ten per cent, a centre within a radius
of the middle of the readings). Directions without a reading keep the uncertainty of the prior, so
that a sample from a new direction is not taken for a disturbance.
"""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import robust_deviation
from imucal_wizard.estimate.ellipsoid.coverage import BINS, bin_of, centres
from imucal_wizard.estimate.ellipsoid.surface import (
    ELLIPSOID_SIZE,
    Cloud,
    distances,
    locate,
    make_cloud,
    parameters,
    radius_of,
    sphere_near,
    symmetric_matrix,
)
from imucal_wizard.measurement.field_quality import MAX_SHELL_SCATTER

SOFT_IRON_PRIOR = 0.12
"""Prior standard deviation of the matrix's entries beyond a multiple of the identity."""
CENTRE_PRIOR = 2.0
"""The same of the centre about the middle of the readings, in radii."""
MISFIT = 0.006
"""What no ellipsoid explains of one area, in radii: no number of samples makes it better known."""
OUTLYING_SIGMAS = 4.0
"""Standard deviations beyond which a sample hardly pulls any more."""
MIN_PROVISIONAL_SAMPLES = 20
PROVISIONAL_ROUNDS = 4
ROUNDS_AGAIN = 1
"""Rounds from an ellipsoid that was found a moment before."""
_IDENTITY = parameters(np.eye(3), np.zeros(3))[3:]
_DEVIATORIC = np.eye(6) - np.outer(_IDENTITY, _IDENTITY) / 3.0


@dataclass(frozen=True, eq=False)
class Provisional:
    """An ellipsoid and its doubt.

    Attributes:
        cloud: how readings were made dimensionless.
        theta: its parameters, shape (9,).
        covariance: of them, shape (9, 9).
        sigma: standard deviation of one sample's distance, dimensionless.
    """

    cloud: Cloud
    theta: FloatArray
    covariance: FloatArray
    sigma: float

    @property
    def magnitude(self) -> float:
        """Size of the field by the readings' own unit."""
        return self.cloud.span * self._radius

    @cached_property
    def _radius(self) -> float:
        return radius_of(self.theta)

    @property
    def noise(self) -> float:
        """Standard deviation of one sample's distance as a share of the field."""
        return self.sigma / self._radius

    def look(self, readings: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where readings lie.

        Args:
            readings: shape (n, 3).

        Returns:
            Distances from the ellipsoid as shares of the field, shape (n,), and the directions of
            the field seen from the body, unit vectors, shape (3, n).
        """
        distance, seen = locate(self.theta, self._points(readings))
        return distance / self._radius, seen

    def doubt(self, readings: FloatArray) -> FloatArray:
        """Standard deviation of the ellipsoid itself at readings, as shares of the field, (n,)."""
        return self._doubt(self._points(readings))

    def worst(self) -> float:
        """The largest doubt anywhere on the sphere, as a share of the field."""
        whole = np.linalg.solve(symmetric_matrix(self.theta), centres().T)
        return float(self._doubt(whole + self.theta[:3, None]).max())

    def _doubt(self, points: FloatArray) -> FloatArray:
        slope = distances(self.theta, points, 0.0).slope
        square = np.einsum("in,in->n", slope, self.covariance @ slope)
        return np.asarray(np.sqrt(np.maximum(square, 0.0)) / self._radius)

    def _points(self, readings: FloatArray) -> FloatArray:
        return np.ascontiguousarray((readings - self.cloud.centre).T / self.cloud.span)


def provisional(readings: FloatArray, last: Provisional | None = None) -> Provisional | None:
    """The ellipsoid through what has been read so far.

    Areas count alike however many samples they hold; samples far off hardly count.

    Args:
        readings: some thousand at most, shape (n, 3).
        last: the ellipsoid before these readings, to start from.

    Returns:
        None as long as there is nothing that bends.
    """
    if len(readings) < MIN_PROVISIONAL_SAMPLES or not np.ptp(readings, axis=0).max() > 0.0:
        return None
    cloud = make_cloud(readings)
    start = sphere_near(cloud.points)
    if start is None:
        return None
    found = None if last is None else _settled(cloud, start, _moved(last, cloud), ROUNDS_AGAIN)
    if found is None:
        found = _settled(cloud, start, start, PROVISIONAL_ROUNDS)
    return None if found is None or found.noise > MAX_SHELL_SCATTER else found


def _settled(
    cloud: Cloud, middle: FloatArray, theta: FloatArray, rounds: int
) -> Provisional | None:
    """Some rounds of Gauss–Newton with weights of their own; None when they lead nowhere."""
    radius = 1.0 / float(middle[3])
    precision = _prior(radius)
    for _ in range(rounds):
        normal, pull, _ = _weighed(cloud.points, theta, radius)
        # the prior of the matrix does not see how large it is, so that the sphere's size is as good
        pull = pull + precision @ (theta - middle)
        theta = theta - np.linalg.solve(normal + precision, pull)
        if not _possible(theta, radius):
            return None
    normal, _, sigma = _weighed(cloud.points, theta, radius)
    covariance = np.asarray(np.linalg.inv(normal + precision), float)
    return Provisional(cloud, theta, covariance, sigma)


def _weighed(
    points: FloatArray, theta: FloatArray, radius: float
) -> tuple[FloatArray, FloatArray, float]:
    """The linear problem at one θ: normal matrix, right side; and the noise of a sample."""
    now = distances(theta, points, 0.0)
    sigma = max(robust_deviation(now.distance), 1e-6 * radius)
    weighted = now.slope * _weights(now.distance, bin_of(now.seen), sigma, radius)
    return weighted @ now.slope.T, weighted @ now.distance, sigma


def _weights(
    distance: FloatArray, areas: NDArray[np.intp], sigma: float, radius: float
) -> FloatArray:
    """``1/(σ² + n τ²)`` for each of an area's n samples, less for those far off."""
    scatter = float(np.hypot(sigma, MISFIT * radius))
    trust = 1.0 / (1.0 + (distance / (OUTLYING_SIGMAS * scatter)) ** 2) ** 2
    count = np.bincount(areas, trust, BINS)[areas]
    return np.asarray(trust / (sigma**2 + count * (MISFIT * radius) ** 2))


def _prior(radius: float) -> FloatArray:
    """Precision of the centre and of what makes the matrix no multiple of the identity."""
    precision = np.zeros((ELLIPSOID_SIZE, ELLIPSOID_SIZE))
    precision[:3, :3] = np.eye(3) / (CENTRE_PRIOR * radius) ** 2
    precision[3:, 3:] = _DEVIATORIC * (radius / SOFT_IRON_PRIOR) ** 2
    return precision


def _moved(last: Provisional, cloud: Cloud) -> FloatArray:
    """The last ellipsoid in the new dimensionless form."""
    theta = np.empty(ELLIPSOID_SIZE)
    theta[:3] = (last.cloud.bias(last.theta) - cloud.centre) / cloud.span
    theta[3:] = last.theta[3:] * (cloud.span / last.cloud.span)
    return theta


def _possible(theta: FloatArray, radius: float) -> bool:
    """An ellipsoid, about as large as the sphere was and not far from it."""
    if not np.isfinite(theta).all():
        return False
    values = np.linalg.eigvalsh(symmetric_matrix(theta)) * radius
    return bool(values[0] > 0.2 and values[-1] < 5.0 and np.abs(theta[:3]).max() < 10.0 * radius)
