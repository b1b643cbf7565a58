"""Slow courses of the bias: what is named alone, and what the data cannot tell apart."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.survey import diagnosis_of
from imucal_wizard.diagnose.thermometer import THERMOMETER_STEP, delay_of_thermometer, step_of
from imucal_wizard.diagnose.verdict import Opinion, Verdict
from imucal_wizard.diagnose.verdict_text import verdict_text
from imucal_wizard.model.effect import Circumstances
from tests.diagnose.recordings import MG, fitted, refitted

pytestmark = pytest.mark.usefixtures("rough_sizes_throughout")

AXES = np.array([1.0, -0.6, 0.8]) * MG
Course = Callable[[FloatArray], FloatArray]


def _opinion(error: Course, temperature: Course | None) -> Opinion:
    """Of 27 holds over five minutes with an error by the time in s, (n,) to (n, 3), m/s²."""
    report, _ = fitted(poses="26", seed=5)
    time = np.array([0.5 * (hold.start + hold.end) for hold in report.holds])
    time -= time[0]
    read = np.full(len(time), np.nan) if temperature is None else temperature(time)
    holds = [
        replace(
            hold,
            accelerometer=hold.accelerometer + wrong,
            temperature=None if np.isnan(degrees) else float(degrees),
        )
        for hold, wrong, degrees in zip(report.holds, error(time), read, strict=True)
    ]
    return Benches(refitted(report, holds)).accelerometer.look().opinion


def _warm(seconds: float) -> Course:
    """A temperature that settles, °C."""
    return lambda time: 24.0 + 6.0 * (1.0 - np.exp(-time / seconds))


@pytest.mark.parametrize("seconds", [100.0, 150.0, 200.0])
def test_the_temperature_is_listed_where_its_steps_hide_what_the_bias_follows(
    seconds: float,
) -> None:
    """In whole degrees the recorded temperature fits worse than a warm-up does."""
    warm = _warm(seconds)
    opinion = _opinion(lambda t: np.outer(warm(t) - 24.0, AXES), lambda t: np.round(warm(t)))
    assert opinion.verdict is Verdict.AMBIGUOUS
    assert ("bias-temperature",) in opinion.explanations


def test_the_temperature_is_listed_where_the_thermometer_is_late() -> None:
    warm, delay = _warm(200.0), 30.0

    def late(time: FloatArray) -> FloatArray:
        settled = (200.0 * np.exp(-time / 200.0) - delay * np.exp(-time / delay)) / (200.0 - delay)
        return 24.0 + 6.0 * (1.0 - settled)

    opinion = _opinion(lambda t: np.outer(warm(t) - 24.0, 2.0 * AXES), late)
    assert opinion.verdict is Verdict.AMBIGUOUS
    assert ("bias-temperature", "thermal-lag") in opinion.explanations


@pytest.mark.parametrize("step", [1.0 / 16.0, 0.25])
def test_a_lag_is_listed_where_the_steps_of_the_thermometer_blur_the_slope(step: float) -> None:
    """The temperature then explains more than its own slope does, and settles as the error does."""
    warm, rise = _warm(180.0), 6.0 / 180.0
    opinion = _opinion(
        lambda t: np.outer(60.0 * rise * np.exp(-t / 180.0), AXES),
        lambda t: step * np.round(warm(t) / step),
    )
    assert opinion.verdict is Verdict.AMBIGUOUS
    assert ("thermal-lag",) in opinion.explanations


def test_no_lag_is_listed_where_the_temperature_rises_steadily() -> None:
    """Its slope is one number, which the bias absorbs."""
    opinion = _opinion(
        lambda t: np.outer(6.0 * t / 300.0, AXES), lambda t: np.round((24.0 + t / 50.0) * 16) / 16
    )
    assert ("bias-temperature",) in opinion.explanations
    assert ("thermal-lag",) not in opinion.explanations


def test_a_warm_up_is_named_alone_beside_a_temperature_in_whole_degrees_that_swings() -> None:
    opinion = _opinion(
        lambda t: np.outer(np.exp(-t / 120.0), 4.0 * AXES),
        lambda t: np.round(24.0 + 4.0 * np.sin(2.0 * np.pi * t / 300.0)),
    )
    assert opinion.verdict is Verdict.MISSING
    assert opinion.terms == (("warm-up",),)


def _gain(share: Course) -> Course:
    """An error by a share of the force on two axes that changes with the time, (n,) to (n, 3)."""
    report, _ = fitted(poses="26", seed=5)
    forces = np.array([hold.accelerometer for hold in report.holds])
    return lambda time: share(time)[:, None] * forces * np.array([1.0, -0.6, 0.0])


def test_a_scale_that_drifts_at_a_steady_temperature_is_named_alone() -> None:
    """By 2000 ppm in five minutes, as the supply voltage falls: no step and no temperature."""
    opinion = _opinion(_gain(lambda t: 2e-3 * t / 300.0), lambda t: 24.0 + 0.0 * t)
    assert opinion.verdict is Verdict.MISSING
    assert opinion.terms == (("scale-drift",),)


def test_a_scale_that_drifts_while_the_temperature_rises_may_follow_either() -> None:
    opinion = _opinion(_gain(lambda t: 2e-3 * t / 300.0), lambda t: 24.0 + 6.0 * t / 300.0)
    assert opinion.verdict is Verdict.AMBIGUOUS
    assert {("scale-drift",), ("scale-temperature",)} <= {*opinion.explanations}


def test_a_scale_that_follows_a_temperature_that_swings_is_no_drift() -> None:
    opinion = _opinion(
        _gain(lambda t: 1e-3 * np.sin(2.0 * np.pi * t / 200.0)),
        lambda t: 24.0 + 3.0 * np.sin(2.0 * np.pi * t / 200.0),
    )
    assert opinion.verdict is Verdict.MISSING
    assert opinion.terms == (("scale-temperature",),)


def test_one_effect_is_told_before_pairs() -> None:
    """Only the first explanations are told, and pairs may be many."""
    warm = _warm(150.0)
    report, _ = fitted(poses="26", seed=5)
    benches = Benches(report)
    said = diagnosis_of(benches, benches.accelerometer)
    assert said.findings is not None
    opinion = _opinion(lambda t: np.outer(warm(t) - 24.0, AXES), lambda t: np.round(warm(t)))
    pairs = [("bias-drift", one) for one in ("bias-temperature", "thermal-lag", "warm-up")]
    many = replace(opinion, explanations=(("warm-up",), *pairs, ("bias-temperature",)))
    told = replace(said, verdict=Verdict.AMBIGUOUS, findings=replace(said.findings, opinion=many))
    assert "separate: warm-up; bias-temperature; bias-drift with " in verdict_text(told)


SUMS = [(100.0, 1.0), (150.0, 1.0), (200.0, 2.0), (100.0, 2.0), (150.0, 2.0), (200.0, 1.0)]


@pytest.mark.parametrize(("seconds", "times"), SUMS)
def test_a_drift_with_a_warm_up_is_not_a_warm_up_for_certain(seconds: float, times: float) -> None:
    """Together they are nearly a warm-up with a longer time constant."""

    def error(time: FloatArray) -> FloatArray:
        drift = np.outer(time / time[-1], np.array([-1.0, 0.7, -0.7]) * MG)
        return times * (np.outer(np.exp(-time / seconds), AXES) + drift)

    opinion = _opinion(error, None)
    both = ("bias-drift", "warm-up")
    assert both in opinion.explanations
    assert opinion.verdict is Verdict.AMBIGUOUS or opinion.twice


def _read(time: FloatArray, temperature: FloatArray) -> Circumstances:
    zeros = np.zeros((len(time), 3))
    return Circumstances(zeros, zeros, temperature, time, zeros, np.zeros(len(time)))


def test_a_thermometer_reads_no_course_that_differs_by_more_than_its_steps() -> None:
    time = np.arange(0.0, 400.0, 10.0)
    swings = 24.0 + 3.0 * np.sin(2.0 * np.pi * time / 400.0)
    warms = np.exp(-time / 100.0)[:, None]
    assert delay_of_thermometer(_read(time, np.round(swings)), swings[:, None], 1.0) == 0.0
    assert delay_of_thermometer(_read(time, np.round(swings)), warms, 1.0) is None
    assert delay_of_thermometer(_read(time, np.full(len(time), np.nan)), warms, 1.0) is None


def test_the_step_of_a_thermometer_is_that_of_values_that_come_again() -> None:
    rng, warm = np.random.default_rng(3), _warm(150.0)(np.arange(0.0, 300.0, 7.0))
    assert step_of(np.round(warm)) == 1.0
    assert step_of(np.round(2.0 * warm) / 2.0) == 0.5
    assert step_of(warm + 0.01 * rng.standard_normal(len(warm))) == THERMOMETER_STEP
