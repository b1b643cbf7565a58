"""The procedure as a state machine that takes readings and needs no key.

For each block it decides whether the device is still, and what follows: a hold begins, is kept or
breaks; the present step takes the hold; the next step begins. All decisions use sample time, so the
same samples and commands give the same holds to the last bit, however the samples are cut and
however fast they come.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from imucal_wizard.core.instruction import Instruction, RotationRequest
from imucal_wizard.core.limits.procedure import HAND_HELD_EXCESS, MAX_LOOSENED, WINDOW_SECONDS
from imucal_wizard.core.limits.stillness import TIME_TOLERANCE
from imucal_wizard.core.poses import FACES
from imucal_wizard.core.readings import Readings
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.guide.commands import Commands, named
from imucal_wizard.guide.context import Context, Stage
from imucal_wizard.guide.field.checks import left_out_spans
from imucal_wizard.guide.field.samples import FieldRecord
from imucal_wizard.guide.field.step import FieldStage
from imucal_wizard.guide.hold_capture import HoldCapture
from imucal_wizard.guide.instruction import present
from imucal_wizard.guide.kinds import MEASURING, TITLES, EventKind, StepKind
from imucal_wizard.guide.measurements import Kept, KeptHold
from imucal_wizard.guide.plan import Procedure
from imucal_wizard.guide.scales import Scales, excess
from imucal_wizard.guide.state import Event, Offer, Status, StillStatus
from imucal_wizard.guide.steps.directions import DirectionsStage, ValidationStage
from imucal_wizard.guide.steps.recheck import Planner, RecheckStage
from imucal_wizard.guide.steps.requests import RequestsStage
from imucal_wizard.guide.steps.rotations import RotationsStage
from imucal_wizard.guide.steps.settle import SettleStage
from imucal_wizard.guide.steps.waiting import WaitingStage
from imucal_wizard.measurement.clipping import frozen_axis
from imucal_wizard.measurement.holds import Collected, Hold
from imucal_wizard.measurement.stillness import Block, BlockStream, Noise

Listener = Callable[[Instruction, int], None]
"""Receives the instruction and the number of samples before it."""

_PLACING = (
    StepKind.UP_DOWN,
    StepKind.POSES,
    StepKind.VALIDATE,
    StepKind.MORE,
    StepKind.RECHECK,
)
"""Steps that need poses."""
_MEASURED = (StepKind.RESULT, StepKind.VERDICT)
"""Steps that follow the last measurement."""


class StateMachine:
    """Leads through a procedure.

    Args:
        procedure: the steps and their needs.
        rate: samples per second.
        accelerometer_unit: ``m/s^2`` or ``count``.
        gyroscope_unit: ``rad/s`` or ``count``.
        gravity: local gravity, m/s².
        gyroscope_range: full scale of the gyroscope in its unit, or None if not known.
        noise: of the device at rest, if it is known already; the settle step is then done.
        listener: receives the instruction after each block and each command.
        planner: chooses the poses of a recheck; None for the six faces.

    Attributes:
        context: shared by all steps.
        capture: makes and keeps the holds.
        step: the present step.
        stages: the logic of each step.
        settle: the settle step, whose limits all steps use.
        field: the magnetometer's step.
        requests: the step of requested measurements, which the plan does not have.
        skipped: steps that were skipped, with the consequence.
        return_to: the step to return to after a new measurement of the noise.
        elapsed: sample time since the start, s.
    """

    def __init__(
        self,
        procedure: Procedure | None = None,
        *,
        rate: float,
        accelerometer_unit: str = "m/s^2",
        gyroscope_unit: str = "rad/s",
        gravity: float = STANDARD_GRAVITY,
        gyroscope_range: float | None = None,
        noise: Noise | None = None,
        listener: Listener | None = None,
        planner: Planner | None = None,
    ) -> None:
        plan = procedure or Procedure()
        units = Scales(accelerometer_unit, gyroscope_unit, gravity)
        self.context = context = Context(plan, units, gyroscope_range)
        self.settle = SettleStage(context, plan.step(StepKind.SETTLE), noise)
        self.field = FieldStage(context)
        poses, rotations = plan.step(StepKind.POSES), plan.step(StepKind.ROTATIONS)
        self.requests = RequestsStage(context, poses, rotations)
        self.stages: dict[StepKind, Stage] = {
            StepKind.SOURCE: WaitingStage(StepKind.SOURCE),
            StepKind.SETTLE: self.settle,
            StepKind.UP_DOWN: DirectionsStage(context, plan.step(StepKind.UP_DOWN)),
            StepKind.POSES: DirectionsStage(context, poses),
            StepKind.ROTATIONS: RotationsStage(context, rotations),
            StepKind.FIELD: self.field,
            StepKind.RESULT: WaitingStage(StepKind.RESULT),
            StepKind.MORE: self.requests,
            StepKind.VALIDATE: ValidationStage(context, plan.step(StepKind.VALIDATE)),
            StepKind.SAVE: WaitingStage(StepKind.SAVE),
            StepKind.RECHECK: RecheckStage(
                context, plan.step(StepKind.RECHECK), planner, self.collected
            ),
            StepKind.VERDICT: WaitingStage(StepKind.VERDICT),
        }
        longest = max(stage.seconds for stage in self.stages.values())
        self.capture = HoldCapture(context, longest, self._withdraw)
        self.step = plan.kinds[0]
        self.skipped: dict[StepKind, str] = {}
        self.return_to: StepKind | None = None
        self.elapsed = 0.0
        self._commands = Commands(self)
        self._blocks = BlockStream(rate)
        self._record = FieldRecord()
        self._broke = ""
        self._refused = ""
        self._status: Status | None = None
        self._view: Status | None = None
        self._listener = listener
        self._judged = 0

    def __getstate__(self) -> dict[str, Any]:
        """Everything but who listens; for a checkpoint."""
        return {**vars(self), "_listener": None, "_status": None, "_view": None}

    def listen(self, listener: Listener | None) -> None:
        """Pass the instruction to another listener from now on."""
        self._listener = listener

    # Input

    def feed(self, readings: Readings) -> tuple[Event, ...]:
        """Take the next readings; returns the events in them."""
        for block in self._blocks.feed(readings):
            self._take(block)
            self._judged += len(block.time)
            self._changed()
        return self.context.drain()

    def command(self, name: str, argument: str = "") -> tuple[Event, ...]:
        """Carry out a command; returns the events.

        Args:
            name: one of the commands of ``guide.commands``.
            argument: the step's name for ``goto``; for ``measure`` what
                ``measurement.requests.requests_to_text`` made.

        Raises:
            UsageError: there is no such command or step.
        """
        self._commands.obey(name, argument)
        self._changed()
        return self.context.drain()

    def flush(self) -> tuple[Event, ...]:
        """The data have ended: complete the present hold and circle as they are."""
        self.capture.restart()
        if self.step is StepKind.FIELD:
            self.field.end()
        self._changed()
        return self.context.drain()

    def _changed(self) -> None:
        self._status = self._view = None
        if self._listener is not None:
            self._listener(self.instruction(), self._judged)

    # One block

    def _take(self, block: Block) -> None:
        context, was_still = self.context, self.context.still
        context.time = block.end
        context.has_gyroscope = block.rate is not None
        if block.field is not None and len(block.field):
            self._record.add(block.field)
            context.has_magnetometer = True
        self.elapsed += block.seconds
        self._refused = ""
        self._learn(block)
        context.still = self._judge(block)
        if was_still and not context.still:
            self._break(block)
        elif not context.still:
            self.capture.fresh()
        self.capture.add(block)
        if context.still:
            self._rest(began=not was_still)
        context.held = self.capture.counted
        stage, finished = self.stage, self.stage.finished
        stage.follow(block)
        if stage.finished and not finished:
            self.advance()
        if context.still:
            self._take_hold(block)
        self._be_patient(block)

    def _learn(self, block: Block) -> None:
        """Learn the up direction and the resolution of the readings."""
        context, reading = self.context, block.mean_a
        if not context.up_estimate.known or not (context.measurements.holds or context.still):
            # The device may be moving at the start, so the newest estimate is the best.
            context.up_estimate.begin(reading)
        self.settle.assume()
        context.up = context.up_estimate.up(reading) if np.isfinite(reading).all() else None
        finer = context.resolution.see((block.acceleration, block.rate))
        if finer and self.step is not StepKind.SETTLE:
            self.settle.refine()

    def _judge(self, block: Block) -> bool:
        """Whether the device is still."""
        watch = self.context.watch
        if self.step is not StepKind.SETTLE:
            return watch.judge(block)
        if watch.limits is None:
            self.settle.prepare()
        watch.judge(block)
        return self.settle.admits(block)

    def _rest(self, *, began: bool) -> None:
        """Follow a device at rest."""
        run = self.context.run
        if began and self.asking and not run.used:
            self.context.emit(EventKind.STILL, "Still.")
        if run.kept is not None:
            self.capture.rest_in(run.kept)

    def _break(self, block: Block) -> None:
        """The still run ends with the block before this one."""
        context, run = self.context, self.context.run
        if run.kept is not None:
            self.capture.finish()
            if self.asking and not run.kept.dropped:
                context.emit(EventKind.MOVED, "Moving.")
        elif self.asking and not run.used:
            what = "Moved" if block.full else "Interrupted"
            self._broke = self._why_not_still(block)
            text = f"{what} after {self.capture.seconds:.1f} s: {self._broke}."
            context.emit(EventKind.HOLD_BROKEN, text)
        self.capture.fresh()

    def _why_not_still(self, block: Block) -> str:
        if self.step is StepKind.SETTLE and self.settle.why:
            return self.settle.why
        fallback = "it moved" if block.full else "samples are missing"
        return self.context.watch.reason or fallback

    def _take_hold(self, block: Block) -> None:
        """Keep a hold that is long enough, and pass it to the step once."""
        context, run = self.context, self.context.run
        if not self.asking or run.used or self.step in run.received:
            return
        if self.capture.counted < self.stage.seconds - TIME_TOLERANCE:
            return
        if run.kept is not None:
            self.capture.finish()
            context.motion = None
            if not run.kept.dropped:
                self._pass_on(run.kept)
            return
        hold = self.capture.hold()
        # a slow motion has calm moments, which are shorter than the rest that the step asks for
        if hold is not None and hold.end - hold.start < self.stage.seconds - WINDOW_SECONDS:
            return
        if hold is None or self.capture.slow_moment(hold):
            self._refused = "it turns or sways slowly"
            return
        if context.watch.tighten(self.stage.seconds):
            context.emit(
                EventKind.WARNING, "The device is calm again: the limits are back to normal."
            )
        self._pass_on(self.capture.keep(hold, self.step))
        frozen = frozen_axis(block.window, self.settle.noise, context.resolution.steps[0])
        if frozen:
            context.emit(EventKind.WARNING, frozen)

    def take_back(self, kept: Kept) -> None:
        """Take back a measurement, and ask for it again in its step."""
        step, run = kept.step, self.context.run
        ticks = dict(kept.ticks) if isinstance(kept, KeptHold) else {}
        if isinstance(kept, KeptHold) and step is StepKind.SETTLE:
            step = next(iter(ticks))
            kept.ticks.clear()
        else:
            self.context.measurements.remove(kept)
        if self.step is not step:
            self.pass_over(step)
            self.enter(step)
        if run.kept is kept:
            run.used = True
        self.stage.enter()
        if step in ticks and isinstance(self.stage, DirectionsStage):
            self.stage.ask_again(ticks[step])

    def _withdraw(self, kept: KeptHold) -> None:
        """Take back a hold whose rest as a whole is a slow motion."""
        self.take_back(kept)
        text = f"{named(kept)} was taken back: the device was turning slowly."
        self.context.emit(EventKind.UNDONE, text)

    def take_hand_held(self, hold: Hold) -> None:
        """Keep a hand-held hold; the device must be moved before the next one."""
        self.capture.restart()
        run = self.context.run
        kept = self.capture.keep(hold, self.step)
        run.complete = run.used = True
        self._pass_on(kept)

    def _pass_on(self, kept: KeptHold) -> None:
        """Pass a hold to the current step."""
        self.context.run.received.add(self.step)
        before = len(self.context.measurements.rotations)
        more = self.step is StepKind.ROTATIONS and self.stage.finished
        self.stage.completed(kept)
        self.capture.rest_in(kept)
        self.context.watch.rest()
        # the user went back to measure more: a rest is no rotation, and no new orientation
        measured = self.context.measurements
        nothing = more and len(measured.rotations) == before
        if self.step is StepKind.VALIDATE:
            nothing = all(one is not kept for one in measured.validation)
        if self.stage.finished and not nothing:
            self.advance()

    def _be_patient(self, block: Block) -> None:
        """Count the time without a hold where one is wanted; offer alternatives."""
        context, watch, settling = self.context, self.context.watch, self.step is StepKind.SETTLE
        content = context.still and (context.run.used or self.step in context.run.received)
        if not self.asking or content:
            watch.rest()
            return
        if not self.stage.holds_here:
            return
        if settling and watch.exhausted_in(block.seconds) and self.settle.make_do():
            self.advance()
            return
        outcome = watch.wait(block.seconds)
        if outcome is None:
            return
        broken = f"every rest is broken ({self._broke or 'it moves'})"
        reason = watch.reason or self._refused or broken
        if outcome == "stuck":
            text = f"No rest for {watch.waiting:.0f} s: {reason}. {self._way_out()}"
            context.emit(EventKind.STUCK, text)
        else:
            text = f"The limits are {watch.loosened:.0f} times wider now: {reason}."
            context.emit(EventKind.WARNING, text)

    def _way_out(self) -> str:
        """Advice for a device that does not come to rest."""
        worst = self.context.watch.worst
        if self.step is not StepKind.SETTLE:
            return "Lean it on something."
        if worst is not None and excess(worst) < HAND_HELD_EXCESS:
            return "Lay it down where nothing shakes it."
        return "If it lies still, its units are wrong: go back to the source."

    # Order of the steps

    @property
    def stage(self) -> Stage:
        """The logic of the present step."""
        return self.stages[self.step]

    @property
    def asking(self) -> bool:
        """Whether the present step needs a hold."""
        return self.stage.seconds > 0.0

    @property
    def kinds(self) -> tuple[StepKind, ...]:
        """The steps for this stream, in order."""
        every = self.context.procedure.kinds
        if self.context.has_magnetometer:
            return every
        return tuple(kind for kind in every if kind is not StepKind.FIELD)

    def enter(self, kind: StepKind) -> None:
        """Begin a step, or return to it."""
        context = self.context
        self.step = kind
        self.skipped.pop(kind, None)
        kept = context.run.kept
        if kind is StepKind.SETTLE:
            self.capture.restart()
        elif kept is not None and (kind is StepKind.VALIDATE or kept.ticks):
            # One placement is one measurement, so a repeat begins with a move. A rotation may
            # begin with the present hold.
            rotating = kind is StepKind.ROTATIONS
            rotating |= kind is StepKind.MORE and self.requests.rotating
            context.run.used = not rotating
        if kind is StepKind.SAVE and not self.stages[StepKind.VALIDATE].finished:
            self.skipped[StepKind.VALIDATE] = self._not_validated()
        if kind in (*_MEASURED, StepKind.SAVE):
            # The measurements that are fitted must not change afterwards.
            self.capture.finish()
            context.run.complete = kept is not None
        context.watch.rest()
        self.stage.enter()

    def pass_over(self, step: StepKind) -> None:
        """Skip the steps that are not finished between the present one and a later one."""
        kinds = self.kinds
        if self.step in kinds and step in kinds:  # the requested measurements have no place
            for kind in kinds[kinds.index(self.step) : kinds.index(step)]:
                if kind in MEASURING and not self.stages[kind].finished:
                    self.skipped[kind] = self.context.procedure.step(kind).skipped

    def _not_validated(self) -> str:
        """Consequence of an incomplete validation."""
        taken, wanted = self.stages[StepKind.VALIDATE].tally
        if not taken:
            return self.context.procedure.step(StepKind.VALIDATE).skipped
        return f"{taken:.0f} of {wanted:.0f} new orientations were taken"

    def advance(self) -> None:
        """Leave a finished step."""
        self.context.emit(EventKind.STEP_DONE, f"{TITLES[self.step]} done.")
        self.go_on()

    def go_on(self) -> None:
        """Enter the next step that is neither finished nor skipped."""
        if self.step is StepKind.SETTLE and self.return_to is not None:
            kind, self.return_to = self.return_to, None
            self.enter(kind)
            return
        kinds = self.kinds
        later: tuple[StepKind, ...] = (StepKind.RESULT,)
        if self.step is not StepKind.MORE:
            later = kinds[kinds.index(self.step) + 1 :]
        for kind in later:
            if self._left_out(kind):
                continue
            self.enter(kind)
            if kind in _MEASURED and self.step is kind:
                left = ", ".join(TITLES[one] for one in self.skipped)
                text = f"Measured except {left}." if left else "Everything is measured."
                self.context.emit(EventKind.FINISHED, text)
            return

    def _left_out(self, kind: StepKind) -> bool:
        if kind not in MEASURING:
            return False
        if self.stages[kind].finished or kind in self.skipped:
            return True
        if kind is StepKind.ROTATIONS and not self.context.has_gyroscope:
            self.skipped[kind] = "the stream has no gyroscope"
            self.context.emit(EventKind.STEP_SKIPPED, "No gyroscope: no rotations.")
            return True
        return False

    # Output

    def status(self) -> Status:
        """The status for the screens, frozen."""
        if self._status is None:
            context, own, noise = self.context, self.context.measurements, self.settle.noise
            up = context.up
            self._status = present(
                replace(
                    self._stage_view(),
                    step=self.step,
                    elapsed=self.elapsed,
                    still=self._still_status(),
                    up=None if up is None else (float(up[0]), float(up[1]), float(up[2])),
                    noise="" if noise is None else context.units.noise_text(noise),
                    offers=self._offers(),
                    last_event=self._last_event(),
                    holds=len(own.holds) + len(own.validation),
                    rotations=len(own.rotations),
                    skipped=tuple(self.skipped.items()),
                    steps=context.procedure.kinds,
                    poses=len(context.procedure.step(StepKind.POSES).poses),
                )
            )
        return self._status

    def _last_event(self) -> Event | None:
        """The newest event; not the advice for a place where no hold is wanted any more."""
        newest = self.context.last_event
        stuck = newest is not None and newest.kind is EventKind.STUCK
        return None if stuck and not self._offers_ways_out else newest

    def _still_status(self) -> StillStatus:
        context, watch, needed = self.context, self.context.watch, self.stage.seconds
        reason = watch.reason or self._refused
        if self.step is StepKind.SETTLE and not context.still and self.settle.why:
            reason = self.settle.why
        return StillStatus(
            still=context.still and not self._refused,
            motions=watch.motions,
            worst=watch.worst,
            held=self._held(needed),
            needed=needed,
            waiting=watch.waiting,
            loosened=watch.loosened,
            reason=reason,
            spent=context.run.used,
        )

    @property
    def _offers_ways_out(self) -> bool:
        """Whether the device has long failed to rest where a hold is wanted."""
        return self.asking and self.context.watch.offered and self.stage.holds_here

    def _offers(self) -> tuple[Offer, ...]:
        """The commands that are offered now."""
        offers: list[Offer] = []
        if self._offers_ways_out:
            if self.context.watch.loosened < MAX_LOOSENED:
                offers.append(Offer("loosen", "double the limits"))
            offers.append(Offer("take", "take it, marked hand-held"))
            if self.step is not StepKind.SETTLE:
                offers.append(Offer("remeasure", "measure the noise again"))
        if self.step in (*MEASURING, StepKind.MORE, StepKind.VALIDATE) and self.stage.finished:
            offers.append(Offer("skip", "all taken: go on"))
        if self.step is StepKind.FIELD:
            offers.extend(self.field.offers())
        if self.step is StepKind.POSES and self._faces_wait():
            offers.append(Offer("count-faces", "count the faces of the up/down step"))
        return tuple(offers)

    def _faces_wait(self) -> bool:
        """Whether faces of the up/down step could still count as poses."""
        own = self.context.measurements
        wanted = set(self.context.procedure.step(StepKind.POSES).poses) & set(FACES)
        taken = set(own.ticked(StepKind.UP_DOWN)) & wanted
        return bool(taken - set(own.ticked(StepKind.POSES)))

    def instruction(self) -> Instruction:
        """The instruction to the person or program that moves the device."""
        view, needed, own = self._stage_view(), self.stage.seconds, self.context.measurements
        pose: str | tuple[float, float, float] | None = None
        if self.step in _PLACING:
            pose = view.wanted or view.wanted_up or next(iter(view.missing), None)
        asked, field = view.rotation, view.field
        return Instruction(
            self.step,
            pose,
            None
            if asked is None
            else RotationRequest(
                asked.axis, asked.start_pose, asked.done, asked.wanted_angle, asked.wanted_rate
            ),
            field is not None,
            None if field is None else field.face,
            self._held(needed),
            needed,
            len(own.holds) + len(own.validation),
        )

    def _stage_view(self) -> Status:
        """What the step shows; made once for each block."""
        if self._view is None:
            self._view = self.stage.view()
        return self._view

    def _held(self, needed: float) -> float:
        """Rest so far, s; at most what the step needs while it asks for a rest."""
        return min(self.context.held, needed) if self.asking else self.context.held

    @property
    def provisional_noise(self) -> Noise | None:
        """The noise of a rest that was shorter than the step needs; None after a full rest."""
        return self.settle.noise if self.settle.provisional else None

    def collected(self) -> Collected:
        """All measurements; the present hold has its present length."""
        collected = replace(self.capture.collected(), steps=self.context.resolution.steps)
        collected = replace(collected, magnetometer=self._record.series())
        if collected.magnetometer is None or StepKind.FIELD in self.skipped:
            return collected
        survey, unit = self.field.gathered.survey, self.field.gathered.unit
        return replace(
            collected, field_spans=survey.spans(), field_left_out=left_out_spans(survey, unit)
        )
