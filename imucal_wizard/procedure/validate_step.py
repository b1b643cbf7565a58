"""Validation: a few orientations that the fit has not seen, away from all that it has."""

from dataclasses import replace

from imucal_wizard.procedure.ledger import KeptHold
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.plan import Step
from imucal_wizard.procedure.poses import (
    CORNERS,
    DIRECTIONS,
    POSE_TOLERANCE_DEG,
    nearest,
    spoken,
    turn_towards,
)
from imucal_wizard.procedure.scene import Scene
from imucal_wizard.procedure.state import EventKind, Status
from imucal_wizard.procedure.wording import how_to_turn, turn_up
from imucal_wizard.readings import FloatArray


class ValidateStage:
    """Takes holds that go to the validation only; asks for corners, accepts anything new."""

    def __init__(self, scene: Scene, step: Step) -> None:
        self._scene = scene
        self._step = step
        self.seconds = step.seconds
        self.wanted: str | None = None

    @property
    def finished(self) -> bool:
        """There are enough new orientations."""
        return len(self._scene.ledger.validation) >= self._step.orientations

    @property
    def tally(self) -> tuple[float, float]:
        """New orientations taken and wanted."""
        return float(len(self._scene.ledger.validation)), float(self._step.orientations)

    def enter(self) -> None:
        """Ask for the nearest corner that is new."""
        self.wanted = None
        self._choose()

    def follow(self, moment: Moment) -> None:  # noqa: ARG002 -- every stage is told of each moment
        """Ask for a corner as soon as it is known where the device is."""
        if self.wanted is None:
            self._choose()

    def completed(self, kept: KeptHold) -> None:
        """Keep the hold if it is far enough from everything known, else say where to tilt."""
        scene = self._scene
        up = scene.direction(kept)
        near = None if up is None else self._nearest(up, apart_from=kept)
        if up is None or (near is not None and near[1] < self._step.apart_deg):
            scene.ledger.remove(kept)
            where = "" if near is None else f"Only {near[1]:.0f}° from a pose already taken. "
            scene.emit(EventKind.WRONG_POSE, where + self._way(up))
            return
        kept.hold = replace(kept.hold, pose=nearest(up, DIRECTIONS, POSE_TOLERANCE_DEG))
        self._choose()
        done, wanted = self.tally
        scene.emit(EventKind.HOLD_TAKEN, f"New orientation taken, {done:.0f} of {wanted:.0f}.")

    def _way(self, up: FloatArray | None) -> str:
        if up is None or self.wanted is None:
            return "Tilt it farther."
        axis, sense, angle = turn_towards(up, DIRECTIONS[self.wanted])
        return f"Tilt it about {axis}, to the {sense}, by about {angle:.0f}°."

    def _known(self, apart_from: KeptHold | None) -> list[FloatArray]:
        ledger = self._scene.ledger
        kept = [hold for hold in (*ledger.holds, *ledger.validation) if hold is not apart_from]
        ups = [self._scene.direction(hold) for hold in kept]
        return [up for up in ups if up is not None]

    def _nearest(
        self, up: FloatArray, apart_from: KeptHold | None = None
    ) -> tuple[FloatArray, float] | None:
        """The known direction nearest to this one, and how far it is, degrees."""
        known = self._known(apart_from)
        if not known:
            return None
        angles = [turn_towards(up, other)[2] for other in known]
        best = min(range(len(known)), key=angles.__getitem__)
        return known[best], angles[best]

    def _choose(self) -> None:
        """The corner that is new and nearest from here."""
        up = self._scene.up
        if up is None or self.finished:
            self.wanted = None
            return
        fresh = []
        for name, direction in CORNERS.items():
            near = self._nearest(direction)
            if near is None or near[1] >= self._step.apart_deg:
                fresh.append(name)
        self.wanted = min(
            fresh, key=lambda name: round(turn_towards(up, DIRECTIONS[name])[2]), default=None
        )

    def view(self) -> Status:
        """The corner asked for, and what else will do."""
        up, wanted = self._scene.up, self.wanted
        off_by = None
        if up is not None and wanted is not None:
            off_by = turn_towards(up, DIRECTIONS[wanted])[2]
        return Status(
            instruction=turn_up(wanted) if wanted else "TILT IT ANEW",
            detail=f"{spoken(wanted)}; any new orientation will do" if wanted else "",
            guidance=how_to_turn(up, wanted) if up is not None and wanted else "",
            wanted=wanted,
            recognised=None if up is None else nearest(up, DIRECTIONS, POSE_TOLERANCE_DEG),
            off_by=off_by,
            progress=self.tally,
        )
