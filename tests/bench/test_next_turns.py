"""Turns that would tell two explanations of a gyroscope's misfit apart, with their gain."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.bench.advice import advice
from imucal_wizard.bench.benches import Benches
from imucal_wizard.bench.next_poses import Explained
from imucal_wizard.bench.next_turns import turns_apart
from imucal_wizard.bench.pose import asked_for
from imucal_wizard.bench.says import says
from imucal_wizard.bench.session import Bench, Findings
from imucal_wizard.bench.statement import Statement
from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.effects.catalogue import effect
from imucal_wizard.solver.extended.turn_data import TurnData
from tests.bench.recordings import fitted

K2 = Explained(effect("second-order"), None, np.array([2.0, 0.0, 0.0]))
ASYMMETRY = Explained(effect("asymmetry"), None, np.array([3.0, 0.0, 0.0]))


def gyroscope(rotations: int) -> Bench:
    """A gyroscope that bends on its x axis, turned so often about each axis."""
    report, readings = fitted("gyroscope/second-order:2:x", seed=4, rotations=rotations)
    bench = Benches(report, readings).gyroscope
    assert bench is not None
    return bench


@pytest.fixture(scope="module")
def bench() -> Bench:
    return gyroscope(2)


@pytest.fixture(scope="module")
def findings(bench: Bench) -> Findings:
    return bench.look()


def apart(bench: Bench, first: Explained, second: Explained, axis: str) -> tuple[float, float]:
    assert isinstance(bench.measured, TurnData)
    return turns_apart(bench.measured, bench.fit, first, second, axis)


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


def test_turns_come_with_their_gain_and_as_the_procedure_takes_them(
    bench: Bench, findings: Findings
) -> None:
    members = ("second-order", "asymmetry")
    opinion = replace(findings.opinion, verdict=Verdict.AMBIGUOUS, terms=(members,))
    open_ = replace(findings, opinion=opinion)
    said = advice(bench, open_, Verdict.AMBIGUOUS)
    gain = said.apart[-1]
    assert gain.turning
    assert gain.after < gain.before
    (pose,) = said.poses
    assert f"from {gain.after:.2g} instead of {gain.before:.2g}" in pose.why
    (asked,) = asked_for(said.poses)
    assert (asked.axis, asked.turns) == ("x", 6)
    told = says(Statement("gyroscope", Verdict.AMBIGUOUS, said, bench, open_))
    assert "6 more turns" in told
