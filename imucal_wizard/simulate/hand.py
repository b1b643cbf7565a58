"""The virtual hand: it holds, rotates and lays down the device with a known true motion.

Commands come from the operator (``turn``, ``snap_to``, ``tremble``), from a script (``perform``),
or from the procedure's instructions (``follow``). The hand executes them one after the other at
sample times, when ``advance`` makes the samples. A lock admits commands from another thread.
"""

import threading
from collections import deque
from collections.abc import Iterable
from dataclasses import fields

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.instruction import Instruction
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.simulate.actions import (
    Action,
    LieStill,
    PassSteel,
    PlacePose,
    Rotate,
    Tremble,
    check_action,
)
from imucal_wizard.simulate.follow import Follower
from imucal_wizard.simulate.motion import Motion
from imucal_wizard.simulate.moves import Mover

REACTION_SECONDS = 1.5
"""Time from an instruction to the hand's motion, s of samples."""
PREVIEW_SECONDS = 2.0
"""Time of samples made before the first instruction if the hand follows, s."""
MAX_RATE = 100_000.0
"""Largest number of samples per second: no IMU is faster, and more would fill the memory."""
UNATTENDED_STEPS = ("source", "result", "save", "verdict")
"""Steps in which nobody moves the device."""


class VirtualHand:
    """The true motion of the virtual device.

    A following hand acts on each instruction ``REACTION_SECONDS`` after the sample to which the
    instruction refers, and no sample is made beyond that time. The motion therefore depends neither
    on the playback speed nor on the pieces in which the samples are read. In the steps in which
    nobody moves the device, it stands still until the next instruction.

    Args:
        rate: samples per second.
        seed: seed of the random quantities of a hand: placement errors, wobble, tremor.
        up: the initial pose, at rest.
        shaken: whether a following hand holds every third pose on a vibrating support.
        following: it follows the procedure's instructions.

    Raises:
        UsageError: the rate is not between 0 and ``MAX_RATE``, or there is no such pose.
    """

    def __init__(
        self,
        rate: float = 100.0,
        seed: int = 0,
        up: str = "+z",
        *,
        shaken: bool = False,
        following: bool = False,
    ) -> None:
        if not 0.0 < rate <= MAX_RATE:
            raise UsageError(f"a rate of {rate:g} samples per second is impossible; give 100")
        self._rate = rate
        self._mover = Mover(rate, seed, up)
        self._lock = threading.RLock()
        self._queue: deque[Action] = deque()
        self._follower = Follower(shaken=shaken)
        self._instructions: deque[tuple[int, Instruction]] = deque()
        self._step = UNATTENDED_STEPS[0]
        self._following = following
        self._horizon = round(PREVIEW_SECONDS * rate) if following else None

    @property
    def sample(self) -> int:
        """Index of the next sample."""
        return self._mover.sample

    @property
    def time(self) -> float:
        """Sample time of the next sample, s."""
        return self._mover.sample / self._rate

    @property
    def busy(self) -> bool:
        """Whether it moves or has actions left."""
        with self._lock:
            return bool(self._queue) or self._mover.left > 0

    @property
    def up(self) -> FloatArray:
        """Up direction in the body frame at the end of the current move, shape (3,)."""
        with self._lock:
            return self._mover.up

    @property
    def trembling(self) -> bool:
        """Whether the device is held in the hand."""
        return self._mover.trembling

    def turn(self, axis: str, degrees: float) -> None:
        """Rotate about a body axis next; waiting rotations about the same axis are joined.

        Raises:
            UsageError: the axis is not x, y or z, or the angle is impossible.
        """
        check_action(Rotate(axis, degrees))
        with self._lock:
            self.following = False
            last = self._queue[-1] if self._queue else None
            if isinstance(last, Rotate) and (last.axis, last.fastest) == (axis, None):
                self._queue.pop()
                degrees += last.degrees
            self._queue.append(Rotate(axis, degrees))

    def snap_to(self, target: str | tuple[float, float, float]) -> None:
        """Bring a pose (``+x-y``) or an up direction on top, with the accuracy of a hand.

        Raises:
            UsageError: no such pose.
        """
        with self._lock:
            self.following = False
            self.perform([PlacePose(target)])

    def tremble(self, on: bool) -> None:
        """Hold the device in the hand, or lay it down."""
        self.perform([Tremble(on)])

    def pass_steel(self) -> None:
        """Let a steel object pass by immediately, during any action."""
        with self._lock:
            self._mover.begin(PassSteel())

    def rest(self, seconds: float) -> None:
        """Lie still for a while before the next action.

        Raises:
            UsageError: the duration is impossible.
        """
        self.perform([LieStill(seconds)])

    def perform(self, script: Iterable[Action]) -> None:
        """Append these actions to the queue.

        Raises:
            UsageError: an action is impossible; then none is queued.
        """
        actions = list(script)
        for action in actions:
            check_action(action)
        with self._lock:
            self._queue.extend(actions)

    @property
    def following(self) -> bool:
        """Whether it follows the procedure's instructions."""
        return self._following

    @following.setter
    def following(self, on: bool) -> None:
        with self._lock:
            if self._following and not on:
                self._queue.clear()
                self._instructions.clear()
                self._horizon = None
            self._following = on

    def follow(self, instruction: Instruction, samples: int) -> None:
        """Act on an instruction ``REACTION_SECONDS`` after the samples that it is about.

        Args:
            instruction: the instruction.
            samples: number of the device's samples that the procedure has processed.
        """
        with self._lock:
            waiting = self._instructions
            if waiting and waiting[-1][0] == samples:
                waiting.pop()
            waiting.append((samples, instruction))
            step = instruction.step
            if self._horizon is None or step not in UNATTENDED_STEPS or step != self._step:
                self._horizon = samples + round(REACTION_SECONDS * self._rate)
            self._step = step

    @property
    def ahead(self) -> int | None:
        """Number of samples that may be made before the next instruction; None if unlimited."""
        with self._lock:
            return None if self._horizon is None else max(0, self._horizon - self._mover.sample)

    @property
    def unattended(self) -> bool:
        """Whether the procedure requests nothing: the device stops after ``ahead`` samples."""
        with self._lock:
            return self._horizon is not None and self._step in UNATTENDED_STEPS

    def advance(self, n: int) -> Motion:
        """The next ``n`` samples; the true motion does not depend on the division into calls."""
        parts = []
        with self._lock:
            while n > 0:
                due = self._react()
                most = n if due is None else min(n, due)
                if self._mover.left <= 0 and not self._begin():
                    self._mover.idle(most)
                count = min(most, self._mover.left)
                parts.append(self._mover.advance(count))
                n -= count
        return _joined(parts)

    def remaining(self, most: int) -> int:
        """Remaining samples of the current action, at most ``most``; 0 if the queue is empty."""
        with self._lock:
            if self._mover.left <= 0:
                self._begin()
            return min(most, self._mover.left)

    def _react(self) -> int | None:
        """Act on the due instructions; returns the samples until the next one, or None.

        An instruction from before the end of the last move is out of date.
        """
        mover, reaction = self._mover, round(REACTION_SECONDS * self._rate)
        while self._instructions:
            seen, instruction = self._instructions[0]
            if (due := seen + reaction - mover.sample) > 0:
                return due
            self._instructions.popleft()
            rested = (seen - mover.rest_since) / self._rate
            if not self.busy and rested > 0.0:
                self._queue.extend(self._follower.decide(instruction, rested, mover.up))
        return None

    def _begin(self) -> bool:
        """Begin the next action that takes time; False if there is none."""
        while self._queue:
            if self._mover.begin(self._queue.popleft()):
                return True
        return False


def _joined(parts: list[Motion]) -> Motion:
    if len(parts) == 1:
        return parts[0]
    names = [field.name for field in fields(Motion)]
    shapes = (0, (0, 3), (0, 3), (0, 4), (0, 3), (0, 3), (0, 3))
    empty = Motion(*(np.zeros(shape) for shape in shapes))
    return Motion(*(np.concatenate([getattr(p, name) for p in [empty, *parts]]) for name in names))
