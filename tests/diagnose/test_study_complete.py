"""A small version of ``benchmarks.complete``: when a model is called complete."""

import pytest

from benchmarks.complete import HONEST, LARGE, STRUCTURES, judged
from benchmarks.hidden.noise import CONSUMER
from imucal_wizard.diagnose.verdict import Verdict

RECORDINGS = 8
SEED = 31


@pytest.mark.study
@pytest.mark.parametrize("noise", ["white noise", "usual flicker noise"])
def test_a_model_that_lacks_nothing_is_complete(noise: str) -> None:
    """Of 16 recordings with repeats at most two are not: at 5 % more are rarer than 1 in 20."""
    found = [judged("26+12", HONEST[noise], None, SEED, k).verdict for k in range(2 * RECORDINGS)]
    assert sum(one is not Verdict.COMPLETE for one in found) <= 2


NAMES = ("bias that swings", "ripple", "placement scatter", "stiction", "step of scale")


@pytest.mark.study
@pytest.mark.parametrize("plan", ["18", "26+12"])
def test_a_model_that_leaves_structure_is_not_complete(plan: str) -> None:
    """None of these structures above three times the noise of a hold is called noise."""
    assert set(NAMES) <= set(STRUCTURES)
    found = [judged(plan, CONSUMER, one, SEED, k) for one in NAMES for k in range(RECORDINGS // 4)]
    large = [one for one in found if one.structure > LARGE]
    assert len(large) >= RECORDINGS // 4
    assert not any(one.verdict is Verdict.COMPLETE for one in large)
