"""Marginal likelihoods are what the textbook's density says."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.hypotheses import DISTURBED, EFFECT, PAIR_SPREAD, UNKNOWN
from imucal_wizard.diagnose.posterior import HypothesisSet, explained, hypothesis_set
from imucal_wizard.diagnose.random_walk import SIGMAS, sigma_prior
from imucal_wizard.diagnose.significance import log_evidences
from imucal_wizard.diagnose.verdict import judge_misfit
from tests.diagnose.recordings import fitted
from tests.diagnose.sessions import session


def density(
    hypotheses: HypothesisSet, residual: FloatArray, own: list[tuple[FloatArray, float]]
) -> float:
    """Log density of a residual, averaged over σ and the noise's wander.

    Args:
        hypotheses: whose coordinates and priors.
        residual: whitened.
        own: patterns and the standard deviation of their size.
    """
    frame = hypotheses.frame
    x = frame.across.T @ residual
    signal = sum((s**2 * p @ p.T for p, s in own), np.zeros((len(x), len(x))))
    found = [
        prior
        + at
        + multivariate_normal.logpdf(
            x, cov=sigma**2 * np.diag(1.0 + wander**2 * frame.walk) + signal
        )
        for wander, prior in zip(frame.wanders, frame.log_prior, strict=True)
        for sigma, at in zip(SIGMAS, sigma_prior(), strict=True)
    ]
    return float(logsumexp(found)) + 0.5 * len(x) * float(np.log(2.0 * np.pi))


@pytest.mark.parametrize("kind", [EFFECT, DISTURBED, UNKNOWN])
def test_a_single_explanation_has_the_density_of_its_covariance(kind: str) -> None:
    """Averaged over size, σ and wander, each explanation is a mixture of plain Gaussians."""
    misfit, hypotheses = session("second-order:1:x", design="18")
    evidence = hypotheses.posterior(misfit.residual).evidence
    places = [i for i, one in enumerate(hypotheses.single) if one.kind == kind][:9:3]
    for place in places:
        one = hypotheses.single[place]
        each = [density(hypotheses, misfit.residual, [(one.patterns, s)]) for s in one.spreads]
        assert evidence[place] == pytest.approx(logsumexp(each, b=one.shares), abs=1e-6)
    assert evidence[0] == pytest.approx(density(hypotheses, misfit.residual, []), abs=1e-6)


def test_what_the_model_takes_up_explains_nothing_at_any_size() -> None:
    """Cubic cross terms make third-order terms up to a scale, and nearly all odd quadratic ones.

    What is left of these, 0.5 %, is what a linear model neglects as well. A residual along it would
    need dozens of times the usual size.
    """
    bench = Benches(*fitted(poses="26+repeats", seed=5)).accelerometer
    bench.add("cubic-cross")
    misfit = bench.look().misfit
    frame = hypothesis_set(misfit, pairs=False).frame
    alike = next(one for one in misfit.candidates if one.term == "odd-quadratic")
    left = frame.across @ (frame.across.T @ alike.columns[:, 0])
    assert 0.0 < np.linalg.norm(left) < 0.01 * np.linalg.norm(alike.columns[:, 0])
    wrong = replace(misfit, residual=20.0 * left / np.linalg.norm(left))
    hypotheses, posterior = explained(wrong)
    blamed = [one.terms == ("odd-quadratic",) for one in hypotheses.single]
    assert posterior.single[blamed].sum() < 0.1


def test_pairs_have_the_density_of_both_patterns() -> None:
    """The closed form for two patterns is the Gaussian with both of them."""
    misfit, hypotheses = session("second-order:1:x", design="18")
    posterior, pairs = hypotheses.posterior(misfit.residual), hypotheses.pairs
    assert pairs is not None
    nothing = posterior.evidence[0] + hypotheses.log_prior[0]
    for place in (0, len(pairs) // 3, int(posterior.paired.argmax())):
        both = [
            (one.patterns, one.spreads[1] if one.kind == DISTURBED else PAIR_SPREAD)
            for one in pairs.both(place)
        ]
        wanted = density(hypotheses, misfit.residual, both) + pairs.log_prior[place] - nothing
        found = np.log(posterior.paired[place]) - np.log(posterior.single[0])
        # single precision of numbers up to about 30
        assert found == pytest.approx(wanted, abs=4e-6)


def test_two_effects_of_one_slow_family_explain_what_neither_does() -> None:
    """A bias that drifts, and settles at the beginning: no time constant makes both."""
    misfit, _ = session(design="26+12")
    sizes = {("bias-drift", None): 20.0, ("warm-up", 60.0): 40.0}
    for one in misfit.candidates:
        size = sizes.get((one.term, one.variant), 0.0) / np.linalg.norm(one.columns, axis=0).max()
        misfit = replace(misfit, residual=misfit.residual + size * one.columns.sum(axis=1))
    hypotheses, posterior = explained(misfit)
    shares = zip(hypotheses.single, posterior.single, strict=True)
    both = sum(own for one, own in shares if one.terms == ("bias-drift", "warm-up"))
    assert both > 0.75
    opinion = judge_misfit(misfit, hypotheses, posterior)
    assert opinion.families == ("slow-bias", "slow-bias")
    assert {*opinion.terms} == {("bias-drift",), ("warm-up",)}


def test_probabilities_add_up_to_one() -> None:
    """Single explanations and pairs share all the probability, and so does the noise."""
    misfit, hypotheses = session("second-order:1:x", design="18")
    posterior = hypotheses.posterior(misfit.residual)
    assert posterior.single.sum() + posterior.paired.sum() == pytest.approx(1.0)
    assert posterior.noise.sum() == pytest.approx(1.0)


def test_many_residuals_at_once_are_judged_as_each_alone() -> None:
    """The simulation's evidence without a loop is that of one residual after the other."""
    misfit, hypotheses = session(design="18")
    rng = np.random.default_rng(0)
    residuals = rng.standard_normal((5, len(misfit)))
    together = log_evidences(hypotheses, residuals @ hypotheses.frame.across)
    for row, residual in zip(together, residuals, strict=True):
        # noise sizes that are out of the question are left out of the simulation
        np.testing.assert_allclose(row, hypotheses.posterior(residual).evidence, atol=1e-3)


