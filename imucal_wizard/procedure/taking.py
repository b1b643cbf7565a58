"""From a run that is long enough to a hold that is kept, and the motion that led to it."""

import math
from collections import deque
from dataclasses import replace

import numpy as np

from imucal_wizard.procedure.blocks import ALMOST, join_blocks
from imucal_wizard.procedure.doubts import frozen_axis
from imucal_wizard.procedure.holding import Holding
from imucal_wizard.procedure.holds import Hold, hold_from
from imucal_wizard.procedure.ledger import KeptHold, KeptRotation
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.rotation_check import fault_of
from imucal_wizard.procedure.route import Route
from imucal_wizard.procedure.scene import Scene
from imucal_wizard.procedure.state import EventKind, StepKind
from imucal_wizard.procedure.stillness import WINDOW_BLOCKS


class Taking:
    """Keeps holds, by themselves or at the operator's word, and tells the step at work."""

    def __init__(self, scene: Scene, holding: Holding, route: Route) -> None:
        self._scene = scene
        self._holding = holding
        self._route = route
        longest = max(stage.seconds for stage in route.stages.values())
        self._recent: deque[Moment] = deque(maxlen=max(round(longest * 10.0), WINDOW_BLOCKS) + 1)

    def remember(self, moment: Moment) -> None:
        """Take the next moment, in case it is wanted hand-held."""
        self._recent.append(moment)

    def consider(self) -> None:
        """Take the hold once it is long enough, and tell the step of it, once."""
        run, route = self._scene.run, self._route
        if not route.asking or run.used or route.step in run.told:
            return
        if self._holding.counted < route.stage.seconds - ALMOST:
            return
        if run.kept is None:
            hold = self._holding.hold()
            if hold is not None:
                if self._scene.watch.tighten(route.stage.seconds):
                    self._scene.emit(EventKind.WARNING, "It is calm again: so are the limits.")
                self._tell(self._keep(hold))
                self._doubt()
        else:
            self._holding.finish()
            self._scene.motion = None
            self._tell(run.kept)

    def hand_held(self) -> str:
        """Keep the newest seconds as a hand-held hold; why not, or ""."""
        if not self._route.asking:
            return "nothing is asked for in this step"
        moments = self._newest(self._route.stage.seconds)
        if len(moments) < WINDOW_BLOCKS:
            return "too little has arrived since the last hold"
        hold = replace(hold_from(join_blocks([m.block for m in moments])), hand_held=True)
        if not np.isfinite(hold.accelerometer).all():
            return "the newest readings are not numbers"
        self._holding.restart()
        run = self._scene.run
        kept = self._keep(hold)
        run.complete = run.used = True
        self._tell(kept)
        return ""

    def _keep(self, hold: Hold) -> KeptHold:
        """A new hold, and the motion that led to it."""
        scene = self._scene
        kept = KeptHold(hold, self._route.step)
        scene.run.kept = kept
        scene.motion = self._motion(kept)
        if not scene.ledger.holds:
            scene.upright.begin(hold.accelerometer)
        scene.ledger.add_hold(kept)
        scene.upright.learn([entry.hold.accelerometer for entry in scene.ledger.holds])
        if scene.motion is not None:
            scene.ledger.add_rotation(scene.motion)
        return kept

    def _doubt(self) -> None:
        """Say so when an axis looks clipped or dead in this hold."""
        scene, window = self._scene, self._recent[-1].window
        text = frozen_axis(window, self._route.settle.noise, scene.resolution.steps[0])
        if text:
            scene.emit(EventKind.WARNING, text)

    def _tell(self, kept: KeptHold) -> None:
        scene, route = self._scene, self._route
        scene.run.told.add(route.step)
        route.stage.completed(kept)
        if not kept.dropped:
            scene.passage.rest(kept)
        scene.watch.rest()
        if route.stage.finished:
            route.advance()

    def _motion(self, kept: KeptHold) -> KeptRotation | None:
        """The motion from the last kept hold to this one; None where there was none."""
        passage = self._scene.passage
        before = passage.before
        if before is None or before.dropped or not passage.moved:
            return None
        if StepKind.VALIDATE in (before.step, kept.step):
            return None
        samples = passage.samples(kept)
        if samples is None:
            return None
        motion = KeptRotation(
            before, kept, samples.time, samples.rate, samples.acceleration, self._route.step
        )
        motion.problem = fault_of(motion, self._scene.gyroscope_range, missing=samples.missing)
        return motion

    def _newest(self, seconds: float) -> list[Moment]:
        """The newest moments that no kept hold has, without a gap between them."""
        wanted = math.ceil(seconds / self._recent[-1].seconds - ALMOST) if self._recent else 0
        ledger = self._scene.ledger
        kept = (*ledger.holds[-1:], *ledger.validation[-1:])
        since = max((entry.hold.end for entry in kept), default=-math.inf)
        newest: list[Moment] = []
        for moment in reversed(self._recent):
            if len(newest) == wanted or float(moment.block.start[0]) < since:
                break
            newest.append(moment)
            if bool(moment.block.gap[0]):
                break
        return newest[::-1]
