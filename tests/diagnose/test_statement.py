"""What is said of each sensor: the word, the sentences, and the order among the sensors."""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.notices import begun
from imucal_wizard.core.poses import FACES
from imucal_wizard.core.quantities import number, quantity
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import Found, entries_of
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.effect_text import effect_text, sizes_of, sizes_text
from imucal_wizard.diagnose.grade import Grade, graded
from imucal_wizard.diagnose.survey import (
    diagnose_benches,
    diagnosis_of,
    insufficient,
    tried_findings,
)
from imucal_wizard.diagnose.suspects import EffectTrial
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.diagnose.verdict_text import spans_to_leave_out, verdict_text
from imucal_wizard.estimate.fit_warnings import rotation_warnings
from imucal_wizard.estimate.lack_of_fit import TEST_LEVEL
from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
from imucal_wizard.estimate.recording import FitOptions, fit_accelerometer, fit_holds, fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.measurement.clipping import clipped_rotation
from imucal_wizard.measurement.data_quality import dead_axes
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.lesson import cost_of_ignoring, lesson
from imucal_wizard.report.bench_document import bench_document
from imucal_wizard.report.bench_text import bench_text, suspect_size
from imucal_wizard.report.text import errors_text, interval_text, summary
from tests.diagnose.recordings import MG, along, fitted, moved, refitted, tumbled
from tests.estimate.long_holds import SIGMA, holds_of
from tests.estimate.truth import EIGHTEEN

pytestmark = pytest.mark.usefixtures("rough_sizes_throughout")


def benches(*hidden: str, rotations: int = 0) -> Benches:
    """Of a recording with 18 poses; without rotations, as if there were no gyroscope."""
    report, readings = fitted(*hidden, rotations=rotations)
    if not rotations:
        report = replace(
            report,
            rates={"accelerometer": 100.0},
            sensors={"accelerometer": report.sensors["accelerometer"]},
        )
    return Benches(report, readings)


def test_a_missing_effect_is_told_with_size_cost_and_the_fall_of_the_error() -> None:
    (said,) = diagnose_benches(benches("second-order:5:x"), {}, automatic=True)
    assert said.added == ("second-order",)
    text = said.says
    for words in (
        "follows the force",
        "second-order",
        "±",
        "mg/g²",
        "up direction wrong by",
        "falls from",
    ):
        assert words in text


