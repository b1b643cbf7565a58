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
    title = "scale follows the temperature"
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
            what="Silicon gets softer when it is warm, and the reference voltage of the converter "
            "moves: the same force bends the spring farther or is measured with another ruler.",
            equation="error on an axis = coefficient × (temperature − mean temperature) × force on "
            "that axis",
            signature="Warm poses come out too large, or too small, at both faces of the axis; a "
            "level axis does not care.",
            needs="Faces of each axis both cold and warm, 10 °C apart or more.",
            remedy="Add the term and apply it with the sensor's own temperature, or calibrate at "
            "the operating temperature.",
            confirm="Hold two opposite faces cold and again 20 °C warmer: half the difference of "
            "the two readings has changed, half their sum has not.",
            source="IEEE Std 1293, model equation of linear accelerometers (temperature "
            "coefficients); Martínez and others, Sensors 21 (2021) 3117.",
        ),
        GYROSCOPE: Story(
            what="Warmth softens the vibrating structure and shifts its resonance; the same turn "
            "gives a larger or smaller signal.",
            equation="error on an axis = coefficient × (temperature − mean temperature) × rate "
            "about that axis",
            signature="The same turn comes out larger when warm, by the same share in both senses; "
            "readings at rest do not care.",
            needs="Turns about each axis both cold and warm, 10 °C apart or more.",
            remedy="Add the term and apply it with the sensor's own temperature, or calibrate at "
            "the operating temperature.",
            confirm="Turn the device by exactly one circle against a stop, cold and again 20 °C "
            "warmer: the integrated angle has changed by the same share in both senses.",
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
