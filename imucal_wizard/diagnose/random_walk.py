"""The noise under which every explanation is judged: its size, and a random walk of the bias.

Rows are divided by the noise measured within the holds. Between holds the noise may be larger, and
the bias may walk; neither is a drift. With K the covariance of a random walk as the rows see it,
the noise is ``σ² (I + ω² K)``; σ and ω are unknown and are averaged over. The noise within holds
is nearly the whole noise of a white sensor, and a half or a third of that of a coloured one.

A fit takes the noise of different holds to be independent. With ``ω² K`` the covariance that a
random walk adds, the estimate ``C Aᵀ r`` has the variance ``C + ω² C Aᵀ K A C``.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import complement, median
from imucal_wizard.diagnose.residuals import RowKind, WhitenedResiduals
from imucal_wizard.estimate.result import Parameter, SensorFit
from imucal_wizard.model.terms import Terms

SIGMAS = np.exp(np.linspace(np.log(0.65), np.log(12.0), 15))
"""Noise in units of that within the holds."""
SQUARES = SIGMAS**2
WANDERS = (0.0, 0.6, 2.0, 6.0)
"""Steps of a wandering bias, in units of the noise per square root of minute."""
FREE_WANDERS = (0.6, 2.0, 6.0, 20.0, 60.0, 200.0, 600.0)
"""The same in units of the white part of a residual of any size, which may be as good as none."""
WANDER_PRIOR = (0.6, 0.2, 0.13, 0.07)
"""Probability of each. A choice: most biases hardly wander in a session. With more for the large
ones, slow effects need to be larger to be named; with less, a wander is taken for a drift."""
VISITS_AN_ERROR_LASTS = (0.0, 1.0)
"""Of an error that follows no time: until the row ends, as a seat does, or until the next rest, as
what the last motion leaves behind does. A bias that wanders lasts longer."""
MIN_WANDER_SHARE = 1e-3
"""Probability below which a wander of the noise is left out."""
WHITE_NOISE_SHARE = 0.6
"""Share of sensors whose noise between holds is that within them."""


def sigma_prior() -> FloatArray:
    """Logarithm of the prior of each σ: a peak at one, and a broad shoulder above it."""
    x = np.log(SIGMAS)
    peak = np.exp(-0.5 * ((x - 0.03) / 0.15) ** 2) / 0.15
    broad = np.exp(-0.5 * ((x - 0.6) / 0.55) ** 2) / 0.55
    prior = WHITE_NOISE_SHARE * peak + (1.0 - WHITE_NOISE_SHARE) * broad
    return np.asarray(np.log(prior / prior.sum()))


@dataclass(frozen=True, eq=False)
class Frame:
    """Coordinates in which both the base parameters and the noise are simple.

    Attributes:
        across: orthonormal, what the base cannot absorb, wandering noise diagonal; shape (n, m).
        walk: variance of a random walk along each coordinate, shape (m,).
        wanders: the values of ω that make a difference here.
        log_prior: logarithm of the prior of each of them.
    """

    across: FloatArray
    walk: FloatArray
    wanders: tuple[float, ...]
    log_prior: FloatArray

    def largest_wander(self, noise: FloatArray) -> float:
        """The largest wander that is not improbable.

        Args:
            noise: probability of each wander and σ, shape (wanders, sigmas).
        """
        likely = np.flatnonzero(noise.sum(axis=1) > MIN_WANDER_SHARE)
        return self.wanders[int(likely[-1])]

    def up_to(self, wander: float) -> "Frame":
        """The same without larger wanders."""
        count = sum(one <= wander for one in self.wanders)
        return replace(self, wanders=self.wanders[:count], log_prior=self.log_prior[:count])

    def weights(self, wander: float) -> FloatArray:
        """Variance of white noise over that of white and wandering noise, by coordinate, (m,)."""
        return np.asarray(1.0 / (1.0 + wander**2 * self.walk))

    def walked(self, wander: float) -> FloatArray:
        """What wandering adds to the covariance of the rows, in units of the noise, (n, n)."""
        return np.asarray(wander**2 * (self.across * self.walk) @ self.across.T)

    @cached_property
    def each_weights(self) -> list[FloatArray]:
        """The weights under each of the wanders."""
        return [self.weights(wander) for wander in self.wanders]

    @cached_property
    def _log_volume(self) -> FloatArray:
        spread = -np.array([np.log(weights).sum() for weights in self.each_weights])
        volume = self.across.shape[1] * np.log(SQUARES) + spread[:, None]
        return np.asarray(self.log_prior[:, None] + sigma_prior() - 0.5 * volume)

    def log_noise(self, coordinates: FloatArray) -> FloatArray:
        """Likelihood and prior of noise alone, shape (…, wanders, sigmas).

        Args:
            coordinates: of residuals, shape (…, m).
        """
        squares = coordinates**2
        totals = np.stack([squares @ own for own in self.each_weights], axis=-1)
        return np.asarray(self._log_volume - 0.5 * totals[..., None] / SQUARES)


def frame_of(misfit: WhitenedResiduals) -> Frame:
    """The frame of a misfit."""
    across = complement(misfit.base)
    values, vectors = np.linalg.eigh(across.T @ walk_of(misfit) @ across)
    count = len(WANDERS) if values.size and values[-1] > 1e-3 else 1
    prior = np.array(WANDER_PRIOR[:count])
    return Frame(
        across @ vectors,
        np.maximum(values, 0.0),
        WANDERS[:count],
        np.asarray(np.log(prior / prior.sum())),
    )


def walk_of(misfit: WhitenedResiduals) -> FloatArray:
    """Covariance of the whitened rows by a wander of one about its mean over them, (n, n)."""
    minutes = (misfit.time - misfit.time.min()) / 60.0
    walked = np.minimum(minutes[:, None], minutes)
    walked -= walked.mean(axis=0)
    return _of_bias(misfit, walked - walked.mean(axis=1)[:, None])


def _passing_of(misfit: WhitenedResiduals, visits: float) -> FloatArray:
    """The same by a bias that is another one after so many visits, (n, n)."""
    apart = np.abs(misfit.time[:, None] - misfit.time)
    usual = median(np.diff(distinct(misfit.time[_seen_at_rest(misfit)])))
    if not visits:
        return _of_bias(misfit, (apart == 0.0).astype(float))
    return _of_bias(misfit, np.exp(-apart / (visits * usual)))


def _of_bias(misfit: WhitenedResiduals, covariance: FloatArray) -> FloatArray:
    """Covariance of the whitened rows by that of the bias at their times, (n, n)."""
    seen = _seen_at_rest(misfit)
    usual = median(misfit.sigma[seen]) if seen.any() else 1.0
    moved = (misfit.lever @ misfit.lever.T) * covariance
    return np.asarray(usual**2 * misfit.whitened(misfit.whitened(moved).T))


def _seen_at_rest(misfit: WhitenedResiduals) -> BoolArray:
    return np.asarray(misfit.kind != RowKind.ROTATION)


def wandering(misfit: WhitenedResiduals, frame: Frame, coordinates: FloatArray) -> float:
    """Probability that a residual of any size walks with the time.

    It may also be white, or be an error of the bias that is another one at each visit: rows at rest
    and rows in motion then differ by more than their noise, too, but neighbours are not alike. The
    size is averaged over (with the prior 1/σ): visits may differ by any multiple of the noise
    within the holds.

    Args:
        misfit: the rows.
        frame: of them.
        coordinates: of the residual in the frame, shape (m,).
    """
    if not coordinates.any() or len(distinct(misfit.time[_seen_at_rest(misfit)])) < 2:
        return 0.0
    found = [_log_evidence(frame.walk, coordinates), _log_evidence(0.0 * frame.walk, coordinates)]
    for visits in VISITS_AN_ERROR_LASTS:
        passing = frame.across.T @ _passing_of(misfit, visits) @ frame.across
        variance, axes = np.linalg.eigh(passing)
        found.append(_log_evidence(np.maximum(variance, 0.0), axes.T @ coordinates))
    share = np.exp(np.array(found) - max(found))
    return float(share[0] / share.sum())


def _log_evidence(variance: FloatArray, coordinates: FloatArray) -> float:
    """Logarithm of the evidence for noise of this variance, any multiple of it, beside white noise.

    Args:
        variance: along each coordinate, shape (m,).
        coordinates: of the residual, shape (m,).
    """
    weights = 1.0 / (1.0 + np.multiply.outer(np.array(FREE_WANDERS) ** 2, variance))
    each = np.log(weights).sum(axis=1) - len(coordinates) * np.log(weights @ coordinates**2)
    best = float(each.max())
    return 0.5 * best + float(np.log(np.mean(np.exp(0.5 * (each - best)))))


def shown_axes(misfit: WhitenedResiduals) -> FloatArray:
    """How much of each axis's error a row shows, shape (n, 3); nothing for rotations."""
    shown = np.zeros((len(misfit), 3))
    holds = misfit.kind == RowKind.HOLD
    shown[holds] = misfit.direction[holds]
    field = misfit.kind >= RowKind.FIELD
    shown[field] = misfit.lever[field]
    still = np.flatnonzero(misfit.kind == RowKind.STILL)
    shown[still, misfit.axis[still]] = 1.0
    return shown


