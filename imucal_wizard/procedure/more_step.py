"""What the bench asks for beyond the plan: exactly these poses, then exactly these turns."""

from collections.abc import Sequence
from dataclasses import replace

from imucal_wizard.procedure.asked import Asked
from imucal_wizard.procedure.ledger import KeptHold
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.plan import Step
from imucal_wizard.procedure.poses import POSE_TOLERANCE_DEG, turn_towards
from imucal_wizard.procedure.rotation_step import RotationStage
from imucal_wizard.procedure.scene import Scene
from imucal_wizard.procedure.state import EventKind, Status, StepKind
from imucal_wizard.procedure.wording import PUT_BACK, how_to_reach, label, lift_and_reach, turn_up
from imucal_wizard.readings import FloatArray

WARMER = 5.0
"""Degrees above the coldest hold from which a device counts as warmed up."""
EXACTLY_DEG = 8.0
"""How near to a direction without a name a hold must be."""
KIND = StepKind.MORE


class MoreStage:
    """Takes the poses and turns asked for; any pose still missing is accepted.

    Args:
        scene: the present moment.
        pose: what a pose needs.
        turn: what a rotation needs.
    """

    def __init__(self, scene: Scene, pose: Step, turn: Step) -> None:
        self._scene = scene
        self._pose = replace(pose, kind=KIND)
        self._turn = replace(turn, kind=KIND)
        self._poses: tuple[Asked, ...] = ()
        self._round = 0
        self._wanted: int | None = None
        self._rotation = RotationStage(scene, self._turn, {"z": 0})
        self.since = 0.0

    def ask(self, asked: Sequence[Asked]) -> None:
        """Begin with these; those that need a warm device last, then the turns."""
        scene = self._scene
        self._round, self.since, self._wanted = self._round + 1, scene.time, None
        self._poses = tuple(sorted((a for a in asked if not a.axis), key=lambda one: one.warm))
        needs: dict[str, int] = {}
        for one in asked if scene.has_gyroscope else ():
            if one.axis:
                needs[one.axis] = needs.get(one.axis, 0) + one.turns
        self._rotation = RotationStage(scene, self._turn, needs or {"z": 0}, scene.time)

    @property
    def seconds(self) -> float:
        """How long the device must be at rest for one hold."""
        return self._turn.seconds if self.turning else self._pose.seconds

    @property
    def turning(self) -> bool:
        """The poses are done and turns are left."""
        return not self._missing() and not self._rotation.finished

    @property
    def finished(self) -> bool:
        """All poses and turns are taken."""
        return not self._missing() and self._rotation.finished

    @property
    def tally(self) -> tuple[float, float]:
        """Poses and turns taken, poses and turns wanted."""
        done, wanted = self._rotation.tally
        count = len(self._poses)
        return count - len(self._missing()) + done, count + wanted

    def enter(self) -> None:
        """Ask for the nearest pose."""
        self._wanted = None
        self._rotation.enter()
        self._choose()

    def follow(self, moment: Moment) -> None:
        """Ask for a pose as soon as it is known where the device is; follow a turn."""
        if self.turning:
            self._rotation.follow(moment)
        elif self._wanted is None:
            self._choose()

    def completed(self, kept: KeptHold) -> None:
        """Tick the pose of this hold, or say which way the nearest one is."""
        if self.turning:
            self._rotation.completed(kept)
            return
        up, missing = self._scene.direction(kept), self._missing()
        found = None if up is None else self._recognised(up)
        if found is None:
            self._refuse(up, missing)
            return
        kept.ticks[KIND] = self._tick(found)
        kept.hold = replace(kept.hold, pose=self._poses[found].pose)
        self._wanted = None
        self._choose()
        self._tell(self._poses[found], kept)

    def _tell(self, taken: Asked, kept: KeptHold) -> None:
        scene = self._scene
        done, wanted = self.tally
        name = label(taken.pose) if taken.pose else "The pose"
        scene.emit(EventKind.HOLD_TAKEN, f"{name} taken, {done:.0f} of {wanted:.0f}.")
        if taken.warm and self._cold(kept):
            scene.emit(
                EventKind.WARNING,
                f"It is hardly warmer than before ({kept.hold.temperature:.0f} °C): u takes it "
                "back; warm it first with a hand, a lamp or a box.",
            )

    def _cold(self, kept: KeptHold) -> bool:
        holds = (one.hold.temperature for one in self._scene.ledger.holds)
        known = [value for value in holds if value is not None]
        now = kept.hold.temperature
        return now is not None and bool(known) and now < min(known) + WARMER

    def ask_again(self, tick: str) -> None:
        """Ask for the pose that was taken back, wherever the device is."""
        self._wanted = next((k for k in self._missing() if self._tick(k) == tick), self._wanted)

    def _refuse(self, up: FloatArray | None, missing: Sequence[int]) -> None:
        if up is None or not missing:
            self._scene.emit(EventKind.WRONG_POSE, "The accelerometer reads almost nothing here.")
            return
        place = min(missing, key=lambda k: self._away(up, k))
        way = how_to_reach(up, self._poses[place].direction)
        self._scene.emit(EventKind.WRONG_POSE, f"None of these poses: {way}. Kept all the same.")

    def _tick(self, place: int) -> str:
        return f"{self._round}.{place}"

    def _missing(self) -> list[int]:
        """Places of the poses still to take."""
        ticked = self._scene.ledger.ticked(KIND)
        return [k for k in range(len(self._poses)) if self._tick(k) not in ticked]

    def _tolerance(self, place: int) -> float:
        """A direction without a name is asked for because the poses with names are not it."""
        return POSE_TOLERANCE_DEG if self._poses[place].pose else EXACTLY_DEG

    def _away(self, up: FloatArray, place: int) -> float:
        return turn_towards(up, self._poses[place].direction)[2]

    def _recognised(self, up: FloatArray) -> int | None:
        """The missing pose that the device is in; of several alike the first."""
        near = [k for k in self._missing() if self._away(up, k) <= self._tolerance(k)]
        return min(near, key=lambda k: round(self._away(up, k)), default=None)

    def _choose(self) -> None:
        """The nearest missing pose, cold ones first; it stays until it is taken."""
        up, missing = self._scene.up, self._missing()
        if self._wanted in missing or up is None:
            return
        cold = [k for k in missing if not self._poses[k].warm] or missing
        # a pose wanted twice is held with another one in between where there is one
        away = [k for k in cold if not self._spent or self._away(up, k) > POSE_TOLERANCE_DEG]
        away = away or cold
        self._wanted = min(away, key=lambda k: round(self._away(up, k)), default=None)

    def view(self) -> Status:
        """The pose or turn asked for, and the way to it."""
        names = [(self._poses[k].pose or "", k) for k in range(len(self._poses))]
        missing = self._missing()
        lists = Status(
            done=tuple(name for name, k in names if name and k not in missing),
            missing=tuple(name for name, k in names if name and k in missing),
            progress=self.tally,
        )
        if self.turning:
            return replace(self._rotation.view(), done=lists.done, missing=(), progress=self.tally)
        up = self._scene.up
        if self._wanted is None or up is None:
            return replace(lists, instruction="HOLD IT STILL" if missing else "ALL TAKEN")
        return self._asking(lists, up, self._poses[self._wanted])

    def _asking(self, lists: Status, up: FloatArray, one: Asked) -> Status:
        here = self._recognised(up)
        return replace(
            lists,
            instruction=turn_up(one.pose) if one.pose else "TILT IT AS SHOWN",
            detail=f"warm it first; {one.words}" if one.warm else one.words,
            reason=one.why,
            guidance=self._way(up, one.direction, here),
            wanted=one.pose,
            wanted_up=one.up,
            recognised=None if here is None else self._poses[here].pose,
            off_by=turn_towards(up, one.direction)[2],
        )

    @property
    def _spent(self) -> bool:
        """This placement has been measured: the device must be moved first."""
        return self._scene.run.used or KIND in self._scene.run.told

    def _way(self, up: FloatArray, wanted: FloatArray, here: int | None) -> str:
        if self._scene.still and self._spent:
            again = here is not None and here == self._wanted
            return PUT_BACK if again else lift_and_reach(up, wanted)
        if here is not None and here != self._wanted and self._poses[here].pose:
            return f"{label(self._poses[here].pose or '')} is asked for too: hold it still"
        return "there: hold it still" if here is not None else how_to_reach(up, wanted)
