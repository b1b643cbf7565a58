"""Two effects at once: one parameter of each, of different families.

With the two patterns' products ``a``, ``b``, ``c`` (XᵀWX) and the residual's ``y``, ``z`` (XᵀWr),
and t = (s/σ)², the determinant is ``1 + t (a + b) + t² (ab − c²)`` and the quadratic form
``(t/σ²) [y² + z² + t (b y² − 2c yz + a z²)]`` over it; no matrix is taken apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.bench.hypotheses import DISTURBED, EFFECT, PAIR, PRIOR, Hypothesis
from imucal_wizard.bench.noise import SQUARES
from imucal_wizard.readings import FloatArray

SPREAD = 2.0
"""Size of both against what is typical; two effects that both show are both large."""
SAME_AXIS = 0.2
"""Share of pairs that bend one axis' characteristic, evenly and oddly: one cause makes both."""
WITH_DISTURBED = 0.15
"""Share of an effect and a disturbed hold."""
BENT = ("even-order", "odd-order")


@dataclass(frozen=True, eq=False)
class Pairs:
    """All pairs of a design.

    Attributes:
        patterns: of the single parameters that pair, shape (m, d).
        first: of each pair, shape (p,).
        second: of each pair, shape (p,).
        log_prior: shape (p,).
        members: the single explanations that pair, d of them.
    """

    patterns: FloatArray
    first: NDArray[np.intp]
    second: NDArray[np.intp]
    log_prior: FloatArray
    members: tuple[Hypothesis, ...]

    def __len__(self) -> int:
        return len(self.first)

    def both(self, place: int) -> list[Hypothesis]:
        """The two explanations of a pair."""
        return [self.members[self.first[place]], self.members[self.second[place]]]

    def gains(self, coordinates: FloatArray, weights: FloatArray) -> NDArray[np.float32]:
        """What each adds to the log likelihood of noise alone, shape (p, sigmas).

        Args:
            coordinates: of a residual, shape (m,).
            weights: of each coordinate, shape (m,).
        """
        products = self.patterns.T @ (weights[:, None] * self.patterns)
        along = self.patterns.T @ (weights * coordinates)
        a, b = products[self.first, self.first], products[self.second, self.second]
        c = products[self.first, self.second]
        y, z = along[self.first], along[self.second]
        # single precision from here on: millions of numbers of which a thousandth is enough
        t = (1.0 / SQUARES).astype(np.float32)
        determinant = np.multiply.outer((a * b - c * c).astype(np.float32), t)
        determinant += (a + b).astype(np.float32)[:, None]
        determinant *= t
        determinant += 1.0
        form = np.multiply.outer((b * y * y - 2.0 * c * y * z + a * z * z).astype(np.float32), t)
        form += (y * y + z * z).astype(np.float32)[:, None]
        form *= t * t
        form /= determinant
        form -= np.log(determinant)
        form *= np.float32(0.5)
        return np.asarray(form)


def all_pairs(hypotheses: Sequence[Hypothesis]) -> Pairs | None:
    """Pairs of single parameters, and of a parameter with a disturbed hold; None without any."""
    single = [
        one for one in hypotheses if one.patterns.shape[1] == 1 and one.kind in (EFFECT, DISTURBED)
    ]
    if not single:
        return None
    family = np.array([one.families[0] for one in single])
    number = np.unique(family, return_inverse=True)[1]
    bent = np.array([one.families[0] in BENT for one in single])
    axis = np.array([one.parameter for one in single])
    wrong = family == DISTURBED
    first, second = np.triu_indices(len(single), 1)
    keep = number[first] != number[second]
    first, second = first[keep], second[keep]
    if not len(first):
        return None
    mixed = wrong[first] | wrong[second]
    same = bent[first] & bent[second] & (axis[first] == axis[second])
    kinds = [(mixed, WITH_DISTURBED), (same, SAME_AXIS), (~mixed & ~same, 0.0)]
    kinds[2] = (kinds[2][0], 1.0 - WITH_DISTURBED - SAME_AXIS)
    shares = np.array([one.log_prior for one in single])
    prior = np.zeros(len(first))
    for where, share in kinds:
        if where.any():
            # a setting among many, as a step's moment, is as likely in a pair as it is alone
            weight = np.exp(shares[first[where]] + shares[second[where]])
            prior[where] = PRIOR[PAIR] * share * weight / weight.sum()
    patterns = np.concatenate([one.patterns for one in single], axis=1)
    size = np.where(wrong, np.array([one.spreads[1] for one in single]), SPREAD)
    return Pairs(patterns * size, first, second, np.log(prior), tuple(single))
