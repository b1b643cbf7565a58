"""A p-value of one per cent is one per cent."""

import numpy as np
import pytest

from imucal_wizard.diagnose.posterior import hypothesis_set
from imucal_wizard.diagnose.significance import Chances, log_odds, members
from tests.diagnose.sessions import session

DRAWS = 250
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


def test_a_simulation_is_made_once_and_always_the_same() -> None:
    """The same design and seed give the same threshold, whoever asks first."""
    misfit, _ = session(design="18")
    hypotheses = hypothesis_set(misfit, pairs=False)
    one, other = Chances(hypotheses), Chances(hypotheses)
    assert one.at(1.0, 0) is one.at(1.02, 0)
    np.testing.assert_array_equal(one.at(1.0, 0).best, other.at(1.0, 0).best)
