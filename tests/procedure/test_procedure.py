"""The whole procedure, performed on a device that does what it is told."""

import numpy as np

from imucal_wizard.procedure.poses import EDGES, FACES
from imucal_wizard.procedure.state import EventKind, StepKind
from imucal_wizard.procedure.steps import Machine
from tests.procedure.device import RATE, Device

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
    machine = Machine(rate=RATE)
    machine.command("start")
    events = machine.feed(performed().readings())
    status, collected = machine.status(), machine.collected()
    assert status.step is StepKind.RESULT
    assert events[-1].kind is EventKind.FINISHED
    assert len(collected.up_down) == 6
    assert {collected.holds[index].pose for index in collected.poses} == {*FACES, *EDGES}
    assert len(collected.turns) == 18
    starts = [hold.start for hold in collected.holds]
    assert starts == sorted(starts)
    assert np.all(np.diff(starts) > 2.0)
