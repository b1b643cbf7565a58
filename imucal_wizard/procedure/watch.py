"""Is the device still, which axis says no, and what happens when it never is.

The limits widen by themselves, announced and bounded, because both hands hold the device and
nothing may need a key.
"""

from collections import deque
from dataclasses import replace

from imucal_wizard.procedure.blocks import ALMOST
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.scales import Scales, excess, moves
from imucal_wizard.procedure.state import AxisMotion
from imucal_wizard.procedure.stillness import Limits
from imucal_wizard.readings import FloatArray

OFFER_SECONDS = 15.0
LOOSEN_SECONDS = 15.0
"""After the ways out are offered, the wait until the limits widen by themselves."""
LOOSEN_FACTOR = 2.0
MOST_LOOSENED = 16.0
RECENT_SECONDS = 5.0
WINDOW_SECONDS = 0.5
"""What a window reaches back: a rest is known to be one only after that."""


class Watch:
    """Limits of rest and the patience with a device that does not meet them."""

    def __init__(self, units: Scales) -> None:
        self._units = units
        self._limits: Limits | None = None
        self._tight: Limits | None = None
        self._recent: deque[float] = deque(maxlen=1)
        self._calm = 0.0
        self.loosened = 1.0
        self.waiting = 0.0
        self.motions: tuple[AxisMotion, ...] = ()
        self.still = False

    @property
    def limits(self) -> Limits | None:
        """The limits as they are now, or None before any are known."""
        return self._limits

    @property
    def offered(self) -> bool:
        """Whether the ways out are open."""
        return self.waiting >= OFFER_SECONDS

    @property
    def worst(self) -> AxisMotion | None:
        """The axis farthest over its limit, or nearest to it when all are below."""
        return max(self.motions, key=excess, default=None)

    @property
    def reason(self) -> str:
        """Why it does not count as still: "z turns at 2.9 °/s, limit 0.8"; "" when it does."""
        worst = self.worst
        return moves(worst) if worst is not None and worst.moving else ""

    def set_limits(self, limits: Limits) -> None:
        """New limits, not loosened."""
        self._tight = self._limits = limits
        self.loosened = 1.0
        self.rest()

    def adapt(self, limits: Limits) -> None:
        """Other limits about the same resting value, as loosened as before."""
        if self._tight is not None:
            mean = self._tight.gyroscope_mean
            self._tight = limits if mean is None else replace(limits, gyroscope_mean=mean)
            self._limits = self._tight.scaled(self.loosened)

    def rest_at(self, mean: FloatArray) -> None:
        """The same limits about another resting value of the gyroscope."""
        if self._tight is None or self._tight.gyroscope_mean is None:
            return
        self._tight = replace(self._tight, gyroscope_mean=mean)
        self._limits = self._tight.scaled(self.loosened)

    def loosen(self) -> bool:
        """Widen the limits; False when they are as wide as they may be."""
        if self._tight is None or self.loosened >= MOST_LOOSENED:
            return False
        self.loosened *= LOOSEN_FACTOR
        self._limits = self._tight.scaled(self.loosened)
        return True

    def tighten(self, seconds: float) -> bool:
        """Back to the first limits once the device has met them for so long; whether it has."""
        if self.loosened == 1.0 or self._calm < seconds - WINDOW_SECONDS:
            return False
        self._limits, self.loosened = self._tight, 1.0
        return True

    def rest(self) -> None:
        """A hold was completed, or nothing is asked for: the waiting begins anew."""
        self.waiting = 0.0
        self._recent.clear()

    def judge(self, moment: Moment) -> bool:
        """Whether the window that ends with this moment is still; keeps the reasons."""
        if self._limits is None:
            self.motions, self.still = (), False
            return False
        self.motions = self._units.motions(moment.window, self._limits)
        self.still = bool(moment.window.still(self._limits)[0])
        calm = self._tight is not None and bool(moment.window.still(self._tight)[0])
        self._calm = self._calm + moment.seconds if calm else 0.0
        return self.still

    def exhausted_in(self, seconds: float) -> bool:
        """Whether it will then have lasted so long that something must give way."""
        return self.waiting + seconds >= OFFER_SECONDS + LOOSEN_SECONDS - ALMOST

    def wait(self, seconds: float) -> str | None:
        """Count a moment in which a hold is asked for and not complete.

        Returns:
            ``"stuck"`` when the ways out open now, ``"loosened"`` when the limits have just been
            widened, else None. Limits widen only for a device that is nearly at rest: one that is
            being carried would not meet the widest either.
        """
        if self._recent.maxlen == 1:
            self._recent = deque(maxlen=max(round(RECENT_SECONDS / seconds), 1))
        worst = self.worst
        self._recent.append(excess(worst) if worst is not None else float("inf"))
        before = self.waiting
        self.waiting += seconds
        if before < OFFER_SECONDS <= self.waiting:
            return "stuck"
        if self.exhausted_in(0.0) and not self.still and self._nearly():
            self.loosen()
            self.waiting = OFFER_SECONDS
            return "loosened"
        return None

    def _nearly(self) -> bool:
        middle = sorted(self._recent)[len(self._recent) // 2]
        return self.loosened < MOST_LOOSENED and middle * self.loosened <= MOST_LOOSENED
