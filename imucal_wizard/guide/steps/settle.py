"""The settle step: some seconds of rest, whose noise gives the limits of rest.

The noise is not known yet, so rest is judged by coarse limits, by the run's own typical spread, and
by its mean at the start: a device that turns slowly has a small spread all the time.
"""

import numpy as np

from imucal_wizard.core.limits.procedure import (
    CALMER_FACTOR,
    JUMP_FACTOR,
    MAX_DRIFT_G,
    MAX_UNIT_FACTOR,
    MIN_PROVISIONAL_WINDOWS,
    MIN_SETTLE_WINDOWS,
)
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.guide.context import Context
from imucal_wizard.guide.kinds import Act, EventKind
from imucal_wizard.guide.measurements import KeptHold
from imucal_wizard.guide.plan import Step
from imucal_wizard.guide.scales import Scales
from imucal_wizard.guide.state import Status
from imucal_wizard.guide.stillness_watch import coarse_limits, limits_of
from imucal_wizard.measurement.rounding import Resolution
from imucal_wizard.measurement.stillness import Block, Limits, Noise, Windows, measure_noise


class Settling:
    """The windows of the present still run."""

    def __init__(self, units: Scales, resolution: Resolution, *, keep: int) -> None:
        self._units = units
        self._resolution = resolution
        self._keep = keep
        self._run: list[Windows] = []
        self._first: list[FloatArray] = []
        self._newest: list[FloatArray] = []
        self._all: list[Windows] = []
        self._longest: list[Windows] = []

    def add(self, block: Block, one_g: float) -> str:
        """Take a block within the coarse limits; returns why it is a movement nevertheless, or "".

        Args:
            block: the newest block and window.
            one_g: reading of the accelerometer for one gravity, in its unit.
        """
        reason = self._departs(block, one_g)
        if reason:
            self.broken()
        else:
            self._run.append(block.window)
            self._run = self._run[-self._keep :]
            if len(self._first) < MIN_SETTLE_WINDOWS:
                self._first.append(block.mean_a)
            self._newest = [*self._newest[-MIN_SETTLE_WINDOWS + 1 :], block.mean_a]
        return reason

    def remember(self, block: Block) -> None:
        """Keep any full window, still or not, for a hold taken on command."""
        if block.full:
            self._all = [*self._all[-self._keep + 1 :], block.window]

    def broken(self) -> None:
        """Begin the run again after a movement."""
        if len(self._run) > len(self._longest):
            self._longest = self._run
        self._run, self._first, self._newest = [], [], []

    @property
    def longest(self) -> list[Windows]:
        """The windows of the longest run that was broken."""
        return self._longest

    def noise(self, *, any_window: bool = False) -> Noise | None:
        """The noise of the run, or of the newest windows, still or not."""
        return window_noise(self._all if any_window else self._run)

    def _departs(self, block: Block, one_g: float) -> str:
        if len(self._run) < MIN_SETTLE_WINDOWS:
            return ""
        typical = measure_noise(stacked_windows(self._run))
        if typical is None:
            return ""
        if self._calmer(typical):
            return "the device has just come to rest"
        step_a, step_g = self._resolution.steps
        floor_a = np.maximum(step_a, MAX_DRIFT_G * one_g / 3.0)
        limit = np.maximum(JUMP_FACTOR * typical.std_a, floor_a)
        reason = self._units.shaking(block.window.std_a[0], limit)
        if not reason and block.window.std_g is not None and typical.std_g is not None:
            limit = np.maximum(JUMP_FACTOR * typical.std_g, step_g)
            reason = self._units.trembling(block.window.std_g[0], limit)
        return reason or self._wandered(typical, one_g)

    def _calmer(self, typical: Noise) -> bool:
        newest = measure_noise(stacked_windows(self._run[-MIN_SETTLE_WINDOWS:]))
        if newest is None:
            return False
        floor = np.maximum(CALMER_FACTOR * newest.std_a, self._resolution.steps[0])
        return bool((typical.std_a > floor).any())

    def _wandered(self, typical: Noise, one_g: float) -> str:
        apart = np.abs(np.mean(self._newest, axis=0) - np.mean(self._first, axis=0))
        limit = np.maximum(
            JUMP_FACTOR * typical.std_a, np.maximum(self._resolution.steps[0], MAX_DRIFT_G * one_g)
        )
        return self._units.wandering(apart, limit)


def window_noise(windows: list[Windows]) -> Noise | None:
    """The noise in single windows; None without windows."""
    return measure_noise(stacked_windows(windows)) if windows else None


def stacked_windows(windows: list[Windows]) -> Windows:
    """Single windows as one table."""
    rates = [window.std_g for window in windows if window.std_g is not None]
    means = [window.mean_g for window in windows if window.mean_g is not None]
    return Windows(
        np.concatenate([window.std_a for window in windows]),
        np.concatenate(rates) if rates else None,
        np.concatenate(means) if means else None,
        np.concatenate([window.full for window in windows]),
    )


