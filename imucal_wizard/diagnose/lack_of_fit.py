"""The test of lack of fit: whether measured noise makes what a model leaves.

The noise is what was measured apart from the model: the noise within the holds, and how far the
same pose differs from one visit to the next. Residuals between directions do not tell it: they hold
what the model lacks. The residual is tested twice, each time at one per cent:

- against the noise within the holds alone, by F with the degrees of freedom of that noise;
- where poses were repeated, against that and the variance between visits that the repeats show:
  F of what is left between the directions over the pure error (Draper & Smith, Applied Regression
  Analysis, 2.1).
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.residuals import RowKind, WhitenedResiduals
from imucal_wizard.estimate.distributions import exceeded
from imucal_wizard.estimate.repeatability import WITHIN_FREEDOM, pure_error
from imucal_wizard.estimate.slow_noise import complement

TEST_LEVEL = 0.01
"""Share of complete models that the test rejects."""
MAX_REPEATABILITY = 2.5
"""What is left, rms in units of the noise within the holds, above which poses that differ from
visit to visit are no noise of a usable sensor. Structure of three times that noise leaves more than
this with any poses; flicker noise of four times the usual size leaves 2."""


@dataclass(frozen=True)
class LackOfFit:
    """What a model leaves, against measured noise.

    Attributes:
        ratio: what is left, rms over its degrees of freedom, in units of the noise within holds.
        p: chance that this noise alone leaves as much.
        share: variance of the visits to one pose, over that of this noise; None without repeats.
        p_visits: chance that noise with the variance between visits leaves as much between the
            directions; None without repeats.
        p_repeatable: chance that the noise within holds makes visits differ as much; None without.
    """

    ratio: float
    p: float
    share: float | None = None
    p_visits: float | None = None
    p_repeatable: float | None = None

    @property
    def within_noise(self) -> bool:
        """Whether measured noise, of the holds alone or of the visits too, makes what is left."""
        if self.p >= TEST_LEVEL:
            return True
        return self._visits_explain and self.ratio <= MAX_REPEATABILITY

    @property
    def not_repeatable(self) -> bool:
        """Whether the visits explain what is left, and differ by far more than the noise."""
        differ = self.p_repeatable is not None and self.p_repeatable < TEST_LEVEL
        return self._visits_explain and differ and self.ratio > MAX_REPEATABILITY

    @property
    def _visits_explain(self) -> bool:
        return self.p_visits is not None and self.p_visits >= TEST_LEVEL


def lack_of_fit(misfit: WhitenedResiduals, coordinates: FloatArray) -> LackOfFit:
    """Test what a model leaves.

    Args:
        misfit: what is left, whitened by the noise within the holds.
        coordinates: of the residual in what the model cannot absorb, shape (m,).
    """
    freedom, known = len(coordinates), WITHIN_FREEDOM * len(misfit)
    if not freedom:
        return LackOfFit(0.0, 1.0)
    total = float(coordinates @ coordinates)
    own = LackOfFit(float(np.sqrt(total / freedom)), exceeded(total / freedom, freedom, known))
    # a direction of the field comes again at another place of the room, which is no noise
    rest = (misfit.kind < RowKind.ROTATION) & (misfit.group >= 0)
    if not rest.any():
        return own
    axis = np.maximum(misfit.axis[rest], 0)
    group, visit = 3 * misfit.group[rest] + axis, 3 * misfit.visit[rest] + axis
    share, repeats = pure_error(misfit.residual[rest], group, visit)
    if not repeats or freedom <= repeats:
        return own
    between = max(share - 1.0, 0.0) * float(np.mean(misfit.sigma[rest] ** 2))
    factor = 1.0 / np.sqrt(1.0 + np.where(rest, between / misfit.sigma**2, 0.0))
    across = complement(factor[:, None] * misfit.base)
    left = float(((across.T @ (factor * misfit.residual)) ** 2).sum())
    pure, _ = pure_error((factor * misfit.residual)[rest], group, visit)
    ratio = (left - repeats * pure) / (freedom - repeats)
    return LackOfFit(
        own.ratio,
        own.p,
        share,
        exceeded(ratio / max(pure, 1.0), freedom - repeats, repeats),
        exceeded(share, repeats, known),
    )