def test_an_effect_that_leaves_the_error_as_it_is_would_bring_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A fall from 0.0919 to 0.0919 mg is none, whichever of the two is a little larger."""
    (said,) = diagnose_benches(benches("second-order:5:x"), {}, automatic=False)
    assert "would bring" in said.says
    assert said.bench is not None
    now = said.bench.fit.rms_held_out or 0.0
    monkeypatch.setattr(EffectTrial, "rms_held_out", property(lambda _: (1.0 - 1e-6) * now))
    in_noise = said.bench.fit.held_out_in_noise or 0.0
    same = property(lambda _: (1.0 - 1e-6) * in_noise)
    monkeypatch.setattr(EffectTrial, "held_out_in_noise", same)
    text = verdict_text(said)
    assert "would bring" not in text
    assert "would leave the error" in text


def test_a_complete_model_states_the_detectable_sizes() -> None:
    (said,) = diagnose_benches(benches(), {}, automatic=True)
    assert said.verdict is Verdict.COMPLETE
    assert "complete" in said.says
    assert "would have been seen from" in bench_text([said])
    assert said.next_poses == ()


def scattered(size: float, repeats: int = 12) -> Diagnosis:
    """26 poses, up to twelve of them again, each settle a little differently (mg)."""
    rng = np.random.default_rng(1)
    report, _ = fitted(poses="26+repeats", seed=5)
    restless = moved(report, lambda _, hold: along(hold, rng.normal(0.0, size * MG)))
    if repeats < 12:
        restless = refitted(restless, restless.holds[: 26 + repeats])
    return diagnose_benches(Benches(restless), {}, automatic=True)[0]


def test_poses_that_repeat_a_little_worse_than_the_noise_are_no_alarm() -> None:
    """35 µg from hold to hold are as large as the noise within them."""
    said = scattered(0.035)
    assert said.verdict is Verdict.COMPLETE
    assert "count as noise here" in said.says


def test_a_model_that_is_complete_by_few_repeats_alone_says_so() -> None:
    """Three repeats happen to differ little more than the noise; what is left exceeds it."""
    says = "the model counts as complete because repeated poses differ by"
    said = scattered(0.04, repeats=3)
    assert said.verdict is Verdict.COMPLETE
    assert said.bench is not None
    assert said.opinion is not None
    floors = said.bench.ladder[-1].floors
    assert floors.repeats is not None
    assert said.opinion.lack.p < TEST_LEVEL
    size, times = quantity(floors.repeats.rms, floors.unit), number(said.opinion.lack.ratio, 2)
    assert f"What is left is {times} times what the noise within each hold makes" in said.says
    assert f"{says} {size}, which few repeats tell" in said.says
    assert "repeat more of them" in said.says
    assert says not in scattered(0.035).says  # twelve repeats show that poses differ


def test_poses_that_do_not_repeat_are_told_with_how_much_and_against_what() -> None:
    """A quarter milli-g from hold to hold is seven times the noise within them."""
    said = scattered(0.25)
    assert said.verdict is Verdict.NOT_REPEATABLE
    for words in (
        "does not repeat",
        "90 % interval",
        "degrees of freedom",
        "settle a little differently",
    ):
        assert words in said.says
    assert said.next_poses


def with_error(
    by: Callable[[FloatArray, FloatArray], FloatArray], seed: int, poses: str = "26+repeats"
) -> Diagnosis:
    """26 poses, twelve of them again, with an error (mg) of the force now and before, g."""
    report, _ = fitted(poses=poses, seed=seed)
    force = [hold.accelerometer / STANDARD_GRAVITY for hold in report.holds]
    before = [force[0], *force[:-1]]
    changed = moved(report, lambda k, _: MG * by(force[k], before[k]))
    return diagnose_benches(Benches(changed), {}, automatic=True)[0]


@pytest.mark.parametrize("seed", [5, 6, 13])
def test_play_that_is_in_every_hold_accuses_none(seed: int) -> None:
    """Z lags behind the force by up to 0.6 g of play, which the first holds show most."""
    at: list[float] = []

    def play(force: FloatArray, _: FloatArray) -> FloatArray:
        now = float(force[2])
        at.append(float(np.clip(at[-1], now - 0.6, now + 0.6)) if at else now)
        return np.array([0.0, 0.0, 0.5 * (at[-1] - now) / 0.6])

    said = with_error(play, seed)
    assert said.verdict in (Verdict.NOT_REPEATABLE, Verdict.UNEXPLAINED)
    assert said.disturbed_holds == ()


def test_what_follows_the_pose_before_on_another_axis_is_not_blamed_on_the_seat() -> None:
    """Z depends on the force along x in the hold before, which no effect of the catalogue does."""
    said = with_error(lambda _, before: np.array([0.0, 0.0, 0.8 * before[0]]), seed=6)
    assert said.verdict is Verdict.NOT_REPEATABLE
    assert "other dependences on the pose before were not tested" in said.says
    assert said.says.index("still follow the pose before") < said.says.index("settle")
    assert all("from another pose than before" in pose.why for pose in said.next_poses)


@pytest.mark.parametrize(("poses", "again"), [("26", True), ("26+repeats", False)])
def test_repeats_that_agree_are_not_asked_for_again(poses: str, again: bool) -> None:
    """A little of a third order: few repeats ask whether it repeats, many what it follows."""
    said = with_error(lambda force, _: np.array([0.0, 0.0, 0.6 * force[2] ** 3]), 7, poses)
    assert said.verdict is Verdict.UNEXPLAINED
    assert said.next_poses
    asked = [pose for pose in said.next_poses if "does this repeat" in pose.why]
    assert bool(asked) == again
    assert ("show whether the error repeats" in said.says) == again
    assert ("Repeated poses agree within the noise (" in said.says) != again
    assert said.report is not None
    held = unit_vectors(np.array([hold.accelerometer for hold in said.report.holds]))
    near = [float((held @ pose.direction).max()) for pose in said.next_poses]
    assert again or np.degrees(np.arccos(max(near))) > 5.0


@pytest.mark.parametrize(
    ("seed", "names"),
    [
        (10, "In the model now: scale-step"),
        (20, "In the model now: scale-drift"),
        (
            6,
            "comes nearest, but this is not certain.",
        ),
    ],
)
def test_repeats_that_an_effect_nearly_explains_are_not_called_chance(
    seed: int, names: str
) -> None:
    """The scale of x walks during the session, which a step resembles, a drift or the temperature.

    What data held out confirm is added, but no effect makes the model complete.
    """
    walk = 0.25 * MG * np.cumsum(np.random.default_rng(seed).standard_normal(60))
    report, _ = fitted(poses="26+repeats", seed=seed)
    walked = moved(
        report,
        lambda k, hold: along(hold, walk[k] * (hold.accelerometer[0] / STANDARD_GRAVITY) ** 2),
    )
    said = diagnose_benches(Benches(walked), {}, automatic=True)[0]
    assert said.verdict is Verdict.NOT_REPEATABLE
    assert names in said.says
    assert "probably" not in said.says
    assert "chance" not in said.says


def test_what_a_missing_effect_spoils_is_not_blamed_on_the_seat() -> None:
    """Poses are held again within some degrees only: a bent characteristic reads another value."""
    report, readings = fitted("second-order:5:y", poses="26+repeats", seed=5)
    report = replace(report, rates={"accelerometer": 100.0})
    said = diagnose_benches(Benches(report, readings), {}, automatic=False)[0]
    assert said.verdict is Verdict.MISSING
    assert "repeat" not in said.says


def test_a_wrong_member_of_the_right_family_is_named() -> None:
    """The student has added asymmetry; what it leaves is the rest of a second-order term."""
    report, readings = fitted("second-order:5:y", poses="26+repeats", seed=5)
    report = replace(report, rates={"accelerometer": 100.0})
    wrong = Benches(report, readings)
    said = diagnose_benches(wrong, {"accelerometer": ["asymmetry"]}, automatic=False)[0]
    assert said.verdict is Verdict.UNEXPLAINED
    text = said.says
    assert "Second-order, an effect of the same kind as asymmetry, would lower it further" in text
    assert "take asymmetry out, and compare" in text
    assert "No effect known here" not in text


def test_what_takes_little_of_the_misfit_is_not_probable() -> None:
    """The bias of z swings once and a half, which a warm-up hardly takes any of."""
    report, _ = fitted(poses="26+repeats", seed=5)
    first, last = report.holds[0].start, report.holds[-1].end

    def swung(_: int, hold: Hold) -> FloatArray:
        phase = 3.0 * np.pi * (hold.start - first) / (last - first)
        return np.array([0.0, 0.0, 4.0 * MG * np.sin(phase)])

    said = diagnose_benches(Benches(moved(report, swung)), {}, automatic=True)[0]
    assert said.verdict in (Verdict.NOT_REPEATABLE, Verdict.UNEXPLAINED)
    assert "probably" not in said.says


@pytest.mark.parametrize(("poses", "again"), [("26", True), ("26+repeats", False)])
def test_a_moved_hold_is_accused_and_asked_for_once(poses: str, again: bool) -> None:
    """A milli-g in one hold is no physics; nothing is added and nothing deleted.

    Where its pose was measured twice, another hold there would only be accused of the same.
    """
    report, _ = fitted(poses=poses, seed=5)
    spoilt = moved(report, lambda k, hold: along(hold, 1.0 * MG if k == 9 else 0.0))
    said = diagnose_benches(Benches(spoilt), {}, automatic=True)[0]
    assert said.verdict is Verdict.DISTURBED
    assert said.disturbed_holds == (9,)
    assert said.added == ()
    assert "Hold 10" in said.says
    if again:
        assert "hold 10" in said.next_poses[0].why
        assert "Measure it again" in said.says
        assert spans_to_leave_out(said) == []
        return
    hold = report.holds[9]
    assert said.next_poses == ()
    assert f"recording without {hold.start:.1f} to {hold.end:.1f} s" in said.says
    assert spans_to_leave_out(said) == [(hold.start, hold.end)]


def test_directions_that_do_not_determine_the_model_are_insufficient() -> None:
    """The six faces carry bias and scale; the edges are asked for."""
    report, readings = fitted()
    faces = tuple(hold for hold in report.holds if hold.pose in FACES)
    said = statement_of(Benches(refitted(report, faces, readings), readings))
    assert said.verdict is Verdict.INSUFFICIENT
    assert "theta" in said.says
    assert "These data determine all other parameters of bias, scale." in said.says
    assert said.next_poses


def test_a_fit_with_as_many_parameters_as_data_tells_no_error() -> None:
    """Six faces are met exactly: rounding of 10⁻¹³ mg is no error of the sensor."""
    report, readings = fitted()
    faces = {hold.pose: hold for hold in report.holds if hold.pose in FACES}
    said = statement_of(Benches(refitted(report, tuple(faces.values()), readings), readings))
    assert said.bench is not None
    assert errors_text(said.bench.fit) == "the error is not known"
    by_method = fit_accelerometer(tuple(faces.values()), report.gravity, "m/s^2", "newton")
    assert errors_text(by_method) == "the error is not known"


def test_an_interval_below_the_error_held_out_is_said_to_be_that_of_new_data() -> None:
    """With few data, those left out have a worse fit than new ones."""
    fit = replace(fitted(seed=5)[0].sensors["accelerometer"], rms_held_out=2.0)
    usual = replace(fit, held_out_interval=(1.0, 3.0))
    above = replace(fit, held_out_interval=(0.1, 1.5))
    assert interval_text(usual).startswith("90 %: ")
    assert interval_text(above).startswith("new data, 90 %: ")


def test_a_hold_that_is_disturbed_beside_an_effect_is_told() -> None:
    made = benches("third-order:5:x", "second-order:5:x")
    found = tried_findings(made, made.accelerometer)
    assert found.opinion.verdict in (Verdict.MISSING, Verdict.AMBIGUOUS)
    beside = replace(found, opinion=replace(found.opinion, holds=(4,)))
    says = diagnosis_of(made, made.accelerometer, beside).says
    assert "Hold 5 disagrees with all the rest beside this: measure it again" in says
    assert "disagrees" not in diagnosis_of(made, made.accelerometer, found).says


def test_an_error_that_is_only_fitted_has_the_same_noise_in_all_lines() -> None:
    report, readings = fitted(seed=5)
    faces = tuple(hold for hold in report.holds if hold.pose in FACES)
    few = refitted(report, faces, readings)
    fit = few.sensors["accelerometer"]
    assert fit.rms_held_out is None
    assert fit.degrees_of_freedom
    noise = quantity(fit.floor_fitted, fit.unit)
    assert errors_text(fit).endswith(f"fitted, noise {noise}")
    assert f"held out not known, noise {noise}" in " ".join(summary(few).split())


def test_an_accelerometer_without_enough_directions_has_not_passed() -> None:
    """The gyroscope's reference is not known better than what it stands on."""
    report, readings = fitted()
    faces = tuple(hold for hold in report.holds if hold.pose in FACES)
    assert not Benches(refitted(report, faces, readings), readings).passed


