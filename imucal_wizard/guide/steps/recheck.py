"""The recheck: poses in any order, until every change that is looked for would be seen."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from imucal_wizard.core.poses import FACES
from imucal_wizard.core.records import dataclass
from imucal_wizard.guide.context import Context
from imucal_wizard.guide.kinds import Act, EventKind
from imucal_wizard.guide.measurements import KeptHold
from imucal_wizard.guide.plan import Step
from imucal_wizard.guide.state import Status
from imucal_wizard.guide.steps.directions import DirectionsStage, DirectionTarget
from imucal_wizard.measurement.holds import Collected

MAX_RECHECK_HOLDS = 24
"""A change that these holds do not show is not shown by further holds."""


@dataclass(frozen=True)
class Proposal:
    """What a recheck needs next.

    Attributes:
        pose: the pose that shows most; None once nothing more is gained.
        seen: changes that would be seen.
        wanted: changes that are looked for.
        why: what the pose is for, or "".
    """

    pose: str | None
    seen: int
    wanted: int
    why: str = ""


Planner = Callable[[Collected, Mapping[str, str]], Proposal]
"""From the measurements and the units of the readings by sensor to the next pose."""


class RecheckStage(DirectionsStage):
    """Asks for the pose that shows most of what was not seen yet; accepts any.

    Args:
        context: shared by all steps.
        step: what the step needs.
        planner: chooses the poses; None asks for the six faces.
        collected: gives all measurements.
    """

    def __init__(
        self,
        context: Context,
        step: Step,
        planner: Planner | None,
        collected: Callable[[], Collected],
    ) -> None:
        super().__init__(context, step)
        self._planner = planner or self._faces
        self._collected = collected
        self._proposal: Proposal | None = None

    @property
    def missing(self) -> tuple[DirectionTarget, ...]:
        """The pose that is asked for; none once everything is seen."""
        asked = None if self._proposal is None else self._proposal.pose
        return tuple(one for one in self.targets if one.key == asked)

    @property
    def finished(self) -> bool:
        """Whether no further pose is needed."""
        holds = len(self._context.measurements.holds)
        done = self._proposal is not None and self._proposal.pose is None
        return done or holds >= MAX_RECHECK_HOLDS

    @property
    def tally(self) -> tuple[float, float]:
        """Changes that would be seen, and all that are looked for."""
        if self._proposal is None:
            return 0.0, 1.0
        return float(self._proposal.seen), float(self._proposal.wanted)

    def enter(self) -> None:
        """Choose the first pose."""
        self._plan()
        super().enter()

    def completed(self, kept: KeptHold) -> None:
        """Count the hold, whichever pose it is, and choose the next one."""
        context, kind = self._context, self._step.kind
        up = context.direction(kept)
        found = None if up is None else self._recognised(up)
        kept.ticks[kind] = f"{len(context.measurements.holds)}"
        if found is not None:
            kept.hold = replace(kept.hold, pose=found.pose)
        self.wanted = None
        self._plan()
        self._choose()
        seen, wanted = self.tally
        name = "The pose" if found is None else found.label
        text = f"{name} taken: {seen:.0f} of {wanted:.0f} checks done."
        context.emit(EventKind.HOLD_TAKEN, text)

    def view(self) -> Status:
        """The pose that is asked for, and why."""
        status = super().view()
        why = "" if self._proposal is None else self._proposal.why
        done = tuple(dict.fromkeys(pose for pose in self._poses if pose))
        return replace(status, done=done, reason=why if status.act is Act.POSE else status.reason)

    @property
    def _poses(self) -> list[str | None]:
        return [kept.hold.pose for kept in self._context.measurements.holds]

    def _plan(self) -> None:
        units, context = self._context.units, self._context
        read = {"accelerometer": units.accelerometer}
        if context.has_gyroscope:
            read["gyroscope"] = units.gyroscope
        self._proposal = self._planner(self._collected(), read)

    def _faces(self, collected: Collected, units: Mapping[str, str]) -> Proposal:
        """The six faces, if no planner says which poses show most."""
        del units
        taken = {hold.pose for hold in collected.holds}
        left = [face for face in FACES if face not in taken]
        return Proposal(left[0] if left else None, len(FACES) - len(left), len(FACES))

    def _counts(self, up: object) -> bool:
        """Every pose counts."""
        del up
        return True
