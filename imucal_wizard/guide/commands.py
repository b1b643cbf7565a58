"""The operator's commands; every command is safe in every step."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.quantities import plural
from imucal_wizard.guide.kinds import AFTERWARDS, MEASURING, TITLES, EventKind, StepKind
from imucal_wizard.guide.measurements import Kept, KeptCircle, KeptHold
from imucal_wizard.guide.wording import label
from imucal_wizard.measurement.requests import requests_from_text

if TYPE_CHECKING:
    from imucal_wizard.guide.state_machine import StateMachine

_NOUNS = {StepKind.ROTATIONS: "rotation", StepKind.FIELD: "circle"}
"""Noun for the measurements of a step; "hold" for all other steps."""


class Commands:
    """Carries out commands by name.

    Args:
        machine: the state machine that they control.
    """

    def __init__(self, machine: "StateMachine") -> None:
        self._machine = machine
        self._context = machine.context
        self._skips: list[tuple[StepKind, Kept | None]] = []
        """The skipped steps, each with the last measurement before the skip."""
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
            "end": self._end,
        }

    def obey(self, name: str, argument: str = "") -> None:
        """Carry out one command.

        Raises:
            UsageError: there is no such command or step.
        """
        self._context.last_event = None  # what happened before may not fit what is asked now
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
        self._context.emit(EventKind.WARNING, text)

    def _start(self) -> None:
        if self._machine.step is StepKind.SOURCE:
            self._machine.go_on()

    def _goto(self, argument: str) -> None:
        """Enter a step; steps that are jumped over are skipped, with their consequence."""
        machine, plan = self._machine, self._context.procedure
        if argument not in list(plan.kinds):
            known = ", ".join(plan.kinds)
            raise UsageError(f"there is no step {argument!r}; give one of {known}")
        step = StepKind(argument)
        if step not in machine.kinds:
            self._say(f"No step {TITLES[step]}: the stream has no magnetometer.")
            return
        machine.return_to = None
        machine.pass_over(step)
        machine.enter(step)

    def _has(self, kind: StepKind) -> bool:
        """Whether the procedure has a step; says so if it does not."""
        if kind not in self._context.procedure.kinds:
            self._say(f"No step {TITLES[kind]} in this procedure.")
            return False
        return True

    def _validate(self) -> None:
        if self._has(StepKind.VALIDATE):
            self._machine.enter(StepKind.VALIDATE)

    def _save(self) -> None:
        """Save now; an incomplete validation is skipped."""
        machine, kind = self._machine, StepKind.VALIDATE
        if not self._has(StepKind.SAVE):
            return
        if not machine.stages[kind].finished:
            machine.skipped[kind] = self._context.procedure.step(kind).skipped
        machine.enter(StepKind.SAVE)

    def _end(self) -> None:
        """The data have ended: leave a step that measures, with what it has."""
        if self._machine.step in (*MEASURING, StepKind.MORE):
            kinds = self._context.procedure.kinds
            self._goto(StepKind.RESULT if StepKind.RESULT in kinds else kinds[-1])
        elif self._machine.step is StepKind.VALIDATE:
            self._save()

    def _measure(self, argument: str) -> None:
        """Enter the step of requested measurements; it returns to the result."""
        requests = requests_from_text(argument)
        machine = self._machine
        if machine.step not in AFTERWARDS:
            self._say("More can be measured only after the result.")
            return
        machine.return_to = None
        machine.requests.ask(requests)
        if machine.requests.finished:
            self._say("Rotations were requested, but the stream has no gyroscope.")
            return
        machine.enter(StepKind.MORE)

    def _back(self) -> None:
        step, skipped = self._machine.step, self._machine.skipped
        if step is StepKind.MORE or (step is StepKind.SAVE and StepKind.VALIDATE in skipped):
            self._machine.enter(StepKind.RESULT)
            return
        kinds = self._machine.kinds
        self._machine.return_to = None
        self._machine.enter(kinds[max(kinds.index(self._machine.step) - 1, 0)])

    def _skip(self) -> None:
        machine, kind = self._machine, self._machine.step
        if kind is StepKind.SAVE:
            return
        measured = kind in (*MEASURING, StepKind.VALIDATE) and machine.return_to is None
        if kind is StepKind.MORE and machine.return_to is None:
            self._context.emit(
                EventKind.STEP_SKIPPED, "Measurements that were not taken are left out."
            )
        if measured and not machine.stage.finished:
            consequence = self._context.procedure.step(kind).skipped
            machine.skipped[kind] = consequence
            self._skips.append((kind, self._context.measurements.last()))
            self._context.emit(EventKind.STEP_SKIPPED, f"{TITLES[kind]} skipped: {consequence}.")
        if kind is StepKind.SETTLE:
            machine.settle.do_without()
        machine.go_on()

    def _enough(self) -> None:
        """Finish the magnetometer's step with the present coverage."""
        if self._machine.step is not StepKind.FIELD:
            self._say("Only the magnetometer's step accepts partial coverage.")
            return
        self._machine.field.accept()
        self._machine.advance()

    def _undo(self) -> None:
        machine, context = self._machine, self._context
        step = self._skipped_after(context.measurements.last())
        last = None if step else self._to_undo()
        step = step or self._skipped_after(last)
        if step:
            machine.enter(step)
            context.emit(EventKind.UNDONE, f"The skip of {TITLES[step]} was taken back.")
        elif last is None:
            self._say("There is nothing to undo.")
        else:
            machine.take_back(last)
            context.emit(EventKind.UNDONE, f"{named(last)} was taken back.")

    def _skipped_after(self, last: Kept | None) -> StepKind | None:
        """The step that was skipped since this measurement, no longer noted, or None."""
        while self._skips and self._skips[-1][1] is last:
            kind, _ = self._skips.pop()
            if kind in self._machine.skipped:
                return kind
        return None

    def _to_undo(self) -> Kept | None:
        """The measurement that undo removes. Circles that have hardly begun are removed before it.

        A new circle begins by itself as soon as the last one is taken back.
        """
        own = self._context.measurements
        last = own.last()
        while isinstance(last, KeptCircle) and self._machine.field.hardly_begun(last):
            own.remove(last)
            last = own.last()
        return last

    def _repeat(self) -> None:
        machine, kind = self._machine, self._machine.step
        if kind not in (*MEASURING, StepKind.VALIDATE, StepKind.MORE):
            return
        since = machine.requests.since if kind is StepKind.MORE else -math.inf
        dropped = 0 if kind is StepKind.SETTLE else self._context.measurements.clear(kind, since)
        noun = _NOUNS.get(kind, "hold")
        self._machine.capture.restart()
        machine.enter(kind)
        lost = f": {plural(dropped, noun)} taken back" if dropped else ""
        self._context.emit(EventKind.UNDONE, f"{TITLES[kind]} begins again{lost}.")

    def _loosen(self) -> None:
        watch = self._context.watch
        if watch.loosen():
            watch.rest()
            self._say(f"The limits are {watch.loosened:.0f} times wider now.")
        else:
            self._say("The limits cannot be wider.")

    def _take(self) -> None:
        """Keep the newest seconds as a hold, marked hand-held."""
        machine = self._machine
        if not machine.asking:
            self._say("Not taken: this step needs no hold.")
            return
        hold = machine.capture.newest(machine.stage.seconds)
        if hold is None:
            self._say("Not taken: too few samples since the last hold.")
        elif not np.isfinite(hold.accelerometer).all():
            self._say("Not taken: the newest readings are not numbers.")
        else:
            machine.take_hand_held(hold)

    def _remeasure(self) -> None:
        machine = self._machine
        if machine.step in (StepKind.SETTLE, StepKind.SOURCE):
            return
        machine.return_to = machine.step
        machine.enter(StepKind.SETTLE)
        self._say("The noise is measured again.")

    def _count_faces(self) -> None:
        machine, context = self._machine, self._context
        poses = set(context.procedure.step(StepKind.POSES).poses)
        before = set(context.measurements.ticked(StepKind.POSES))
        for kept in context.measurements.holds:
            pose = kept.ticks.get(StepKind.UP_DOWN)
            if pose in poses:
                kept.ticks.setdefault(StepKind.POSES, pose)
        counted = len(set(context.measurements.ticked(StepKind.POSES)) - before)
        kind = EventKind.HOLD_TAKEN if counted else EventKind.WARNING
        context.emit(
            kind, f"{plural(counted, 'face')} of the up/down step counted among the poses."
        )
        if machine.step is StepKind.POSES:
            machine.stage.enter()
            if machine.stage.finished:
                machine.advance()


def named(last: Kept) -> str:
    """A measurement in words."""
    if isinstance(last, KeptHold):
        return label(last.hold.pose) if last.hold.pose else "The last hold"
    if isinstance(last, KeptCircle):
        return f"The circle on {label(last.face)}" if last.face else "The tumbling"
    return "The last rotation"
