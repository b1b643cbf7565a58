"""Every kind of moment of the wizard, with what the operator is to do in it."""

from functools import cache

import numpy as np

from imucal_wizard.core.poses import DIRECTIONS
from imucal_wizard.guide.kinds import Act, StepKind
from imucal_wizard.guide.plan import standard
from imucal_wizard.guide.state import Status
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.requests import MeasurementRequest, requests_to_text
from imucal_wizard.simulate.actions import LieStill, PassSteel, PlacePose
from tests.guide.device import QUICK, Device, machine_at, pose_asked
from tests.guide.field.compass import Session, circle, circles, turned

Moment = tuple[Act, Status]


@cache
def moments() -> dict[str, Moment]:
    """Name of the moment, the act that is right in it, and the status."""
    found: dict[str, Moment] = {"no sample yet": (Act.WAIT, Status(step=StepKind.SETTLE))}
    for part in (_settle, _poses, _rotations, _more, _validation, _field):
        found |= part()
    return found


def _settle() -> dict[str, Moment]:
    device, machine = Device(), StateMachine(QUICK, rate=100.0)
    machine.command("start")
    found = {}
    machine.feed(device.shake(1.0).taken())
    found["settle, moving"] = (Act.LAY_DOWN, machine.status())
    machine.feed(device.rest(2.0).taken())
    found["settle, still"] = (Act.HOLD, machine.status())
    machine.feed(device.shake(0.5).taken())
    found["settle, too short"] = (Act.LAY_DOWN, machine.status())
    machine.feed(device.shake(20.0).taken())
    found["settle, no rest"] = (Act.LAY_DOWN, machine.status())
    return found


def _poses() -> dict[str, Moment]:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    found = {"up/down, lies in a pose that is taken": (Act.POSE, machine.status())}
    machine.feed(device.shake(30.0, force=0.06, rate=0.002).taken())
    found["up/down, trembles in a pose that is taken"] = (Act.POSE, machine.status())
    machine.feed(device.rotate("y", -40.0).taken())
    found["up/down, on the way"] = (Act.POSE, machine.status())
    machine.feed(device.rotate("y", -50.0).taken())
    found["up/down, there but not yet still"] = (Act.HOLD, machine.status())
    machine.feed(device.rest(0.9).taken())
    found["up/down, still"] = (Act.HOLD, machine.status())
    machine.feed(device.rotate("y", -60.0).taken())
    found["up/down, too short"] = (Act.POSE, machine.status())
    machine.feed(device.place("+x").rest(2.0).taken())
    found["up/down, taken"] = (Act.POSE, machine.status())
    machine.command("undo")
    machine.feed(device.rest(1.0).taken())
    found["up/down, undone"] = (Act.LIFT, machine.status())
    machine.feed(device.rotate("y", 60.0).taken())
    found["up/down, undone and moved"] = (Act.POSE, machine.status())
    machine.feed(device.hold("+x").place("+z").rest(2.0).taken())
    found["up/down, repeated"] = (Act.POSE, machine.status())
    machine.command("repeat")
    machine.feed(device.rest(1.0).taken())
    found["up/down, begun again"] = (Act.HOLD, machine.status())
    machine.command("skip")
    machine.feed(device.rest(0.5).taken())
    found["poses, the step before was skipped"] = (Act.POSE, machine.status())
    machine.feed(device.hold("+x+y+z").taken())
    found["poses, wrong pose"] = (Act.POSE, machine.status())
    other = next(one for one in machine.status().missing if one != machine.status().wanted)
    machine.feed(device.place(other).rest(0.9).taken())
    found["poses, another missing pose"] = (Act.HOLD, machine.status())
    machine.feed(device.shake(40.0, force=0.5, rate=0.05).taken())
    found["poses, trembling for long"] = (Act.HOLD, machine.status())
    machine.command("take")
    found["poses, taken hand-held"] = (Act.POSE, machine.status())
    machine.command("remeasure")
    machine.feed(device.shake(0.5).taken())
    found["noise measured again"] = (Act.LAY_DOWN, machine.status())
    machine.feed(device.rest(5.0).taken())
    machine.command("goto", "result")
    machine.command("goto", "up-down")
    machine.feed(device.place("+x+y+z").taken())
    for pose in ("+x", "-x", "+y", "-y", "+z", "-z"):
        machine.feed(device.hold(pose).taken())
    machine.command("goto", "up-down")
    found["up/down, all taken"] = (Act.DONE, machine.status())
    machine.command("goto", "result")
    found["result"] = (Act.WAIT, machine.status())
    return found