def test_nothing_is_added_to_a_base_that_the_directions_do_not_determine() -> None:
    """Nine directions: a tilt of the axes that is left at zero looks like a second-order term."""
    report, readings = fitted(seed=3)
    alone = refitted(report, report.holds[:10], readings)
    (said,) = diagnose_benches(Benches(alone, readings), {}, automatic=True)
    assert said.verdict is Verdict.INSUFFICIENT
    assert said.added == ()


def test_an_effect_asked_for_that_takes_up_every_hold_leaves_a_word_not_a_fault() -> None:
    """Nothing is left to compare when there are as many parameters as holds."""
    report, readings = fitted(seed=3)
    alone = refitted(report, report.holds[:10], readings)
    (said,) = diagnose_benches(
        Benches(alone, readings), {"accelerometer": ("second-order",)}, False
    )
    assert said.verdict is Verdict.INSUFFICIENT


def test_while_a_part_of_the_base_is_left_out_no_effect_is_named() -> None:
    """What it leaves looks like any effect: the sentence asks for it, and automatic adds it."""
    report, readings = fitted()
    alone = replace(report, rates={"accelerometer": 100.0})
    (said,) = diagnose_benches(
        Benches(alone, readings, {"accelerometer": ("bias",)}), {}, automatic=False
    )
    assert said.verdict is Verdict.UNEXPLAINED
    assert "Put back scale and non-orthogonality" in said.says
    assert said.next_poses == ()
    climbed = Benches(alone, readings, {"accelerometer": ("bias",)})
    (said,) = diagnose_benches(climbed, {}, automatic=True)
    assert said.verdict is Verdict.COMPLETE
    added = [rung.added for rung in climbed.accelerometer.ladder]
    assert added == [None, "scale", "non-orthogonality"]


