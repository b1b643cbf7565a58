"""The change of one sensor since its calibration: prior, posterior, test and power.

The change δ of the entries of M and b has a normal prior: the calibration's own covariance C, the
drift D of an unchanged sensor, and the changes Δ that are looked for. With the rows of a recheck,
``r = J δ + n``, the estimate is the MAP ``δ̂ = K r``. Of an unchanged sensor it scatters by

    Σ = K J (C + D) Jᵀ Kᵀ + K R Kᵀ,

R being the noise. An error of the corrected input is linear in δ, ``e = L δ``; its largest value
over some inputs is compared with the limit, and Σ gives how often noise and drift alone exceed it.
"""

from copy import copy
from functools import cache
from statistics import NormalDist

import numpy as np

from imucal_wizard.core.limits import drift as limits
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.diagnose.calibrated_sensor import CalibratedSensor
from imucal_wizard.estimate.distributions import EXACT_FREEDOM, exceeded
from imucal_wizard.estimate.experiment import Directions, Experiment
from imucal_wizard.estimate.fit import Minimum, minimum
from imucal_wizard.estimate.split import principal_steps
from imucal_wizard.model.rows.source import ENTRIES

UNEXPLAINED_P = 0.01
"""Probability of residuals by measured noise alone, below which rows count as noisier."""
ERROR_DRAWS = 30_000
"""Of the error of an unchanged sensor, for its quantiles: they then err by about one per cent."""
PLANNING_DRAWS = 1_000
"""The same while the next pose is chosen: they then err by a few per cent."""
LEAST_CHANGE = 1.6
"""A change that has to be seen makes at least so many times a limit of the user's own: one that
just makes the limit exceeds it in half of all rechecks, however exact they are."""


@dataclass(frozen=True)
class DetectableChange:
    """One change that a recheck has to see.

    Attributes:
        parameter: ``bias`` or ``scale``.
        axis: ``x``, ``y`` or ``z``.
        change: its size, m/s², rad/s or relative.
        power: probability of seeing it.
        smallest: change that is seen with the wanted power, in the same unit.
    """

    parameter: str
    axis: str
    change: float
    power: float
    smallest: float


@cache
def _normal(draws: int) -> FloatArray:
    """Normal variables, the same ones each time, so that a comparison has no chance in it."""
    return np.random.default_rng(0).standard_normal((draws, ENTRIES))


