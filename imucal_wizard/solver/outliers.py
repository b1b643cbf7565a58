"""The one hold or rotation that does not fit with all others: to be measured again, never dropped.

Left out, a good one lowers the sum of squares by about its share; how much more is by chance is
known exactly for normal noise (the externally studentised residual). All of them are looked at, so
the probability is multiplied by their number (Bonferroni).
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.student import two_sided

FALSE_ALARM = 0.001
"""Probability with which a faultless set of data has a suspect."""
SMALLEST_FREEDOM = 3
"""Degrees of freedom below which one measurement is not told from the fit itself."""


@dataclass(frozen=True)
class Suspect:
    """What does not fit.

    Attributes:
        index: which hold or rotation.
        probability: of such a misfit anywhere by chance.
        ratio: its error, free of its own pull on the fit, over the spread of the others.
    """

    index: int
    probability: float
    ratio: float


def suspect_hold(errors: FloatArray, columns: FloatArray) -> Suspect | None:
    """The hold that stands out, if any.

    Args:
        errors: weighted residuals, shape (n,).
        columns: weighted derivative by the parameters fitted, shape (n, p).
    """
    freedom = len(errors) - columns.shape[1]
    if freedom < SMALLEST_FREEDOM:
        return None
    leverage = np.minimum((columns * np.linalg.pinv(columns).T).sum(axis=1), 1.0)
    left = 1.0 - leverage
    seen = left > 1e-6
    drops = np.where(seen, errors**2 / np.where(seen, left, 1.0), 0.0)
    worst = int(np.argmax(drops))
    spread = (float(errors @ errors) - drops[worst]) / (freedom - 1)
    if not drops[worst] > 0.0:
        return None
    ratio = float(np.sqrt(drops[worst] / max(spread, 1e-12 * drops[worst])))
    probability = min(len(errors) * two_sided(ratio, freedom - 1), 1.0)
    return Suspect(worst, probability, ratio) if probability < FALSE_ALARM else None


def suspect_rotation(closure: FloatArray, drops: FloatArray, freedom: int) -> Suspect | None:
    """The rotation that stands out, if any.

    Two components of each closure count; of their ratio to the others' spread the distribution is
    Fisher's with 2 and ν degrees of freedom, ``P(F > f) = (1 + 2 f/ν)^(−ν/2)``.

    Args:
        closure: weighted closure error of each rotation, shape (m, 3).
        drops: how much the sum of their squares falls without each, shape (m,).
        freedom: degrees of freedom of the fit.
    """
    rest = freedom - 2
    if rest < SMALLEST_FREEDOM:
        return None
    total = float((closure**2).sum())
    worst = int(np.argmax(drops))
    drop = min(float(drops[worst]), total)
    if not drop > 0.0:
        return None
    spread = max((total - drop) / rest, 1e-12 * drop)
    probability = len(closure) * float((1.0 + drop / spread / rest) ** (-0.5 * rest))
    ratio = float(np.sqrt(0.5 * drop / spread))
    return Suspect(worst, min(probability, 1.0), ratio) if probability < FALSE_ALARM else None
