"""Conversion of the hand's actions to segments of motion."""

from dataclasses import replace

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.simulate import attitude
from imucal_wizard.simulate.actions import (
    Action,
    LieStill,
    PassSteel,
    PlacePose,
    Rotate,
    Shake,
    Tremble,
    direction,
)
from imucal_wizard.simulate.motion import (
    MINIMUM_JERK_PEAK,
    HandVibration,
    Motion,
    MotionSegment,
    Wobble,
    bump,
)
from imucal_wizard.simulate.noise import RandomStream, generator

LEISURELY_DEG = 130.0
"""Default peak rate of a move, °/s."""
SHORTEST_MOVE = 0.35
"""Shortest duration of a move, s."""
TREMBLE_RAMP = 0.5
"""Time to pick the device up or to lay it down, s."""
STEEL_SECONDS = 1.6
"""Time in which a steel object passes by, s."""
POSE_AFTER = 1.0
"""Rest after which a pose counts for the hysteresis of the sensor, s."""


class Mover:
    """The attitude of the device and the current segment of motion.

    Args:
        rate: samples per second.
        seed: seed of placement errors, wobble and tremor.
        up: the initial pose, at rest.

    Attributes:
        sample: index of the next sample.
        rest_since: index of the first sample after the last move.
        trembling: whether the device is held in the hand.
    """

    def __init__(self, rate: float, seed: int, up: str) -> None:
        self._rate = rate
        self._rng = generator(seed, RandomStream.HAND)
        self._unrest = HandVibration.drawn(generator(seed, RandomStream.TREMOR))
        self._shake = 0.0
        self._steel: tuple[int, FloatArray] | None = None
        self.sample = 0
        self.rest_since = 0
        self.trembling = False
        start = attitude.rotation_quaternion(
            attitude.shortest_rotation(attitude.WORLD_UP, direction(up))
        )
        self._stretch = MotionSegment(0, 0, start, np.zeros(3))

    @property
    def left(self) -> int:
        """Remaining samples of the current segment."""
        return self._stretch.first + self._stretch.count - self.sample

    @property
    def up(self) -> FloatArray:
        """Up direction in the body frame at the end of the current segment."""
        return attitude.to_body(self._stretch.end, attitude.WORLD_UP)

    def begin(self, action: Action) -> bool:
        """Begin an action; False if it takes no time."""
        stretch = self._stretch_of(action)
        if stretch is not None:
            self._stretch = stretch
        return stretch is not None

    def idle(self, count: int) -> None:
        """Lie still for this number of samples."""
        self._stretch = self._lying(count)

    def advance(self, count: int) -> Motion:
        """The next samples of the current segment; ``count`` is at most ``left``."""
        samples = np.arange(self.sample, self.sample + count)
        self.sample += count
        if self._stretch.turn is not None:
            self.rest_since = self.sample
        motion = self._stretch.at(samples, self._rate, self._unrest)
        if self._steel is None:
            return motion
        first, field = self._steel
        share = np.clip((samples - first) / (STEEL_SECONDS * self._rate), 0.0, 1.0)
        return replace(motion, disturbance=bump(share)[0][:, None] * field)

    def _stretch_of(self, action: Action) -> MotionSegment | None:
        match action:
            case LieStill(seconds):
                count = round(seconds * self._rate)
                return self._lying(count) if count > 0 else None
            case Shake(rms):
                self._shake = rms
                return None
            case PassSteel(field):
                self._steel = self.sample, np.array(field)
                return None
            case Tremble(on):
                return self._ramp(on) if on != self.trembling else None
            case Rotate(axis, degrees, fastest, error):
                turn = np.radians(degrees) * np.eye(3)[AXES.index(axis)]
                return self._move(turn, fastest, error)
            case PlacePose(target, error, fastest):
                turn = attitude.shortest_rotation(self.up, direction(target))
                return self._move(turn, fastest, error)

    def _lying(self, count: int) -> MotionSegment:
        level = float(self.trembling)
        return self._after(count, tremor=(level, level))

    def _ramp(self, on: bool) -> MotionSegment:
        levels = float(self.trembling), float(on)
        self.trembling = on
        return self._after(round(TREMBLE_RAMP * self._rate), tremor=levels)

    def _move(self, turn: FloatArray, fastest: float | None, error: float) -> MotionSegment:
        """A rotation by hand: with placement error, wobble and a shift of the device."""
        miss = np.clip(self._rng.standard_normal(3), -2.5, 2.5) * np.radians(error)
        swing, phase, shift = np.clip(self._rng.standard_normal((3, 2, 3)), -2.0, 2.0)
        turn = turn + miss
        angle = float(np.sqrt(turn @ turn))
        peak = np.radians(LEISURELY_DEG if fastest is None else fastest)
        seconds = max(SHORTEST_MOVE, MINIMUM_JERK_PEAK * angle / peak)
        size = 0.015 * min(angle, 1.5)
        wobble = Wobble(size * swing / np.array([[1.0], [2.0]]), np.pi * phase)
        rested = (self.sample - self.rest_since) / self._rate >= POSE_AFTER
        return self._after(
            max(1, round(seconds * self._rate)),
            turn=turn,
            wobble=wobble,
            shift=size * shift[0],
            previous=self.up if rested else self._stretch.previous,
            tremor=(float(self.trembling), float(self.trembling)),
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
    ) -> MotionSegment:
        """A segment that begins at the end of the current one."""
        before = self._stretch.previous if previous is None else previous
        start = self._stretch.end
        return MotionSegment(
            self.sample, max(1, count), start, before, turn, wobble, shift, tremor, self._shake
        )