def test_the_noise_of_the_gyroscope_has_nothing_of_what_the_accelerometer_lacks() -> None:
    """A second-order term tilts gravity by 0.07°, and the rotations close by no less."""
    good = benches(rotations=3).report.sensors["gyroscope"]
    poor = benches("second-order:5:x", rotations=3).report.sensors["gyroscope"]
    assert poor.rms_held_out is not None
    assert good.floor is not None
    assert poor.rms_held_out > 1.5 * good.floor
    assert poor.floor == pytest.approx(good.floor, rel=0.05)
    assert poor.floor_fitted == pytest.approx(good.floor_fitted, rel=0.05)


def statement_of(benches: Benches) -> Diagnosis:
    return diagnosis_of(benches, benches.accelerometer)


def test_a_term_added_by_hand_that_does_not_help_is_regretted() -> None:
    said = diagnose_benches(benches(), {"accelerometer": ["cross-product"]}, automatic=False)[0]
    assert said.says.startswith("Cross-product was added, but held-out data do not confirm it")
    assert "an effect is confirmed by a fall of more than 3 %" in said.says


def test_what_was_added_together_is_not_regretted_one_by_one() -> None:
    made = benches()
    bench = made.accelerometer
    for name in ("second-order", "cross-product"):
        bench.add(name)
    assert not bench.confirmed()
    assert "Cross-product was added, but" in statement_of(made).says
    bench.keep([Found(one, "", "") for one in ("second-order", "cross-product")])
    assert "was added, but" not in statement_of(made).says


def test_the_gyroscope_waits_until_the_accelerometer_is_complete() -> None:
    """What tilts its reference would be blamed on it: nothing is added, and the sentence says why.

    Once the accelerometer's term is in, its own effect is named.
    """
    both = benches("second-order:5:x", "gyroscope/g-sensitivity:0.1:xy", rotations=3)
    first, waiting = diagnose_benches(both, {}, automatic=False)
    assert first.verdict in (Verdict.MISSING, Verdict.AMBIGUOUS)
    assert waiting.verdict is Verdict.WAITING
    assert "accelerometer's model is not complete" in waiting.says
    first, second = diagnose_benches(both, {}, automatic=True)
    assert second.verdict is not Verdict.WAITING
    assert second.added == ("g-sensitivity",)
    sizes = {one.name: one for one in second.bench.fit.parameters} if second.bench else {}
    found = sizes["g-sensitivity_xy"]
    assert found.standard_error is not None
    assert abs(found.value - 0.1) < 4.5 * found.standard_error


def test_the_gyroscope_keeps_its_effects_when_the_accelerometers_model_changes() -> None:
    both = benches("second-order:5:x", "gyroscope/g-sensitivity:0.1:xy", rotations=3)
    before = both.bench("gyroscope")
    assert before is not None
    before.add("g-sensitivity")
    both.accelerometer.add("second-order")
    after = both.bench("gyroscope")
    assert after is not None
    assert after is not before
    assert after.fit.model[-1] == "g-sensitivity"


def test_a_file_that_is_named_like_a_sensor_is_not_taken_for_it() -> None:
    """The warnings of several files begin with the name of each."""
    report, readings = fitted(rotations=3)
    series = readings.accelerometer
    dead = replace(series, values=series.values * np.array([0.0, 1.0, 1.0]))
    warning = begun("gyroscope.csv: ", dead_axes("accelerometer", dead))
    warned = replace(report, warnings=(warning,))
    assert "it is dead" in insufficient("accelerometer", "add holds", warned).says
    assert "it is dead" not in insufficient("gyroscope", "add rotations", warned).says


def test_rotations_that_clipped_are_not_asked_for_again_as_they_were() -> None:
    """More rotations alone would clip as well."""
    report, _ = fitted(rotations=3)
    clipped = clipped_rotation("x")
    turned = tuple(replace(one, problem=clipped) for one in report.rotations)
    warned = replace(report, rotations=turned, warnings=tuple(rotation_warnings(turned)))
    said = insufficient("gyroscope", "add rotations", warned)
    assert "The gyroscope reaches the end of its range in the rotations from" in said.says
    assert said.says.endswith("turn more slowly, or set a wider range in the device.")


