"""Drift of the scale factor with time."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import ACCELERATION_UNITS
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DEGREE,
    GYROSCOPE,
    PPM,
    AxisEffect,
    Circumstances,
    Size,
    Story,
    sensed,
    since_middle,
)


class ScaleDrift(AxisEffect):
    """``ε_i = d_i (t − t₀) x_i``, ``t₀`` the middle of the session.

    The scale of the base model is that of the session's middle. Three equal coefficients of a
    gyroscope make exactly the error of a changing clock.
    """

    name = "scale-drift"
    sensors = (ACCELEROMETER, GYROSCOPE)
    family = "slow-scale"
    against = "time"
    kind = "time"
    title = "drift of the scale with time"
    equation = "ε_i = dᵢ (t − t₀) x_i"
    order = 41
    aliases = ("clock",)
    # as many ppm as the temperature makes in a device that warms by 1 °C per minute
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "ppm/min",
            PPM * ACCELERATION_UNITS["g"],
            250.0,
            {"consumer": (100.0, 400.0), "industrial": (20.0, 100.0), "tactical": (2.0, 20.0)},
            chosen=("consumer", "industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "ppm/min",
            PPM * DEGREE,
            250.0,
            {"consumer": (100.0, 400.0), "industrial": (20.0, 100.0), "tactical": (2.0, 20.0)},
            chosen=("consumer", "industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="The gain follows the supply voltage or the reference voltage of the converter, "
            "and this voltage falls as the battery empties. The glue of the package may also "
            "creep: the strain of the chip, and with it the stiffness of the springs, changes a "
            "little every minute.",
            equation="error on an axis = coefficient × (time − middle of the session) × force on "
            "that axis",
            signature="Early, both faces of the axis read too large, and late too small, or vice "
            "versa; poses with the axis level do not change.",
            needs="Both faces of each axis early, in the middle and late. While the temperature "
            "only rises, a temperature coefficient of the scale looks the same; with few repeats "
            "a step of the scale does, too. In "
            "one session a scale that wanders at random may look like a drift; the next session "
            "then shows another slope.",
            remedy="Supply the sensor from a regulator and wait until the device has settled, or "
            "calibrate again before use. Do not apply the slope outside the session: it seldom "
            "continues.",
            confirm="Hold two opposite faces at a steady temperature, with a full and with an "
            "almost empty battery: half the difference of the two readings changes, half their "
            "sum does not. Measure the supply voltage as well.",
            source="IEEE Std 528, inertial sensor terminology (scale factor stability); data "
            "sheets of ratiometric sensors state the sensitivity per supply voltage.",
        ),
        GYROSCOPE: Story(
            what="The amplitude of the drive or the reference voltage of the converter follows "
            "the supply voltage, which falls as the battery empties: the same rate causes a "
            "smaller signal from minute to minute.",
            equation="error on an axis = coefficient × (time − middle of the session) × rate about "
            "that axis",
            signature="Early rotations about the axis are measured too large and late ones too "
            "small, or vice versa, by the same share in both senses; readings at rest do not "
            "change.",
            needs="Rotations about each axis early, in the middle and late. With the same "
            "coefficient on all three axes it is exactly the drift of a sample clock, which no "
            "rotations separate from it. While the temperature only rises, a temperature "
            "coefficient of the scale looks the same. In one session a scale that wanders at "
            "random may look like a drift; the next session then shows another slope.",
            remedy="Supply the sensor from a regulator, or calibrate again before use. Do not "
            "apply the slope outside the session: it seldom continues.",
            confirm="Rotate the device by one full circle against a stop at a steady temperature, "
            "with a full and with an almost empty battery: the integrated angle changes. Time the "
            "samples by an accurate clock as well: their rate must not change.",
            source="IEEE Std 528, inertial sensor terminology (scale factor stability).",
        ),
    }

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """``(t − t₀) x_i``, min·g or min·°/s."""
        del variant
        return np.asarray(since_middle(c)[:, None] * sensed(sensor, c), np.float64)

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "since_middle / 60.0f * {x}"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """A session of more than a minute; a gyroscope must have been turned."""
        return requirements.rotations(sensor, c) or requirements.duration(c)
