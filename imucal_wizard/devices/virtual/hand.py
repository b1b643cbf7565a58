"""A hand that holds, turns and lays down the device; it knows exactly what it does.

Commands come from any thread: keys (``turn``, ``snap_to``, ``tremble``), a script (``perform``), or
what the wizard asks for (``follow``). They are carried out one after the other, at sample times;
whoever makes the samples calls ``advance``.
"""

import threading
from collections import deque
from collections.abc import Iterable

import numpy as np

from imucal_wizard.devices.virtual import attitude
from imucal_wizard.devices.virtual.actions import (
    AXES,
    Action,
    Place,
    Rest,
    RestUntil,
    Shake,
    Tremble,
    Turn,
    direction,
)
from imucal_wizard.devices.virtual.follow import Follower, StatusLike
from imucal_wizard.devices.virtual.motion import Motion, Stretch, Unrest
from imucal_wizard.devices.virtual.profile import PEAK_OF_MIN_JERK, Wobble
from imucal_wizard.errors import UsageError
from imucal_wizard.readings import FloatArray

LEISURELY_DEG = 130.0
"""Peak rate of a move that is not told how fast, °/s."""
SHORTEST_MOVE = 0.35
"""A hand does not move and stop in less, s."""
TREMBLE_RAMP = 0.5
"""How long it takes to pick the device up or to lay it down, s."""
POSE_AFTER = 1.0
"""A rest this long, s, counts as a pose that the sensor may remember."""


