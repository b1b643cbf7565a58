"""A hand that holds, turns and lays down the device; it knows exactly what it does.

Commands come from any thread: keys (``turn``, ``snap_to``, ``tremble``), a script (``perform``), or
what the wizard asks for (``follow``). They are carried out one after the other, at sample times;
whoever makes the samples calls ``advance``.
"""

import threading
from collections import deque
from collections.abc import Iterable
from dataclasses import fields

import numpy as np

from imucal_wizard.devices.virtual.actions import (
    Action,
    PassSteel,
    Place,
    Rest,
    Tremble,
    Turn,
    check,
)
from imucal_wizard.devices.virtual.asks import StatusLike
from imucal_wizard.devices.virtual.follow import Follower
from imucal_wizard.devices.virtual.motion import Motion
from imucal_wizard.devices.virtual.moves import Mover
from imucal_wizard.devices.virtual.words import Words
from imucal_wizard.errors import UsageError
from imucal_wizard.readings import FloatArray

REACTION = 1.5
"""From the wizard's word to the hand's move, s of samples."""
PREVIEW = 2.0
"""What a device that waits for the wizard puts out before the first word, s of samples."""
FASTEST = 100_000.0
"""Samples per second that are made at most: no IMU gives more, and more would fill the memory."""


class VirtualHand:
    """The true motion of the virtual device.

    Args:
        rate: samples per second.
        seed: of everything that is by chance in a hand: errors of placement, wobble, tremor.
        up: the pose it starts in, lying at rest.
        shaken: when it follows the wizard, it holds every third pose on a support that vibrates.

    Raises:
        UsageError: the rate is not between 0 and ``FASTEST``, or there is no such pose.
    """

    def __init__(
        self, rate: float = 100.0, seed: int = 0, up: str = "+z", *, shaken: bool = False
    ) -> None:
        if not 0.0 < rate <= FASTEST:
            raise UsageError(f"a rate of {rate:g} samples per second cannot be; give one like 100")
        self._rate = rate
        self._mover = Mover(rate, seed, up)
        self._lock = threading.RLock()
        self._queue: deque[Action] = deque()
        self._follower = Follower()
        self._follower.shaken = shaken
        self._words = Words(round(REACTION * rate), round(PREVIEW * rate))

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
        """Whether it moves, or has something left to do."""
        with self._lock:
            return bool(self._queue) or self._mover.left > 0

    @property
    def up(self) -> FloatArray:
        """Up direction in the body frame at the end of the present move, shape (3,)."""
        with self._lock:
            return self._mover.up

    @property
    def shaken(self) -> bool:
        """Whether it holds every third pose on a support that vibrates."""
        return self._follower.shaken

    @property
    def trembling(self) -> bool:
        """Whether the device is held in the hand."""
        return self._mover.trembling

    def turn(self, axis: str, degrees: float, *, fastest: float | None = None) -> None:
        """Turn about a body axis next; turns about the same axis that still wait are one turn.

        Raises:
            UsageError: the axis is not x, y or z.
        """
        check(Turn(axis, degrees, fastest))
        with self._lock:
            last = self._queue[-1] if self._queue else None
            if isinstance(last, Turn) and (last.axis, last.fastest) == (axis, fastest):
                self._queue.pop()
                degrees += last.degrees
            self._queue.append(Turn(axis, degrees, fastest))

    def snap_to(self, target: str | tuple[float, float, float]) -> None:
        """Bring a pose (``+x-y``) or an up direction on top, as well as a hand can.

        Raises:
            UsageError: no such pose.
        """
        self.perform([Place(target)])

    def tremble(self, on: bool) -> None:
        """Hold the device in the hand, or lay it down."""
        self.perform([Tremble(on)])

    def pass_steel(self) -> None:
        """Let something of steel pass by, at once and whatever it is doing."""
        with self._lock:
            self._mover.begin(PassSteel())

    def rest(self, seconds: float) -> None:
        """Do nothing for a while before the next command."""
        self.perform([Rest(seconds)])

    def perform(self, script: Iterable[Action]) -> None:
        """Do all of this, in order, after what was asked before.

        Raises:
            UsageError: a pose or an axis that there is not; then nothing of it is done.
        """
        actions = list(script)
        for action in actions:
            check(action)
        with self._lock:
            self._queue.extend(actions)

    def drop(self) -> None:
        """Forget what has not begun yet."""
        with self._lock:
            self._queue.clear()

    def follow(self, status: StatusLike, samples: int) -> None:
        """Do what the wizard asks for, ``REACTION`` after the samples it is about.

        Args:
            status: what the procedure says (``procedure.state.Status``).
            samples: how many of the device's samples it has judged.
        """
        with self._lock:
            self._words.hear(status, samples)

    @property
    def ahead(self) -> int | None:
        """Samples it may go on before the wizard is heard again; None: any number."""
        with self._lock:
            horizon = self._words.horizon
            return None if horizon is None else max(0, horizon - self._mover.sample)

    @property
    def halting(self) -> bool:
        """Whether the wizard asks nothing of it now: it makes no more than the reaction time."""
        with self._lock:
            return self._words.halting

    @property
    def standing(self) -> bool:
        """Whether it waits, as long as it takes, for a wizard that asks nothing of it now."""
        with self._lock:
            return self._words.standing and self.ahead == 0

    def heed(self) -> None:
        """Wait for the wizard's word from now on."""
        with self._lock:
            self._words.listen()

    def unhand(self) -> None:
        """Stop waiting for the wizard until it speaks again."""
        with self._lock:
            self._words.forget()

    def advance(self, n: int) -> Motion:
        """The next ``n`` samples of true motion; what they are does not depend on ``n``."""
        parts = []
        with self._lock:
            while n > 0:
                self._react()
                due = self._words.before(self._mover.sample)
                most = n if due is None else min(n, due)
                if self._mover.left <= 0 and not self._begin():
                    self._mover.idle(most)
                count = min(most, self._mover.left)
                parts.append(self._mover.advance(count))
                n -= count
        return _joined(parts)

    def remaining(self, most: int) -> int:
        """Samples left of what it is doing, at most ``most``; 0 when there is nothing to do."""
        with self._lock:
            if self._mover.left <= 0:
                self._begin()
            return min(most, self._mover.left)

    def _react(self) -> None:
        """Act on the words that are due; one from before the last move's end is out of date."""
        mover = self._mover
        while (word := self._words.take(mover.sample)) is not None:
            seen, status = word
            rested = (seen - mover.rest_since) / self._rate
            if not self.busy and rested > 0.0:
                self._queue.extend(self._follower.decide(status, rested, mover.up))

    def _begin(self) -> bool:
        """Begin the next command that takes time; False when there is none."""
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
