"""Student's t with whole degrees of freedom, in closed form (Abramowitz & Stegun 26.7.3–4).

SciPy has it too, but importing its special functions costs more than a whole fit.
"""

import math


def two_sided(t: float, freedom: int) -> float:
    """Probability that |t| is larger by chance.

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
