"""Rotations that begin or end in a hand that trembles: they say less, and count for less."""

from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from imucal_wizard.core.quaternions import rotation_matrix
from imucal_wizard.core.readings import FloatArray, IntArray, Readings, Series, join_readings
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.recording import fit_collected, fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.plan import Procedure, standard
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.model.rows.field_closure import FieldClosure
from imucal_wizard.model.rows.gravity_closure import GravityClosure
from imucal_wizard.simulate.actions import Action, LieStill, Tremble
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.recording import recording_script
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.sensor import SensorModel
from tests.calibrate.collecting import offline
from tests.estimate.whole_session import Session
from tests.simulate.sensors import truth

RATE = 100.0
SEEDS = (0, 1)
IN_THE_HAND = (24, 30)
"""During these rests, counted from the first, the device is not put down."""


def _script(seed: int, trembling: bool) -> Iterator[Action]:
    rests = 0
    script = recording_script("18", np.random.default_rng([seed, 5]), hold=3.5, rotations=6)
    for action in script:
        yield action
        if isinstance(action, LieStill):
            rests += 1
            if trembling and rests in IN_THE_HAND:
                yield Tremble(rests == IN_THE_HAND[0])


def _readings(seed: int, trembling: bool) -> Readings:
    hand = VirtualHand(RATE, seed)
    hand.perform(_script(seed, trembling))
    stream = VirtualStream(hand, SensorModel.drawn(seed), rate=RATE, seed=seed)
    parts = []
    while count := hand.remaining(4096):
        part = stream.take(count)
        parts.append(
            Readings(
                Series(part.time, part.accelerometer, "m/s^2"),
                Series(part.time, part.gyroscope, "rad/s"),
            )
        )
    return join_readings(parts)


@cache
def fitted(seed: int, trembling: bool) -> FitReport:
    """What the wizard makes of it, the limits loosened as soon as that is offered."""
    readings = _readings(seed, trembling)
    machine = StateMachine(Procedure(standard(6, settle_seconds=5.0).steps, led=False), rate=RATE)
    machine.command("start")
    time = readings.accelerometer.time
    for start in np.arange(0.0, float(time[-1]), 1.0):
        machine.feed(_part(readings, start))
        if machine.status().still.waiting > 4.0:
            machine.command("loosen")
    return fit_collected(
        machine.collected(), {"accelerometer": "m/s^2", "gyroscope": "rad/s"}, RATE
    )


def _part(readings: Readings, start: float) -> Readings:
    assert readings.gyroscope is not None
    return Readings(
        readings.accelerometer.between(start, start + 1.0),
        readings.gyroscope.between(start, start + 1.0),
    )


def off(seed: int, trembling: bool) -> FloatArray:
    """Error of the gyroscope's matrix and bias."""
    fit, true = fitted(seed, trembling).sensors["gyroscope"], truth(seed)
    return np.concatenate(
        [(fit.matrix - true.gyroscope_matrix).ravel(), fit.bias - true.gyroscope_bias]
    )


@pytest.mark.study
def test_a_hand_that_trembles_a_while_spoils_little() -> None:
    """A sixth of the holds lost doubles the error; taken as good ones they make it ninefold."""
    calm, shaken = (
        float(np.sqrt(np.mean([np.sum(off(seed, trembling)[:9] ** 2) for seed in SEEDS])))
        for trembling in (False, True)
    )
    assert shaken < 4.0 * calm


@pytest.mark.study
def test_its_standard_errors_are_true() -> None:
    """Of the gains; the biases are means over the session, which wander from what was simulated."""
    errors, biases = [], []
    for seed in SEEDS:
        calm, shaken = (fitted(seed, one).sensors["gyroscope"] for one in (False, True))
        assert calm.covariance is not None
        assert shaken.covariance is not None
        before, after = np.diag(calm.covariance), np.diag(shaken.covariance)
        errors.append(off(seed, True)[:9] / np.sqrt(after[:9]))
        biases.append((shaken.bias - calm.bias) / np.sqrt(before + after)[9:])
        # the rests in which the hand trembled hardly make the bias uncertain
        assert (after[9:] < 2.0 * before[9:]).all()
    assert np.abs(errors).max() < 4.0
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.6
    assert np.abs(biases).max() < 4.0


@pytest.mark.study
def test_what_the_hand_does_is_not_laid_on_the_model() -> None:
    """The wizard keeps the same rests as a recording of it, and the floor counts what is left."""
    for seed in SEEDS:
        report, recorded = fitted(seed, True), fit_readings(_readings(seed, True))
        live, later = ([hold.start for hold in one.holds] for one in (report, recorded))
        np.testing.assert_allclose(live, later, atol=0.2)
        fit = report.sensors["gyroscope"]
        assert fit.floor is not None
        assert fit.rms_fitted < 2.0 * fit.floor


def _by_both(seed: int) -> GyroscopeExperiment:
    """Forty rests and the rotations between them, closed by gravity and field."""
    fit = offline(seed).sensors["gyroscope"]
    assert fit.method == "vector + field"
    assert isinstance(fit.experiment, GyroscopeExperiment)
    return fit.experiment


def test_rotations_that_are_known_less_weigh_less_with_both_references_too() -> None:
    """Eight of thirty-nine rotations began a degree from where the hold's mean says."""
    true, rng = Session().gyroscope, np.random.default_rng(8)
    errors = {False: 0.0, True: 0.0}
    for seed in (0, 1):
        experiment = _by_both(seed)
        still, gravity, heading = experiment.sources
        assert isinstance(gravity, GravityClosure)
        assert isinstance(heading, FieldClosure)
        count = len(gravity.before)
        assert len(heading.labels) == count
        bad, turned = rng.choice(count, 8, replace=False), np.tile(np.eye(3), (count, 1, 1))
        turned[bad] = [rotation_matrix(np.radians(1.0) * rng.standard_normal(3)) for _ in bad]
        # headings stand in the order of the holds, closures in that of the rotations
        order = heading.labels.group

        def moved(
            source: GravityClosure, rows: IntArray, by: FloatArray = turned
        ) -> GravityClosure:
            return replace(source, before=np.einsum("mij,mj->mi", by[rows], source.before))

        for known in errors:
            more = np.zeros(count)
            more[bad] = np.radians(1.0) ** 2 if known else 0.0
            one = copy(experiment)
            one.sources = (
                still,
                replace(moved(gravity, np.arange(count)), noise=gravity.noise + more),
                replace(
                    heading,
                    by_gravity=moved(heading.by_gravity, order),
                    by_field=moved(heading.by_field, order),
                    noise=heading.noise + more[order],
                ),
            )
            errors[known] += float(((fit(one).matrix - true.matrix) ** 2).sum())
    assert errors[True] < 0.1 * errors[False]
