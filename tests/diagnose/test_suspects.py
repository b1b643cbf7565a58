"""Which effects look the same here, which are invisible, and from what size they show."""

import numpy as np
import pytest

from imucal_wizard.diagnose.effect_text import seen_from
from imucal_wizard.diagnose.posterior import hypothesis_set
from imucal_wizard.diagnose.residuals import WhitenedResiduals
from imucal_wizard.diagnose.suspects import Suspect, rank
from imucal_wizard.diagnose.verdict import Verdict, judge_misfit
from tests.diagnose.sessions import EXACT_POSES, session


def ranked(misfit: WhitenedResiduals) -> dict[str, Suspect]:
    hypotheses = hypothesis_set(misfit)
    return {
        one.term: one for one in rank(misfit, hypotheses, hypotheses.posterior(misfit.residual))
    }


@pytest.mark.parametrize(
    ("term", "alike"),
    [
        ("second-order", {"asymmetry"}),
        ("third-order", {"odd-quadratic"}),
        ("bias-drift", {"warm-up", "bias-temperature"}),
    ],
)
def test_members_of_a_family_look_the_same(term: str, alike: set[str]) -> None:
    """Where 1 g cannot split two effects, the suspect says so; strangers are not listed."""
    suspect = ranked(session()[0])[term]
    assert alike <= set(suspect.like)
    assert "hysteresis" not in suspect.like


def test_a_product_that_no_pose_shows_is_visible_at_no_size() -> None:
    """Faces and edges alone never see x·y·z: its three parameters are infinite, others are not."""
    misfit, _ = session(design=EXACT_POSES)
    suspect = ranked(misfit)["cross-product"]
    assert suspect.candidate is not None
    sizes = dict(zip(suspect.candidate.names, suspect.detectable, strict=True))
    assert {name for name, size in sizes.items() if np.isinf(size)} == {"xyz", "yxz", "zxy"}


def test_beyond_usual_sizes_nothing_is_said() -> None:
    """Five times a thermal lag of 30 s is within the noise here; larger ones are not tried."""
    suspect = ranked(session(design="18", louder=20.0)[0])["thermal-lag"]
    assert seen_from(suspect) == "shown at no size that a sensor usually has (up to 150 s)"


def test_an_undetectable_effect_is_never_named() -> None:
    """Exact faces and edges see nothing of x·y·z, and nothing is claimed.

    Across gravity they do: 50 mg/g² would change the magnitude by the square, 0.3 mg.
    """
    misfit, hypotheses = session("cross-product:10:xyz", design=EXACT_POSES)
    opinion = judge_misfit(misfit, hypotheses, hypotheses.posterior(misfit.residual))
    assert opinion.verdict is Verdict.COMPLETE
    assert opinion.families == ()


def test_a_hidden_effect_is_the_first_suspect_at_its_size_and_sign() -> None:
    """Name, axis, sign and size come back."""
    first = next(iter(ranked(session("hysteresis:-1:z")[0]).values()))
    assert first.term == "hysteresis"
    assert first.p < 0.01
    assert first.trial is not None
    assert first.trial.size[2] == pytest.approx(-1.0, abs=4.0 * first.trial.standard_error[2])


def test_louder_noise_hides_larger_effects() -> None:
    """What is seen is in proportion to the noise; the family is named from a larger one on.

    That size grows faster than the noise: far above its usual size an effect is improbable.
    """
    quiet, loud = (session(colour="white", louder=louder) for louder in (1.0, 4.0))
    one, other = (ranked(misfit)["second-order"] for misfit, _ in (quiet, loud))
    noise = [
        misfit.sigma.mean() * known.posterior(misfit.residual).expected_noise
        for misfit, known in (quiet, loud)
    ]
    ratio = noise[1] / noise[0]
    assert np.median(other.detectable / one.detectable) == pytest.approx(ratio, rel=0.1)
    assert np.median(other.nameable / one.nameable) > 0.9 * ratio
    assert (one.nameable > one.detectable).all()
