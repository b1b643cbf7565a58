"""How a hand carries out one command: which stretch of motion it makes of it."""

from dataclasses import replace

import numpy as np

from imucal_wizard.devices.virtual import attitude
from imucal_wizard.devices.virtual.actions import (
    AXES,
    Action,
    PassSteel,
    Place,
    Rest,
    Shake,
    Tremble,
    Turn,
    direction,
)
from imucal_wizard.devices.virtual.chance import Chance, generator
from imucal_wizard.devices.virtual.motion import Motion, Stretch, Unrest
from imucal_wizard.devices.virtual.profile import PEAK_OF_MIN_JERK, Wobble, bump
from imucal_wizard.readings import FloatArray

LEISURELY_DEG = 130.0
"""Peak rate of a move that is not told how fast, °/s."""
SHORTEST_MOVE = 0.35
"""A hand does not move and stop in less, s."""
TREMBLE_RAMP = 0.5
"""How long it takes to pick the device up or to lay it down, s."""
STEEL_SECONDS = 1.6
"""How long steel takes to pass by."""
POSE_AFTER = 1.0
"""A rest this long, s, counts as a pose that the sensor may remember."""


class Mover:
    """Where the device is, and the stretch of motion it is in.

    Args:
        rate: samples per second.
        seed: of errors of placement, wobble and tremor.
        up: the pose it starts in, lying at rest.

    Attributes:
        sample: index of the next sample.
        rest_since: index of the first sample after the last move.
        trembling: the device is held in the hand.
    """

    def __init__(self, rate: float, seed: int, up: str) -> None:
        self._rate = rate
        self._rng = generator(seed, Chance.HAND)
        self._unrest = Unrest.drawn(generator(seed, Chance.TREMOR))
        self._shake = 0.0
        self._steel: tuple[int, FloatArray] | None = None
        self.sample = 0
        self.rest_since = 0
        self.trembling = False
        start = attitude.exp(attitude.shortest_turn(attitude.WORLD_UP, direction(up)))
        self._stretch = Stretch(0, 0, start, np.zeros(3))

    @property
    def left(self) -> int:
        """Samples left of the present stretch."""
        return self._stretch.first + self._stretch.count - self.sample

    @property
    def up(self) -> FloatArray:
        """Up direction in the body frame at the end of the present stretch."""
        return attitude.to_body(self._stretch.end, attitude.WORLD_UP)

    def begin(self, action: Action) -> bool:
        """Begin a command; False when it takes no time."""
        stretch = self._stretch_of(action)
        if stretch is not None:
            self._stretch = stretch
        return stretch is not None

    def idle(self, count: int) -> None:
        """Do nothing for so many samples."""
        self._stretch = self._lying(count)

    def advance(self, count: int) -> Motion:
        """The next samples of the present stretch; ``count`` is at most ``left``."""
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

    def _stretch_of(self, action: Action) -> Stretch | None:
        match action:
            case Rest(seconds):
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
            case Turn(axis, degrees, fastest, error):
                turn = np.radians(degrees) * np.eye(3)[AXES.index(axis)]
                return self._move(turn, fastest, error)
            case Place(target, error, fastest):
                turn = attitude.shortest_turn(self.up, direction(target))
                return self._move(turn, fastest, error)

    def _lying(self, count: int) -> Stretch:
        level = float(self.trembling)
        return self._after(count, tremor=(level, level))

    def _ramp(self, on: bool) -> Stretch:
        levels = float(self.trembling), float(on)
        self.trembling = on
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
    ) -> Stretch:
        """A stretch that begins where the present one ends."""
        before = self._stretch.previous if previous is None else previous
        start = self._stretch.end
        return Stretch(
            self.sample, max(1, count), start, before, turn, wobble, shift, tremor, self._shake
        )