class VirtualHand:
    """The true motion of the virtual device.

    Args:
        rate: samples per second.
        seed: of everything that is by chance in a hand: errors of placement, wobble, tremor.
        up: the pose it starts in, lying at rest.
    """

    def __init__(self, rate: float = 100.0, seed: int = 0, up: str = "+z") -> None:
        self._rate = rate
        self._rng = np.random.default_rng([seed, 1])
        self._unrest = Unrest.drawn(np.random.default_rng([seed, 2]))
        self._lock = threading.RLock()
        self._queue: deque[Action] = deque()
        self._follower = Follower()
        self._sample = 0
        self._rest_since = 0
        self._trembling = False
        self._shake = 0.0
        start = attitude.exp(attitude.shortest_turn(attitude.WORLD_UP, direction(up)))
        self._stretch = Stretch(0, 0, start, np.zeros(3))

    @property
    def time(self) -> float:
        """Sample time of the next sample, s."""
        return self._sample / self._rate

    @property
    def busy(self) -> bool:
        """Whether it moves, or has something left to do."""
        with self._lock:
            return bool(self._queue) or self._sample < self._stretch.first + self._stretch.count

    @property
    def up(self) -> FloatArray:
        """Up direction in the body frame at the end of the present move, shape (3,)."""
        with self._lock:
            return self._up()

    @property
    def trembling(self) -> bool:
        """Whether the device is held in the hand."""
        return self._trembling

    def turn(self, axis: str, degrees: float, *, fastest: float | None = None) -> None:
        """Turn about a body axis next; turns about the same axis that still wait are one turn.

        Raises:
            UsageError: the axis is not x, y or z.
        """
        if axis not in AXES or len(axis) != 1:
            raise UsageError(f"{axis!r} is not an axis; turn about x, y or z")
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
        direction(target)
        self.perform([Place(target)])

    def tremble(self, on: bool) -> None:
        """Hold the device in the hand, or lay it down."""
        self.perform([Tremble(on)])

    def rest(self, seconds: float) -> None:
        """Do nothing for a while before the next command."""
        self.perform([Rest(seconds)])

    def perform(self, script: Iterable[Action]) -> None:
        """Do all of this, in order, after what was asked before."""
        with self._lock:
            self._queue.extend(script)

    def drop(self) -> None:
        """Forget what has not begun yet."""
        with self._lock:
            self._queue.clear()

    def follow(self, status: StatusLike, time: float | None = None) -> None:
        """Do what the wizard asks for now.

        Args:
            status: what the procedure says (``procedure.state.Status``).
            time: device time of the newest sample behind that status, s; taken from
                ``status.elapsed`` when not given.
        """
        with self._lock:
            idle = not self.busy
            rest_since = self._rest_since / self._rate
            self._queue.extend(
                self._follower.react(status, time, self.time, idle, rest_since, self._up())
            )

    @property
    def horizon(self) -> float | None:
        """Sample time up to which it may go before the wizard is heard again; None: any."""
        return self._follower.horizon

    def unhand(self) -> None:
        """Stop waiting for the wizard until it speaks again."""
        self._follower.horizon = None

    def advance(self, n: int) -> Motion:
        """The next ``n`` samples of true motion; what they are does not depend on ``n``."""
        parts = []
        with self._lock:
            while n > 0:
                count = min(n, self._stretch.first + self._stretch.count - self._sample)
                if count <= 0:
                    self._stretch = self._next() or self._lying(n)
                    continue
                samples = np.arange(self._sample, self._sample + count)
                parts.append(self._stretch.at(samples, self._rate, self._unrest))
                self._sample += count
                n -= count
                if self._stretch.turn is not None:
                    self._rest_since = self._sample
        return _joined(parts)

    def remaining(self, most: int) -> int:
        """Samples left of what it is doing, at most ``most``; 0 when there is nothing to do."""
        with self._lock:
            if self._sample >= self._stretch.first + self._stretch.count:
                self._stretch = self._next() or self._stretch
            return min(most, self._stretch.first + self._stretch.count - self._sample)

    def _up(self) -> FloatArray:
        return attitude.to_body(self._stretch.end, attitude.WORLD_UP)

    def _next(self) -> Stretch | None:
        """The stretch that the next command asks for; None when there is none."""
        while self._queue:
            action = self._queue.popleft()
            match action:
                case Rest(seconds):
                    count = round(seconds * self._rate)
                    if count > 0:
                        return self._lying(count)
                case RestUntil(time):
                    count = round(time * self._rate) - self._sample
                    if count > 0:
                        return self._lying(count)
                case Shake(rms):
                    self._shake = rms
                case Tremble(on):
                    if on != self._trembling:
                        return self._ramp(on)
                case Turn(axis, degrees, fastest, error):
                    turn = np.radians(degrees) * np.eye(3)[AXES.index(axis)]
                    return self._move(turn, fastest, error)
                case Place(target, error, fastest):
                    turn = attitude.shortest_turn(self._up(), direction(target))
                    return self._move(turn, fastest, error)
        return None

    def _lying(self, count: int) -> Stretch:
        level = float(self._trembling)
        return self._after(count, tremor=(level, level))

    def _ramp(self, on: bool) -> Stretch:
        levels = float(self._trembling), float(on)
        self._trembling = on
        return self._after(round(TREMBLE_RAMP * self._rate), tremor=levels)

    def _move(self, turn: FloatArray, fastest: float | None, error: float) -> Stretch:
        """A turn as a hand makes it: missed a little, wobbling, and shifting the device."""
        miss = np.clip(self._rng.standard_normal(3), -2.5, 2.5) * np.radians(error)
        swing, phase, shift = np.clip(self._rng.standard_normal((3, 2, 3)), -2.0, 2.0)
        turn = turn + miss
        angle = float(np.sqrt(turn @ turn))
        peak = np.radians(LEISURELY_DEG if fastest is None else fastest)
        seconds = max(SHORTEST_MOVE, PEAK_OF_MIN_JERK * angle / peak)
        size = 0.015 * min(angle, 1.5)
        wobble = Wobble(size * swing / np.array([[1.0], [2.0]]), np.pi * phase)
        rested = (self._sample - self._rest_since) / self._rate >= POSE_AFTER
        return self._after(
            max(1, round(seconds * self._rate)),
            turn=turn,
            wobble=wobble,
            shift=size * shift[0],
            previous=self._up() if rested else self._stretch.previous,
            tremor=(float(self._trembling), float(self._trembling)),
        )

    def _after(
        self,
        count: int,
        *,
        turn: FloatArray | None = None,
        wobble: Wobble | None = None,
        shift: FloatArray | None = None,
        previous: FloatArray | None = None,
        tremor: tuple[float, float] = (0.0, 0.0),
    ) -> Stretch:
        """A stretch that begins where the present one ends."""
        before = self._stretch.previous if previous is None else previous
        start = self._stretch.end
        return Stretch(
            self._sample, max(1, count), start, before, turn, wobble, shift, tremor, self._shake
        )


def _joined(parts: list[Motion]) -> Motion:
    if len(parts) == 1:
        return parts[0]
    names = ("time", "specific_force", "rate", "attitude", "acceleration", "previous")
    empty = Motion(*(np.zeros(shape) for shape in (0, (0, 3), (0, 3), (0, 4), (0, 3), (0, 3))))
    return Motion(*(np.concatenate([getattr(p, name) for p in [empty, *parts]]) for name in names))
