"""The sizes that are told in advance, held to simulations of the same design."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from benchmarks.hidden.designs import STANDARD
from benchmarks.hidden.noise import CONSUMER
from benchmarks.hidden.recording import record
from benchmarks.hidden.trialled import Nameable, chances_of
from benchmarks.sizes import NAMED, SEEN, Asked, Compared, least_factor, seeds_of, session_told
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose import detectability
from imucal_wizard.diagnose.detectability import Detectability
from imucal_wizard.diagnose.explained_variance import ExplainedVariance
from imucal_wizard.diagnose.noise_draws import NoiseDraws
from imucal_wizard.diagnose.posterior import HypothesisSet, Posterior
from imucal_wizard.diagnose.random_walk import SIGMAS
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals
from imucal_wizard.diagnose.significance import SEEN_P, Chances
from imucal_wizard.diagnose.suspects import rank
from imucal_wizard.diagnose.verdict import judge_misfit
from imucal_wizard.estimate.accelerometer import AccelerometerExperiment
from imucal_wizard.estimate.distributions import chi_square
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import Minimum
from imucal_wizard.model.effect import ACCELEROMETER, MAGNETOMETER
from imucal_wizard.simulate.hidden import Hidden
from tests.diagnose.sessions import session

Rule = Callable[[FloatArray], bool]

RECORDINGS = {SEEN: 60, NAMED: 30}
"""With fewer, the largest few of them, which decide on 95 or 90 in 100, say little."""
NOISE = float(SIGMAS[2])


class KnownNoise(AccelerometerExperiment):
    """An experiment whose noise is known.

    Args:
        variance: along each coordinate of the misfit, shape (m,).
    """

    def __init__(self, variance: FloatArray) -> None:
        self._variance = variance

    def foreseen(
        self, found: Minimum[Experiment], combinations: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The variance that is known."""
        del found, combinations
        return np.ones(1), self._variance[None]


def quiet(
    misfit: WhitenedResiduals, known: HypothesisSet, wander: int
) -> tuple[WhitenedResiduals, HypothesisSet, Posterior]:
    """The noise is known: of this size and wander."""
    frame = known.frame
    variance = NOISE**2 / frame.weights(frame.wanders[wander])
    minimum = replace(misfit.minimum, experiment=KnownNoise(variance))
    found = known.posterior(np.zeros(len(frame.across)))
    noise = np.zeros_like(found.noise)
    noise[wander, np.argmin(np.abs(SIGMAS - NOISE))] = 1.0
    shown = replace(misfit, minimum=minimum)
    return shown, known, replace(found, noise=noise)


def right(known: HypothesisSet, shown: FloatArray, met: Rule, what: str) -> bool:
    """Whether the rule is met at the size told, within 20 % as far as these recordings tell.

    Args:
        known: the explanations.
        shown: what an effect of the size told shows, shape (m,).
        met: the rule, of what is left, whitened.
        what: ``seen`` or ``named``.
    """
    found, count = [], RECORDINGS[what]
    for each in NOISE * np.random.default_rng(3).standard_normal((count, len(shown))):

        def at(factor: float, each: FloatArray = each) -> bool:
            return met(known.frame.across @ (factor * shown + each))

        found.append(least_factor(at, 1.0))
    return Compared(what, np.ones((count, 1)), np.array(found), np.ones((count, 2, 1))).may_be_right


def on_one_axis(misfit: WhitenedResiduals, term: str) -> Candidate:
    one = next(one for one in misfit.candidates if one.term == term)
    return replace(one, columns=one.columns[:, :1], typical=one.typical[:1])


def usual(term: str, wander: int = 0) -> tuple[Candidate, Detectability, HypothesisSet, Chances]:
    misfit, known = session()
    known = HypothesisSet(known.frame, known.single)
    chances = Chances(known)
    one = on_one_axis(misfit, term)
    return one, Detectability(*quiet(misfit, known, wander), chances), known, chances


@pytest.mark.study
def test_a_misfit_of_the_size_told_is_seen_95_times_in_100() -> None:
    """A drift, which slow noise resembles."""
    misfit, _ = session()
    one, sizes, known, chances = usual("bias-drift")
    shown = sizes.seen(one)[0] * (known.frame.across.T @ one.columns[:, 0])

    def seen(residual: FloatArray) -> bool:
        posterior = known.posterior(residual)
        return rank(misfit, known, posterior, chances)[0].p <= SEEN_P

    assert right(known, shown, seen, SEEN)


