"""Readings in the units that people use: mg and °/s, or counts if the unit is not known."""

import math

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quantities import decimals, fixed, number, readable
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import COUNT, STANDARD_GRAVITY
from imucal_wizard.guide.state import AxisMotion
from imucal_wizard.measurement.stillness import Limits, Noise, Windows


@dataclass(frozen=True)
class Scales:
    """The units of accelerometer and gyroscope.

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
        """Factor from an accelerometer reading to the shown unit."""
        return readable(self.accelerometer)[0]

    @property
    def degrees(self) -> float:
        """Factor from a gyroscope reading to the shown unit."""
        return readable(self.gyroscope)[0]

    @property
    def mg_unit(self) -> str:
        """The unit in which accelerometer readings are shown."""
        return readable(self.accelerometer)[1]

    @property
    def degrees_unit(self) -> str:
        """The unit in which gyroscope readings are shown."""
        return readable(self.gyroscope)[1]

    def motions(self, window: Windows, limits: Limits) -> tuple[AxisMotion, ...]:
        """The motion of each axis beside its limit; empty until the window is full.

        A gyroscope axis shows its standard deviation or its mean rate, the larger one in terms of
        its limit.
        """
        if not window.full[0]:
            return ()
        factor, unit = readable(self.accelerometer)
        shown = [
            AxisMotion(f"a{axis}", float(value) * factor, float(limit) * factor, unit)
            for axis, value, limit in zip(AXES, window.std_a[0], limits.accelerometer, strict=True)
        ]
        if window.std_g is not None and limits.gyroscope is not None:
            pairs = [list(zip(window.std_g[0], limits.gyroscope, strict=True))]
            if window.mean_g is not None and limits.gyroscope_mean is not None:
                turn = abs(window.mean_g[0] - limits.gyroscope_mean)
                if limits.rate is not None:
                    pairs.append(list(zip(turn, limits.rate, strict=True)))
            factor, unit = readable(self.gyroscope)
            for index, axis in enumerate(AXES):
                value, limit = max((kind[index] for kind in pairs), key=_excess_of)
                shown.append(
                    AxisMotion(f"g{axis}", float(value) * factor, float(limit) * factor, unit)
                )
        return tuple(shown)

    def shaking(self, values: FloatArray, limits: FloatArray) -> str:
        """The accelerometer axis farthest over its limit: "x shakes by 12 mg, limit 4"; or ""."""
        return _worst(values * self.mg, limits * self.mg, "shakes by", self.mg_unit)

    def wandering(self, values: FloatArray, limits: FloatArray) -> str:
        """The same for a mean that has changed."""
        return _worst(values * self.mg, limits * self.mg, "wandered by", self.mg_unit)

    def trembling(self, values: FloatArray, limits: FloatArray) -> str:
        """The same for the gyroscope."""
        return _worst(values * self.degrees, limits * self.degrees, "sways by", self.degrees_unit)

    def noise_text(self, noise: Noise) -> str:
        """The noise of each axis: "1.2 1.1 1.6 mg, 0.06 0.05 0.07 °/s"."""
        text = f"{_three(noise.std_a * self.mg)} {self.mg_unit}"
        if noise.std_g is not None:
            text += f", {_three(noise.std_g * self.degrees)} {self.degrees_unit}"
        return text


def excess(motion: AxisMotion) -> float:
    """Motion of an axis as a multiple of its limit; infinite if it is not a number."""
    return _excess_of((motion.value, motion.limit))


def _excess_of(pair: tuple[float, float]) -> float:
    value, limit = float(pair[0]), float(pair[1])
    if not math.isfinite(value):
        return math.inf
    if limit > 0.0:
        return value / limit
    return math.inf if value > 0.0 else 0.0


def _three(values: FloatArray) -> str:
    """Three values with the decimals that give the largest of them two digits."""
    places = min(6, decimals(float(np.nanmax(values, initial=0.0))))
    return " ".join(fixed(value, places) for value in values.tolist())


def _worst(values: FloatArray, limits: FloatArray, verb: str, unit: str) -> str:
    pairs = list(zip(values.tolist(), limits.tolist(), strict=True))
    index = max(range(len(pairs)), key=lambda i: _excess_of(pairs[i]))
    value, limit = pairs[index]
    if _excess_of(pairs[index]) <= 1.0:
        return ""
    return f"{AXES[index]} {verb} {number(value, 2)} {unit}, limit {number(limit, 2)}"


def moves(motion: AxisMotion) -> str:
    """One axis in words: "z turns at 2.9 °/s, limit 0.8"."""
    axis = motion.channel[1:]
    verb = "turns at" if motion.channel.startswith("g") else "shakes by"
    return f"{axis} {verb} {number(motion.value, 2)} {motion.unit}, limit {number(motion.limit, 2)}"