WINDOWS_PER_SECOND = 20
"""Windows kept per second of rest: twice as many as there are."""


class SettleStage:
    """Measures the noise and sets the limits of the steps that follow.

    Args:
        context: shared by all steps.
        step: what the step needs.
        known: noise that is known already; the step is then done.

    Attributes:
        noise: the noise that gives the limits, or None.
        provisional: the noise is that of a rest shorter than the step needs.
        why: why the device is not at rest, or "".
    """

    def __init__(self, context: Context, step: Step, known: Noise | None = None) -> None:
        self._context = context
        self.seconds = step.seconds
        self._settling = Settling(context.units, context.resolution, keep=1)
        self.noise = known
        self.finished = known is not None
        self.provisional = False
        self.why = ""

    @property
    def tally(self) -> tuple[float, float]:
        """Seconds of rest, seconds needed."""
        done = self.seconds if self.finished else min(self._context.held, self.seconds)
        return done, self.seconds

    @property
    def holds_here(self) -> bool:
        """Always: the noise is measured in any pose."""
        return True

    def enter(self) -> None:
        """Begin again, with coarse limits."""
        self.finished = False
        self.why = ""
        context = self._context
        keep = max(round(self.seconds * WINDOWS_PER_SECOND), WINDOWS_PER_SECOND)
        self._settling = Settling(context.units, context.resolution, keep=keep)
        self.prepare()

    def prepare(self) -> None:
        """Set coarse limits as soon as the reading of one gravity is known."""
        if self._context.up_estimate.known:
            self._context.watch.set_limits(self.coarse())

    def assume(self) -> None:
        """Set limits from known noise as soon as the reading of one gravity is known."""
        context = self._context
        if self.noise is not None and context.watch.limits is None and context.up_estimate.known:
            context.watch.set_limits(self.fine(self.noise))

    def coarse(self) -> Limits:
        """Limits before the noise is known."""
        context = self._context
        return coarse_limits(
            context.up_estimate.radius, context.units, gyroscope=context.has_gyroscope
        )

    def fine(self, noise: Noise) -> Limits:
        """Limits from the noise and the resolution."""
        context = self._context
        return limits_of(noise, context.resolution.steps, context.up_estimate.radius, context.units)

    def do_without(self) -> None:
        """Skip the measurement: use the noise measured before, or coarse limits."""
        limits = self.coarse() if self.noise is None else self.fine(self.noise)
        self._context.watch.set_limits(limits)

    def refine(self) -> None:
        """Adapt the limits to a finer resolution."""
        if self.noise is not None and self.finished:
            self._context.watch.adapt(self.fine(self.noise))

    def admits(self, block: Block) -> bool:
        """Whether a window belongs to the run; keeps the reason if not."""
        self._settling.remember(block)
        if not self._context.watch.still:
            self._settling.broken()
            self.why = self._context.watch.reason or "samples are missing"
            return False
        self.why = self._settling.add(block, self._context.up_estimate.radius)
        return not self.why

    def follow(self, block: Block) -> None:
        """``admits`` has taken the block."""

    def completed(self, kept: KeptHold) -> None:
        """Set the limits: the rest was long enough."""
        self.noise = self._settling.noise(any_window=kept.hold.hand_held)
        self.provisional = False
        if self.noise is None:
            return
        context = self._context
        context.watch.set_limits(self.fine(self.noise))
        self.finished = True
        context.emit(
            EventKind.HOLD_TAKEN, f"Noise measured: {context.units.noise_text(self.noise)}."
        )
        self._doubt()

    def make_do(self) -> bool:
        """Use the longest rest; returns False if that is too short too."""
        windows = self._settling.longest
        noise = window_noise(windows) if len(windows) >= MIN_PROVISIONAL_WINDOWS else None
        if noise is None:
            return False
        self.noise, self.provisional = noise, True
        context = self._context
        context.watch.set_limits(self.fine(noise))
        self.finished = True
        context.emit(
            EventKind.WARNING,
            f"No rest lasted {self.seconds:.0f} s. The noise is that of the longest rest: "
            f"{context.units.noise_text(noise)}.",
        )
        return True

    def _doubt(self) -> None:
        """Warn if the magnitude of gravity is wrong."""
        units = self._context.units
        if not units.accelerometer_known:
            return
        size = self._context.up_estimate.radius
        if not 1.0 / MAX_UNIT_FACTOR < size / units.gravity < MAX_UNIT_FACTOR:
            self._context.emit(
                EventKind.WARNING,
                f"Gravity reads {size:.3g} m/s² instead of {units.gravity:.3g}: "
                "check the accelerometer's unit in the source step.",
            )

    def view(self) -> Status:
        """The instruction, and the seconds measured."""
        still = self._context.still
        seconds = f"for {self.seconds:.0f} s: its noise is measured"
        return Status(
            act=Act.HOLD if still else Act.LAY_DOWN,
            instruction="HANDS OFF" if still else "PUT IT DOWN",
            detail=f"leave it alone {seconds}",
            progress=self.tally,
        )