@pytest.mark.study
def test_a_family_is_named_90_times_in_100_at_the_size_told() -> None:
    """A bent characteristic, which other shapes resemble."""
    misfit, _ = session()
    one, sizes, known, _ = usual("second-order")
    shown = sizes.named(one)[0] * (known.frame.across.T @ one.columns[:, 0])

    def named(residual: FloatArray) -> bool:
        left = replace(misfit, residual=residual)
        return judge_misfit(left, known, known.posterior(residual)).families == (one.family,)

    assert right(known, shown, named, NAMED)


def test_a_wander_that_the_noise_may_have_hides_larger_effects() -> None:
    one, calm, _, _ = usual("bias-drift")
    _, far, _, _ = usual("bias-drift", wander=1)
    assert (far.seen(one) > 1.2 * calm.seen(one)).all()


def test_other_draws_of_the_noise_tell_the_same_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """They leave a few per cent, where a size is right to 20 %."""
    misfit, known = session(seed=6)
    posterior, chances = known.posterior(misfit.residual), Chances(known)
    drift = on_one_axis(misfit, "bias-drift")
    told = []
    for seed in range(4):
        monkeypatch.setattr(detectability, "NoiseDraws", partial(NoiseDraws, seed=seed))
        told.append(float(Detectability(misfit, known, posterior, chances).seen(drift)[0]))
    assert np.std(told) < 0.05 * np.mean(told)


def test_an_effect_is_hidden_with_the_setting_that_its_size_is_told_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A slow warm-up and a late step show less than one of the same size at the usual setting."""
    monkeypatch.setattr(Detectability, "named", lambda _, one: one.variant)
    sizes = Nameable(STANDARD, CONSUMER, chances_of(STANDARD, CONSUMER), [3])
    hidden = record(STANDARD, CONSUMER, (), np.random.default_rng([3]))
    assert sizes["warm-up"] == hidden.settling
    assert sizes["bias-step"] == sizes["scale-step"] == hidden.step


@pytest.mark.parametrize(("count", "least"), [(48, 0.0), (60, 1.0)])
def test_few_sessions_give_a_95th_centile_no_upper_end(count: int, least: float) -> None:
    """All of 48 sizes lie below it in 9 of 100 studies, and all of 60 in less than 5.

    Otherwise told over found would look certain in a table of few sessions.
    """
    told, found = np.full((count, 1), float(count)), np.arange(1.0, count + 1.0)
    one = Compared(SEEN, told, np.random.default_rng(0).permutation(found), np.ones((count, 2, 1)))
    ratio, low, high = one.interval
    assert low == pytest.approx(least)
    assert low < ratio < high


def test_few_holds_leave_the_sizes_uncertain() -> None:
    """The interval of a size is that of the noise, by the degrees of freedom of its scale.

    Slow noise is less certain than the scale; it hides a drift, and no second order.
    """
    for design, freedom in (("18", 9), ("26+12", 29)):
        misfit, known = session(design=design)
        sizes = Detectability(misfit, known, known.posterior(misfit.residual), Chances(known))
        width = {}
        for term in ("second-order", "bias-drift"):
            one = next(one for one in misfit.candidates if one.term == term)
            low, high = sizes.uncertainty(one)
            width[term] = float(np.median(high / low))
        by_scale = np.sqrt(chi_square(1.645, freedom) / chi_square(-1.645, freedom))
        assert width["second-order"] == pytest.approx(by_scale, rel=0.15)
        assert width["bias-drift"] > width["second-order"]


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


@pytest.mark.parametrize(
    ("sensor", "term"), [(ACCELEROMETER, "warm-up"), (MAGNETOMETER, "current")]
)
def test_an_effect_that_is_hidden_does_not_count_as_noise(sensor: str, term: str) -> None:
    """Else it would hide all but effects several times larger than those told without it."""
    asked = Asked(sensor, "18")
    (seeds,) = seeds_of(asked, 6, 1, 1)
    plain = session_told(asked, [term], seeds)
    assert plain is not None
    sizes, setting = plain.told[term].sizes, plain.told[term].setting
    hidden = [Hidden(sensor, term, 2.0 * float(sizes[NAMED][0]), (0,))]
    other = session_told(asked, [term], seeds, hidden, setting)
    assert other is not None
    for what, each in other.told[term].sizes.items():
        assert each == pytest.approx(sizes[what], rel=0.5)
