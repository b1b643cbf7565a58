"""An effect far above its usual size is named as one of usual size is."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.hidden.designs import PLANS
from benchmarks.hidden.fitted import measured_of
from benchmarks.hidden.noise import CONSUMER
from benchmarks.hidden.recording import record
from benchmarks.wrong_names import answered
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.hypotheses import PAIR, UNKNOWN
from imucal_wizard.diagnose.posterior import explained
from imucal_wizard.diagnose.survey import add_by_itself
from imucal_wizard.diagnose.verdict import Verdict, judge_misfit
from imucal_wizard.simulate.hidden import parse_hidden
from tests.diagnose.sessions import session


@pytest.mark.parametrize(
    ("hidden", "plan"),
    [
        ("hysteresis:20:z", "18"),
        ("warm-up:160:y", "26+12"),
        ("third-order:80:x", "26+12"),
        ("second-order:80:x", "26+12"),
        ("bias-step:60:x", "26+12"),
    ],
)
def test_an_effect_far_above_its_usual_size_is_added_under_its_name(hidden: str, plan: str) -> None:
    """Neither its size nor its square is taken for noise, unknown structure or another effect."""
    rng = np.random.default_rng(511)
    recorded = record(PLANS[plan], CONSUMER, (parse_hidden(hidden),), rng)
    bench = Bench("accelerometer", measured_of(recorded))
    name = hidden.partition(":")[0]
    trial = next(one.trial for one in bench.look().suspects if one.term == name)
    add_by_itself(bench)
    assert [term.name for term in bench.fit.terms] == [name]
    assert trial is not None
    assert trial.rms_held_out == pytest.approx(bench.fit.rms_held_out, rel=0.05)  # as promised


@pytest.mark.parametrize(("seed", "number"), [(23802, 38)])
def test_structure_far_above_the_noise_keeps_its_place_beside_a_less_likely_effect(
    seed: int, number: int
) -> None:
    """At the place of a step of the bias, the rows of an axis that tilts are no longer linear."""
    answer = answered("axis that tilts once", seed, number)
    assert answer.names == ()
    assert answer.verdict is Verdict.UNEXPLAINED


def test_two_effects_of_which_one_has_many_parameters_are_named_together() -> None:
    """Neither alone explains the misfit, and unknown structure would explain everything."""
    misfit, alone = session()
    known = {one.term: one for one in misfit.candidates}
    wide, single = known["cross-product"], known["hysteresis"]
    sizes = 10.0 * wide.typical * np.resize([1.0, -0.5, -1.0], len(wide.names))
    error = wide.columns @ sizes + 40.0 * single.columns[:, 0] * single.typical[0]
    misfit = replace(misfit, residual=misfit.residual + error)
    posterior = alone.posterior(misfit.residual)
    unknown = [one.kind == UNKNOWN for one in alone.single]
    assert posterior.single[unknown].sum() > 0.9
    assert judge_misfit(misfit, *explained(misfit)).families == ("even-order", "hysteresis")


def test_an_effect_without_any_of_another_family_is_joined_with_none() -> None:
    """It was joined with noise alone, which has no family: a look at the misfit failed."""
    misfit, alone = session()
    unknown = next(one for one in alone.single if one.kind == UNKNOWN)
    pattern = (
        alone.frame.across @ unknown.patterns @ np.resize([20.0, -20.0], unknown.patterns.shape[1])
    )
    candidates = tuple(one for one in misfit.candidates if one.family == "slow-bias")
    misfit = replace(misfit, residual=misfit.residual + pattern, candidates=candidates)
    hypotheses, posterior = explained(misfit)
    assert not any(one.kind == PAIR for one in hypotheses.single)
    assert judge_misfit(misfit, hypotheses, posterior).families == ()
