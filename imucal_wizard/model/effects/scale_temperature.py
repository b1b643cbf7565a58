"""Temperature coefficient of the scale factor."""

from collections.abc import Mapping

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
    warmth,
)


class ScaleTemperature(AxisEffect):
    """``ε_i = s₁ (T − T₀) x_i``, ``T₀`` the session's mean temperature.

    The thermal coefficient of the scale factor of IEEE 1293 and IEEE 1431.
    """

    name = "scale-temperature"
    sensors = (ACCELEROMETER, GYROSCOPE)
    family = "slow-scale"
    against = "temperature"
    kind = "time"
    title = "temperature coefficient of the scale"
    equation = "ε_i = s₁ᵢ (T − T₀) x_i"
    order = 40
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "ppm/°C",
            PPM * ACCELERATION_UNITS["g"],
            250.0,
            {"consumer": (100.0, 400.0), "industrial": (20.0, 100.0), "tactical": (2.0, 20.0)},
            chosen=("industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "ppm/°C",
            PPM * DEGREE,
            250.0,
            {"consumer": (100.0, 400.0), "industrial": (20.0, 100.0), "tactical": (2.0, 20.0)},
            chosen=("consumer", "industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="Silicon becomes softer as it warms, and the reference voltage of the converter "
            "changes: the same force bends the spring farther, or the same voltage is converted "
            "to another number.",
            equation="error on an axis = coefficient × (temperature − mean temperature) × force on "
            "that axis",
            signature="When warm, both faces of the axis read too large, or both too small; poses "
            "with the axis level do not change.",
            needs="Both faces of each axis, cold and warm, at least 10 °C apart.",
            remedy="Add the term and apply it with the sensor's own temperature, or calibrate at "
            "the operating temperature.",
            confirm="Hold two opposite faces cold and again 20 °C warmer: half the difference of "
            "the two readings changes, half their sum does not.",
            source="IEEE Std 1293, model equation of linear accelerometers (temperature "
            "coefficients); Martínez and others, Sensors 21 (2021) 3117.",
        ),
        GYROSCOPE: Story(
            what="A higher temperature softens the vibrating structure and shifts its resonance; "
            "the same rate then causes a larger or smaller signal.",
            equation="error on an axis = coefficient × (temperature − mean temperature) × rate "
            "about that axis",
            signature="When warm, the same rotation is measured larger, or smaller, by the same "
            "share in both senses; readings at rest do not change.",
            needs="Rotations about each axis, cold and warm, at least 10 °C apart.",
            remedy="Add the term and apply it with the sensor's own temperature, or calibrate at "
            "the operating temperature.",
            confirm="Rotate the device by exactly one circle against a stop, cold and again 20 °C "
            "warmer: the integrated angle changes by the same share in both senses.",
            source="IEEE Std 1431, model equation of Coriolis vibratory gyroscopes (temperature "
            "coefficients).",
        ),
    }

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """``(T − T₀) x_i``, °C·g or °C·°/s."""
        del variant
        return warmth(c)[:, None] * sensed(sensor, c)

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "warmth * {x}"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """Known temperatures that differ; a gyroscope must have been turned."""
        return requirements.temperatures(c) or requirements.rotations(sensor, c)
