"""All that the bench has to say of one sensor, in one place: screens, JSON and text show this."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.bench.advice import Advice, advice
from imucal_wizard.bench.benches import Benches
from imucal_wizard.bench.field_advice import accused_field, circles
from imucal_wizard.bench.lacking import lacking_base
from imucal_wizard.bench.more_poses import accused, missing_directions
from imucal_wizard.bench.pose import turns
from imucal_wizard.bench.session import Bench, Findings
from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.effects.effect import GYROSCOPE, MAGNETOMETER
from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.hold_data import BASE
from imucal_wizard.solver.result import FitReport

Stretches = tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class Statement:
    """What is said of one sensor.

    Attributes:
        sensor: which.
        verdict: the word.
        advice: what to measure next.
        bench: the sensor's bench; None where its data do not carry any model.
        findings: those that the verdict is about; None without a bench.
        added: terms that have been added to the model these findings are about.
        lacking: why the data are insufficient, or "".
        waiting: the accelerometer has not passed, so that nothing can be named here.
        holds: numbers of disturbed holds.
        rotations: numbers of disturbed rotations.
        stretches: of a magnetometer, begin and end of stretches of time in which the field was
            disturbed, s.
        report: the plain fit, for the names of poses and axes; None where there is none.
    """

    sensor: str
    verdict: Verdict
    advice: Advice
    bench: Bench | None = None
    findings: Findings | None = None
    added: tuple[str, ...] = ()
    lacking: str = ""
    waiting: bool = False
    holds: tuple[int, ...] = ()
    rotations: tuple[int, ...] = ()
    stretches: Stretches = ()
    report: FitReport | None = None


def statement(benches: Benches, bench: Bench, findings: Findings | None = None) -> Statement:
    """What the bench of one sensor says.

    Args:
        benches: the session's.
        bench: that of the sensor.
        findings: those that the verdict is about (``Bench.automatic``); the present model's when
            left out.
    """
    findings = findings or bench.look()
    lacking = lacking_base(bench)
    waiting = bench.sensor == GYROSCOPE and not benches.passed
    verdict = _verdict(findings, lacking, waiting, bench.fit.base == bench.whole)
    disturbed = verdict is Verdict.DISTURBED
    holds, rotations, stretches = _accused(bench, findings) if disturbed else ((), (), ())
    before = set(findings.fit.model)
    return Statement(
        sensor=bench.sensor,
        verdict=verdict,
        advice=advice(bench, findings, verdict) if bench.fit.base == bench.whole else Advice(),
        bench=bench,
        findings=findings,
        added=tuple(term for term in bench.fit.model if term not in before),
        lacking=lacking,
        waiting=waiting,
        holds=holds,
        rotations=rotations,
        stretches=stretches,
        report=benches.report,
    )


def _accused(
    bench: Bench, findings: Findings
) -> tuple[tuple[int, ...], tuple[int, ...], Stretches]:
    """Holds, rotations and stretches of time that are said to be disturbed."""
    if isinstance(bench.measured, FieldData):
        holds, stretches = accused_field(bench.measured, findings)
        return holds, (), stretches
    return (*accused(findings), ())


def _verdict(findings: Findings, lacking: str, waiting: bool, whole: bool) -> Verdict:
    """The word.

    While a part of the base is left out nothing is named: what it leaves looks like any effect.
    While the accelerometer has not passed, what it lacks tilts the reference: neither an effect nor
    a disturbed rotation is the gyroscope's for sure.
    """
    if lacking:
        return Verdict.INSUFFICIENT
    verdict = findings.opinion.verdict
    if not whole and verdict is not Verdict.COMPLETE:
        return Verdict.UNEXPLAINED
    named = verdict in (Verdict.MISSING, Verdict.DISTURBED)
    return Verdict.AMBIGUOUS if waiting and named else verdict


def nothing_carried(sensor: str, reason: str) -> Statement:
    """What is said of a sensor whose data carry no model at all.

    Args:
        sensor: which.
        reason: why, in words.
    """
    needed = missing_directions(np.zeros((0, 3)), BASE)
    if sensor == GYROSCOPE:
        needed = tuple(turns("xyz", "the gyroscope needs turns about every axis"))
    if sensor == MAGNETOMETER:
        needed = circles("the magnetometer needs the field from every side")
    return Statement(sensor, Verdict.INSUFFICIENT, Advice(needed), lacking=reason)