class DetectionPower:
    """What rows show of the change of a sensor, measured or only planned.

    Args:
        known: the calibration.
        drift: covariance of M and b by drift, shape (12, 12).
        gravity: m/s².
        level: probability of an error above the limit for an unchanged sensor.
        information: ``Jᵀ R⁻¹ J`` of the rows by the coordinates of the change and then the shared
            parameters; None without rows.
        draws: of the error of an unchanged sensor.
        turned: angle by which the whole sensor may have turned on its board, rad.

    Attributes:
        basis: change of M and b with one standard deviation of each coordinate, shape (12, p).
        usual: Σ of an unchanged sensor, shape (12, 12).
        predicted: error that an unchanged sensor exceeds with the probability ``level``.
    """

    def __init__(
        self,
        known: CalibratedSensor,
        drift: FloatArray,
        gravity: float,
        level: float,
        information: FloatArray | None = None,
        draws: int = ERROR_DRAWS,
        turned: float = 0.0,
    ) -> None:
        self.known, self._given = known, (drift, gravity, level)
        bias, scale = limits.CHANGES[known.sensor]
        looked_for = known.spread(np.full(3, bias**2), scale**2, 0.0)
        if turned:
            looked_for = looked_for + known.turned(turned)
        self.basis = principal_steps(known.covariance + drift + looked_for)
        self._into = np.linalg.pinv(self.basis)
        self._errors = known.error_rows(gravity)
        if information is None:
            information = np.zeros(2 * (self.basis.shape[1],))
        self._see(information, draws)

    def _see(self, information: FloatArray, draws: int) -> None:
        """Take what the rows show."""
        drift, _, level = self._given
        self._information, self._draws = information, draws
        covariance = np.linalg.inv(information + np.eye(len(information)))
        self._gain = covariance @ information
        self._own = self._gain @ covariance
        self.usual = self.scatter(drift)
        self.predicted = float(np.quantile(self.errors(self.usual), 1.0 - level))

    @property
    def _own_count(self) -> int:
        return int(self.basis.shape[1])

    def scatter(self, drift: FloatArray) -> FloatArray:
        """Σ: covariance of the estimate for a sensor with this drift alone, shape (12, 12)."""
        own = slice(0, self._own_count)
        prior = np.eye(len(self._gain))
        prior[own, own] = self._into @ (self.known.covariance + drift) @ self._into.T
        whole = self._gain @ prior @ self._gain.T + self._own
        return np.asarray(self.basis @ whole[own, own] @ self.basis.T)

    def errors(self, covariance: FloatArray) -> FloatArray:
        """Errors of sensors whose estimates scatter like this, drawn by chance, shape (n,).

        The symmetric root of the covariance changes as little as the covariance does, so that the
        same draws give the same limit an hour later; principal axes may change places. It is taken
        of gains as shares and of biases in SI: in counts the variances differ by too many powers of
        ten for it.
        """
        size = self.known.size
        unit = np.repeat([1.0 / size, size], [9, 3])
        values, axes = np.linalg.eigh(covariance * np.outer(unit, unit))
        root = axes * np.sqrt(np.maximum(values, 0.0)) @ axes.T / unit[:, None]
        return np.asarray(np.abs(_normal(self._draws) @ (self._errors @ root).T).max(axis=1))

    def error_of(self, change: FloatArray) -> float:
        """The largest error of corrected readings by a change of M and b."""
        return float(np.abs(self._errors @ change).max())

    def more(self, rows: FloatArray, variance: FloatArray) -> "DetectionPower":
        """With further rows.

        Args:
            rows: derivative of them by M and b, shape (n, 12).
            variance: of each, shape (n,).
        """
        information, columns = self._information.copy(), rows @ self.basis
        own = slice(0, self._own_count)
        information[own, own] += columns.T @ (columns / variance[:, None])
        found = copy(self)
        found._see(information, PLANNING_DRAWS)
        return found

    def limit(self, given: float | None) -> float:
        """The limit of the error: the user's own, or the usual one."""
        return max(self.known.limit, self.predicted) if given is None else given

    def seen(self, given: float | None, usual: FloatArray | None = None) -> list[DetectableChange]:
        """The power of seeing each change that is looked for.

        The error in the input that shows a change best exceeds the limit with
        ``Φ((m − limit)/s)``; the largest error does so at least as often.

        Args:
            given: limit of the user's own, which may allow the changes that are looked for.
            usual: Σ of an unchanged sensor; None for that of the sensor's drift.
        """
        limit = self.limit(given)
        if usual is None:
            usual = self.usual
        elif given is None:
            drawn = float(np.quantile(self.errors(usual), 1.0 - self._given[2]))
            limit = max(self.known.limit, drawn)
        variance = np.einsum("ki,ij,kj->k", self._errors, usual, self._errors)
        # of inputs that nothing shows it is zero but for rounding
        sigma = np.sqrt(np.maximum(variance, (1e-12 * limit) ** 2))
        own = slice(0, self._own_count)
        shown = self.basis @ self._gain[own, own] @ self._into
        normal = NormalDist()
        deviations = normal.inv_cdf(limits.POWER)
        sizes = dict(zip(("bias", "scale"), limits.CHANGES[self.known.sensor], strict=True))
        found = []
        steps = ("bias", self.known.bias_step), ("scale", self.known.scale_step)
        for name, step_of in steps:
            for axis in range(3):
                step = step_of(axis)
                mean = np.abs(self._errors @ (shown @ step))
                least = LEAST_CHANGE * limit / self.error_of(step)
                size = sizes[name] if given is None else max(sizes[name], least)
                power = normal.cdf(float(((size * mean - limit) / sigma).max()))
                smallest = float(((limit + deviations * sigma) / np.maximum(mean, 1e-300)).min())
                found.append(DetectableChange(name, AXES[axis], size, power, smallest))
        return found


