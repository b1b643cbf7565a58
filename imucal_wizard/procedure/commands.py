"""What the operator may ask for at any time; each is safe in each step."""

import math
from collections.abc import Callable

from imucal_wizard.errors import UsageError
from imucal_wizard.procedure.asked import from_text
from imucal_wizard.procedure.conductor import Conductor
from imucal_wizard.procedure.ledger import Kept, KeptCircle, KeptHold
from imucal_wizard.procedure.more_step import MoreStage
from imucal_wizard.procedure.pose_step import PoseStage
from imucal_wizard.procedure.route import MEASURING
from imucal_wizard.procedure.state import EventKind, StepKind
from imucal_wizard.procedure.wording import TITLES, label, plural

AFTERWARDS = (StepKind.RESULT, StepKind.MORE, StepKind.VALIDATE, StepKind.SAVE)
"""Steps in which there is a result, so that the bench may ask for more."""
_NOUNS = {StepKind.ROTATIONS: "rotation", StepKind.FIELD: "circle"}
"""What is taken in a step, where it is no hold."""


class Commands:
    """Carries out commands by name."""

    def __init__(self, conductor: Conductor) -> None:
        self._taking = conductor.taking
        self._holding = conductor.holding
        self._route = conductor.route
        self._scene = conductor.scene
        self._table: dict[str, Callable[[], None]] = {
            "start": self._start,
            "skip": self._skip,
            "undo": self._undo,
            "repeat": self._repeat,
            "back": self._back,
            "loosen": self._loosen,
            "take": self._take,
            "remeasure": self._remeasure,
            "count-faces": self._count_faces,
            "enough": self._enough,
            "validate": self._validate,
            "save": self._save,
        }

    def obey(self, name: str, argument: str = "") -> None:
        """Carry out one command.

        Raises:
            UsageError: there is no such command or step.
        """
        if name == "goto":
            self._goto(argument)
        elif name == "measure":
            self._measure(argument)
        elif name in self._table:
            self._table[name]()
        else:
            known = ", ".join([*self._table, "goto STEP", "measure WHAT"])
            raise UsageError(f"there is no command {name!r}; give one of {known}")

    def _say(self, text: str) -> None:
        self._scene.emit(EventKind.WARNING, text)

    def _start(self) -> None:
        if self._route.step is StepKind.SOURCE:
            self._route.go_on()

    def _goto(self, argument: str) -> None:
        kinds = self._scene.procedure.kinds
        if argument not in list(kinds):
            known = ", ".join(kinds)
            raise UsageError(f"there is no step {argument!r}; give one of {known}")
        if argument not in list(self._route.kinds):
            self._say(f"There is no step {TITLES[StepKind(argument)]}: no magnetometer.")
            return
        self._route.return_to = None
        self._route.leave_out(StepKind(argument))
        self._route.enter(StepKind(argument))

    def _validate(self) -> None:
        self._route.enter(StepKind.VALIDATE)
        self._scene.last_event = None  # what happened before the result is no news here

    def _save(self) -> None:
        """Save with what there is; a validation that is not whole is left out."""
        route, kind = self._route, StepKind.VALIDATE
        if not route.stages[kind].finished:
            route.skipped[kind] = self._scene.procedure.step(kind).skipped
        route.enter(StepKind.SAVE)

    def _measure(self, argument: str) -> None:
        """Hold what the bench asks for, and come back to the result."""
        asked = from_text(argument)
        route = self._route
        if route.step not in AFTERWARDS:
            self._say("There is a result first; then the bench can ask for more.")
            return
        route.return_to = None
        route.more.ask(asked)
        if route.more.finished:
            self._say("Turns were asked for, and the stream has no gyroscope.")
            return
        route.enter(StepKind.MORE)

    def _back(self) -> None:
        step, skipped = self._route.step, self._route.skipped
        if step is StepKind.MORE or (step is StepKind.SAVE and StepKind.VALIDATE in skipped):
            self._route.enter(StepKind.RESULT)
            return
        kinds = self._route.kinds
        self._route.return_to = None
        self._route.enter(kinds[max(kinds.index(self._route.step) - 1, 0)])

    def _skip(self) -> None:
        route, kind = self._route, self._route.step
        if kind is StepKind.SAVE:
            return
        measured = kind in (*MEASURING, StepKind.VALIDATE) and route.return_to is None
        if kind is StepKind.MORE and route.return_to is None:
            self._scene.emit(EventKind.STEP_SKIPPED, "What was not taken is left out.")
        if measured and not route.stage.finished:
            consequence = self._scene.procedure.step(kind).skipped
            route.skipped[kind] = consequence
            self._scene.emit(EventKind.STEP_SKIPPED, f"{TITLES[kind]} skipped: {consequence}.")
        if kind is StepKind.SETTLE:
            self._typical_limits()
        route.go_on()

    def _enough(self) -> None:
        """Go on with the part of the sphere that could be reached."""
        if self._route.step is not StepKind.FIELD:
            self._say("Only the magnetometer's step can do with less.")
            return
        self._route.field.accept()
        self._route.advance()

    def _typical_limits(self) -> None:
        """Without a measured noise: the limits it had before, or coarse ones."""
        scene = self._scene
        settle = self._route.settle
        noise = settle.noise
        scene.watch.set_limits(settle.coarse() if noise is None else settle.fine(noise))

    def _undo(self) -> None:
        route, scene = self._route, self._scene
        last = self._to_undo()
        if last is None:
            self._say("There is nothing to undo.")
            return
        step, run = last.step, scene.run
        ticks = dict(last.ticks) if isinstance(last, KeptHold) else {}
        if isinstance(last, KeptHold) and last.step is StepKind.SETTLE:
            step = next(iter(ticks))
            last.ticks.clear()
        else:
            scene.ledger.remove(last)
        if route.step is not step:
            route.enter(step)
        if run.kept is last:
            run.used = True
        route.stage.enter()
        if step in ticks and isinstance(route.stage, PoseStage | MoreStage):
            route.stage.ask_again(ticks[step])
        scene.emit(EventKind.UNDONE, f"{_named(last)} is taken back.")

    def _to_undo(self) -> Kept | None:
        """What undo takes back; a circle in which hardly anything has been turned goes with it.

        One begins by itself wherever the device lies, as soon as the last is taken back.
        """
        ledger = self._scene.ledger
        last = ledger.last()
        while isinstance(last, KeptCircle) and self._route.field.hardly_begun(last):
            ledger.remove(last)
            last = ledger.last()
        return last

    def _repeat(self) -> None:
        route, kind = self._route, self._route.step
        if kind not in (*MEASURING, StepKind.VALIDATE, StepKind.MORE):
            return
        since = route.more.since if kind is StepKind.MORE else -math.inf
        dropped = 0 if kind is StepKind.SETTLE else self._scene.ledger.clear(kind, since)
        noun = _NOUNS.get(kind, "hold")
        self._holding.restart()
        route.enter(kind)
        lost = f": {plural(dropped, noun)} taken back" if dropped else ""
        self._scene.emit(EventKind.UNDONE, f"{TITLES[kind]} begins again{lost}.")

    def _loosen(self) -> None:
        watch = self._scene.watch
        if watch.loosen():
            watch.rest()
            self._say(f"The limits are {watch.loosened:.0f} times wider now.")
        else:
            self._say("The limits are as wide as they may be: take it hand-held instead.")

    def _take(self) -> None:
        reason = self._taking.hand_held()
        if reason:
            self._say(f"Not taken: {reason}.")

    def _remeasure(self) -> None:
        route = self._route
        if route.step in (StepKind.SETTLE, StepKind.SOURCE):
            return
        route.return_to = route.step
        route.enter(StepKind.SETTLE)
        self._say("The noise is measured again: put it down and leave it.")

    def _count_faces(self) -> None:
        route, scene = self._route, self._scene
        poses = set(scene.procedure.step(StepKind.POSES).poses)
        counted = 0
        for kept in scene.ledger.holds:
            pose = kept.ticks.get(StepKind.UP_DOWN)
            if pose in poses and StepKind.POSES not in kept.ticks:
                kept.ticks[StepKind.POSES] = pose
                counted += 1
        kind = EventKind.HOLD_TAKEN if counted else EventKind.WARNING
        scene.emit(kind, f"{plural(counted, 'face')} of the up/down step counted among the poses.")
        if route.step is StepKind.POSES:
            route.stage.enter()
            if route.stage.finished:
                route.advance()


def _named(last: Kept) -> str:
    if isinstance(last, KeptHold):
        return label(last.hold.pose) if last.hold.pose else "The last hold"
    if isinstance(last, KeptCircle):
        return f"What was turned on {label(last.face)}" if last.face else "What was turned"
    return "The last rotation"
