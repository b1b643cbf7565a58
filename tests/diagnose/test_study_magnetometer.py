"""The study of the magnetometer's hidden effects, small and with fixed seeds.

The whole of it is ``python -m benchmarks.hidden_magnetometer``.
"""

from collections import Counter
from dataclasses import replace
from functools import cache

import pytest

from benchmarks.hidden.table import outcome
from benchmarks.hidden_field.recording import Colour
from benchmarks.hidden_field.scenarios import EFFECTS, Scenario, rows, single
from benchmarks.hidden_field.sessions import REPEATED
from benchmarks.hidden_field.trialled import Quiet, quiet, try_out
from benchmarks.hidden_field.whole import NO_CURRENT, bench_of
from benchmarks.sizes import Asked, seeds_of, study
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.model.effect import MAGNETOMETER
from imucal_wizard.simulate.hidden import Hidden

pytestmark = pytest.mark.study

SEEDS = (99001, 99002)
RIGHT = ("named", "family")
STRANGERS = ("room 4 µT/m", "steel passes 4 µT", "bias jumps 0.2 µT", "random walk 0.03 µT/√min")


@cache
def known(seed: int) -> Quiet:
    return quiet(REPEATED, seed)


def counted(scenario: Scenario) -> Counter[str]:
    found = [try_out(REPEATED, scenario, known(seed), seed) for seed in SEEDS]
    return Counter("refused" if one is None else outcome(one) for one in found)


def row(name: str) -> Scenario:
    return next(scenario for scenario in rows() if scenario.name == name)


@pytest.mark.parametrize("floor", [0.0, 0.005])
def test_where_nothing_is_hidden_the_model_is_complete(floor: float) -> None:
    """With white noise, and with flicker noise (its floor in µT) that is smaller than that."""
    found = counted(replace(row("no effect"), colour=Colour(floor=floor)))
    assert found == {"complete": len(SEEDS)}


def test_flicker_noise_that_no_repeats_tell_gets_no_name() -> None:
    """A floor of 0.01 µT leaves 1.2 times the noise of the samples.

    A direction of the field that comes again tells no variance between visits, so that the model
    may be unexplained.
    """
    found = counted(replace(row("no effect"), colour=Colour(floor=0.01)))
    assert set(found) <= {"complete", "unexpl"}


@pytest.mark.parametrize("term", EFFECTS)
def test_above_its_nameable_size_an_effect_is_named_or_its_family_is(term: str) -> None:
    found = counted(single(term, 1.5))
    assert sum(found[word] for word in RIGHT) == len(SEEDS)


def test_a_drift_is_seen_and_named_from_the_sizes_told() -> None:
    """The sizes told are those found within 20 %, as far as 8 sessions show them (90 %).

    Fewer than 59 give the 95th centile, that of the size seen, no upper end.
    """
    asked = Asked(MAGNETOMETER, "18")
    ((_, both, _),) = study(asked, ["bias-drift"], seeds_of(asked, 5, 2, 4))
    assert len(both) == 2
    assert all(one.may_be_right for one in both)


@pytest.mark.parametrize("name", STRANGERS)
def test_a_disturbance_outside_the_catalogue_gets_no_name(name: str) -> None:
    found = counted(row(name))
    assert not {*RIGHT, "part", "WRONG"} & set(found)
    nameless = ("unexpl", "disturb", "repeat", "complete")
    assert sum(found[word] for word in nameless) == len(SEEDS)


def test_an_effect_leaves_the_rotation_between_the_sensors_as_it_is() -> None:
    """Beside slow errors, which the rows share as they share the rotation: a raw recording."""
    bench = bench_of(1851000, [Hidden(MAGNETOMETER, "current", 0.03, (1,)), NO_CURRENT])
    before = {one.name: one.value for one in bench.fit.parameters}
    bench.add("current")
    after = {one.name: one for one in bench.fit.parameters}
    for axis in "xyz":
        name = f"misalignment_{axis}"
        assert after[name].value == pytest.approx(before[name], abs=0.01)
    size = after["current_y"]
    assert abs(size.value - 0.03) < 4.0 * (size.standard_error or 0.0) < 0.01
    assert bench.look().opinion.verdict is Verdict.COMPLETE