def _fitted(
    experiment: Experiment, basis: FloatArray, noise: float
) -> tuple[float, float, Minimum[Experiment]]:
    """Squares of the residuals over their noise per degree of freedom, these degrees, and the fit.

    Args:
        experiment: the rows.
        basis: changes of one standard deviation, shape (12, p).
        noise: variance of the rows over the one measured.
    """
    count = basis.shape[1]
    names = tuple(f"change-{k}" for k in range(count))
    directions = Directions(basis, names, experiment.base_terms, precision=np.ones(count))
    found = minimum(experiment, directions=directions, own_noise=noise)
    freedom = float(found.balance.freedom.sum())
    squares = float((found.system.residual**2 / found.balance.variance).sum())
    return squares / max(freedom, 1e-9), freedom, found


def _unlikely(ratio: float, freedom: float) -> bool:
    """Whether measured noise hardly makes such residuals."""
    return freedom >= 1.0 and exceeded(ratio, freedom, EXACT_FREEDOM) < UNEXPLAINED_P


class Change:
    """What the rows of a recheck say of one sensor.

    Args:
        known: the calibration.
        experiment: the rows, beginning at the calibration.
        drift: covariance of M and b by drift, shape (12, 12).
        gravity: m/s².
        level: probability of an error above the limit for an unchanged sensor.

    Attributes:
        found: the MAP estimate.
        power: what these rows show.
        error: the largest error of corrected readings by the change found, SI.
        noise: rms of that error by noise and by the calibration's own uncertainty.
        resolved: error that a sensor without any drift exceeds with the probability ``level``.
        unexplained: the rows scatter by more than their noise whatever has changed.
    """

    def __init__(
        self,
        known: CalibratedSensor,
        experiment: Experiment,
        drift: FloatArray,
        gravity: float,
        level: float,
    ) -> None:
        self.known = known
        narrow = DetectionPower(known, drift, gravity, level, draws=PLANNING_DRAWS).basis
        ratio, freedom, usual = _fitted(experiment, narrow, 1.0)
        self.found, self._basis = usual, narrow
        self.unexplained = _unlikely(ratio, freedom)
        if self.unexplained and not known.own_frame:
            # a sensor that is mounted anew has turned as a whole
            wide = DetectionPower(
                known, drift, gravity, level, draws=PLANNING_DRAWS, turned=limits.MOUNTED_ANEW
            ).basis
            then, left, found = _fitted(experiment, wide, 1.0)
            self.unexplained = _unlikely(then, left)
            if not self.unexplained:
                self.found, self._basis = found, wide
        if self.unexplained:
            self.found = usual = _fitted(experiment, narrow, ratio)[2]
        columns, weight = usual.system.columns, 1.0 / usual.balance.variance
        information = columns.T @ (columns * weight[:, None])
        self.power = DetectionPower(known, drift, gravity, level, information)
        still = self.power.errors(self.power.scatter(0.0 * drift))
        self.noise = root_mean_square(still)
        self.resolved = float(np.quantile(still, 1.0 - level))
        self.error = self.power.error_of(self.moved)

    @property
    def moved(self) -> FloatArray:
        """Change of M by rows and b, the MAP estimate, shape (12,)."""
        return self.found.calibration.entries - self.known.calibration.entries

    @property
    def covariance(self) -> FloatArray:
        """Of that estimate, the calibration's own uncertainty included, shape (12, 12)."""
        basis = self._basis
        own = slice(0, basis.shape[1])
        return np.asarray(basis @ self.found.balance.covariance[own, own] @ basis.T)
