"""The same samples give the same holds to the last bit, however they are cut."""

import itertools
from functools import cache

from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.core.readings import Readings
from imucal_wizard.guide.state import Event
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.holds import Collected
from tests.guide.device import QUICK, RATE, Device, part


@cache
def readings() -> Readings:
    """Settle, a few poses, a broken hold, a gap, tremor, and rotations."""
    device = Device().rest(5.0).hold("-z", 2.0).hold("+x", 2.0).hold("-x", 0.8)
    device.rotate("y", 5.0).rest(1.3).gap(0.4).rest(2.0).shake(1.0).hold("+y", 2.0).hold("-y", 2.0)
    device.rotate("z", 70.0).rest(2.0).rotate("z", -120.0).rest(2.0)
    return device.readings()


def fingerprint(collected: Collected) -> list[object]:
    """Everything measured, bit by bit."""
    prints: list[object] = []
    for hold in collected.holds:
        prints += [hold.start, hold.end, hold.pose, hold.accelerometer.tobytes()]
        prints += [hold.accelerometer_covariance.tobytes()]
    for rotation in collected.rotations:
        prints += [rotation.time.tobytes(), rotation.rate.tobytes(), rotation.axis]
        prints += [rotation.problem]
    return prints


def fed(cuts: list[int]) -> tuple[list[Event], list[object]]:
    """Events and fingerprint of the recording cut before these samples."""
    whole = readings()
    machine = StateMachine(QUICK, rate=RATE)
    events = list(machine.command("start"))
    for first, last in itertools.pairwise([0, *sorted(set(cuts)), len(whole)]):
        events += machine.feed(part(whole, first, last))
        machine.status()
    events += machine.flush()
    return events, fingerprint(machine.collected())


@cache
def in_one_piece() -> tuple[list[Event], list[object]]:
    """The same without a cut."""
    return fed([])


@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(1, 3500), max_size=25))
def test_holds_rotations_and_events_do_not_depend_on_the_cuts(cuts: list[int]) -> None:
    assert len(readings()) > 3500
    assert fed(cuts) == in_one_piece()


def test_one_sample_at_a_time_gives_the_same_bits_as_all_at_once() -> None:
    assert fed(list(range(1, len(readings())))) == in_one_piece()


def test_asking_for_what_is_collected_changes_nothing() -> None:
    whole = readings()
    machine = StateMachine(QUICK, rate=RATE)
    machine.command("start")
    for first in range(0, len(whole), 20):
        machine.feed(part(whole, first, first + 20))
        machine.collected()
    machine.flush()
    assert fingerprint(machine.collected()) == in_one_piece()[1]
