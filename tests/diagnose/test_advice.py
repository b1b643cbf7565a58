"""For every verdict the poses that would help, and what they bring."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.poses import CORNERS, EDGES, FACES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.bench import Bench, BenchFindings
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.diagnosis import Apart
from imucal_wizard.diagnose.effect_text import difference_at_one_g
from imucal_wizard.diagnose.next_poses import (
    brings,
    missing_directions,
    next_requests,
    separating_poses,
)
from imucal_wizard.diagnose.optimal_design import Explained, one_more_hold
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.diagnose.verdict_text import would_decide
from imucal_wizard.estimate.accelerometer import BASE
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.terms import Term
from tests.diagnose.recordings import MG, fitted

K2 = Explained(effect("second-order"), None, np.array([2.0, 0.0, 0.0]))
ASYMMETRY = Explained(effect("asymmetry"), None, np.array([2.9, 0.0, 0.0]))


def size(name: str, **parameters: float) -> FloatArray:
    names = [one.name for one in effect(name).parameters("accelerometer")]
    return np.array([parameters.get(one, 0.0) for one in names])


# K₂ x² on x and −K₂(xy on y + xz on z) differ by a bias only: x³ = x − xy² − xz²
ALIAS = Explained(effect("cross-product"), None, size("cross-product", yxy=-2.0, zxz=-2.0))


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Benches(*fitted("second-order:5:x")).accelerometer


@pytest.fixture(scope="module")
def findings(bench: Bench) -> BenchFindings:
    return bench.look()


def between(findings: BenchFindings, *members: str) -> BenchFindings:
    """The findings with the choice left among these effects."""
    opinion = replace(findings.opinion, verdict=Verdict.AMBIGUOUS, terms=(members,))
    return replace(findings, opinion=opinion)


def test_poses_that_tell_two_explanations_apart_come_with_their_gain_in_numbers(
    bench: Bench, findings: BenchFindings
) -> None:
    open_ = between(findings, "second-order", "asymmetry")
    poses, compared = next_requests(bench, open_, Verdict.AMBIGUOUS)
    apart = compared[-1]
    assert (apart.first, apart.second, apart.unit) == ("second-order", "asymmetry", "mg/g²")
    assert apart.after < apart.before < np.inf
    assert poses
    assert brings(apart) in poses[0].why
    assert f"{apart.after:.2g} mg/g² instead of {apart.before:.2g} mg/g²" in poses[0].why
    for pose in poses:
        assert np.linalg.norm(pose.direction) == pytest.approx(1.0)


def test_exact_aliases_are_told_apart_by_no_pose(bench: Bench) -> None:
    c = bench.measured.circumstances
    found = separating_poses(K2, ALIAS, c, np.full(len(c), 0.1 * MG))
    assert found == ((), np.inf, np.inf)


def test_what_poses_bring_counts_with_the_effects_that_the_model_has(bench: Bench) -> None:
    """An effect that is fitted too takes up a part of what separates two others.

    The size needed is that of a standard deviation by weighted least squares with its prior.
    """
    c, other = bench.measured.circumstances, effect("cross-product")
    noise = np.full(len(c), 0.1 * MG)
    _, alone, _ = separating_poses(K2, ASYMMETRY, c, noise)
    _, needed, after = separating_poses(K2, ASYMMETRY, c, noise, others=(Term(other),))
    assert needed > 1.5 * alone
    assert after < needed
    up = c.force / np.linalg.norm(c.force, axis=1)[:, None]
    along = [np.einsum("ni,nip->np", up, one.columns("accelerometer", c)) for one in
             (K2.effect, ASYMMETRY.effect, other)]  # fmt: skip
    x, y, z = up.T
    base = [up, up**2, np.column_stack([x * y, x * z, y * z])]
    columns = np.concatenate([along[0][:, :1], *base, *along[1:]], axis=1) / noise[:, None]
    normal = columns.T @ columns
    own = np.arange(len(normal) - along[2].shape[1], len(normal))
    normal[own, own] += other.typical("accelerometer") ** -2
    sigma = np.sqrt(np.linalg.pinv(normal, rcond=1e-13, hermitian=True)[0, 0])
    assert needed == pytest.approx((2.33 + 1.645) * sigma / K2.size[0], rel=1e-3)


def test_where_two_cannot_be_told_apart_the_next_pair_is_tried(
    bench: Bench, findings: BenchFindings
) -> None:
    members = ("second-order", "cross-product", "asymmetry")
    poses, compared = next_requests(bench, between(findings, *members), Verdict.AMBIGUOUS)
    assert compared[0].never
    assert compared[0].second == "cross-product"
    assert compared[-1].second == "asymmetry"
    assert poses


def test_at_one_g_alike_in_magnitude_is_not_always_alike_in_direction() -> None:
    """K₂ or asymmetry hardly moves up; K₂ or its alias across the axes does, by milliradians."""
    assert difference_at_one_g(K2, K2) == 0.0
    assert difference_at_one_g(K2, ASYMMETRY) < 0.03
    assert difference_at_one_g(K2, ALIAS) > 0.05


def test_a_disturbed_hold_is_taken_again_in_its_own_direction(
    bench: Bench, findings: BenchFindings
) -> None:
    opinion = replace(findings.opinion, holds=(7,))
    (pose,) = next_requests(bench, replace(findings, opinion=opinion), Verdict.DISTURBED)[0]
    force = bench.measured.circumstances.force[7]
    assert np.degrees(np.arccos(pose.direction @ force / np.linalg.norm(force))) < 0.01
    assert "hold 8" in pose.why


def test_what_is_unexplained_asks_for_corners_and_for_the_worst_holds_again(
    bench: Bench, findings: BenchFindings
) -> None:
    poses = next_requests(bench, findings, Verdict.UNEXPLAINED)[0]
    assert {pose.pose for pose in poses} >= set(CORNERS)
    assert sum("again" in pose.why for pose in poses) == 4
    assert all(pose.brief and pose.why.endswith(pose.brief) for pose in poses), (
        "the screen tells it"
    )


def test_a_pose_follows_the_one_that_was_chosen_before_it(bench: Bench) -> None:
    """An effect of the pose before depends on the poses that are proposed, in their order."""
    done = bench.measured.circumstances
    first = one_more_hold(done, (), "+x", warm=True)
    second = one_more_hold(done, (("+x", True),), "-y", warm=False)
    assert first.previous == pytest.approx(done.force[-1:])
    assert second.previous == pytest.approx(first.force)
    assert second.time > first.time
    assert second.temperature == pytest.approx(done.temperature[-1:], nan_ok=True)


def test_a_complete_model_asks_for_nothing(bench: Bench, findings: BenchFindings) -> None:
    assert next_requests(bench, findings, Verdict.COMPLETE) == ((), ())


@pytest.mark.parametrize("held", [0, 1, 3])
def test_few_directions_are_completed_until_the_model_is_determined(held: int) -> None:
    """With what was held, the directions asked for carry nine parameters and two to spare."""
    up = np.array([*FACES.values()])[:held].reshape(-1, 3)
    asked = missing_directions(up, BASE)
    assert len(asked) + held >= 11
    names = [pose.pose for pose in asked]
    assert len(set(names)) == len(names)
    assert all("needed to determine" in pose.brief for pose in asked)


def test_enough_directions_ask_for_no_more() -> None:
    up = np.array([*FACES.values(), *EDGES.values()])
    assert missing_directions(up, BASE) == ()


def test_between_faces_and_edges_a_kink_and_a_bend_differ_most(bench: Bench) -> None:
    c = bench.measured.circumstances
    noise = np.full(len(c), 0.1 * MG)
    poses, before, after = separating_poses(K2, ASYMMETRY, c, noise, 6)
    tilts = [one for one in poses if one.pose is None]
    assert len(tilts) >= 4
    assert "tilted 30° towards" in tilts[0].why
    assert all(np.linalg.norm(one.direction) == pytest.approx(1.0) for one in poses)
    assert after < 0.6 * before


def test_what_poses_bring_is_told_in_the_digits_of_the_verdict() -> None:
    apart = Apart("scale-temperature", "bias-temperature", 794.6, 12.34, 500.0, "mg/°C", 2)
    assert brings(apart) == "both poses together: from 12 mg/°C instead of 795 mg/°C"
    never = replace(apart, before=np.inf)
    assert brings(never) == "both poses together: from 12 mg/°C instead of no size"
    pair = "These data separate scale-temperature from bias-temperature"
    assert would_decide(never, "time").startswith(
        f"{pair} at no size; 2 more poses, which the bench lists"
    )
    assert brings(replace(apart, poses=1)) == "this pose: from 12 mg/°C instead of 795 mg/°C"


def test_no_rotation_from_rest_to_rest_is_said_to_separate_a_late_axis_from_products() -> None:
    """They are the same in all of them, fast ones too; at a constant rate a delay is nothing."""
    apart = Apart("axis-delay", "cross-product", np.inf, np.inf, 2.0, "ms", 4, turning=True)
    said = would_decide(apart, "orientation")
    assert said.endswith("; constant rates about several axes, as on a rate table, may.")
    assert "temperature rises and falls" in would_decide(apart, "time")
