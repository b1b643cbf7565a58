"""Turns that would tell two explanations of a gyroscope's misfit apart, with their gain."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.diagnose.bench import Bench, BenchFindings
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.next_poses import brings, next_requests, to_measure
from imucal_wizard.diagnose.optimal_design import (
    Explained,
    apart_length,
    rotation_patterns,
    size_needed,
)
from imucal_wizard.diagnose.survey import diagnosis_of
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.diagnose.verdict_text import verdict_text
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.catalogue import effect
from tests.diagnose.recordings import fitted
from tests.estimate.whole_session import Session

pytestmark = pytest.mark.usefixtures("rough_sizes_throughout")

K2 = Explained(effect("second-order"), None, np.array([2.0, 0.0, 0.0]))
ASYMMETRY = Explained(effect("asymmetry"), None, np.array([3.0, 0.0, 0.0]))


def gyroscope(rotations: int) -> Bench:
    """A gyroscope that bends on its x axis, turned so often about each axis."""
    report, readings = fitted("gyroscope/second-order:20:x", seed=4, rotations=rotations)
    bench = Benches(report, readings).bench("gyroscope")
    assert bench is not None
    return bench


@pytest.fixture(scope="module")
def bench() -> Bench:
    return gyroscope(2)


@pytest.fixture(scope="module")
def findings(bench: Bench) -> BenchFindings:
    return bench.look()


def apart(bench: Bench, first: Explained, second: Explained, axis: str) -> tuple[float, float]:
    now, more = rotation_patterns(bench.fit, bench.measured.gravity, first, second, axis)
    both = (np.concatenate(pair) for pair in zip(now, more, strict=True))
    return size_needed(apart_length(*now)), size_needed(apart_length(*both))


def test_turns_about_the_axis_that_bends_tell_more_than_turns_about_another(bench: Bench) -> None:
    before, after = apart(bench, K2, ASYMMETRY, "x")
    _, across = apart(bench, K2, ASYMMETRY, "y")
    assert after < 0.8 * before
    assert after < across <= before * 1.001


def test_what_is_predicted_is_what_more_turns_by_hand_bring() -> None:
    """Six imagined turns bring what the hand's next four do, up to a factor of two."""
    few, many = gyroscope(2), gyroscope(6)
    before, after = apart(few, K2, ASYMMETRY, "x")
    then, _ = apart(many, K2, ASYMMETRY, "x")
    assert then < before
    assert 0.5 * then < after < then


def test_an_effect_is_told_from_itself_by_no_turn(bench: Bench) -> None:
    assert apart(bench, K2, K2, "x") == (np.inf, np.inf)


def test_turns_separate_the_effect_that_was_added_from_the_one_like_it() -> None:
    report, readings = fitted("gyroscope/second-order:20:x", seed=4, rotations=2)
    benches = Benches(report, readings)
    bench = benches.bench("gyroscope")
    assert bench is not None
    bench.add("second-order")
    requests, gain = to_measure(diagnosis_of(benches, bench))
    assert gain is not None
    assert (gain.first, gain.second) == ("second-order", "asymmetry")
    assert gain.after < gain.before < np.inf
    assert "separates second-order from asymmetry" in requests[0].why


def test_turns_come_with_their_gain_and_as_the_procedure_takes_them(
    bench: Bench, findings: BenchFindings
) -> None:
    members = ("second-order", "asymmetry")
    opinion = replace(findings.opinion, verdict=Verdict.AMBIGUOUS, terms=(members,))
    open_ = replace(findings, opinion=opinion)
    requests, compared = next_requests(bench, open_, Verdict.AMBIGUOUS)
    gain = compared[-1]
    assert gain.turning
    assert gain.after < gain.before
    (asked,) = requests
    assert brings(gain) in asked.why
    assert (asked.axis, asked.turns) == ("x", 6)
    text = verdict_text(
        Diagnosis(
            "gyroscope",
            Verdict.AMBIGUOUS,
            next_poses=requests,
            apart=compared,
            bench=bench,
            findings=open_,
        )
    )
    assert "6 more rotations" in text


def test_where_rotations_do_not_fit_the_worst_ones_are_asked_for_again(
    bench: Bench, findings: BenchFindings
) -> None:
    """A hold again says nothing of an error that only rotations show."""
    asked, _ = next_requests(bench, findings, Verdict.UNEXPLAINED)
    table = bench.rows
    worst = int(np.argmax(np.where(table.moving, np.abs(table.residual / table.floor), 0.0)))
    assert asked[0].why.startswith(f"rotation {table.index[worst] + 1} again")
    assert {(one.axis, one.turns) for one in asked} == {("x", 1)}


def test_turns_are_imagined_for_a_gyroscope_that_the_field_has_closed_too() -> None:
    """Its rows share errors of the magnetometer; and rounding shifts what a coarse one reads."""
    readings = Session(holds=24).readings(3)
    series = readings.gyroscope
    assert series is not None
    step = 4e-3
    coarse = replace(series, values=np.round(series.values / step) * step)
    for gyroscope in (series, coarse):
        made = replace(readings, gyroscope=gyroscope)
        bench = Benches(fit_readings(made), made).bench("gyroscope")
        assert bench is not None
        assert "magnetometer_0" in bench.rows.names
        before, after = apart(bench, K2, ASYMMETRY, "x")
        assert after < 0.9 * before
