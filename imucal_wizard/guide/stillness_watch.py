"""Limits of rest, the axis that exceeds them, and the waiting for a device that does not rest.

The limits come from the noise of the settle step. They widen by themselves, announced and bounded,
because the operator has no hand free for a key.
"""

import math
from collections import deque
from dataclasses import replace

import numpy as np

from imucal_wizard.core.limits.procedure import (
    COARSE_LIMIT_G,
    COARSE_RATE_LIMIT_DEG,
    LOOSEN_FACTOR,
    LOOSEN_SECONDS,
    MAX_LOOSENED,
    MIN_REST_LIMIT_G,
    MIN_SWAY_LIMIT_DEG,
    NOISE_FACTOR,
    OFFER_SECONDS,
    RECENT_SECONDS,
    WINDOW_SECONDS,
)
from imucal_wizard.core.limits.stillness import MIN_RATE_LIMIT_DEG, TIME_TOLERANCE
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.guide.scales import Scales, excess, moves
from imucal_wizard.guide.state import AxisMotion
from imucal_wizard.measurement.stillness import Block, Limits, Noise, Windows


def limits_of(
    noise: Noise, quantum: tuple[FloatArray, FloatArray], one_g: float, units: Scales
) -> Limits:
    """Limits of rest that a hand at a desk can keep, for the steps after the settle step.

    Args:
        noise: from the settle step.
        quantum: resolution of each accelerometer and gyroscope axis, shape (3,) each; 0 if not
            known. A reading that flickers between two adjacent values is at rest.
        one_g: reading of the accelerometer for one gravity, in its unit.
        units: units of the readings.
    """
    limits = noise.limits(NOISE_FACTOR)
    floor = np.maximum(quantum[0], MIN_REST_LIMIT_G * one_g)
    accelerometer = np.maximum(limits.accelerometer, floor)
    if limits.gyroscope is None:
        return Limits(accelerometer)
    sway, turn = math.radians(MIN_SWAY_LIMIT_DEG), math.radians(MIN_RATE_LIMIT_DEG)
    if not units.gyroscope_known:
        sway = turn = 1e-9
    gyroscope = np.maximum(limits.gyroscope, np.maximum(quantum[1], sway))
    rate = np.maximum(limits.gyroscope * 1.5, np.maximum(2.0 * quantum[1], turn))
    return Limits(accelerometer, gyroscope, noise.mean_g, rate)


def coarse_limits(one_g: float, units: Scales, *, gyroscope: bool) -> Limits:
    """Limits before the noise is known; none for a gyroscope in counts."""
    accelerometer = np.full(3, COARSE_LIMIT_G * one_g)
    if not gyroscope or not units.gyroscope_known:
        return Limits(accelerometer)
    return Limits(accelerometer, np.full(3, math.radians(COARSE_RATE_LIMIT_DEG)))


class StillnessWatch:
    """Limits of rest, and the waiting for a device that does not meet them.

    Attributes:
        loosened: factor by which the limits are wider than they were set.
        waiting: time without a completed hold while one is needed, s.
        still: the newest window is still.
    """

    def __init__(self, units: Scales) -> None:
        self._units = units
        self._limits: Limits | None = None
        self._tight: Limits | None = None
        self._recent: deque[float] = deque(maxlen=1)
        self._calm = 0.0
        self.loosened = 1.0
        self.waiting = 0.0
        self._newest: tuple[Windows, Limits] | None = None
        self._motions: tuple[AxisMotion, ...] | None = ()
        self.still = False

    @property
    def limits(self) -> Limits | None:
        """The present limits, or None if not known."""
        return self._limits

    @property
    def offered(self) -> bool:
        """Whether alternatives are offered."""
        return self.waiting >= OFFER_SECONDS

    @property
    def motions(self) -> tuple[AxisMotion, ...]:
        """The motion of each axis in the newest window, computed when somebody asks."""
        if self._motions is None:
            self._motions = () if self._newest is None else self._units.motions(*self._newest)
        return self._motions

    @property
    def worst(self) -> AxisMotion | None:
        """The axis with the largest motion in terms of its limit."""
        return max(self.motions, key=excess, default=None)

    @property
    def reason(self) -> str:
        """Why the device is not still: "z turns at 2.9 °/s, limit 0.8"; "" if it is."""
        worst = self.worst
        return moves(worst) if worst is not None and worst.moving else ""

    def set_limits(self, limits: Limits) -> None:
        """Set new limits, not loosened."""
        self._tight = self._limits = limits
        self.loosened = 1.0
        self.rest()

    def adapt(self, limits: Limits) -> None:
        """Change the limits, but keep the resting rate and the loosening."""
        if self._tight is not None:
            mean = self._tight.gyroscope_mean
            self._tight = limits if mean is None else replace(limits, gyroscope_mean=mean)
            self._limits = self._tight.scaled(self.loosened)

    def rest_at(self, mean: FloatArray) -> None:
        """Keep the limits, but set another resting rate of the gyroscope."""
        if self._tight is None or self._tight.gyroscope_mean is None:
            return
        self._tight = replace(self._tight, gyroscope_mean=mean)
        self._limits = self._tight.scaled(self.loosened)

    def loosen(self) -> bool:
        """Widen the limits; returns False if they cannot be wider."""
        if self._tight is None or self.loosened >= MAX_LOOSENED:
            return False
        self.loosened *= LOOSEN_FACTOR
        self._limits = self._tight.scaled(self.loosened)
        return True

    def tighten(self, seconds: float) -> bool:
        """Restore the limits if the device has met them for some seconds; returns whether."""
        if self.loosened == 1.0 or self._calm < seconds - WINDOW_SECONDS:
            return False
        self._limits, self.loosened = self._tight, 1.0
        return True

    def rest(self) -> None:
        """Restart the waiting: a hold was completed, or none is needed."""
        self.waiting = 0.0
        self._recent.clear()

    def judge(self, block: Block) -> bool:
        """Whether the window that ends with this block is still."""
        if self._limits is None:
            self._newest, self._motions, self.still = None, (), False
            return False
        self._newest, self._motions = (block.window, self._limits), None
        calm = self.still = bool(block.window.still(self._limits)[0])
        if self._tight is not self._limits:
            calm = self._tight is not None and bool(block.window.still(self._tight)[0])
        self._calm = self._calm + block.seconds if calm else 0.0
        return self.still

    def exhausted_in(self, seconds: float) -> bool:
        """Whether the waiting will end within some seconds, so that the limits must widen."""
        return self.waiting + seconds >= OFFER_SECONDS + LOOSEN_SECONDS - TIME_TOLERANCE

    def wait(self, seconds: float) -> str | None:
        """Count a block in which a hold is needed and not complete.

        Returns:
            ``"stuck"`` if alternatives are offered from now on, ``"loosened"`` if the limits have
            just been widened, else None. Limits widen only for a device that is nearly at rest:
            one that is carried would not meet the widest limits either.
        """
        if self._recent.maxlen == 1:
            self._recent = deque(maxlen=max(round(RECENT_SECONDS / seconds), 1))
        worst = self.worst
        self._recent.append(excess(worst) if worst is not None else math.inf)
        before = self.waiting
        self.waiting += seconds
        if before < OFFER_SECONDS <= self.waiting:
            return "stuck"
        if self.exhausted_in(0.0) and not self.still and self._nearly_still():
            self.loosen()
            self.waiting = OFFER_SECONDS
            return "loosened"
        return None

    def _nearly_still(self) -> bool:
        middle = sorted(self._recent)[len(self._recent) // 2]
        return self.loosened < MAX_LOOSENED and middle * self.loosened <= MAX_LOOSENED
