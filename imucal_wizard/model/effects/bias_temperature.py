"""Temperature coefficient of the bias."""

from collections.abc import Mapping

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DEGREE,
    GYROSCOPE,
    MAGNETOMETER,
    MILLI_G,
    BiasEffect,
    Circumstances,
    Size,
    Story,
    warmth,
)


class BiasTemperature(BiasEffect):
    """``ε_i = b₁ (T − T₀)``, ``T₀`` the session's mean temperature.

    IEEE 1293 and IEEE 1431 give the thermal coefficient of the bias; with the mean as reference the
    bias of the base model stays that of the session.
    """

    name = "bias-temperature"
    sensors = (ACCELEROMETER, GYROSCOPE, MAGNETOMETER)
    family = "slow-bias"
    against = "temperature"
    kind = "time"
    title = "bias follows the temperature"
    equation = "ε_i = b₁ᵢ (T − T₀)"
    order = 30
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg/°C",
            MILLI_G,
            0.8,
            {"consumer": (0.2, 1.3), "industrial": (0.02, 0.2), "tactical": (0.002, 0.02)},
            chosen=("industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "°/s/°C",
            DEGREE,
            0.03,
            {"consumer": (0.015, 0.05), "industrial": (0.001, 0.015), "tactical": (1e-4, 1e-3)},
            chosen=("industrial", "tactical"),
        ),
        MAGNETOMETER: Size(
            "µT/°C",
            1.0,
            0.1,
            {"consumer": (0.03, 0.3), "industrial": (0.005, 0.03), "tactical": (5e-4, 0.005)},
            chosen=("consumer", "industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="Silicon, glue and package grow by different amounts when they get warm. The "
            "stress bends the die, and the proof mass rests a little elsewhere: the zero moves.",
            equation="error on an axis = coefficient × (temperature − mean temperature of the "
            "session)",
            signature="The same pose reads differently when warm. Over the temperature the "
            "residual is a straight line, up at one face of the axis and down at the other.",
            needs="A swing of 10 °C or more that does not merely run along with time: repeat poses "
            "after warming the device and again after cooling. In a single warm-up it looks like "
            "a drift.",
            remedy="Add the term and apply it with the sensor's own temperature, or let the device "
            "reach its operating temperature and calibrate there.",
            confirm="Leave the device untouched in one pose, warm it by 10 °C and let it cool "
            "again: the reading follows the temperature both ways, on the same line.",
            source="IEEE Std 1293, model equation of linear accelerometers (temperature "
            "coefficients); Martínez and others, Sensors 21 (2021) 3117.",
        ),
        GYROSCOPE: Story(
            what="Warmth changes the stiffness and the damping of the vibrating structure, and "
            "with them the small part of the drive motion that leaks into the read-out: the zero "
            "moves.",
            equation="error on an axis = coefficient × (temperature − mean temperature of the "
            "session)",
            signature="The readings at rest run along a straight line over the temperature, in "
            "every pose alike.",
            needs="Still poses at temperatures 10 °C or more apart, warm and cold in turn. In a "
            "single warm-up it looks like a drift.",
            remedy="Add the term and apply it with the sensor's own temperature, or take the mean "
            "rate at rest anew before each use.",
            confirm="Leave the device at rest, warm it by 10 °C and let it cool again: the rate "
            "follows the temperature both ways, on the same line.",
            source="IEEE Std 1431, model equation of Coriolis vibratory gyroscopes (temperature "
            "coefficients).",
        ),
        MAGNETOMETER: Story(
            what="The bridge of magnetic film changes its resistance with warmth, its four arms "
            "not quite alike, and so does the amplifier: the zero moves.",
            equation="error on an axis = coefficient × (temperature − mean temperature of the "
            "session)",
            signature="The same direction reads differently when warm; over the temperature the "
            "residuals of one direction lie on a straight line.",
            needs="Whole circles at temperatures 10 °C or more apart, warm and cold in turn. In a "
            "single warm-up it looks like a drift.",
            remedy="Add the term and apply it with the sensor's own temperature, or calibrate at "
            "the operating temperature. Many chips can set and reset their film, which removes "
            "most of it.",
            confirm="Leave the device untouched, warm it by 10 °C and let it cool again: the field "
            "follows the temperature both ways. A room whose field changes does not.",
            source="Data sheets of magnetoresistive sensors: offset temperature coefficient, set "
            "and reset.",
        ),
    }

    def course(self, c: Circumstances, variant: float | None) -> FloatArray:
        """``T − T₀``, °C."""
        del variant
        return warmth(c)

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "warmth"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """Known temperatures that differ."""
        del sensor
        return requirements.temperatures(c)
