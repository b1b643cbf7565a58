"""Detection of a single hold or rotation that disagrees with all others; it is never dropped.

Left out, a good one lowers the sum of squares by about its share; how much more is by chance is
known exactly for normal noise (the externally studentised residual, Fisher's F for several
components). All of them are tested, so the probability is multiplied by their number (Bonferroni).
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.distributions import exceeded

FALSE_ALARM = 0.001
"""Probability with which a faultless set of data has an outlier."""
MIN_FREEDOM = 3
"""Degrees of freedom below which one measurement determines the fit itself."""


@dataclass(frozen=True)
class Outlier:
    """What does not fit.

    Attributes:
        index: which hold or rotation, of those whose errors are reported.
        probability: of such a misfit anywhere by chance.
        ratio: its error, free of its own pull on the fit, over the spread of the others.
    """

    index: int
    probability: float
    ratio: float


LEAST_LEFT = 1e-9
"""Share of the squares below which what is left per degree of freedom is rounding."""


def outlier(drops: FloatArray, total: float, size: int, freedom: float) -> Outlier | None:
    """The hold or rotation that stands out, if any.

    Args:
        drops: by how much the weighted sum of squares falls without each, ``rᵀ (I − H)⁻¹ r``, (m,).
        total: the weighted sum of squares.
        size: rows of each.
        freedom: degrees of freedom of that sum.
    """
    rest = freedom - size
    if rest < MIN_FREEDOM or not len(drops):
        return None
    worst = int(np.argmax(drops))
    drop = float(drops[worst])
    spread = (total - drop) / rest
    # where it takes everything away nothing is left to compare it with
    if not spread > LEAST_LEFT * total:
        return None
    ratio = drop / size / spread
    probability = min(len(drops) * exceeded(ratio, size, rest), 1.0)
    if probability >= FALSE_ALARM:
        return None
    return Outlier(worst, probability, float(np.sqrt(ratio)))
