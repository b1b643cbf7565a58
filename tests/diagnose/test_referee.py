"""Rotations decide between explanations that the magnitude of gravity cannot split."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from benchmarks.referee import KINDS, judged
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.hypotheses import SPREAD_SHARES, SPREADS
from imucal_wizard.diagnose.random_walk import SIGMAS, sigma_prior
from imucal_wizard.diagnose.referee import Hearing, best_beyond, evidence_by_scatter
from imucal_wizard.diagnose.referee import Testimony as Said
from imucal_wizard.diagnose.survey import add_by_itself, diagnose_benches, diagnosis_of
from imucal_wizard.diagnose.verdict import Verdict, judge_misfit, unconfirmed
from imucal_wizard.diagnose.verdict_text import verdict_text
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import Minimum, refined_minimum
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.rows import gravity_closure
from imucal_wizard.model.terms import Term
from imucal_wizard.report.bench_document import bench_document
from imucal_wizard.report.bench_text import bench_text
from tests.diagnose.recordings import fitted

pytestmark = pytest.mark.usefixtures("no_sizes_throughout")


def dense(found: Minimum[Experiment], sigma: float, effect: FloatArray) -> float:
    """The marginal likelihood with the covariance of all rows written out."""
    system, known = found.system, found.system.precision > 0.0
    moving = found.system.kinds == found.system.kinds.max()
    doubts = system.columns[:, known]
    residual = system.residual - doubts @ system.value[known]
    noise = np.where(moving, sigma**2 * system.own, found.balance.variance)
    shared = doubts / np.sqrt(system.precision[known])
    variance = np.diag(noise) + shared @ shared.T + effect @ effect.T
    inverse, free = np.linalg.inv(variance), system.columns[:, ~known]
    normal = free.T @ inverse @ free
    left = inverse - inverse @ free @ np.linalg.solve(normal, free.T @ inverse)
    volume = np.linalg.slogdet(variance)[1] + np.linalg.slogdet(normal)[1]
    return float(-0.5 * (volume + residual @ left @ residual))


@cache
def asymmetric() -> Benches:
    """Of an asymmetry that the rotations tell from a square; its models stay as they are."""
    return Benches(*fitted("asymmetry:1.5:y", rotations=6))


def test_the_evidence_is_the_likelihood_with_the_whole_covariance() -> None:
    """Sums over noise, effect and size of what the dense formula gives."""
    bench = asymmetric().bench("gyroscope")
    assert bench is not None
    assert bench.fit.minimum is not None
    found = bench.fit.minimum
    rng = np.random.default_rng(1)
    effect = rng.standard_normal((len(found.system.own), 2)) * np.sqrt(found.system.own)[:, None]
    each = [
        np.logaddexp.reduce(
            [
                prior + np.log(0.5 / 0.79) + dense(found, sigma, 0.0 * effect),
                *(
                    prior + np.log(0.29 / 0.79 * share) + dense(found, sigma, s * effect)
                    for s, share in zip(SPREADS, SPREAD_SHARES, strict=True)
                ),
            ]
        )
        for sigma, prior in zip(SIGMAS, sigma_prior(), strict=True)
    ]
    whole = [one.whole for one in evidence_by_scatter(found, [effect])]
    assert np.logaddexp.reduce(whole) == pytest.approx(np.logaddexp.reduce(each), abs=1e-6)


def test_rotations_tell_an_asymmetry_from_a_square() -> None:
    """Alone the accelerometer cannot; text and document show both closures, and who decided."""
    benches = Benches(*fitted("asymmetry:1.5:y", rotations=6))
    bench = benches.accelerometer
    referee, bench.referee = bench.referee, None
    assert bench.look().opinion.verdict is Verdict.AMBIGUOUS
    bench.referee, bench._findings = referee, None
    opinion = bench.look().opinion
    assert opinion.verdict is Verdict.MISSING
    assert opinion.terms == (("asymmetry",),)
    right, wrong = opinion.closures(("asymmetry",)), opinion.closures(("second-order",))
    assert right is not None
    assert wrong is not None
    assert right[1] < min(wrong[1], right[0])
    said = diagnosis_of(benches, bench)
    assert "this decides for asymmetry (probability 9" in said.says
    assert "gyroscope's closure with this: " in " ".join(bench_text([said]).split())
    own = bench_document([said])["sensors"]["accelerometer"]
    assert own["gyroscope_closure"]["decided"] == ["even-order"]
    assert own["suspects"][0]["gyroscope_closure"] == [*right]
    add_by_itself(bench)
    assert [(one.term, one.decided_by) for one in bench.found] == [
        ("asymmetry", "directions left out and the gyroscope's closure")
    ]


def test_a_name_that_is_withdrawn_is_not_decided() -> None:
    """Nothing is named then that the closure could decide for."""
    said = diagnosis_of(asymmetric(), asymmetric().accelerometer)
    assert said.findings is not None
    assert said.findings.opinion.decided == ("even-order",)
    opinion = unconfirmed(said.findings.opinion)
    assert opinion.decided == ()
    withdrawn = replace(
        said, verdict=opinion.verdict, findings=replace(said.findings, opinion=opinion)
    )
    assert "gyroscope's closure is" in verdict_text(withdrawn)
    assert "decides for" not in verdict_text(withdrawn)


def test_the_evidence_does_not_depend_on_the_directions_in_which_closures_are_measured(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Those across up of a face change with the least tilt of the reference."""
    bench = asymmetric().accelerometer
    assert bench.referee is not None
    referee, across = bench.referee(), gravity_closure.across
    assert referee is not None
    found = refined_minimum(bench.measured, [Term(effect("asymmetry"))], bench.fit.base)
    before = referee.hear(found).log_evidence
    # a quarter turn about up
    monkeypatch.setattr(
        gravity_closure, "across", lambda up: across(up)[:, ::-1] * [[[1.0], [-1.0]]]
    )
    assert referee.hear(found).log_evidence == pytest.approx(before, abs=1e-6)