def test_a_gyroscope_that_never_turned_is_insufficient_and_asked_to_turn() -> None:
    report, readings = fitted()
    still = replace(
        report, rotations=(), sensors={"accelerometer": report.sensors["accelerometer"]}
    )
    _, said = diagnose_benches(Benches(still, readings), {}, automatic=False)
    assert said.sensor == "gyroscope"
    assert said.verdict is Verdict.INSUFFICIENT
    assert {pose.pose for pose in said.next_poses} == {"+z", "+x"}
    assert all("rotate about" in pose.why for pose in said.next_poses)


def test_a_term_for_a_gyroscope_that_is_not_there_is_refused() -> None:
    with pytest.raises(UsageError, match="no gyroscope"):
        diagnose_benches(benches(), {"gyroscope": ["g-sensitivity"]}, automatic=False)


def test_document_and_text_are_made_of_every_statement() -> None:
    """Numbers, words and nulls only; no line of text is wider than a terminal."""
    statements = (
        *diagnose_benches(benches("second-order:5:x"), {}, automatic=True),
        insufficient("gyroscope", "it never turned"),
    )
    document = bench_document(statements)
    assert set(document["sensors"]) == {"accelerometer", "gyroscope"}
    for one in document["sensors"].values():
        assert isinstance(one["says"], str)
        for pose in one["next_poses"]:
            assert np.linalg.norm(pose["direction"]) == pytest.approx(1.0)
    assert max(len(line) for line in bench_text(statements).splitlines()) <= 80


def test_new_poses_that_err_more_than_what_was_held_out_are_told() -> None:
    """Something has changed since: the verdict on the model stays, and the reservation is added."""
    report, readings = fitted()
    fit = report.sensors["accelerometer"]
    share = 10.0 * (fit.rms_held_out or 0.0) / report.gravity
    changed = replace(report, validation=later(report.holds[:4], 1.0 + share))
    said = diagnose_benches(Benches(changed, readings), {}, automatic=False)[0]
    assert said.verdict is Verdict.COMPLETE
    assert "On your 4 new poses" in said.says
    assert "Measure them again" in said.says
    assert "may lack" not in said.says
    same = diagnose_benches(Benches(report, readings), {}, automatic=False)[0]
    assert "new poses" not in same.says


def test_new_poses_in_directions_that_the_fit_lacks_may_show_what_the_model_lacks() -> None:
    """Faces and edges are blind to a cross product of all three axes; the corners are not."""
    every, readings = fitted("cross-product:6:xyz", poses="26")
    corner = [bool((np.abs(one.accelerometer) > 0.4 * every.gravity).all()) for one in every.holds]
    fit_on = [one for one, new in zip(every.holds, corner, strict=True) if not new]
    report = refitted(every, fit_on, readings)
    new = tuple(one for one, new in zip(every.holds, corner, strict=True) if new)
    said = diagnose_benches(Benches(replace(report, validation=new)), {}, automatic=False)[0]
    assert said.verdict is Verdict.COMPLETE
    assert said.says.startswith("The model is complete for the poses of the fit, not for the new")
    assert "On your 8 new poses" in said.says
    assert "the model may lack what the poses of the fit do not show" in said.says
    assert "Fit all samples of the session together" in said.says


def test_new_poses_are_judged_by_the_model_with_its_effects() -> None:
    """Where the effect is missing it makes their error, and the bench takes it away."""
    report, readings = fitted("second-order:5:x")
    benches = Benches(replace(report, validation=later(report.holds[:6])), readings)
    before = benches.fitted().sensors["accelerometer"]
    benches.accelerometer.add("second-order")
    after = benches.fitted().sensors["accelerometer"]
    assert len(after.validation) == 6
    assert after.validation_rms is not None
    assert after.validation_rms < 2.0 * after.rms_fitted
    assert after.validation_rms < 0.2 * before.rms_fitted


def later(holds: Sequence[Hold], scale: float = 1.0) -> tuple[Hold, ...]:
    """The same poses once more, a moment after each, with readings that have changed."""
    return tuple(
        replace(one, start=one.start + 1e-3, accelerometer=scale * one.accelerometer)
        for one in holds
    )


def test_too_few_directions_to_predict_one_are_told() -> None:
    """Five times the fitted error: each direction is needed to determine the model."""
    report, readings = fitted()
    fit = report.sensors["accelerometer"]
    few = replace(fit, rms_held_out=5.0 * fit.rms_fitted)
    changed = replace(report, sensors={**report.sensors, "accelerometer": few})
    said = diagnose_benches(Benches(changed, readings), {}, automatic=False)[0]
    assert "These directions are too few to predict one that is left out" in said.says
    noise = replace(few, floor=6.0 * fit.rms_fitted)
    changed = replace(report, sensors={**report.sensors, "accelerometer": noise})
    said = diagnose_benches(Benches(changed, readings), {}, automatic=False)[0]
    assert "too few" not in said.says


