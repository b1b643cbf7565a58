"""Readings as a person reads them: mg and °/s where the units are known, else counts."""

import math
from dataclasses import dataclass

import numpy as np

from imucal_wizard.digits import decimals, fixed
from imucal_wizard.procedure.poses import AXES
from imucal_wizard.procedure.state import AxisMotion
from imucal_wizard.procedure.stillness import Limits, Noise, Windows
from imucal_wizard.readings import FloatArray
from imucal_wizard.units import COUNT, STANDARD_GRAVITY


@dataclass(frozen=True)
class Scales:
    """The units of both sensors.

    Attributes:
        accelerometer: ``m/s^2`` or ``count``.
        gyroscope: ``rad/s`` or ``count``.
        gravity: local gravity, m/s².
    """

    accelerometer: str = "m/s^2"
    gyroscope: str = "rad/s"
    gravity: float = STANDARD_GRAVITY

    @property
    def accelerometer_known(self) -> bool:
        """Whether accelerometer readings are in m/s²."""
        return self.accelerometer != COUNT

    @property
    def gyroscope_known(self) -> bool:
        """Whether gyroscope readings are in rad/s."""
        return self.gyroscope != COUNT

    @property
    def mg(self) -> float:
        """What an accelerometer reading is multiplied by to be shown."""
        return 1000.0 / self.gravity if self.accelerometer_known else 1.0

    @property
    def degrees(self) -> float:
        """What a gyroscope reading is multiplied by to be shown."""
        return 180.0 / math.pi if self.gyroscope_known else 1.0

    @property
    def mg_unit(self) -> str:
        """The unit in which accelerometer readings are shown."""
        return "mg" if self.accelerometer_known else COUNT

    @property
    def degrees_unit(self) -> str:
        """The unit in which gyroscope readings are shown."""
        return "°/s" if self.gyroscope_known else COUNT

    def motions(self, window: Windows, limits: Limits) -> tuple[AxisMotion, ...]:
        """How much each axis moves against its limit; empty until the window is full.

        A gyroscope axis shows its tremor or its mean turn, whichever is farther over its limit.
        """
        if not window.full[0]:
            return ()
        shown = [
            AxisMotion(f"a{axis}", float(value) * self.mg, float(limit) * self.mg, self.mg_unit)
            for axis, value, limit in zip(AXES, window.std_a[0], limits.accelerometer, strict=True)
        ]
        if window.std_g is not None and limits.gyroscope is not None:
            pairs = [list(zip(window.std_g[0], limits.gyroscope, strict=True))]
            if window.mean_g is not None and limits.gyroscope_mean is not None:
                turn = abs(window.mean_g[0] - limits.gyroscope_mean)
                if limits.rate is not None:
                    pairs.append(list(zip(turn, limits.rate, strict=True)))
            for index, axis in enumerate(AXES):
                value, limit = max((kind[index] for kind in pairs), key=_excess_of)
                shown.append(
                    AxisMotion(
                        f"g{axis}",
                        float(value) * self.degrees,
                        float(limit) * self.degrees,
                        self.degrees_unit,
                    )
                )
        return tuple(shown)

    def shaking(self, values: FloatArray, limits: FloatArray) -> str:
        """The accelerometer axis farthest over its limit: "x shakes by 12 mg, limit 4"; or ""."""
        return _worst(values * self.mg, limits * self.mg, "shakes by", self.mg_unit)

    def wandering(self, values: FloatArray, limits: FloatArray) -> str:
        """The same of a mean that is not where it was."""
        return _worst(values * self.mg, limits * self.mg, "wandered by", self.mg_unit)

    def trembling(self, values: FloatArray, limits: FloatArray) -> str:
        """The same of the gyroscope."""
        return _worst(values * self.degrees, limits * self.degrees, "sways by", self.degrees_unit)

    def noise_text(self, noise: Noise) -> str:
        """The noise of each axis: "1.2 1.1 1.6 mg, 0.06 0.05 0.07 °/s"."""
        text = f"{_three(noise.std_a * self.mg)} {self.mg_unit}"
        if noise.std_g is not None:
            text += f", {_three(noise.std_g * self.degrees)} {self.degrees_unit}"
        return text


def excess(motion: AxisMotion) -> float:
    """How many times the limit an axis moves; infinite where nothing sensible can be said."""
    return _excess_of((motion.value, motion.limit))


def _excess_of(pair: tuple[float, float]) -> float:
    value, limit = float(pair[0]), float(pair[1])
    if not math.isfinite(value):
        return math.inf
    if limit > 0.0:
        return value / limit
    return math.inf if value > 0.0 else 0.0


def _three(values: FloatArray) -> str:
    """Three values with as many decimals as give the largest of them two digits."""
    places = min(6, decimals(float(np.nanmax(values, initial=0.0))))
    return " ".join(fixed(value, places) for value in values.tolist())


def _worst(values: FloatArray, limits: FloatArray, verb: str, unit: str) -> str:
    pairs = list(zip(values.tolist(), limits.tolist(), strict=True))
    index = max(range(len(pairs)), key=lambda i: _excess_of(pairs[i]))
    value, limit = pairs[index]
    if _excess_of(pairs[index]) <= 1.0:
        return ""
    return f"{AXES[index]} {verb} {_short(value)} {unit}, limit {_short(limit)}"


def moves(motion: AxisMotion) -> str:
    """One axis in words: "z turns at 2.9 °/s, limit 0.8"."""
    axis = motion.channel[1:]
    verb = "turns at" if motion.channel.startswith("g") else "shakes by"
    return f"{axis} {verb} {_short(motion.value)} {motion.unit}, limit {_short(motion.limit)}"


def _short(value: float) -> str:
    if not math.isfinite(value):
        return "?"
    return f"{value:.0f}" if value >= 9.95 else f"{value:.1f}" if value >= 0.095 else f"{value:.2g}"