def usual_errors(misfit: WhitenedResiduals, frame: Frame) -> FloatArray:
    """What an error of each row makes, by the usual noise of its kind of rows, shape (m, n).

    Structure is equally large in quiet and in noisy holds.
    """
    usual = np.ones(len(misfit))
    for kind in distinct(misfit.kind):
        own = misfit.kind == kind
        usual[own] = median(misfit.sigma[own])
    return np.asarray(frame.across.T @ misfit.whitened(np.diag(usual)))


def with_random_walk(fit: SensorFit, misfit: WhitenedResiduals) -> SensorFit:
    """The fit with the wandering of the bias in the standard errors of its effects.

    Args:
        fit: the fit.
        misfit: what it leaves.
    """
    names = Terms(fit.sensor, fit.terms).names
    if fit.size_covariance is None or fit.rows is None or not names:
        return fit
    table = fit.rows
    white = table.independent.scaled(table.variance**-0.5, table.columns)
    normal = white.T @ white + table.prior
    places = [table.names.index(name) for name in names]
    estimate = np.linalg.pinv(normal, hermitian=True)[places] @ white.T
    estimate = table.independent.scaled(np.sqrt(table.noise / table.variance), estimate.T).T
    added = _wander(misfit) * (estimate @ walk_of(misfit)) @ estimate.T
    wider = np.sqrt(np.diag(fit.size_covariance) + np.diag(added))
    errors = dict(zip(names, wider, strict=True))
    ends = np.cumsum([len(size) for size in fit.sizes])[:-1]
    parameters = tuple(_wider(one, errors.get(one.name)) for one in fit.parameters)
    return replace(
        fit,
        parameters=parameters,
        size_errors=tuple(np.split(wider, ends)),
        size_covariance=fit.size_covariance + added,
    )


def _wander(misfit: WhitenedResiduals) -> float:
    """Expected square of the wander, in units of the noise within the holds, by what is left."""
    frame = frame_of(misfit)
    weight = frame.log_noise(frame.across.T @ misfit.residual)
    share: FloatArray = np.exp(weight - weight.max())
    return float(np.array(frame.wanders) ** 2 @ share @ SQUARES / share.sum())


def _wider(one: Parameter, error: float | None) -> Parameter:
    if error is None or one.standard_error is None:
        return one
    return replace(one, standard_error=float(error))
