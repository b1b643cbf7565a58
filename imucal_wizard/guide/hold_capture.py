"""Makes holds and the motions between them from blocks."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from imucal_wizard.core.limits.procedure import (
    MAX_HOLD_SECONDS,
    MAX_MOTION_SECONDS,
    MOTION_REACH_BLOCKS,
)
from imucal_wizard.core.limits.stillness import (
    GUARD_BLOCKS,
    MAX_TRIMMED_BLOCKS,
    MIN_SLOW_MOMENT,
    MIN_TURN_DEG,
    TIME_TOLERANCE,
    WINDOW_BLOCKS,
)
from imucal_wizard.core.quantities import plural
from imucal_wizard.guide.context import Context, StillRun
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.guide.live_checks import reject_clipped
from imucal_wizard.guide.measurements import KeptHold, KeptRotation
from imucal_wizard.measurement.blocks import Blocks, join_blocks
from imucal_wizard.measurement.holds import Collected, Hold, HoldBuilder, hold_from, slow_and_fast
from imucal_wizard.measurement.segmentation import turning_rates
from imucal_wizard.measurement.stillness import Block

BLOCKS_PER_SECOND = 10.0
"""Upper limit: a block lasts at least 0.1 s."""
MAX_SEARCH_SECONDS = 300.0
"""Seconds without a hold whose motion a hold is compared with."""


class HoldCapture:
    """Collects the blocks of the present still run; its hold grows while the device is still.

    Args:
        context: shared by all steps.
        longest: the longest hold that any step needs, s.
        take_back: takes back a kept hold whose rest as a whole is none.
    """

    def __init__(
        self, context: Context, longest: float, take_back: Callable[[KeptHold], None]
    ) -> None:
        self._context = context
        self._take_back = take_back
        self._builder = HoldBuilder()
        self._earlier = 0.0
        self._motion = MotionBuffer(context)
        newest = max(round(longest * BLOCKS_PER_SECOND), WINDOW_BLOCKS) + 1
        self._newest: deque[Block] = deque(maxlen=newest)
        self._since: deque[Blocks] = deque(maxlen=round(MAX_SEARCH_SECONDS * BLOCKS_PER_SECOND))

    def add(self, block: Block) -> None:
        """Take the next block, still or not."""
        self._newest.append(block)
        self._since.append(block.summary)
        self._builder.add(block.summary, block.window, self._context.still)
        self._motion.add(block, still=self._context.still)
        run = self._context.run
        if self._builder.seconds >= MAX_HOLD_SECONDS:
            if run.kept is not None:
                self.finish()
                self._earlier += self._builder.seconds
                run.complete = True
            self._builder.drop()

    @property
    def seconds(self) -> float:
        """Duration of the run without its guards, s."""
        return self._builder.seconds

    @property
    def counted(self) -> float:
        """Seconds of the run that count for the step; 0 if the device must be moved first."""
        run = self._context.run
        if run.used:
            return 0.0
        return self._builder.seconds + (self._earlier if run.kept is not None else 0.0)

    def hold(self) -> Hold | None:
        """The hold of the present rest, or None."""
        return self._hold_in_rest()

    def _hold_in_rest(self, kept: Hold | None = None) -> Hold | None:
        """See ``HoldBuilder.hold``."""
        context, limits = self._context, self._context.watch.limits
        rest = None if limits is None else limits.gyroscope_mean
        most = math.radians(MIN_TURN_DEG) if context.units.gyroscope_known else 0.0
        steps = context.resolution.steps
        hold = self._builder.hold(context.up_estimate.radius, *steps, (rest, most), kept)
        if hold is None or hold.gyroscope is None or rest is None:
            return hold
        if limits is None or limits.rate is None:
            return hold
        # limits that were widened allow for more noise, and not for a hold that turns
        turns = np.abs(hold.gyroscope - rest) > limits.rate / context.watch.loosened
        return None if turns.any() else hold

    def slow_moment(self, hold: Hold) -> bool:
        """Whether a hold is only a slow moment of a device that has not been put down.

        A hold that hardly sways is a rest. One that sways as far as a hand may must be far slower
        than the motion since the last hold, by the same rule as the holds of a recording.
        """
        if not self._since:
            return False
        context, blocks = self._context, join_blocks(list(self._since))
        gravity, (step_a, _) = context.up_estimate.radius, context.resolution.steps
        inside = np.flatnonzero((blocks.start >= hold.start) & (blocks.end <= hold.end))
        if len(inside) < 2:
            return False
        own = blocks.select(slice(int(inside[0]), int(inside[-1]) + 1))
        if slow_and_fast(own, step_a)[0] < (MIN_SLOW_MOMENT * gravity) ** 2:
            return False
        return turning_rates(blocks, gravity, [hold])[2]

    def newest(self, seconds: float) -> Hold | None:
        """A hold of the newest seconds after the last kept hold, still or not; None if too few."""
        wanted = (
            math.ceil(seconds / self._newest[-1].seconds - TIME_TOLERANCE) if self._newest else 0
        )
        own = self._context.measurements
        kept = (*own.holds[-1:], *own.validation[-1:])
        since = max((entry.hold.end for entry in kept), default=-math.inf)
        blocks: list[Block] = []
        for block in reversed(self._newest):
            if len(blocks) == wanted or float(block.summary.start[0]) < since:
                break
            blocks.append(block)
            if bool(block.summary.gap[0]):
                break
        if len(blocks) < WINDOW_BLOCKS:
            return None
        return replace(hold_from(join_blocks([b.summary for b in blocks[::-1]])), hand_held=True)

    def keep(self, hold: Hold, step: StepKind) -> KeptHold:
        """Keep a new hold of a step, and the motion before it."""
        context = self._context
        kept = KeptHold(hold, step)
        context.run.kept = kept
        context.motion = self._motion.to(kept)
        if not context.measurements.holds:
            context.up_estimate.begin(hold.accelerometer)
        context.measurements.add_hold(kept)
        readings = [entry.hold.accelerometer for entry in context.measurements.holds]
        context.up_estimate.learn(readings)
        if context.motion is not None:
            context.measurements.add_rotation(context.motion)
            self._check_clipping()
        return kept

    def _check_clipping(self) -> None:
        """Reject the rotations that reached the end of the range, as far as it shows by now."""
        context, own = self._context, self._context.measurements
        units, limit = context.units.gyroscope, context.gyroscope_range
        found = reject_clipped(own.rotations, limit, units)
        earlier = sum(own.discount(one) for one in found if one is not context.motion)
        if earlier:
            text = (
                f"The gyroscope clips: {plural(earlier, 'earlier rotation')} no longer counted. "
                "Rotate more slowly."
            )
            context.emit(EventKind.WARNING, text)

    def rest_in(self, kept: KeptHold) -> None:
        """Note that the device rests in a kept hold, from which the next motion starts."""
        if not kept.dropped:
            self._motion.rest_in(kept, growing=not self._context.run.complete)

    def finish(self) -> None:
        """Extend the kept hold to its whole rest; its gyroscope mean is the new resting rate.

        A slow motion may rest for as long as a step needs. As in a recording, the whole rest
        decides whether it is one, so a hold that was taken before may be taken back.
        """
        context = self._context
        kept = context.run.kept
        if kept is None:
            return
        if not kept.dropped and not context.run.complete:
            grown = self._grown(kept)
            if grown is None:
                self._take_back(kept)
                return
            kept.update(grown)
            self._motion.begin_after(grown)
            if kept.hold.gyroscope is not None and context.watch.loosened == 1.0:
                context.watch.rest_at(kept.hold.gyroscope)
        self._since.clear()

    def _grown(self, kept: KeptHold) -> Hold | None:
        """A kept hold with what its rest has gained since; None if that is no hold.

        Limits that were widened find the slow moments of a motion, too: where they are, the whole
        rest is compared with the motion before it. That of the settle step is judged by its noise.
        """
        grown = self._hold_in_rest(kept.hold)
        wide = self._context.watch.loosened > 1.0
        if grown is not None and not (wide and self.slow_moment(grown)):
            return grown
        return kept.hold if kept.step is StepKind.SETTLE else None

    def fresh(self) -> None:
        """Begin a new run: the device moves."""
        self._context.run = StillRun()
        self._earlier = 0.0

    def restart(self) -> None:
        """End the present run; a new hold begins now."""
        self.finish()
        self._builder.drop()
        self.fresh()
        self._context.still = False
        self._context.held = 0.0

    def collected(self) -> Collected:
        """All measurements; a hold in progress has its present length."""
        run, own = self._context.run, self._context.measurements
        kept = run.kept
        if kept is None or kept.dropped or run.complete:
            return own.collected()
        grown = self._grown(kept)
        if grown is None:
            return own.collected(without=kept)
        before = kept.hold
        kept.update(grown)
        try:
            return own.collected()
        finally:  # asking for the measurements changes no decision
            kept.hold = before


class MotionBuffer:
    """The samples since the last kept hold, at most MAX_MOTION_SECONDS of them."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._blocks: deque[Block] = deque()
        self._seconds = 0.0
        self._moved = False

    def rest_in(self, kept: KeptHold, *, growing: bool) -> None:
        """Note that the device rests in a kept hold.

        Where a growing hold ends is known when the device moves: until then, all samples are kept.
        Of another one only those at its end are.
        """
        self._context.start, self._context.start_lost, self._moved = kept, "", False
        while not growing and len(self._blocks) > GUARD_BLOCKS + MAX_TRIMMED_BLOCKS + 1:
            self._drop()

    def begin_after(self, hold: Hold) -> None:
        """Begin the motion with the last block of a hold, which has its whole length now."""
        while len(self._blocks) > 1 and self._blocks[1].summary.start[0] < hold.end:
            self._drop()
        if self._blocks and self._blocks[0].summary.start[0] > hold.end + TIME_TOLERANCE:
            self._lose()

    def add(self, block: Block, *, still: bool) -> None:
        """Take the next block."""
        self._moved |= not still
        self._blocks.append(block)
        self._seconds += block.seconds
        while self._seconds > MAX_MOTION_SECONDS:
            self._drop()
            if self._moved:
                self._lose()

    def _drop(self) -> None:
        self._seconds -= self._blocks.popleft().seconds

    def _lose(self) -> None:
        """The beginning of the motion is no longer known."""
        if self._context.start is not None:
            self._context.start = None
            self._context.start_lost = f"it took longer than {MAX_MOTION_SECONDS:.0f} s"

    def to(self, after: KeptHold) -> KeptRotation | None:
        """The motion from the last kept hold to this one, or None."""
        before = self._context.start
        if before is None or before.dropped or not self._moved:
            return None
        if StepKind.VALIDATE in (before.step, after.step):
            return None
        blocks = self._between(before, after)
        rates = [block.rate for block in blocks if block.rate is not None]
        if not rates:
            return None
        rate = np.concatenate(rates)
        time = np.concatenate([block.time for block in blocks])
        acceleration = np.concatenate([block.acceleration for block in blocks])
        motion = KeptRotation(before, after, time, rate, acceleration, after.step)
        # The gap flag of the first block concerns the time before it.
        broken = any(bool(block.summary.gap[0]) for block in blocks[1:])
        missing = broken or not bool(np.isfinite(rate).all())
        motion.problem = "samples are missing in it" if missing else None
        return motion

    def _between(self, before: KeptHold, after: KeptHold) -> list[Block]:
        """The blocks from the last one in ``before`` to some within ``after``.

        The start of ``after`` may still be trimmed, so the motion extends a little into it.
        """
        begin = before.hold.end
        blocks = [block for block in self._blocks if float(block.summary.start[0]) < begin]
        later = [block for block in self._blocks if float(block.summary.start[0]) >= begin]
        blocks = blocks[-1:] + later
        past = sum(float(block.summary.start[0]) <= after.hold.start for block in blocks)
        return blocks[: past + MOTION_REACH_BLOCKS]
