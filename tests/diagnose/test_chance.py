"""A p-value of one per cent is one per cent."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import complement
from imucal_wizard.diagnose.posterior import explained, hypothesis_set
from imucal_wizard.diagnose.residuals import WhitenedResiduals
from imucal_wizard.diagnose.significance import Chances, log_odds, members
from imucal_wizard.diagnose.suspects import rank
from tests.diagnose.sessions import session

DRAWS = 125
LEVELS = (0.05, 0.1, 0.3, 0.6)
IN_WHITE_NOISE = 0.1
"""By which p of 0.3 comes too often where the noise wanders, in 1,500 draws of another seed: half
of the probability goes to noise that does not wander, in which suspects look less good. Small p,
which decide, do not come too often."""


@pytest.mark.study
@pytest.mark.parametrize(
    ("sigma", "wander", "excess"), [(1.0, 0, 0.0), (1.6, 0, 0.0), (1.0, 1, IN_WHITE_NOISE)]
)
def test_under_noise_alone_p_is_uniform(sigma: float, wander: int, excess: float) -> None:
    """Noise of other sizes, and noise that wanders, gives small p no oftener than it says."""
    misfit, _ = session()
    hypotheses = hypothesis_set(misfit, pairs=False)
    chances = Chances(hypotheses)
    rng = np.random.default_rng(8)
    root = sigma / np.sqrt(hypotheses.frame.weights(hypotheses.frame.wanders[wander]))
    found = []
    for _ in range(DRAWS):
        residual = hypotheses.frame.across @ (root * rng.standard_normal(len(root)))
        posterior = hypotheses.posterior(residual)
        best = max(
            float(log_odds(posterior.evidence, hypotheses, own))
            for own in members(hypotheses).values()
        )
        found.append(chances.p(best, posterior.noise))
    for level in LEVELS:
        share = np.mean(np.array(found) < level)
        allowed = 3.0 * np.sqrt(level * (1.0 - level) / DRAWS)
        assert share < level + allowed + (excess if level > 0.1 else 0.0)
        assert share > level - allowed - 0.1  # noise of unknown size makes p a little too large


def first_p(residual: FloatArray, misfit: WhitenedResiduals) -> float:
    """The p of the first suspect where this is left, shape (n,)."""
    left = replace(misfit, residual=residual)
    return rank(left, *explained(left))[0].p


def test_noise_between_holds_of_any_size_makes_no_small_p() -> None:
    """A quiet sensor whose seat scatters by 150 times the noise within its holds.

    An effect as large has a small p all the same.
    """
    misfit, _ = session()
    across, rng = complement(misfit.base), np.random.default_rng(3)
    found = [
        first_p(150.0 * (across @ rng.standard_normal(across.shape[1])), misfit) for _ in range(4)
    ]
    assert np.median(found) > 0.1
    assert sum(one < 0.01 for one in found) <= 1
    bent = next(one for one in misfit.candidates if one.term == "second-order").columns[:, 0]
    shown = across @ (across.T @ bent)
    noise = across @ rng.standard_normal(across.shape[1])
    size = 150.0 * np.sqrt(across.shape[1]) / np.linalg.norm(shown)
    assert first_p(size * shown + noise, misfit) < 0.003


def test_a_simulation_is_made_once_and_always_the_same() -> None:
    """The same design and seed give the same threshold, whoever asks first."""
    misfit, _ = session(design="18")
    hypotheses = hypothesis_set(misfit, pairs=False)
    one, other = Chances(hypotheses), Chances(hypotheses)
    assert one.at(1.0, 0) is one.at(1.02, 0)
    np.testing.assert_array_equal(one.at(1.0, 0).best, other.at(1.0, 0).best)