def test_a_name_that_tilts_gravity_the_wrong_way_is_not_given() -> None:
    """The square of y on x looks like a cross product at 1 g; the rotations speak against that."""
    (said, *_) = diagnose_benches(
        Benches(*fitted("cross-product:4.9:xyy", rotations=6)), {}, automatic=False
    )
    assert said.verdict is Verdict.UNEXPLAINED
    assert "contradicts" in said.says


def test_a_true_effect_with_many_parameters_is_not_contradicted() -> None:
    """One of fifteen cubic products acts; averaged over all that 18 poses leave open, none fits."""
    (said, *_) = diagnose_benches(
        Benches(*fitted("cubic-cross:1:x", rotations=6, seed=2)), {}, automatic=False
    )
    assert said.findings is not None
    heard = said.findings.opinion.heard
    assert heard is not None
    assert heard.unlikely
    true = heard.with_terms["cubic-cross",]
    assert true.log_evidence + true.best_beyond > heard.now.log_evidence
    assert not said.findings.opinion.refuted
    assert "contradicts" not in said.says


def test_what_is_open_is_contradicted_only_by_its_best_value() -> None:
    """The average over its prior may be far less likely than that."""

    def against(*of: tuple[float, float]) -> bool:
        said: dict[tuple[str, ...], Said] = {
            (str(k),): Said(None, one, best_beyond=beyond) for k, (one, beyond) in enumerate(of)
        }
        return Hearing(Said(None, 0.0), said).against_all

    assert against((-10.0, 0.0), (-30.0, 20.0))
    assert not against((-10.0, 0.0), (-30.0, 26.0))


def test_the_best_value_is_that_of_a_likelihood_without_its_prior() -> None:
    """As written out for a vector that a few rows show, one of its directions not at all."""
    rng = np.random.default_rng(2)
    columns, rows = np.zeros((9, 3)), rng.standard_normal(9)
    columns[:, :2] = 3.0 * rng.standard_normal((9, 2))
    covariance = np.linalg.inv(np.eye(3) + columns.T @ columns).astype(float)
    left = rows - columns @ np.linalg.lstsq(columns, rows, rcond=None)[0]
    whole = np.eye(9) + columns @ columns.T
    averaged = -0.5 * (np.linalg.slogdet(whole)[1] + rows @ np.linalg.solve(whole, rows))
    beyond = best_beyond(covariance @ columns.T @ rows, covariance)
    assert averaged + beyond == pytest.approx(-0.5 * left @ left, abs=1e-9)


