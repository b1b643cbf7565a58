"""One frozen picture of the whole procedure for whoever watches it."""

from dataclasses import replace

from imucal_wizard.procedure.conductor import Conductor
from imucal_wizard.procedure.poses import FACES
from imucal_wizard.procedure.route import MEASURING
from imucal_wizard.procedure.state import Offer, Status, StepKind, StillStatus
from imucal_wizard.procedure.watch import MOST_LOOSENED


def overview(conductor: Conductor) -> Status:
    """Everything a screen shows now."""
    scene, stage = conductor.scene, conductor.route.stage
    up = scene.up
    noise = conductor.route.settle.noise
    return replace(
        stage.view(),
        step=conductor.route.step,
        elapsed=conductor.elapsed,
        still=still_status(conductor),
        up=None if up is None else (float(up[0]), float(up[1]), float(up[2])),
        noise="" if noise is None else scene.units.noise_text(noise),
        offers=offers(conductor),
        last_event=scene.last_event,
        holds=len(scene.ledger.holds) + len(scene.ledger.validation),
        rotations=len(scene.ledger.rotations),
        skipped=tuple(conductor.route.skipped.items()),
        steps=scene.procedure.kinds,
        poses=len(scene.procedure.step(StepKind.POSES).poses),
    )


def still_status(conductor: Conductor) -> StillStatus:
    """The decision on stillness with its reasons."""
    scene, watch = conductor.scene, conductor.scene.watch
    reason = watch.reason
    if conductor.route.step is StepKind.SETTLE and not scene.still and conductor.route.settle.why:
        reason = conductor.route.settle.why
    return StillStatus(
        still=scene.still,
        motions=watch.motions,
        worst=watch.worst,
        held=min(scene.held, conductor.route.stage.seconds)
        if conductor.route.asking
        else scene.held,
        needed=conductor.route.stage.seconds,
        waiting=watch.waiting,
        loosened=watch.loosened,
        reason=reason,
        spent=scene.run.used,
    )


def offers(conductor: Conductor) -> tuple[Offer, ...]:
    """The ways out and the choices that are open now."""
    open_now: list[Offer] = []
    watch, step = conductor.scene.watch, conductor.route.step
    if conductor.route.asking and watch.offered:
        if watch.loosened < MOST_LOOSENED:
            open_now.append(Offer("loosen", "l", "loosen the limits twofold"))
        open_now.append(Offer("take", "t", "take it as it is, marked hand-held"))
        if step is not StepKind.SETTLE:
            open_now.append(Offer("remeasure", "n", "measure the noise again"))
    if step in (*MEASURING, StepKind.MORE) and conductor.route.stage.finished:
        open_now.append(Offer("skip", "g", "all taken: go on"))
    if step is StepKind.FIELD:
        open_now.extend(conductor.route.field.offers())
    if step is StepKind.POSES and _faces_wait(conductor):
        open_now.append(Offer("count-faces", "f", "count the faces of the up/down step"))
    if step is StepKind.RESULT:
        open_now.append(Offer("validate", "v", "check it in new orientations"))
        open_now.append(Offer("save", "s", "save the calibration"))
    return tuple(open_now)


def _faces_wait(conductor: Conductor) -> bool:
    """Whether faces of the up/down step could still count among the poses."""
    ledger = conductor.scene.ledger
    wanted = set(conductor.scene.procedure.step(StepKind.POSES).poses) & set(FACES)
    taken = set(ledger.ticked(StepKind.UP_DOWN)) & wanted
    return bool(taken - set(ledger.ticked(StepKind.POSES)))
