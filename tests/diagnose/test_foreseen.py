"""What is said of an effect's odds before there is any: held to simulations of the same design."""

from dataclasses import replace

import numpy as np
import pytest
from imucal_wizard.diagnose.expected_log_odds import detectable, expected_log_odds

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.explained_variance import ExplainedVariance
from imucal_wizard.diagnose.posterior import HypothesisSet
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals
from tests.diagnose.sessions import session

RECORDINGS = 400
NOISE = 1.1
ENOUGH = 6.0
"""Log odds that are asked for."""


def drift(misfit: WhitenedResiduals) -> Candidate:
    """A slow effect, which wandering noise imitates."""
    return next(one for one in misfit.candidates if one.term == "bias-drift")


def simulated(hypotheses: HypothesisSet, one: Candidate, size: float, wander: float) -> FloatArray:
    """Log odds of its first parameter in recordings that it alone is hidden in."""
    place = next(
        k
        for k, h in enumerate(hypotheses.single)
        if h.terms == (one.term,) and h.parameter == one.names[0] and h.variant == one.variant
    )
    shown = size * (hypotheses.frame.across.T @ one.columns[:, 0])
    noise = np.random.default_rng(3).standard_normal((RECORDINGS, len(shown)))
    noise *= NOISE / np.sqrt(hypotheses.frame.weights(wander))
    evidence = [
        hypotheses.posterior(hypotheses.frame.across @ (shown + each)).evidence for each in noise
    ]
    return np.array([each[place] - each[0] for each in evidence])


@pytest.mark.parametrize("wander", [0.3, 0.6, 2.0])
def test_odds_are_foreseen_with_their_spread(wander: float) -> None:
    """To first order: within a unit of their middle and a quarter of their spread."""
    misfit, hypotheses = session()
    hypotheses = HypothesisSet(hypotheses.frame, hypotheses.single)
    one = drift(misfit)
    size = detectable(hypotheses, one, ENOUGH, NOISE, wander)[0]
    patterns = hypotheses.frame.across.T @ one.columns[:, :1]
    said = expected_log_odds(
        hypotheses, patterns, one.typical[:1], np.array([[size]]), NOISE, wander
    )
    found = simulated(hypotheses, one, size, wander)
    assert said.mean[0, 0] == pytest.approx(np.median(found), abs=1.0)
    assert said.deviation[0, 0] == pytest.approx(found.std(), rel=0.25)


@pytest.mark.parametrize("wander", [0.3, 0.6, 2.0])
def test_a_slow_effect_of_its_detectable_size_reaches_the_odds_95_times_in_100(
    wander: float,
) -> None:
    """A wander that the noise may have takes some of it; counting binomially, 90 of 100 or more."""
    misfit, hypotheses = session()
    hypotheses = HypothesisSet(hypotheses.frame, hypotheses.single)
    one = drift(misfit)
    size = detectable(hypotheses, one, ENOUGH, NOISE, wander)[0]
    needed = ENOUGH + np.log(2.0 * len(one.names))
    assert np.mean(simulated(hypotheses, one, size, wander) > needed) > 0.9


def test_what_an_effect_takes_away_is_expected_over_the_wander_that_the_noise_may_have() -> None:
    """Half a chance of a far wander leaves half of it, not what a middling wander would leave."""
    misfit, hypotheses = session("bias-drift:0.3:x")
    posterior = hypotheses.posterior(misfit.residual)

    def taken(*shares: float) -> float:
        noise = np.zeros_like(posterior.noise)
        noise[:, 0] = shares
        best = ExplainedVariance(misfit, hypotheses, replace(posterior, noise=noise))
        return best.taken_away(("slow-bias",))["slow-bias"]

    calm, far = taken(1.0, 0.0, 0.0, 0.0), taken(0.0, 0.0, 1.0, 0.0)
    assert far < 0.5 * calm
    assert taken(0.5, 0.0, 0.5, 0.0) == pytest.approx(0.5 * (calm + far))
