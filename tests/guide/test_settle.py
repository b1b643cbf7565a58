"""The settle step: ten seconds of rest, the noise in them, and the limits set from it."""

import re

import numpy as np
import pytest

from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.scales import Scales
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.stillness import Noise
from tests.guide.device import RATE, Device, kinds, part, texts


def started() -> StateMachine:
    machine = StateMachine(rate=RATE)
    machine.command("start")
    return machine


def test_nothing_is_measured_before_the_source_is_accepted() -> None:
    machine = StateMachine(rate=RATE)
    assert machine.feed(Device().rest(30.0).readings()) == ()
    assert machine.status().step is StepKind.SOURCE
    assert machine.status().up == pytest.approx((0.0, 0.0, 1.0), abs=0.01)


def test_first_samples_from_mid_air_spoil_nothing() -> None:
    whole = Device().rest(14.0).hold("+x").readings()
    values = whole.accelerometer.values.copy()
    values[:60] = [60.0, 10.0, -80.0]
    machine = StateMachine(rate=RATE)
    thrown = Readings(Series(whole.accelerometer.time, values, "m/s^2"), whole.gyroscope)
    machine.feed(part(thrown, 0, 100))
    machine.command("start")
    machine.feed(part(thrown, 100, 150))
    assert machine.status().still.motions[0].limit == pytest.approx(20.0, rel=0.01)
    machine.feed(part(thrown, 150, len(thrown)))
    assert machine.status().done == ("+x", "+z")


def test_ten_seconds_of_rest_settle_it_and_tell_the_noise() -> None:
    machine = started()
    early = machine.feed(Device(noise=(0.02, 0.002)).rest(9.9).readings())
    assert EventKind.STEP_DONE not in kinds(early)
    machine = started()
    events = machine.feed(Device(noise=(0.02, 0.002)).rest(10.6).readings())
    assert EventKind.STEP_DONE in kinds(events)
    status = machine.status()
    assert status.step is StepKind.UP_DOWN
    milli_g = [float(word) for word in status.noise.split(" mg")[0].split()]
    assert milli_g == pytest.approx([2.04] * 3, rel=0.1)
    assert machine.collected().holds[0].end - machine.collected().holds[0].start > 9.9


def test_the_noise_of_all_axes_is_told_with_the_same_decimals() -> None:
    noise = Noise(np.array([1.04, 0.96, 1.1]) / 100.0, np.radians([0.1, 0.096, 0.099]), None)
    assert Scales().noise_text(noise) == "1.1 1.0 1.1 mg, 0.10 0.10 0.10 °/s"
    counts = Noise(np.array([103.0, 96.0, 0.0]), None, None)
    assert Scales("count").noise_text(counts) == "103 96 0 count"


def test_the_limits_are_five_times_the_noise() -> None:
    machine = started()
    machine.feed(Device(noise=(0.05, 0.01)).rest(11.0).readings())
    limits = {motion.channel: motion.limit for motion in machine.status().still.motions}
    assert limits["ax"] == pytest.approx(5.0 * 0.05 / 9.80665 * 1000.0, rel=0.1)
    assert limits["gy"] >= 5.0 * np.degrees(0.01) * 0.9


def test_limits_have_a_floor_that_a_desk_can_keep() -> None:
    machine = started()
    machine.feed(Device(noise=(0.0, 0.0)).rest(11.0).readings())
    limits = {motion.channel: motion.limit for motion in machine.status().still.motions}
    assert limits["ax"] == pytest.approx(3.0)
    assert limits["gz"] >= 0.3


def test_a_reading_that_flickers_between_two_neighbours_is_at_rest() -> None:
    readings = Device(noise=(0.1, 0.0)).rest(11.0).readings()
    step = 0.02 * 9.80665
    coarse = np.round(readings.accelerometer.values / step) * step
    machine = started()
    machine.feed(Readings(Series(readings.accelerometer.time, coarse, "m/s^2"), readings.gyroscope))
    assert machine.status().step is StepKind.UP_DOWN
    assert machine.status().still.motions[0].limit >= 20.0 * 0.999