def test_what_keeps_a_gyroscope_waiting_is_the_verdict_on_the_accelerometer() -> None:
    _, said = diagnose_benches(benches("second-order:5:x", rotations=3), {}, automatic=False)
    assert (said.verdict, said.waits_for) == (Verdict.WAITING, Verdict.MISSING)
    assert "Complete the accelerometer first." in said.says
    for verdict, first in (
        (Verdict.NOT_REPEATABLE, "Find what differs there first."),
        (Verdict.DISTURBED, "Measure that part again first."),
    ):
        other = verdict_text(replace(said, waits_for=verdict))
        assert first in other
        assert "omplete the accelerometer" not in other


def test_circles_that_do_not_show_the_soft_iron_prove_nothing_about_it() -> None:
    """However well a model fits a few circles that leaves the soft iron at nothing."""
    readings = tumbled().readings
    assert readings is not None
    assert readings.magnetometer is not None
    series = readings.magnetometer
    found = fit_magnetometer(series.between(float(series.time[-1]) - 34.0, float(series.time[-1])))
    assert found.fit.not_determined
    report = FitReport(
        9.8, {"magnetometer": 80.0}, (), (), {"magnetometer": found.fit}, magnetic=found
    )
    _, said = diagnose_benches(Benches(report), {}, automatic=True)
    assert said.verdict is Verdict.INSUFFICIENT
    assert "soft iron" in said.says
    assert not said.settled


def test_a_hold_that_stands_out_is_told_with_a_verdict_that_does_not_explain_it() -> None:
    """Without a verdict it is a warning; beside one that explains the data it is not repeated."""
    report, _ = fitted(poses="26+repeats", seed=5)
    spoilt = moved(report, lambda k, hold: along(hold, 1.0 * MG if k == 9 else 0.0))
    assert "does not agree with the others" in spoilt.outlier_notes["accelerometer"]
    assert spoilt.notes(judged=False)[-1] == spoilt.outlier_notes["accelerometer"]
    assert spoilt.outlier_notes["accelerometer"] not in spoilt.notes(judged=True)
    said = diagnose_benches(Benches(spoilt), {}, automatic=False)[0]
    assert said.verdict is Verdict.DISTURBED
    assert "does not agree with the others" not in said.says


def test_beside_a_name_a_hold_is_accused_only_if_the_others_then_agree() -> None:
    """A hold that moved by 3 mg beside a bent axis; a bias that changes over several holds."""
    report, _ = fitted("second-order:5:x", poses="26+repeats", seed=5)
    spoilt = moved(report, lambda k, hold: along(hold, 3.0 * MG if k == 9 else 0.0))
    said = diagnose_benches(Benches(spoilt), {}, automatic=False)[0]
    assert (said.verdict, said.disturbed_holds) == (Verdict.MISSING, (9,))
    report, _ = fitted(poses="26+repeats", seed=5)
    turned = moved(report, lambda k, _: 10.0 * MG * np.tanh((k - 18.3) / 1.3) * np.eye(3)[0])
    said = diagnose_benches(Benches(turned), {}, automatic=False)[0]
    assert (said.verdict, said.disturbed_holds) == (Verdict.MISSING, ())
    assert "with all the rest beside this" not in said.says


def test_the_earth_does_not_turn_ten_times_faster() -> None:
    """A g-sensitivity that is the same on all axes looks like a rotation about the vertical."""
    each = [f"gyroscope/g-sensitivity:0.1:{axis}" for axis in ("xx", "yy", "zz")]
    report, readings = fitted(*each, rotations=6, seed=8)
    said = diagnose_benches(Benches(report, readings), {}, automatic=True)[1]
    assert "earth-rate" not in said.says
    assert "g-sensitivity" in said.says


