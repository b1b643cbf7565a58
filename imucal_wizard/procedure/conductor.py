"""Moment by moment: from stillness to holds, from holds to the next step."""

import math
from collections import deque
from dataclasses import replace

import numpy as np

from imucal_wizard.procedure.blocks import join_blocks
from imucal_wizard.procedure.holds import Hold, HoldBuilder, hold_from
from imucal_wizard.procedure.ledger import KeptHold, KeptRotation
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.plain_step import PlainStage
from imucal_wizard.procedure.plan import Procedure
from imucal_wizard.procedure.pose_step import PoseStage
from imucal_wizard.procedure.rotation_step import RotationStage, fault_of
from imucal_wizard.procedure.scales import Scales
from imucal_wizard.procedure.scene import Run, Scene, Stage
from imucal_wizard.procedure.settle_step import SettleStage
from imucal_wizard.procedure.state import Collected, EventKind, StepKind
from imucal_wizard.procedure.stillness import WINDOW_BLOCKS
from imucal_wizard.procedure.validate_step import ValidateStage
from imucal_wizard.procedure.wording import TITLES

LONGEST_HOLD = 300.0
"""A hold ends after this, s: it says nothing more, and memory stays flat."""
ALMOST = 1e-6
MEASURING = (StepKind.SETTLE, StepKind.UP_DOWN, StepKind.POSES, StepKind.ROTATIONS)
"""The steps that follow one another by themselves; the result comes after the last."""


