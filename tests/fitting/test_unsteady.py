"""Rotations that begin or end in a hand that trembles: they say less, and count for less."""

from collections.abc import Iterator
from functools import cache

import numpy as np

from imucal_wizard.devices.virtual import SensorModel, VirtualHand
from imucal_wizard.devices.virtual.actions import Action, Rest, Tremble
from imucal_wizard.devices.virtual.simulate import recording_script
from imucal_wizard.devices.virtual.stream import VirtualStream
from imucal_wizard.fitting import fit_collected
from imucal_wizard.fitting.passages import crossings
from imucal_wizard.procedure.plan import Procedure, standard
from imucal_wizard.procedure.steps import Machine
from imucal_wizard.readings import FloatArray, Readings, Series, join
from imucal_wizard.solver.attitude import lay_out
from imucal_wizard.solver.result import FitReport
from imucal_wizard.solver.second_stage.attitude_fit import fit_attitude
from imucal_wizard.solver.second_stage.references import References
from imucal_wizard.solver.second_stage.rotation import exponential
from tests.solver.whole_session import HOLD, TURN, Session, attitude
from tests.virtual.sensors import truth

RATE = 100.0
SEEDS = (0, 1, 2)
IN_THE_HAND = (24, 30)
"""During these rests, counted from the first, the device is not put down."""


def _script(seed: int, trembling: bool) -> Iterator[Action]:
    rests = 0
    script = recording_script("18", np.random.default_rng([seed, 5]), hold=3.5, rotations=6)
    for action in script:
        yield action
        if isinstance(action, Rest):
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
    return join(parts)


@cache
def fitted(seed: int, trembling: bool) -> FitReport:
    """What the wizard makes of it, the limits loosened as soon as that is offered."""
    readings = _readings(seed, trembling)
    machine = Machine(Procedure(standard(6, settle_seconds=5.0).steps, led=False), rate=RATE)
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


def test_a_hand_that_trembles_a_while_spoils_little() -> None:
    """A sixth of the holds lost doubles the error; taken as good ones they make it ninefold."""
    calm, shaken = (
        float(np.sqrt(np.mean([np.sum(off(seed, trembling)[:9] ** 2) for seed in SEEDS])))
        for trembling in (False, True)
    )
    assert shaken < 4.0 * calm


def test_its_standard_errors_are_true() -> None:
    errors = []
    for seed in SEEDS:
        covariance = fitted(seed, True).sensors["gyroscope"].covariance
        assert covariance is not None
        errors.append(off(seed, True) / np.sqrt(np.diag(covariance)))
    assert np.abs(errors).max() < 4.0
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.6


def test_what_the_hand_does_is_not_laid_on_the_model() -> None:
    """The floor counts it, the verdict finds nothing missing, and a warning says how many."""
    for seed in SEEDS:
        report = fitted(seed, True)
        fit = report.sensors["gyroscope"]
        assert fit.floor is not None
        assert fit.rms_fitted < 2.0 * fit.floor
        assert any("was not steady" in text for text in report.warnings)
        assert not any("was not steady" in text for text in fitted(seed, False).warnings)


def _references(seed: int, session: Session) -> References:
    """The true directions at both ends of every turn, and the gyroscope between."""
    readings = session.readings(seed)
    assert readings.gyroscope is not None
    poses = session.poses(np.random.default_rng(seed))
    middle = np.arange(session.holds) * (HOLD + TURN) + HOLD / 2.0
    body = attitude(poses, np.asarray(middle, float))
    up = body.inv().apply([0.0, 0.0, 1.0])
    north = body.inv().apply([0.0, 0.4, -0.9165])
    north /= np.linalg.norm(north, axis=1)[:, None]
    rests = [_Rest(time - 0.4 * HOLD, time + 0.4 * HOLD) for time in middle]
    turns = crossings(rests, readings.gyroscope)  # type: ignore[arg-type]  # only times are read
    before = [turn.before for turn in turns]
    after = [turn.after for turn in turns]
    steps = lay_out([turn.time for turn in turns], [turn.rate for turn in turns])
    ones = np.ones((len(turns), 2))
    return References(steps, up[before], up[after], north[before], north[after], ones)


class _Rest:
    """When a rest began and ended."""

    def __init__(self, start: float, end: float) -> None:
        self.start, self.end = start, end


def test_turns_that_are_known_less_weigh_less_with_both_references_too() -> None:
    """Eight of thirty-nine turns began a degree from where the hold's mean says."""
    session = Session(rate=100.0)
    rng = np.random.default_rng(8)
    errors = {False: 0.0, True: 0.0}
    for seed in (0, 1):
        data = _references(seed, session)
        bad = rng.choice(len(data), 8, replace=False)
        spread = np.ones((len(data), 2))
        for turn in bad:
            moved = exponential(np.radians(1.0) * rng.standard_normal(3))
            data.up_before[turn] = moved @ data.up_before[turn]
            data.field_before[turn] = moved @ data.field_before[turn]
            spread[turn] = 20.0
        bias, true = session.gyroscope.bias, session.gyroscope.matrix
        for weighed in (False, True):
            one = References(
                data.steps, data.up_before, data.up_after, data.field_before, data.field_after,
                spread if weighed else np.ones((len(data), 2)),
            )  # fmt: skip
            fit = fit_attitude(one, bias[None], np.full(3, 1e-4), true, bias)
            errors[weighed] += float(np.sum((fit.matrix - true) ** 2))
    assert errors[True] < 0.1 * errors[False]
