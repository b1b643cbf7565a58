"""What is added without being asked, settled between the settings tried, or taken back."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import pytest

from benchmarks.hidden.designs import REPEATED, STANDARD, Plan, Schedule
from benchmarks.hidden.fitted import measured_of
from benchmarks.hidden.noise import CONSUMER
from benchmarks.hidden.recording import Extra, record
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose import survey
from imucal_wizard.diagnose.bench import Bench, confirmed
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.survey import add_by_itself, tried_findings
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.simulate.hidden import parse_hidden

ON_Y = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class OnY(Extra):
    """An error of the y axis alone, mg, from what happened to each hold."""

    of: Callable[[Schedule], FloatArray]

    def error(self, schedule: Schedule, rng: np.random.Generator) -> FloatArray:
        """The same for every session."""
        del rng
        return np.outer(self.of(schedule), ON_Y)


def bench_of(
    *hidden: str, extra: Extra | None = None, seed: int = 3, plan: Plan = REPEATED
) -> Bench:
    effects = [parse_hidden(text) for text in hidden]
    rng = np.random.default_rng(seed)
    return Bench("accelerometer", measured_of(record(plan, CONSUMER, effects, rng, extra)))


@pytest.mark.parametrize(
    "time_constant",
    [
        pytest.param(85.0, marks=pytest.mark.study),
        130.0,
        pytest.param(250.0, marks=pytest.mark.study),
    ],
)
def test_a_time_constant_between_those_tried_is_found(time_constant: float) -> None:
    """A warm-up of a hundred times the noise leaves nothing behind, and no second name.

    The constants tried are a factor of 1.7 apart; one session knows them to about a tenth.
    """
    warming = OnY(lambda schedule: 12.0 * np.exp(-schedule.middle / time_constant))
    bench = bench_of(extra=warming)
    bench.add("warm-up")
    found = bench.fit.terms[0].variant
    assert found == pytest.approx(time_constant, rel=0.25)
    assert bench.look().opinion.verdict is Verdict.COMPLETE


def test_a_setting_that_is_given_is_kept() -> None:
    """Nothing is settled against the user's word."""
    bench = bench_of("warm-up:6:y")
    bench.add("warm-up", variant=100.0)
    assert bench.fit.terms[0].variant == 100.0


@pytest.mark.parametrize(
    "seed", [0, pytest.param(1, marks=pytest.mark.study), pytest.param(2, marks=pytest.mark.study)]
)
def test_a_jump_is_not_left_under_the_name_that_it_resembles(seed: int) -> None:
    """What leaves a sixth of itself behind was something else: all is taken back."""
    jump = OnY(lambda schedule: 10.0 * np.tanh((schedule.up[:, 1] - 0.35) / 0.02))
    bench = bench_of(extra=jump, seed=seed)
    said = add_by_itself(bench)
    assert said.opinion.verdict is Verdict.UNEXPLAINED
    assert bench.fit.terms == ()
    assert len(bench.ladder) == 1


@pytest.mark.parametrize(
    ("plan", "size", "seed"), [(STANDARD, 4.0, 0), (STANDARD, 8.0, 2), (REPEATED, 2.0, 3)]
)
def test_a_scale_that_follows_the_size_of_another_force_is_no_cubic_cross_term(
    plan: Plan, size: float, seed: int
) -> None:
    """``|f_x| f_y`` leaves 3.5 to 18 times the noise, and ``f_x² f_y`` would take most of it."""
    gain = OnY(lambda schedule: size * np.abs(schedule.up[:, 0]) * schedule.up[:, 1])
    opinion = bench_of(extra=gain, seed=seed, plan=plan).look().opinion
    assert opinion.lack.ratio > 3.0
    assert opinion.verdict is Verdict.UNEXPLAINED
    assert opinion.families == ()
    assert opinion.terms == ()


@pytest.mark.parametrize("seed", [0, 3])
def test_a_cubic_cross_term_of_many_times_the_noise_is_named(seed: int) -> None:
    """No power of the size of the force along x explains it as well as the square."""
    opinion = bench_of("cubic-cross:15:yxx", seed=seed).look().opinion
    assert opinion.families == ("odd-order",)
    assert "cubic-cross" in opinion.terms[0]


def test_a_name_is_taken_back_if_the_next_one_is_not_confirmed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is left then has no name, as where none was found for it."""

    def first_alone(bench: Bench, families: object) -> tuple[str, ...]:
        del families
        if len(bench.ladder) > 1:
            return ()
        bench.add("second-order")
        return ("second-order",)

    monkeypatch.setattr(survey, "_try", first_alone)
    bench = bench_of("second-order:4:x", "third-order:6:x")
    assert add_by_itself(bench).opinion.verdict is Verdict.UNEXPLAINED
    assert bench.fit.terms == ()


@dataclass(frozen=True)
class OneBench:
    """The benches of one sensor, which waits for no other."""

    only: Bench

    def bench(self, sensor: str) -> Bench:
        """That one."""
        del sensor
        return self.only

    def waits(self, sensor: str) -> bool:
        """For nothing."""
        del sensor
        return False

    def copied(self) -> "OneBench":
        """With a copy of it."""
        return OneBench(self.only.copied())


def test_what_would_be_taken_back_is_not_called_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A name that looks certain until it is added; the bench is as before after the trial."""
    bench = bench_of("second-order:4:x")
    before, benches = bench.look(), cast("Benches", OneBench(bench))
    assert before.opinion.verdict is Verdict.MISSING
    assert tried_findings(benches, bench).opinion.terms == before.opinion.terms
    monkeypatch.setattr(Bench, "confirmed", lambda *_: False)
    assert tried_findings(benches, bench).opinion.verdict is not Verdict.MISSING
    assert bench.look() is before


def test_late_data_that_show_only_noise_do_not_refute_an_effect_of_time() -> None:
    """With it and without, the early data predict them as well as the noise permits."""
    first = bench_of("warm-up:6:y").ladder[0]
    below = replace(first, held_out_in_noise=2.0, late_in_noise=0.98, late_by_noise=True)
    above = replace(below, held_out_in_noise=1.0, late_in_noise=1.01)
    assert confirmed(below, above, of_time=True)
    assert not confirmed(below, replace(above, held_out_in_noise=2.1), of_time=True)
    worse = replace(above, late_in_noise=1.6, late_by_noise=False)
    assert not confirmed(below, worse, of_time=True)
    assert confirmed(below, worse, of_time=False)


def test_what_was_added_is_the_first_explanation() -> None:
    """And both of two effects are added together; an exact alias of one of them stays listed."""
    bench = bench_of("second-order:4:x", "third-order:6:x")
    said = add_by_itself(bench)
    assert said.opinion.verdict is Verdict.AMBIGUOUS
    assert ("cubic-cross", "second-order") in said.opinion.explanations
    assert said.opinion.explanations[0] == ("second-order", "third-order")
    assert {term.name for term in bench.fit.terms} == {"second-order", "third-order"}
