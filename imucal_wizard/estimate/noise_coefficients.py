"""Noise coefficients from Allan variances, with standard errors.

    σ²(τ) = N²/τ + B² (2 ln 2)/π + K² τ/3 + R² τ²/2        (IEEE 952, annex C)

with white noise N, bias instability B, rate random walk K and a steady drift R. Allan variances at
neighbouring τ come from the same readings, so that the fit is weighted by their joint covariance
(generalised method of wavelet moments: Guerrier, Skaloud, Stebler and Victoria-Feser, 2013). For
Gaussian noise it follows from the generalised autocovariance s(t) of the sums (Greenhall, TMO
Progress Report 42-137; NIST SP 1065, section 5.4):

    cov(σ²(τ₁), σ²(τ₂)) = 2 ⟨R(u)²⟩,    R(u) = Σ_ab c_a c_b s(u + bτ₂ − aτ₁) / (2 τ₁ τ₂)

over a, b = −1, 0, 1 with c = 1, −2, 1; ``s = −N²|t|/2``, ``B² t² ln|t|/(2π)`` and ``K²|t|³/12``.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.distributions import EXACT_FREEDOM, WITHIN_NINETY, exceeded
from imucal_wizard.measurement.allan_variance import AllanVariance

COEFFICIENTS = ("white", "bias_instability", "random_walk", "ramp")
_RANDOM = 3
"""Number of random ones, which come first; the ramp is not random."""
FLAT_SHARE = 2.0 * np.log(2.0) / np.pi
"""Allan variance of flicker noise over B²."""
CORRELATED_TAUS = 3.0
"""Sum of both τ beyond which the correlation of flicker noise no longer matters."""
NEAR_TAUS = 8.0
"""Distance from a sharp bend of R, in the shorter τ, up to which every lag counts by itself."""
LAG_GROWTH = 1.05
"""Growth of the distance from a bend beyond, at whose scale R is smooth there."""
MIN_SPANS = 4.0
"""Shortest stretch, in τ, for an Allan variance that is used; below, it is hardly known."""
MISFIT_P = 0.01
"""Probability by chance of a misfit below which a τ is left out."""
MAX_FIRST_TAU = 30.0
"""Longest τ, s, that is left out; the slowest filters and vibrations act below."""
GUARD_OCTAVES = 2
"""Octaves left out beyond a misfit: the share by which a filter lowers the variance falls with τ,
to a quarter over two octaves."""
MIN_OCTAVES = 6
"""Fewest Allan variances, one per octave, to which four coefficients are fitted."""
DETERMINED_SIGMA = 1.96
"""Standard errors from zero from which on a coefficient counts as determined."""
LEAST_WHITE_SHARE = 1e-3
"""Of the white noise that all Allan variances allow."""
LIMIT_ROUNDS = 6
MIN_EIGENVALUE = 1e-3
"""Of the correlations of Allan variances."""
MIN_VARIANCE_SHARE = 1e-12
"""Of the largest Allan variance: below is rounding."""
WEIGHTING_ROUNDS = 12


@dataclass(frozen=True, eq=False)
class Coefficient:
    """One coefficient of one axis.

    Attributes:
        value: the best estimate.
        standard_error: of it; at least so large that the interval of a coefficient that is not
            determined reaches from zero to its upper limit.
        determined: whether it is clearly above zero.
        below: upper limit that holds in 95 of 100 cases.
    """

    value: float
    standard_error: float
    determined: bool
    below: float


@dataclass(frozen=True, eq=False)
class NoiseFit:
    """Noise coefficients of one axis.

    Attributes:
        coefficients: by name, in the reading's unit times a power of seconds.
        first_tau: shortest τ that was fitted, s.
        misfit_p: probability of as large a misfit by chance.
        curve: fitted Allan deviation at all τ, shape (t,).
        error: standard error of the Allan deviation at all τ, shape (t,).
    """

    coefficients: dict[str, Coefficient]
    first_tau: float
    misfit_p: float
    curve: FloatArray
    error: FloatArray


class AllanTheory:
    """Covariance of Allan variances as a function of the noise coefficients.

    Args:
        taus: s, shape (t,).
        strides: advance of the averages, s, shape (t,).
        segments: lengths of the uninterrupted stretches, s.
        fitted: which Allan variances are fitted; the others need no covariance, shape (t,).
    """

    def __init__(
        self, taus: FloatArray, strides: FloatArray, segments: Sequence[float], fitted: BoolArray
    ) -> None:
        self.taus = taus
        self._spans = np.array(segments)
        count = len(taus)
        # products of the three random parts, and each of them alone for the ramp
        self._pairs = np.zeros((count, count, _RANDOM, _RANDOM))
        self._alone = np.zeros((count, count, _RANDOM))
        for i in range(count):
            for j in range(i, count):
                if i != j and not (fitted[i] and fitted[j]):
                    continue
                pairs, alone = self._sums(i, j, float(strides[i]))
                self._pairs[i, j] = self._pairs[j, i] = pairs
                self._alone[i, j] = self._alone[j, i] = alone

    def _sums(self, i: int, j: int, step: float) -> tuple[FloatArray, FloatArray]:
        """Means over all pairs of differences of R_k R_l and of R_k, for unit coefficients."""
        one, other = float(self.taus[i]), float(self.taus[j])
        places = _lags(one / step, other / step)
        lags = places * step
        shared = np.zeros(len(lags))
        for span in self._spans:
            # centres of differences lie between τ and T − τ
            end = np.minimum(span - one, span - other - lags)
            shared += np.maximum(end - np.maximum(one, other - lags), 0.0)
        widths = [np.maximum(self._spans - 2.0 * tau, 0.0).sum() for tau in (one, other)]
        # each lag stands for those up to the middle of the gaps beside it, on both sides of zero
        count = np.gradient(places) * np.where(places > 0.0, 2.0, 1.0)
        weight = count * shared * step / max(widths[0] * widths[1], 1e-300)
        covariance = _covariances(one, other, lags)
        return (covariance * weight) @ covariance.T, covariance @ weight

    def covariance(self, squares: FloatArray) -> FloatArray:
        """Covariance of the Allan variances, shape (t, t).

        Args:
            squares: N², B², K², R².
        """
        random = squares[:_RANDOM]
        found = 2.0 * np.einsum("ijkl,k,l->ij", self._pairs, random, random)
        drift = 0.5 * squares[_RANDOM] * np.multiply.outer(self.taus, self.taus)
        return np.asarray(found + 4.0 * drift * (self._alone @ random))


def _lags(one: float, other: float) -> FloatArray:
    """Lags at which R is evaluated, in strides, increasing from 0.

    R bends sharply at most two of the shorter τ away from 0 and from the longer τ.

    Args:
        one: the shorter τ, strides.
        other: the longer τ, strides.
    """
    last = CORRELATED_TAUS * (one + other)
    near = np.arange(min(NEAR_TAUS * one, last) + 1.0)
    octaves = max(np.log(last / near[-1]), 0.0)
    far = near[-1] * np.exp(np.arange(0.0, octaves, np.log(LAG_GROWTH)))
    away = np.concatenate([near, far])
    places = np.concatenate([away, np.round(other) + away, np.round(other) - away])
    return distinct(np.round(places[(places >= 0.0) & (places <= last)]))


def _covariances(one: float, other: float, lags: FloatArray) -> FloatArray:
    """R(u) of the three random parts for unit coefficients, shape (3, lags)."""
    found = np.zeros((_RANDOM, len(lags)))
    for a, left in ((-1, 1.0), (0, -2.0), (1, 1.0)):
        for b, right in ((-1, 1.0), (0, -2.0), (1, 1.0)):
            t = np.abs(lags + b * other - a * one)
            log = np.log(np.where(t > 0.0, t, 1.0))
            parts = -0.5 * t, t**2 * log / (2.0 * np.pi), t**3 / 12.0
            found += left * right * np.array(parts)
    return found / (2.0 * one * other)


def unit_variances(taus: FloatArray) -> FloatArray:
    """Allan variance of unit coefficients, shape (t, 4)."""
    flat = np.full_like(taus, FLAT_SHARE)
    return np.column_stack([1.0 / taus, flat, taus / 3.0, 0.5 * taus**2])


def fit_noise(found: AllanVariance, period: float) -> list[NoiseFit]:
    """Fit the noise coefficients of each channel.

    Args:
        found: Allan variances of c channels.
        period: seconds between readings.

    Returns:
        One fit per channel; none of them if the recording is too short.
    """
    taus = np.asarray(found.lengths * period, np.float64)
    long = max(found.segments, default=0) * period
    octave = (found.lengths & (found.lengths - 1)) == 0
    fitted = octave & (taus <= long / MIN_SPANS)
    if fitted.sum() < MIN_OCTAVES:
        return []
    spans = np.array(found.segments) * period
    strides = np.asarray(found.strides * period, np.float64)
    theory = AllanTheory(taus, strides, spans.tolist(), fitted)
    return [
        _fit_axis(taus, np.maximum(column, MIN_VARIANCE_SHARE * column.max()), fitted, theory)
        if column.any()
        else _silent(taus)
        for column in found.variance.T
    ]


def _silent(taus: FloatArray) -> NoiseFit:
    """The result of an axis whose reading is constant."""
    none = Coefficient(0.0, 0.0, determined=False, below=0.0)
    zeros = np.zeros(len(taus))
    return NoiseFit(dict.fromkeys(COEFFICIENTS, none), float(taus[0]), 1.0, zeros, zeros)


def _fit_axis(
    taus: FloatArray, variance: FloatArray, fitted: BoolArray, theory: AllanTheory
) -> NoiseFit:
    """Fit one axis."""
    rows = np.flatnonzero(fitted)
    used = rows[_first_row(variance, rows, theory) :]
    best: tuple[float, FloatArray, FloatArray] | None = None
    # a steady drift only where a random walk does not describe the rise
    for count in (_RANDOM, len(COEFFICIENTS)):
        squares, covariance, misfit = _weighted(variance[used], used, theory, count)
        freedom = max(len(used) - count, 1)
        p = exceeded(misfit / freedom, freedom, EXACT_FREEDOM)
        if best is None or p > best[0]:
            # structure that the model does not describe counts as noise
            inflation = max(misfit / freedom, 1.0) if p < MISFIT_P else 1.0
            best = p, squares, covariance * inflation
        if p >= MISFIT_P:
            break
    assert best is not None  # noqa: S101 (narrows the type)
    p, squares, covariance = best
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    model = unit_variances(taus) @ squares
    spread = np.sqrt(np.maximum(np.diag(theory.covariance(squares)), 0.0))
    error = 0.5 * spread / np.maximum(model, 1e-300) * np.sqrt(np.maximum(variance, 0.0))
    named = {}
    for place, name in enumerate(COEFFICIENTS):
        if place >= _RANDOM and not errors[place]:
            continue  # no drift was fitted
        square, one = float(squares[place]), float(errors[place])
        limit = square + WITHIN_NINETY * one
        if place < _RANDOM:
            limit = _upper_limit(place, squares, one, used, theory)
        value, below, determined = np.sqrt(square), np.sqrt(limit), square > DETERMINED_SIGMA * one
        # of the root, also where the square is within its error
        own = 0.5 * (np.sqrt(square + one) - np.sqrt(max(square - one, 0.0)))
        if not determined:
            own = max(own, value / DETERMINED_SIGMA, (below - value) / WITHIN_NINETY)
        named[name] = Coefficient(float(value), float(own), determined, float(below))
    return NoiseFit(named, float(taus[used[0]]), p, np.sqrt(model), error)


def _first_row(variance: FloatArray, rows: IntArray, theory: AllanTheory) -> int:
    """Place of the shortest τ that neither a filter of the sensor nor a vibration changes.

    Each τ is tested with the next octaves only, so that structure at long τ does not exclude short
    ones. A filter still acts where its misfit is no longer seen: a few more octaves are left out.
    """
    last = len(rows) - MIN_OCTAVES
    for place in range(last + 1):
        if theory.taus[rows[place]] > MAX_FIRST_TAU:
            break
        part = rows[place : place + MIN_OCTAVES]
        _, _, misfit = _weighted(variance[part], part, theory, _RANDOM)
        freedom = MIN_OCTAVES - _RANDOM
        if exceeded(misfit / freedom, freedom, EXACT_FREEDOM) >= MISFIT_P:
            return min(place + GUARD_OCTAVES, last) if place else 0
    return 0


def _weighted(
    variance: FloatArray, rows: IntArray, theory: AllanTheory, count: int
) -> tuple[FloatArray, FloatArray, float]:
    """Generalised least squares with non-negative squares.

    The weights follow from the fitted curve; with the scattering variances themselves, the smallest
    would count most.

    Args:
        variance: Allan variances, shape (r,).
        rows: their places among all of ``theory``, shape (r,).
        theory: of their covariance.
        count: the first so many coefficients; the others are zero.

    Returns:
        N², B², K², R²; their covariance; the weighted sum of squared residuals.
    """
    A = unit_variances(theory.taus[rows])[:, :count]
    weights = np.diag(1.0 / variance**2)
    squares = np.zeros(len(COEFFICIENTS))
    squares[:count] = _not_negative(A, variance, weights)
    # a curve without white noise would have no scatter
    least = np.zeros(len(COEFFICIENTS))
    least[0] = LEAST_WHITE_SHARE * float((variance * theory.taus[rows]).min())
    for _ in range(WEIGHTING_ROUNDS):
        weights = _weights(theory, np.maximum(squares, least), rows)
        before = squares[:count].copy()
        squares[:count] = _not_negative(A, variance, weights)
        if np.allclose(before, squares[:count], rtol=1e-6, atol=0.0):
            break
    rest = variance - A @ squares[:count]
    return squares, _covariance(A, weights), float(rest @ weights @ rest)


def _weights(theory: AllanTheory, squares: FloatArray, rows: IntArray) -> FloatArray:
    """Inverse covariance of Allan variances for these coefficients, shape (r, r)."""
    whole = theory.covariance(squares)[np.ix_(rows, rows)]
    scale = np.sqrt(np.diag(whole))
    # neighbouring τ are so similar that rounding in a weak eigenvalue would have a weight
    values, vectors = np.linalg.eigh(whole / np.outer(scale, scale))
    vectors = vectors / np.sqrt(np.maximum(values, MIN_EIGENVALUE)) / scale[:, None]
    return np.asarray(vectors @ vectors.T)


def _covariance(A: FloatArray, weights: FloatArray) -> FloatArray:
    """Covariance of the squares of all coefficients; zeros for those that are not fitted."""
    norm = np.sqrt(np.einsum("ij,ik,kj->j", A, weights, A))
    information = (A.T @ weights @ A) / np.outer(norm, norm)
    count = A.shape[1]
    found = np.zeros((len(COEFFICIENTS), len(COEFFICIENTS)))
    found[:count, :count] = np.linalg.pinv(information, hermitian=True) / np.outer(norm, norm)
    return found


def _upper_limit(
    place: int, squares: FloatArray, error: float, rows: IntArray, theory: AllanTheory
) -> float:
    """Square of a coefficient that would give a smaller estimate in 5 of 100 recordings.

    Its own size adds to the scatter of the Allan variances, so that the limit is found in steps.
    """
    A = unit_variances(theory.taus[rows])[:, :_RANDOM]
    limit = squares.copy()
    for _ in range(LIMIT_ROUNDS):
        limit[place] = squares[place] + WITHIN_NINETY * error
        error = float(np.sqrt(_covariance(A, _weights(theory, limit, rows))[place, place]))
    return float(limit[place])


def _not_negative(A: FloatArray, values: FloatArray, weights: FloatArray) -> FloatArray:
    """The best fit by any subset of the columns with positive coefficients only."""
    best, least = np.zeros(A.shape[1]), np.inf
    for count in range(1, A.shape[1] + 1):
        for chosen in combinations(range(A.shape[1]), count):
            part = A[:, chosen]
            normal = part.T @ weights @ part
            size = np.sqrt(np.diag(normal))
            projected = part.T @ weights @ values / size
            solved = np.linalg.solve(normal / np.outer(size, size), projected) / size
            if (solved < 0.0).any():
                continue
            rest = values - part @ solved
            error = float(rest @ weights @ rest)
            if error < least:
                best, least = np.zeros(A.shape[1]), error
                best[list(chosen)] = solved
    return best
