"""Student's t, Fisher's F and chi square (Abramowitz & Stegun, 26).

They are in closed form or a continued fraction. SciPy has them too, but importing its special
functions costs more than a whole fit.
"""

import math

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import normal_below

EXACT_FREEDOM = 100_000
"""Degrees of freedom of a variance that is known, as that of a certificate or of a theory."""
FAR_OUTSIDE = 1e100
"""Standard deviations beyond which nothing lies; the square of more may be no number."""


def two_sided(t: float, freedom: int) -> float:
    """Probability that |t| of Student is larger by chance.

    With ``θ = atan(|t|/√ν)`` the probability that it is smaller is a finite sum of powers of cos θ.

    Args:
        t: the value.
        freedom: degrees of freedom ν, at least 1.
    """
    theta = math.atan(abs(t) / math.sqrt(freedom))
    cosine = math.cos(theta)
    odd = freedom % 2
    term = cosine if odd else 1.0
    total = 0.0 if freedom == 1 else term
    for power in range(3 + odd, freedom + odd, 2):
        term *= (power - 2.0) / (power - 1.0) * cosine**2
        total += term
    inside = math.sin(theta) * total
    if odd:
        inside = 2.0 / math.pi * (theta + inside)
    return min(max(1.0 - inside, 0.0), 1.0)


def outside(t: FloatArray, freedom: float) -> FloatArray:
    """``two_sided`` of an array: Wallace's normal variable (26.7.8).

    Within 2 % of probabilities above 1 % from four degrees of freedom on.

    Args:
        t: the values, not negative.
        freedom: degrees of freedom, above 0.
    """
    t = np.minimum(t, FAR_OUTSIDE)
    normal = np.sqrt(freedom * np.log1p(t**2 / freedom))
    normal *= (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)
    return 2.0 * normal_below(-normal)


def quantile(level: float, freedom: int) -> float:
    """How many standard errors an interval reaches that holds the truth with this probability.

    Args:
        level: probability inside, between 0 and 1 (0.95).
        freedom: degrees of freedom of the standard error, at least 1.
    """
    low, high = 0.0, 1.0
    while two_sided(high, freedom) > 1.0 - level:
        high *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if two_sided(middle, freedom) > 1.0 - level:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


WITHIN_NINETY = 1.6449
"""Standard deviations to either side that hold nine in ten of a normal distribution; below the
upper end are 95 in 100."""


MIN_APPROXIMATED = 6.0
"""Degrees of freedom from which on Wilson and Hilferty's approximation of chi square is used: with
one, its quantile of 5 % is zero."""


def chi_square(deviations: float, freedom: float) -> float:
    """Chi square over its degrees of freedom where a normal variable is so many deviations away.

    From ``MIN_APPROXIMATED`` degrees of freedom on by Wilson and Hilferty's approximation
    (26.4.17), within 2 % of the quantiles of 5 and 95 %; below by bisection.

    Args:
        deviations: of the normal variable, standard deviations.
        freedom: degrees of freedom, above 0.
    """
    if freedom >= MIN_APPROXIMATED:
        share = 2.0 / (9.0 * freedom)
        return float(max(1.0 - share + deviations * math.sqrt(share), 0.0) ** 3) or _TINY
    wanted = 0.5 * math.erfc(-deviations / math.sqrt(2.0))
    low, high = math.log(_TINY), math.log(100.0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _gamma_below(0.5 * freedom, 0.5 * freedom * math.exp(middle)) < wanted:
            low = middle
        else:
            high = middle
    return math.exp(low)


def _gamma_below(a: float, x: float) -> float:
    """Regularised incomplete gamma function P(a, x) by its series (6.5.29)."""
    term = total = 1.0 / a
    step = 0
    while term > _ENOUGH * total:
        step += 1
        term *= x / (a + step)
        total += term
    return total * math.exp(a * math.log(x) - x - math.lgamma(a))


_TINY = 1e-300
_ENOUGH = 1e-14
_MOST = 10_000


def exceeded(ratio: float, freedom: float, below: float) -> float:
    """Probability that F is larger than ``ratio`` (Abramowitz & Stegun 26.6.2).

    Args:
        ratio: of the variances.
        freedom: degrees of freedom of the one above.
        below: of the one below.
    """
    if ratio <= 0.0:
        return 1.0
    if not math.isfinite(ratio):
        return 0.0
    return _beta(below / (below + freedom * ratio), 0.5 * below, 0.5 * freedom)


def _beta(x: float, a: float, b: float) -> float:
    """Regularised incomplete beta function I_x(a, b), from the side where its fraction is short."""
    if x <= 0.0 or x >= 1.0:
        return min(max(x, 0.0), 1.0)
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - _beta(1.0 - x, b, a)
    logs = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    front = math.exp(logs + a * math.log(x) + b * math.log1p(-x))
    return min(front / a * _fraction(x, a, b), 1.0)


def _fraction(x: float, a: float, b: float) -> float:
    """Its continued fraction (26.5.8), ``1/(1 + d₁/(1 + d₂/(1 + …``, by Lentz's recurrence."""
    above, below, value = 1.0, 0.0, 1.0
    for step in range(1, _MOST):
        half = step // 2
        front = -(a + half) * (a + b + half) if step % 2 else half * (b - half)
        term = front * x / ((a + step - 1.0) * (a + step))
        below = 1.0 / _safe(1.0 + term * below)
        above = _safe(1.0 + term / above)
        value *= above * below
        if abs(above * below - 1.0) < _ENOUGH:
            break
    return 1.0 / value


def _safe(value: float) -> float:
    return value if abs(value) > _TINY else _TINY