def test_where_it_speaks_against_all_likely_explanations_it_is_asked_of_others() -> None:
    """The prior of aliases may leave the right one less than is listed."""
    found, asked = asymmetric().accelerometer.look(), []

    def hearing(explanations: tuple[tuple[str, ...], ...]) -> Hearing:
        asked.append(explanations)
        said = dict.fromkeys(explanations, Said(None, -50.0 * (len(asked) == 1)))
        return Hearing(Said(None, 0.0), said)

    opinion = judge_misfit(found.misfit, found.hypotheses, found.posterior, hearing)
    first, second = asked
    assert second
    assert not set(first) & set(second)
    assert opinion.heard is not None
    assert not opinion.refuted
    assert set(opinion.heard.with_terms) == {*first, *second}


def test_rotations_that_lack_something_under_every_explanation_decide_nothing() -> None:
    """Closures that scatter by twice their noise do not tell aliases apart."""
    found = asymmetric().accelerometer.look()

    def hearing(explanations: tuple[tuple[str, ...], ...], scattered: float) -> Hearing:
        said = {one: Said(None, -50.0 * place, scattered) for place, one in enumerate(explanations)}
        return Hearing(Said(None, -90.0), said)

    of = found.misfit, found.hypotheses, found.posterior
    alone = judge_misfit(*of, None)
    by_scatter = [judge_misfit(*of, partial(hearing, scattered=one)) for one in (0.5, 0.999)]
    assert [one.terms == alone.terms for one in by_scatter] == [False, True]
    assert [bool(one.decided) for one in by_scatter] == [True, False]


def test_an_effect_that_the_accelerometer_does_not_show_is_found_by_the_rotations() -> None:
    """A cross product of 2 mg/g² that 18 poses cannot see leaves the accelerometer complete."""
    benches = Benches(*fitted("cross-product:2:xyz", rotations=6))
    first, second, *_ = diagnose_benches(benches, {}, automatic=False)
    assert first.verdict is Verdict.COMPLETE
    assert second.verdict is Verdict.UNEXPLAINED
    assert second.in_reference == ("cross-product",)
    assert "cross-product of the accelerometer" in second.says


def test_what_leaves_closures_scattered_explains_nothing() -> None:
    """Neither does what is no more likely than one of so many would be by chance."""

    def enough(*of: tuple[float, float]) -> tuple[tuple[str, ...], ...]:
        said: dict[tuple[str, ...], Said] = {
            (str(k),): Said(None, one, scattered) for k, (one, scattered) in enumerate(of)
        }
        return Hearing(Said(None, 0.0), said).enough

    assert enough((20.0, 0.1), (18.0, 0.2), (10.0, 0.0)) == (("0",), ("1",))
    assert not enough((20.0, 0.9), (18.0, 0.2))
    assert not enough((4.7, 0.0), (0.0, 1.0))


def test_without_a_gyroscope_nothing_changes() -> None:
    """There is nobody to ask."""
    _, readings = fitted("asymmetry:1.5:y", rotations=6)
    alone = replace(readings, gyroscope=None)
    opinion = Benches(fit_readings(alone), alone).accelerometer.look().opinion
    assert opinion.verdict is Verdict.AMBIGUOUS
    assert opinion.heard is None


@pytest.mark.study
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "nothing"])
def test_the_gyroscope_brings_no_wrong_name(kind: str) -> None:
    """In a recording of each kind, with a gyroscope that has an error of its own."""
    one = judged(57, kind, 1)
    assert one.refereed in ("", kind, one.alone)


def test_the_gyroscope_does_not_judge_a_dead_zone() -> None:
    """Within the zone the accelerometer does not show up: with the right size it stays wrong."""
    report, readings = fitted("dead-zone:4:y", poses="26", rotations=6, seed=3)
    said = diagnose_benches(Benches(report, readings), {}, automatic=False)[0]
    assert said.findings is not None
    heard = said.findings.opinion.heard
    assert heard is None or ("dead-zone",) not in heard.with_terms
    assert "contradicts" not in said.says


def test_a_dead_zone_in_the_model_leaves_the_gyroscope_no_error() -> None:
    """Holds within the zone do not show up, and the gyroscope is told so."""
    benches = Benches(*fitted("dead-zone:4:y", poses="26", rotations=6, seed=3))
    benches.accelerometer.add("dead-zone")
    gyroscope = benches.bench("gyroscope")
    assert gyroscope is not None
    assert gyroscope.fit.floor_fitted is not None
    assert gyroscope.fit.rms_fitted < 2.0 * gyroscope.fit.floor_fitted
    assert "hide up to 0.44° of the direction of gravity" in gyroscope.measured.assumption
