"""The whole procedure, performed on a device that does what it is told."""

from dataclasses import replace

import numpy as np

from imucal_wizard.core.poses import EDGES, FACES
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.state_machine import StateMachine
from tests.guide.device import (
    QUICK,
    RATE,
    Device,
    holds_of,
    kinds,
    machine_at,
    rotations_of,
    texts,
)

ANGLES = (90.0, -75.0, 140.0, -165.0, 60.0, -130.0)


def performed() -> Device:
    """Settle, up/down, eighteen poses, six rotations about each axis, four corners."""
    device = Device().rest(12.0)
    device.poses(["-z", "+x", "-x", "+y", "-y"])
    device.poses([*FACES, *EDGES])
    for axis, start in (("x", "+z"), ("y", "+z"), ("z", "+x")):
        device.hold(start, 4.0)
        for angle, speed in zip(ANGLES, (25.0, 70.0, 140.0) * 2, strict=True):
            device.rotate(axis, angle, abs(angle) / speed).rest(4.0)
    return device


def test_the_procedure_is_led_from_the_source_to_the_result_without_a_key() -> None:
    machine = StateMachine(rate=RATE)
    machine.command("start")
    events = machine.feed(performed().readings())
    status, collected = machine.status(), machine.collected()
    assert status.step is StepKind.RESULT
    assert events[-1].kind is EventKind.FINISHED
    assert len(holds_of(machine, StepKind.UP_DOWN)) == 6
    assert {hold.pose for hold in holds_of(machine, StepKind.POSES)} == {*FACES, *EDGES}
    assert len(rotations_of(machine)) == 18
    starts = [hold.start for hold in collected.holds]
    assert starts == sorted(starts)
    assert np.all(np.diff(starts) > 2.0)


def test_what_was_left_out_is_told_at_the_end() -> None:
    """Not everything is measured when steps were skipped."""
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.command("skip")
    messages = texts(machine.command("skip"), EventKind.FINISHED)
    assert messages == ["Measured except Up/down, Poses, Rotations."]


def test_a_recording_gives_no_instructions() -> None:
    """Poses count among the 18 in whatever order they come; all of them, and it is done."""
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device, replace(QUICK, led=False))
    mixed = [pose for pair in zip(EDGES, (*FACES, *FACES), strict=True) for pose in pair]
    events = machine.feed(device.poses(mixed).taken())
    assert machine.status().step is StepKind.ROTATIONS
    assert machine.status().skipped == ()
    assert EventKind.WRONG_POSE not in kinds(events)
    assert {hold.pose for hold in holds_of(machine, StepKind.POSES)} == {*FACES, *EDGES}
    assert {hold.pose for hold in holds_of(machine, StepKind.UP_DOWN)} == set(FACES)


def test_a_person_is_asked_for_the_faces_again() -> None:
    """Where an operator is led, an edge is refused while a face is due."""
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    events = machine.feed(device.poses(["+x+y", *FACES]).taken())
    assert EventKind.WRONG_POSE in kinds(events)
    assert machine.status().step is StepKind.POSES
    assert holds_of(machine, StepKind.POSES) == []