class Conductor:
    """The state of the procedure and what a moment does to it."""

    def __init__(self, procedure: Procedure, units: Scales, gyroscope_range: float | None) -> None:
        self.scene = Scene(procedure, units, gyroscope_range)
        self.settle = SettleStage(self.scene, procedure.step(StepKind.SETTLE))
        self.stages: dict[StepKind, Stage] = {
            kind: PlainStage(kind) for kind in (StepKind.SOURCE, StepKind.RESULT, StepKind.SAVE)
        }
        self.stages[StepKind.SETTLE] = self.settle
        for kind in (StepKind.UP_DOWN, StepKind.POSES):
            self.stages[kind] = PoseStage(self.scene, procedure.step(kind))
        self.stages[StepKind.ROTATIONS] = RotationStage(
            self.scene, procedure.step(StepKind.ROTATIONS)
        )
        self.stages[StepKind.VALIDATE] = ValidateStage(
            self.scene, procedure.step(StepKind.VALIDATE)
        )
        self.step = procedure.kinds[0]
        self.skipped: dict[StepKind, str] = {}
        self.return_to: StepKind | None = None
        self.elapsed = 0.0
        self._builder = HoldBuilder()
        self._earlier = 0.0
        longest = max(stage.seconds for stage in self.stages.values())
        self._recent: deque[Moment] = deque(maxlen=max(round(longest * 10.0), WINDOW_BLOCKS) + 1)

    @property
    def stage(self) -> Stage:
        """The step at work."""
        return self.stages[self.step]

    @property
    def asking(self) -> bool:
        """Whether a hold is asked for now."""
        return self.stage.seconds > 0.0

    # What a moment does

    def follow(self, moment: Moment) -> None:
        """Take one moment."""
        scene = self.scene
        was_still = scene.still
        scene.time = moment.end
        self.elapsed += moment.seconds
        scene.has_gyroscope = moment.rate is not None
        self._look_up(moment)
        if scene.resolution.see(moment) and self.step is not StepKind.SETTLE:
            self.settle.refine()
        scene.still = self._judge(moment)
        if was_still and not scene.still:
            self._break(moment)
        elif not scene.still:
            self._fresh()
        self._recent.append(moment)
        self._builder.add(moment.block, scene.still)
        scene.passage.add(moment, still=scene.still)
        if scene.still:
            self._rest(began=not was_still)
        scene.held = self._held()
        self.stage.follow(moment)
        if scene.still:
            self._consider()
        self._be_patient(moment)

    def _look_up(self, moment: Moment) -> None:
        scene, reading = self.scene, moment.mean_a
        if not scene.upright.known:
            scene.upright.begin(reading)
        scene.up = scene.upright.up(reading) if np.isfinite(reading).all() else None

    def _judge(self, moment: Moment) -> bool:
        watch = self.scene.watch
        if self.step is not StepKind.SETTLE:
            return watch.judge(moment)
        if watch.limits is None:
            self.settle.prepare()
        watch.judge(moment)
        return self.settle.admits(moment)

    def _held(self) -> float:
        run = self.scene.run
        if run.used:
            return 0.0
        return self._builder.seconds + (self._earlier if run.kept is not None else 0.0)

    def _rest(self, *, began: bool) -> None:
        """The device is at rest, and perhaps in a hold that is kept."""
        scene, run = self.scene, self.scene.run
        if began and self.asking and not run.used:
            scene.emit(EventKind.STILL, "Still: keep it so.")
        if run.kept is not None and not run.kept.dropped:
            scene.passage.rest(run.kept)
        if self._builder.seconds >= LONGEST_HOLD:
            if run.kept is not None:
                self._finish()
                self._earlier += self._builder.seconds
                run.complete = True
            self._builder.drop()

    def _break(self, moment: Moment) -> None:
        """The still run ends with the block before this one."""
        scene, run = self.scene, self.scene.run
        if run.kept is not None:
            self._finish()
            if self.asking:
                scene.emit(EventKind.MOVED, "Moving.")
        elif self.asking and not run.used:
            scene.emit(
                EventKind.HOLD_BROKEN,
                f"Moved after {self._builder.seconds:.1f} s: {self._why(moment)}. Hold it again.",
            )
        self._fresh()

    def _why(self, moment: Moment) -> str:
        if self.step is StepKind.SETTLE and self.settle.why:
            return self.settle.why
        return self.scene.watch.reason or ("samples are missing" if not moment.full else "it moved")

    def _fresh(self) -> None:
        self.scene.run = Run()
        self._earlier = 0.0

    def _finish(self) -> None:
        """The kept hold of this run is complete: the whole run, guards off."""
        kept = self.scene.run.kept
        if kept is None or kept.dropped or self.scene.run.complete:
            return
        hold = self._builder.hold()
        if hold is not None:
            kept.update(hold)
        if kept.hold.gyroscope is not None and self.scene.watch.loosened == 1.0:
            self.scene.watch.rest_at(kept.hold.gyroscope)

    def _consider(self) -> None:
        """Take the hold once it is long enough, and tell the step of it, once."""
        scene, run, stage = self.scene, self.scene.run, self.stage
        if not self.asking or run.used or self.step in run.told:
            return
        if self._held() < stage.seconds - ALMOST:
            return
        if run.kept is None:
            hold = self._builder.hold()
            if hold is not None:
                self._tell(self._keep(hold))
        else:
            self._finish()
            scene.motion = None
            self._tell(run.kept)

    def _keep(self, hold: Hold) -> KeptHold:
        """A new hold, and the motion that led to it."""
        scene = self.scene
        kept = KeptHold(hold, self.step)
        scene.run.kept = kept
        scene.motion = self._motion(kept)
        if not scene.ledger.holds:
            scene.upright.begin(hold.accelerometer)
        scene.ledger.add_hold(kept)
        scene.upright.learn([entry.hold.accelerometer for entry in scene.ledger.holds])
        if scene.motion is not None:
            scene.ledger.add_rotation(scene.motion)
        return kept

    def _tell(self, kept: KeptHold) -> None:
        scene = self.scene
        scene.run.told.add(self.step)
        self.stage.completed(kept)
        if not kept.dropped:
            scene.passage.rest(kept)
        scene.watch.rest()
        if self.stage.finished:
            self.advance()

    def _motion(self, kept: KeptHold) -> KeptRotation | None:
        """The motion from the last kept hold to this one; None where there was none."""
        passage = self.scene.passage
        before = passage.before
        if before is None or before.dropped or not passage.moved:
            return None
        if StepKind.VALIDATE in (before.step, kept.step):
            return None
        samples = passage.samples(kept)
        if samples is None:
            return None
        time, rate, missing = samples
        motion = KeptRotation(before, kept, time, rate, self.step)
        motion.problem = fault_of(motion, missing, self.scene.gyroscope_range)
        return motion

    def _be_patient(self, moment: Moment) -> None:
        """Count how long a hold has been asked for in vain; open the ways out."""
        scene, watch = self.scene, self.scene.watch
        content = scene.still and (scene.run.used or self.step in scene.run.told)
        if not self.asking or content:
            watch.rest()
            return
        what = watch.wait(moment.seconds)
        reason = watch.reason or "it moves again and again"
        if what == "stuck":
            scene.emit(
                EventKind.STUCK,
                f"No rest for {watch.waiting:.0f} s: {reason}. Lean it on something.",
            )
        elif what == "loosened":
            scene.emit(
                EventKind.WARNING,
                f"The limits are {watch.loosened:.0f} times wider now: {reason}.",
            )

    # Which step comes when

    def enter(self, kind: StepKind) -> None:
        """Begin a step, or come back to it."""
        scene = self.scene
        self.step = kind
        self.skipped.pop(kind, None)
        kept = scene.run.kept
        if kind is StepKind.SETTLE:
            self.restart_run()
        elif kept is not None and (kind is StepKind.VALIDATE or kept.ticks):
            # One placement is one measurement: a repeat begins with a move.
            scene.run.used = kind is not StepKind.ROTATIONS
        if kind is StepKind.RESULT:
            # What is fitted on the way into the result stays what it is.
            self._finish()
            scene.run.complete = kept is not None
        scene.watch.rest()
        self.stage.enter()

    def advance(self) -> None:
        """The step has all it needs: on to the next that does not."""
        scene = self.scene
        scene.emit(EventKind.STEP_DONE, f"{TITLES[self.step]} done.")
        self.go_on()

    def go_on(self) -> None:
        """Enter the next step that is neither finished nor skipped."""
        if self.step is StepKind.SETTLE and self.return_to is not None:
            kind, self.return_to = self.return_to, None
            self.enter(kind)
            return
        kinds = self.scene.procedure.kinds
        for kind in kinds[kinds.index(self.step) + 1 :]:
            if kind in MEASURING and (self.stages[kind].finished or kind in self.skipped):
                continue
            if kind is StepKind.ROTATIONS and not self.scene.has_gyroscope:
                self.skipped[kind] = "the stream has no gyroscope"
                self.scene.emit(EventKind.STEP_SKIPPED, "No gyroscope: no rotations.")
                continue
            self.enter(kind)
            if kind is StepKind.RESULT:
                self.scene.emit(EventKind.FINISHED, "Everything is measured.")
            return

    def restart_run(self) -> None:
        """A hold begins now, whatever the device did before."""
        self._finish()
        self._builder.drop()
        self._fresh()
        self.scene.still = False
        self.scene.held = 0.0

    # At the operator's word

    def take(self) -> str:
        """Keep the newest seconds as a hand-held hold; why not, or ""."""
        scene, needed = self.scene, self.stage.seconds
        if not self.asking:
            return "nothing is asked for in this step"
        moments = self._newest(needed)
        if len(moments) < WINDOW_BLOCKS:
            return "too little has arrived since the last hold"
        hold = replace(hold_from(join_blocks([m.block for m in moments])), hand_held=True)
        if not np.isfinite(hold.accelerometer).all():
            return "the newest readings are not numbers"
        self.restart_run()
        kept = self._keep(hold)
        scene.run.complete = True
        self._tell(kept)
        scene.run.used = True
        return ""

    def _newest(self, seconds: float) -> list[Moment]:
        """The newest moments that no kept hold has, without a gap between them."""
        wanted = math.ceil(seconds / self._recent[-1].seconds - ALMOST) if self._recent else 0
        kept = (*self.scene.ledger.holds[-1:], *self.scene.ledger.validation[-1:])
        since = max((entry.hold.end for entry in kept), default=-math.inf)
        newest: list[Moment] = []
        for moment in reversed(self._recent):
            if len(newest) == wanted or float(moment.block.start[0]) < since:
                break
            newest.append(moment)
            if bool(moment.block.gap[0]):
                break
        return newest[::-1]

    def end(self) -> None:
        """The data have ended."""
        self.restart_run()

    def collected(self) -> Collected:
        """Everything kept; a hold that is still growing as long as it is by now."""
        run = self.scene.run
        kept, grown = run.kept, self._builder.hold()
        if kept is None or run.complete or grown is None:
            return self.scene.ledger.collected()
        before = kept.hold
        kept.update(grown)
        try:
            return self.scene.ledger.collected()
        finally:
            kept.hold = before