def _rotations() -> dict[str, Moment]:
    device = Device(up="+x")
    plan = standard(2, settle_seconds=3.0, hold_seconds=1.0, rotation_hold_seconds=1.0)
    machine = machine_at(StepKind.ROTATIONS, device, plan)
    machine.feed(device.rotate("y", 20.0).rotate("y", -20.0).rest(0.4).taken())
    found = {"rotations, the axis is upright": (Act.POSE, machine.status())}
    machine.feed(device.place("+z").rest(0.6).taken())
    found["rotations, first hold"] = (Act.HOLD, machine.status())
    machine.feed(device.rest(1.5).taken())
    found["rotations, ready"] = (Act.ROTATE, machine.status())
    machine.feed(device.rotate("x", 60.0).taken())
    found["rotations, moving"] = (Act.ROTATE, machine.status())
    machine.feed(device.rest(0.9).taken())
    found["rotations, stopped"] = (Act.HOLD, machine.status())
    machine.feed(device.rest(1.0).taken())
    found["rotations, taken"] = (Act.ROTATE, machine.status())
    machine.feed(device.rotate("y", 60.0).rest(2.0).taken())
    found["rotations, wrong axis"] = (machine.status().act, machine.status())
    machine.feed(device.place("+z").rest(2.0).rotate("x", 12.0).rest(2.0).taken())
    found["rotations, too small"] = (Act.ROTATE, machine.status())
    machine.command("undo")
    found["rotations, undone"] = (machine.status().act, machine.status())
    machine.feed(device.place("+z").rest(2.0).taken())
    for axis, start in (("x", "+z"), ("y", "+z"), ("z", "+x")):
        device.place(start).rest(2.0)
        for angle in (90.0, -90.0, 60.0):
            device.rotate(axis, angle).rest(2.0)
    machine.feed(device.taken())
    machine.command("back")
    found["rotations, all taken"] = (Act.DONE, machine.status())
    machine.command("repeat")
    machine.feed(device.place("+z").rest(2.0).rotate("x", 60.0).taken())
    machine.feed(device.shake(20.0, force=0.06, rate=0.002).taken())
    found["rotations, trembles where it has stopped"] = (Act.HOLD, machine.status())
    return found


def _more() -> dict[str, Moment]:
    device = Device()
    machine = machine_at(StepKind.UP_DOWN, device)
    machine.feed(device.poses(("+x", "-y")).taken())
    machine.command("goto", "result")
    tilted = np.cos(0.4) * DIRECTIONS["+x"] + np.sin(0.4) * DIRECTIONS["+y"]
    x, y, z = tilted.tolist()
    asked = (
        pose_asked("-y", "tells one from the other"),
        MeasurementRequest((x, y, z), None, "tells one from the other"),
        MeasurementRequest((0.0, 0.0, 1.0), "+z", "tells the rates", axis="x", turns=2),
    )
    machine.command("measure", requests_to_text(asked))
    machine.feed(device.rest(1.0).taken())
    found = {"requests, the placement is used": (Act.POSE, machine.status())}
    machine.feed(device.rotate("z", 30.0).rotate("z", -30.0).rest(2.5).taken())
    found["requests, a pose without a name"] = (Act.POSE, machine.status())
    machine.feed(device.place("+x").rotate("z", np.degrees(-0.4)).rest(2.5).taken())
    found["requests, rotations"] = (Act.POSE, machine.status())
    machine.feed(device.place("+z").rest(4.0).taken())
    found["requests, ready to rotate"] = (Act.ROTATE, machine.status())
    return found


def _validation() -> dict[str, Moment]:
    device = Device()
    machine = machine_at(StepKind.POSES, device)
    machine.feed(device.hold("+x").hold("+y").taken())
    machine.command("goto", "result")
    machine.command("validate")
    machine.feed(device.rest(0.5).taken())
    found = {"validation, a known pose": (Act.POSE, machine.status())}
    machine.feed(device.place("+x").rotate("z", 8.0).rest(2.0).taken())
    found["validation, too near a known pose"] = (Act.POSE, machine.status())
    machine.feed(device.place("-z").rotate("x", 30.0).rest(0.9).taken())
    found["validation, a new orientation"] = (Act.HOLD, machine.status())
    machine.feed(device.rest(1.5).taken())
    found["validation, taken"] = (Act.POSE, machine.status())
    for pose in ("+x+y+z", "-x+y+z", "-x-y+z", "-x-y-z"):
        machine.feed(device.hold(pose).taken())
    found["save"] = (Act.WAIT, machine.status())
    return found


def _field() -> dict[str, Moment]:
    found = {}
    session = Session(turned(circles(("-z", "+x"))))
    session.play(6.0)
    found["field, before the first circle"] = (Act.CIRCLE, session.machine.status())
    session.play(7.5)
    found["field, in a circle"] = (Act.CIRCLE, session.machine.status())
    session.play()
    found["field, another face"] = (Act.POSE, session.machine.status())
    steel = (*circle("-z", 200.0), PassSteel(), LieStill(1.2))
    session = Session(turned((PlacePose("+z"), *steel)))
    for tenth in range(40, 200):
        if session.play(tenth / 10.0).field.disturbed:
            found["field, disturbed"] = (Act.WAIT, session.machine.status())
            break
    session = Session(turned(circles()))
    session.play()
    session.machine.command("back")
    found["field, all taken"] = (Act.DONE, session.machine.status())
    return found