def test_a_knock_begins_it_again_and_names_the_axis() -> None:
    machine = started()
    device = Device().rest(6.0).rotate("x", 4.0, 0.5).rest(9.0)
    events = machine.feed(device.readings())
    broken = texts(events, EventKind.HOLD_BROKEN)
    assert broken
    assert "x" in broken[0]
    assert machine.status().step is StepKind.SETTLE
    assert 8.0 < machine.status().still.held < 9.0


def test_a_device_that_turns_slowly_for_ever_is_not_at_rest() -> None:
    machine = started()
    events = machine.feed(Device().rotate("x", 14.0, 14.0).readings())
    assert EventKind.HOLD_BROKEN in kinds(events)
    assert machine.status().step is StepKind.SETTLE


def test_missing_samples_begin_it_again() -> None:
    machine = started()
    events = machine.feed(Device().rest(6.0).gap(0.5).rest(6.0).readings())
    assert "missing" in texts(events, EventKind.HOLD_BROKEN)[0]
    assert machine.status().step is StepKind.SETTLE


def test_rest_that_has_only_just_begun_does_not_set_the_limits() -> None:
    machine = started()
    device = Device(noise=(0.001, 0.0001)).shake(3.0, force=0.1, rate=0.01).rest(13.0)
    machine.feed(device.readings())
    assert machine.collected().holds[0].start > 2.9
    assert machine.status().still.motions[0].limit < 5.0


def test_a_shaken_device_is_refused_with_the_reason_and_offered_ways_out() -> None:
    machine = started()
    device = Device().shake(14.0, force=0.5, rate=0.05)
    machine.feed(device.taken())
    status = machine.status()
    assert status.step is StepKind.SETTLE
    assert status.still.worst is not None
    assert status.still.worst.moving
    assert "limit" in status.still.reason
    assert status.offers == ()
    events = machine.feed(device.shake(2.0, force=0.5, rate=0.05).taken())
    assert EventKind.STUCK in kinds(events)
    assert {offer.command for offer in machine.status().offers} == {"loosen", "take"}


def test_a_shaken_device_is_not_refused_for_ever() -> None:
    machine = started()
    events = machine.feed(Device().shake(75.0, force=0.5, rate=0.05).readings())
    assert texts(events, EventKind.WARNING)[0].startswith("The limits are 2 times wider")
    assert machine.status().step is StepKind.UP_DOWN


def test_noise_can_be_taken_at_the_operators_word() -> None:
    machine = started()
    machine.feed(Device().shake(16.0, force=0.5, rate=0.05).readings())
    machine.command("take")
    assert machine.status().step is StepKind.UP_DOWN
    assert machine.collected().holds[0].hand_held


def test_a_gravity_of_a_thousand_gives_a_warning() -> None:
    readings = Device().rest(11.0).readings()
    wrong = readings.accelerometer.values * 100.0
    machine = started()
    events = machine.feed(
        Readings(Series(readings.accelerometer.time, wrong, "m/s^2"), readings.gyroscope)
    )
    assert "unit" in texts(events, EventKind.WARNING)[0]


def test_where_ten_seconds_of_rest_never_come_the_longest_rest_must_do() -> None:
    device = Device()
    for pose in ("+x", "+z", "-x", "+y", "-z", "+z", "+x", "-y"):
        device.hold(pose, 4.0)
    machine = started()
    events = machine.feed(device.readings())
    assert "No rest lasted" in texts(events, EventKind.WARNING)[0]
    assert machine.status().step is StepKind.UP_DOWN
    assert machine.status().still.motions[0].limit < 6.0
    assert machine.status().done


def test_why_a_rest_is_none_is_told_with_the_axis_the_amount_and_the_limit() -> None:
    """In the settle step as in every other, and short enough for a row of eighty columns."""
    for device in (
        Device().rest(3.0).shake(1.0, force=0.12, rate=0.0),
        Device().rest(3.0).shake(1.0, force=0.0, rate=0.008),
        Device().rest(3.0).rotate("x", 0.6, 4.0),
    ):
        broken = texts(started().feed(device.taken()), EventKind.HOLD_BROKEN)
        assert broken
        reason = broken[0].split(" s: ")[1].removesuffix(".")
        assert re.fullmatch(r"[xyz] \w+ (by|at) [\d.]+ (mg|°/s), limit [\d.]+", reason), reason
        assert len(reason) <= 33