@pytest.mark.parametrize("times", [1.0, 2.0, 4.0])
def test_the_noise_is_found_from_what_the_repeats_leave(times: float) -> None:
    """White noise of any size is called noise of that size; the prior draws a little to one."""
    misfit, hypotheses = session()
    rng = np.random.default_rng(1)
    found = []
    for _ in range(8):
        posterior = hypotheses.posterior(times * rng.standard_normal(len(misfit)))
        assert posterior.single[0] == posterior.single.max()
        found.append(posterior.sigma[0])
    assert np.mean(found) == pytest.approx(times, rel=0.15)


def test_what_a_name_leaves_is_an_effect_of_the_catalogue_or_unknown() -> None:
    """Beside hysteresis the shaken poses are an effect, a ripple is unknown structure."""
    shaken, known = session("hysteresis:2:z", "vibration-rectification:900:x")
    own = next(one for one in known.single if one.terms == ("hysteresis",) and not one.parameter)
    inside = np.linalg.qr(own.patterns)[0]
    left = known.beside(known.frame.across.T @ shaken.residual, inside)
    assert left[EFFECT] > 0.9
    assert sum(left.values()) == pytest.approx(1.0)
    ripple = 8.0 * np.sin(9.0 * shaken.direction[:, 0])
    rippled = shaken.whitened(np.diag(shaken.sigma)) @ ripple
    left = known.beside(known.frame.across.T @ rippled, inside)
    assert left[UNKNOWN] > 0.9


def test_a_step_of_the_scale_is_named_beside_another_effect() -> None:
    """Of its moments every second is paired: the moment between two of them is near enough."""
    misfit, known = session("scale-step:3000:y", "hysteresis:2:x")
    opinion = judge_misfit(misfit, known, known.posterior(misfit.residual))
    assert opinion.families == ("hysteresis", "slow-scale")
