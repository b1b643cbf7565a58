"""The settle step: ten seconds of rest, and what the device shows when nothing moves.

No noise is known yet, so rest is judged against coarse limits, against the run's own typical
spread, and against where it began: a device that turns slowly shows a small spread for ever.
"""

import numpy as np

from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.resolution import Resolution
from imucal_wizard.procedure.scales import Scales
from imucal_wizard.procedure.stillness import Noise, Windows, measure_noise
from imucal_wizard.readings import FloatArray

JUMP = 4.0
"""A window this many times the run's typical spread is a movement."""
DRIFT_G = 0.003
CALMER = 3.0
"""A last second this many times calmer than the run: what went before was not rest yet."""
FIRST_WINDOWS = 10


class Settling:
    """The windows of the present run."""

    def __init__(self, units: Scales, resolution: Resolution, *, keep: int) -> None:
        self._units = units
        self._resolution = resolution
        self._keep = keep
        self._run: list[Windows] = []
        self._first: list[FloatArray] = []
        self._newest: list[FloatArray] = []
        self._all: list[Windows] = []
        self._longest: list[Windows] = []

    def add(self, moment: Moment, one_g: float) -> str:
        """Take a moment that is within the coarse limits; why it is a movement all the same, or "".

        Args:
            moment: the newest block and window.
            one_g: what the accelerometer reads for one gravity, in its unit.
        """
        reason = self._departs(moment, one_g)
        if reason:
            self.broken()
        else:
            self._run.append(moment.window)
            self._run = self._run[-self._keep :]
            if len(self._first) < FIRST_WINDOWS:
                self._first.append(moment.mean_a)
            self._newest = [*self._newest[-FIRST_WINDOWS + 1 :], moment.mean_a]
        return reason

    def remember(self, moment: Moment) -> None:
        """Note any full window, still or not, for noise taken at the operator's word."""
        if moment.full:
            self._all = [*self._all[-self._keep + 1 :], moment.window]

    def broken(self) -> None:
        """It moved: the run begins again."""
        if len(self._run) > len(self._longest):
            self._longest = self._run
        self._run, self._first, self._newest = [], [], []

    @property
    def longest(self) -> list[Windows]:
        """The windows of the longest run that was broken."""
        return self._longest

    def noise(self, *, any_window: bool = False) -> Noise | None:
        """The noise of the run, or of the newest windows whether still or not."""
        return noise_of(self._all if any_window else self._run)

    def _departs(self, moment: Moment, one_g: float) -> str:
        if len(self._run) < FIRST_WINDOWS:
            return ""
        typical = measure_noise(stacked(self._run))
        if typical is None:
            return ""
        if self._calmer(typical):
            return "it has become calm only now"
        step_a, step_g = self._resolution.steps
        floor_a = np.maximum(step_a, DRIFT_G * one_g / 3.0)
        limit = np.maximum(JUMP * typical.std_a, floor_a)
        reason = self._units.shaking(moment.window.std_a[0], limit)
        if not reason and moment.window.std_g is not None and typical.std_g is not None:
            limit = np.maximum(JUMP * typical.std_g, step_g)
            reason = self._units.trembling(moment.window.std_g[0], limit)
        return reason or self._wandered(typical, one_g)

    def _calmer(self, typical: Noise) -> bool:
        newest = measure_noise(stacked(self._run[-FIRST_WINDOWS:]))
        if newest is None:
            return False
        floor = np.maximum(CALMER * newest.std_a, self._resolution.steps[0])
        return bool((typical.std_a > floor).any())

    def _wandered(self, typical: Noise, one_g: float) -> str:
        apart = np.abs(np.mean(self._newest, axis=0) - np.mean(self._first, axis=0))
        limit = np.maximum(
            JUMP * typical.std_a, np.maximum(self._resolution.steps[0], DRIFT_G * one_g)
        )
        return self._units.wandering(apart, limit)


def noise_of(windows: list[Windows]) -> Noise | None:
    """The noise in single windows; None without any."""
    return measure_noise(stacked(windows)) if windows else None


def stacked(windows: list[Windows]) -> Windows:
    """Single windows as one table."""
    rates = [window.std_g for window in windows if window.std_g is not None]
    means = [window.mean_g for window in windows if window.mean_g is not None]
    return Windows(
        np.concatenate([window.std_a for window in windows]),
        np.concatenate(rates) if rates else None,
        np.concatenate(means) if means else None,
        np.concatenate([window.full for window in windows]),
    )