def test_several_effects_are_told_as_they_are_together() -> None:
    """Each alone takes up some of the other, and its own fall of the error is not what is missing.

    4 mg/g² of y, and a step of 3 mg of z after a quarter of the holds.
    """
    report, readings = fitted(poses="26", seed=6)
    late = report.holds[len(report.holds) // 4].start

    def error(_: int, hold: Hold) -> FloatArray:
        y = hold.accelerometer[1] / STANDARD_GRAVITY
        return np.array([0.0, 4.0 * MG * y**2, 3.0 * MG * (hold.start > late)])

    (missing,) = diagnose_benches(Benches(moved(report, error), readings), {}, automatic=False)[:1]
    assert missing.verdict is Verdict.MISSING
    bench = missing.bench
    assert bench is not None
    for name, place, true in (("second-order", 1, 4.0), ("bias-step", 2, 3.0)):
        effect = next(one for one in bench.catalogue if one.name == name)
        sizes, errors, _ = sizes_of(missing, bench, effect)
        expected = np.zeros(len(sizes))
        expected[place] = true
        assert (np.abs(sizes - expected) < 4.0 * errors).all()
    assert "Adding second-order and bias-step would bring the error" in missing.says
    for name in ("second-order", "bias-step"):
        bench.add(name)
    held_out, floor = bench.fit.rms_held_out, bench.fit.floor
    assert held_out is not None
    assert floor is not None
    assert held_out < 2.0 * floor
    assert f"to {quantity(held_out, bench.fit.unit)}." in missing.says


def test_two_effects_that_leave_much_are_not_probable() -> None:
    """A rippled characteristic is fitted by all products of two and three forces together."""
    report, _ = fitted(poses="18", seed=5)
    rippled = moved(
        report,
        lambda _, hold: (
            3.0
            * MG
            * np.sin(2.0 * np.pi * 6.0 * hold.accelerometer / STANDARD_GRAVITY)
            * np.array([1.0, 0.0, 0.0])
        ),
    )
    said = diagnose_benches(Benches(rippled), {}, automatic=True)[0]
    assert said.verdict in (Verdict.UNEXPLAINED, Verdict.NOT_REPEATABLE)
    assert "probably" not in said.says


def test_what_an_added_effect_leaves_is_said_of_the_present_model() -> None:
    """Second order on x, and poses that settle a little differently each time."""
    rng = np.random.default_rng(4)
    report, _ = fitted(poses="18", seed=6)
    bent = moved(
        report,
        lambda _, hold: along(
            hold,
            8.0 * MG * (hold.accelerometer[0] / STANDARD_GRAVITY) ** 3 + rng.normal(0.0, 0.1 * MG),
        ),
    )
    said = diagnose_benches(Benches(bent), {}, automatic=True)[0]
    assert [one.term for one in said.found] == ["second-order"]
    assert said.verdict is Verdict.UNEXPLAINED
    assert "In the model now: second-order" in said.says
    bench = said.bench
    assert bench is not None
    left = bench.look().opinion.lack.ratio
    assert f"the residuals are {left:.3g} times" in said.says


def test_the_cost_that_is_told_is_that_of_the_setting_in_the_model() -> None:
    """A step counts at the same share of the ordinary session as of the one measured."""
    for name, setting in (("warm-up", 40.0), ("bias-step", None)):
        made = benches(f"{name}:5:x")
        bench, sensor = made.accelerometer, "accelerometer"
        bench.add(name, setting)
        (sizes,), (term,) = bench.fit.sizes, bench.fit.terms
        assert term.variant is not None
        ordinary = setting or 600.0 * term.variant / bench.measured.circumstances.reference_time
        cost = cost_of_ignoring(effect(name), sensor, sizes, ordinary).tilt_rms
        assert cost is not None
        told = f"the up direction wrong by {quantity(math.radians(cost), 'rad', 2)} rms"
        assert told in " ".join(effect_text(diagnosis_of(made, bench), bench, name))
        if name == "warm-up":
            assert cost != cost_of_ignoring(effect(name), sensor, sizes).tilt_rms


def test_sizes_that_are_known_only_together_are_not_left_out() -> None:
    """Still poses show the sum of three products of all forces, and none of them alone."""
    report, readings = fitted("cross-product:4:xyz", poses="26", seed=3)
    alone = {"accelerometer": report.sensors["accelerometer"]}
    report = replace(report, rates={"accelerometer": 100.0}, sensors=alone)
    said = diagnose_benches(Benches(report, readings), {}, automatic=True)[0]
    assert said.found[0].term == "cross-product"
    assert "not determined alone" in said.says
    together = re.search(r"xyz \+ yxz \+ zxy ([\d.]+) ± ([\d.]+)", said.says)
    assert together is not None
    size, error = map(float, together.groups())
    assert abs(size - 4.0) < 3.0 * error < 0.6
    cost = re.search(r"the up direction wrong by ([\d.]+)° to ([\d.]+)° rms \(90 %", said.says)
    assert cost is not None
    low, high = map(float, cost.groups())
    whole = np.array([0.0, 0.0, 4.0, *[0.0] * 6])
    truth = cost_of_ignoring(effect("cross-product"), "accelerometer", whole).tilt_rms
    assert truth is not None
    assert low < truth < high < 3.0 * low


def test_rotations_show_how_a_sum_is_split() -> None:
    """Each split tilts gravity in its own way, and no split is noise of the gyroscope."""
    report, readings = fitted("cross-product:4:xyz", poses="26", seed=3)
    said = diagnose_benches(Benches(report, readings), {}, automatic=True)
    bench, turned = said[0].bench, said[1].bench
    assert bench is not None
    assert turned is not None
    fit = bench.fit
    size, error = fit.sizes[0], fit.size_errors[0]
    assert (np.abs(size - np.array([0.0, 0.0, 4.0, *[0.0] * 6])) < 3.5 * error).all()
    assert error.max() < 0.3
    assert "cross-axis product), xyz 4." in said[0].says
    assert "not determined alone" not in said[0].says
    plain = Benches(*fitted(poses="26", seed=3)).bench("gyroscope")
    assert plain is not None
    floor, held_out = turned.fit.floor, turned.fit.rms_held_out
    assert plain.fit.floor is not None
    assert floor == pytest.approx(plain.fit.floor, rel=0.15)
    assert held_out is not None
    assert held_out < 1.2 * plain.fit.floor


def test_an_effect_that_shows_by_a_sum_of_its_sizes_comes_nearest() -> None:
    """No part of the sum stands out alone; the shortest line of the table gives the sum, too."""
    report, _ = fitted("cross-product:12:xyz", seed=0)
    recording = Benches(refitted(report, report.holds))
    said = diagnosis_of(recording, recording.accelerometer)
    assert said.findings is not None
    entries = entries_of(recording.accelerometer, said.findings)
    first = next(one for one in entries if one.term == "cross-product")
    assert first.suspect is not None
    assert first.suspect.trial is not None
    assert first.suspect.trial.clear
    found = re.match(r"sum (\S+) ± (\S+) mg/g²$", suspect_size(first, "accelerometer", 24))
    assert found is not None
    size, error = map(float, found.groups())
    assert abs(size - 12.0) < 3.0 * error
    if said.verdict is Verdict.UNEXPLAINED:
        assert "cross-product (xyz + yxz + zxy " in said.says


def test_a_lag_is_listed_beside_what_it_equals_in_a_single_warm_up() -> None:
    """While the temperature settles exponentially, its slope is the temperature but for a factor.

    The steps of the thermometer decide for neither.
    """
    bench = Benches(*fitted("bias-temperature:2:x", poses="26", seed=5)).accelerometer
    opinion = bench.look().opinion
    assert opinion.verdict is Verdict.AMBIGUOUS
    assert {"bias-temperature", "thermal-lag"} <= {*opinion.terms[0]}
    words = lesson(effect("thermal-lag"), "accelerometer", bench.catalogue).alike
    assert "Exactly the same error while the temperature settles exponentially" in words
    assert "rises and falls" in words


def test_a_term_added_by_hand_is_said_to_be_one_of_several() -> None:
    """The model is complete with it, and would be with another one; a clear effect stands alone."""
    recording = Benches(*fitted("bias-temperature:2:x", poses="26", seed=5))
    recording.accelerometer.add("bias-temperature")
    said = diagnosis_of(recording, recording.accelerometer)
    assert said.verdict is Verdict.COMPLETE
    assert re.search(r"do not decide for bias-temperature: [^.]*\bthermal-lag\b", said.says)
    clear = Benches(*fitted("second-order:5:x", poses="26", seed=3))
    clear.accelerometer.add("second-order")
    assert "do not decide" not in diagnosis_of(clear, clear.accelerometer).says


def test_two_effects_of_one_slow_family_are_listed_where_one_may_be_enough() -> None:
    recording = Benches(*fitted("bias-temperature:2:x", poses="26", seed=5))
    said = diagnosis_of(recording, recording.accelerometer)
    assert said.findings is not None
    both = ("bias-temperature", "warm-up")
    opinion = replace(said.findings.opinion, explanations=(both[:1], both), together=(both,))
    open_ = replace(said, findings=replace(said.findings, opinion=opinion))
    words = "several explanations that these data cannot separate: bias-temperature; "
    assert f"{words}bias-temperature with warm-up." in verdict_text(open_)


@pytest.mark.parametrize("name", ["odd-quadratic", "axis-delay"])
def test_sizes_that_are_known_as_well_alone_are_not_summed(name: str) -> None:
    """Independent sizes; and sizes whose sum is zero by convention."""
    covariance = 0.04 * np.eye(3) if name == "odd-quadratic" else 0.04 * (np.eye(3) - 1.0 / 3.0)
    sizes, errors = np.array([0.9, 0.5, 0.4]), np.sqrt(np.diag(covariance))
    sensor = "accelerometer" if name == "odd-quadratic" else "gyroscope"
    assert " + " not in sizes_text(effect(name), sensor, sizes, errors, covariance)


def test_a_method_of_the_papers_does_not_take_the_verdict_of_the_usual_fit() -> None:
    """Single-axis scales ignore the cross axes that the data show."""
    _, readings = fitted(rotations=6)
    report = fit_readings(readings, FitOptions(gyroscope_method="static"))
    (_, said) = diagnose_benches(Benches(report, readings), {}, automatic=False)
    (one, other) = (report.sensors["gyroscope"].rms_held_out, said.ladder[0].rms_held_out)
    assert one is not None
    assert other is not None
    assert one > 1.5 * other
    assert said.says.startswith("With the static method the error is ")
    grade = graded(report, {said.sensor: said})["gyroscope"]
    assert grade.grade is Grade.DOUBTFUL
    assert "without the static method" in grade.why


def _on_a_table(seconds: float, seed: int, instability: float, error: float = 0.0) -> Diagnosis:
    """Of eighteen holds without a repeat; noise in units of the white noise of a hold's mean."""
    rng = np.random.default_rng(seed)
    wrong = error * rng.standard_normal((18, 3))
    holds = holds_of(EIGHTEEN, seconds, rng, instability, error=wrong)
    units, rates = {"accelerometer": "m/s^2"}, {"accelerometer": 25.0}
    report = fit_holds(holds, (), rates, units, FitOptions(), (), ())
    (said,) = diagnose_benches(Benches(report, None), {}, automatic=False)
    return said


def test_slow_noise_that_long_holds_show_is_noise_and_said() -> None:
    said = _on_a_table(60.0, 2, 3.0)
    assert said.verdict is Verdict.COMPLETE
    assert "is slow noise from hold to hold" in said.says
    assert said.bench is not None
    floors = said.bench.ladder[-1].floors
    assert floors.within == pytest.approx(math.hypot(1.0, 0.52 * 3.0) * SIGMA, rel=0.3)
    assert floors.slow == pytest.approx(1.1 * 3.0 * SIGMA, rel=0.4)
    assert "slow, from hold to hold" in bench_text([said])


def test_slow_noise_that_long_holds_do_not_exclude_is_not_denied() -> None:
    """White noise within them and twice as much from hold to hold; far more is no slow noise."""
    said = _on_a_table(20.0, 4, 0.0, error=2.0)
    assert said.verdict is Verdict.UNEXPLAINED
    assert "Slow noise may be what is left: these holds do not exclude" in said.says
    large = _on_a_table(20.0, 4, 0.0, error=20.0)
    assert "Slow noise may" not in large.says
