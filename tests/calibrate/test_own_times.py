"""Sensors that start, stop and pause at times of their own: a calibration or a refusal."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.core.errors import ImucalError
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.estimate.gravity_and_field import segments
from imucal_wizard.estimate.parameters import full_parameters
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.guide.plan import Procedure, standard
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.segmentation import rotations_between
from imucal_wizard.run.player import ReadingsTape
from tests.calibrate.collecting import offline, recording
from tests.estimate.truth import typical_gyroscope
from tests.estimate.whole_session import HOLD, TURN, Session

SHARE = st.floats(0.0, 1.0)
PRESENCE = st.tuples(SHARE, SHARE, st.lists(st.tuples(SHARE, st.floats(0.0, 0.4)), max_size=2))
"""Start, stop, and pauses with their lengths, as shares of the recording."""


def _present(
    series: Series | None, times: tuple[float, float, list[tuple[float, float]]]
) -> Series:
    """The samples while a sensor is there; all of it where it would stop before it starts."""
    assert series is not None
    first, seconds = float(series.time[0]), float(np.ptp(series.time))
    start, stop, pauses = times
    share = (series.time - first) / seconds
    keep = (share >= start) & (share <= stop) if start < stop else np.ones(len(series), bool)
    for begin, length in pauses:
        keep &= (share < begin) | (share > begin + length)
    return Series(series.time[keep], series.values[keep], series.unit)


def _played(readings: Readings) -> int:
    """Holds that the wizard takes of a recording."""
    tape = ReadingsTape(readings)

    class Listening:
        machine: StateMachine | None = None

        def receive_readings(self, part: Readings, rate: float) -> None:
            if self.machine is None:
                plan = Procedure(standard(settle_seconds=2.0).steps, led=False)
                self.machine = StateMachine(plan, rate=rate)
                self.machine.command("start")
            self.machine.feed(part)

    engine, until = Listening(), 0.0
    while tape.play(engine, until):  # type: ignore[arg-type]  # all that a tape uses of an engine
        until += 7.0
    assert engine.machine is not None
    engine.machine.flush()
    return len(engine.machine.collected().holds)


def test_a_gyroscope_without_a_sample_says_nothing() -> None:
    whole = recording(0)
    assert whole.gyroscope is not None
    empty = replace(whole, gyroscope=whole.gyroscope.part(0, 0))
    report = fit_readings(empty)
    assert "gyroscope" not in report.sensors
    assert all(hold.gyroscope is None for hold in report.holds)


@pytest.mark.parametrize("late", [False, True])
def test_a_rotation_that_the_gyroscope_saw_in_part_does_not_count(late: bool) -> None:
    """It starts or stops in the middle of the tenth motion."""
    whole, holds = recording(0), offline(0).holds
    assert whole.gyroscope is not None
    middle = 0.5 * (holds[9].end + holds[10].start)
    seen = (whole.gyroscope.time > middle) == late
    part = Series(whole.gyroscope.time[seen], whole.gyroscope.values[seen], "rad/s")
    rotations = rotations_between(holds, part, whole.accelerometer)
    for one in rotations:
        there = one.before.start > middle if late else one.after.end < middle
        assert (one.problem is None) == there
    between = {(one.before, one.after) for one in segments(holds, part)}
    assert (9, 10) not in between


def test_headings_are_no_better_than_the_angles_of_the_accelerometer() -> None:
    """Eight rests leave six of them at usual size; a gain was once 9.5 standard errors off."""
    whole = Session(rate=50.0, holds=16).readings(410)
    assert whole.gyroscope is not None
    first, last = 6.0 * (HOLD + TURN), 14.0 * (HOLD + TURN) - TURN
    report = fit_readings(
        replace(
            whole,
            accelerometer=whole.accelerometer.between(first, last),
            gyroscope=whole.gyroscope.between(first, last),
        )
    )
    reference = report.sensors["accelerometer"].reference
    assert reference is not None
    assert reference.undetermined == 6
    truth = full_parameters(typical_gyroscope().matrix, typical_gyroscope().bias)
    for one in report.sensors["gyroscope"].parameters:
        if one.standard_error is not None and one.carried:
            assert abs(one.value - truth[one.name]) < 4.0 * one.standard_error


def test_a_magnetometer_that_sent_nothing_leaves_the_others_as_they_are() -> None:
    """Its columns are there, and no sample."""
    whole = recording(0)
    silent = replace(whole, magnetometer=_present(whole.magnetometer, (1e-9, 1e-8, [])))
    assert silent.magnetometer is not None
    assert len(silent.magnetometer) == 0
    report = fit_readings(silent)
    assert {"accelerometer", "gyroscope"} <= report.sensors.keys()


@pytest.mark.study
@settings(max_examples=5, deadline=None)
@given(PRESENCE, PRESENCE, PRESENCE)
def test_whatever_sensor_is_there_when(
    accelerometer: tuple[float, float, list[tuple[float, float]]],
    gyroscope: tuple[float, float, list[tuple[float, float]]],
    magnetometer: tuple[float, float, list[tuple[float, float]]],
) -> None:
    """No fault, in a file or played; what is determined agrees with the whole recording's."""
    whole = recording(0)
    readings = replace(
        whole,
        accelerometer=_present(whole.accelerometer, accelerometer),
        gyroscope=_present(whole.gyroscope, gyroscope),
        magnetometer=_present(whole.magnetometer, magnetometer),
    )
    with contextlib.suppress(ImucalError):
        _played(readings)
    try:
        report = fit_readings(readings)
    except ImucalError:
        return
    for name, sensor in report.sensors.items():
        expected = {one.name: one for one in offline(0).sensors[name].parameters}
        for one in sensor.parameters if all(p.carried for p in sensor.parameters) else ():
            errors = one.standard_error, expected[one.name].standard_error
            if errors[0] is not None and errors[1] is not None:
                off = abs(one.value - expected[one.name].value)
                assert off < 6.0 * np.hypot(errors[0], errors[1])
