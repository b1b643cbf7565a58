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
    aliases_while_settling = ("thermal-lag",)
    title = "temperature coefficient of the bias"
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
            what="Silicon, glue and package expand by different amounts when they warm up. The "
            "stress bends the die, the rest position of the proof mass moves, and the bias "
            "changes.",
            equation="error on an axis = coefficient × (temperature − mean temperature of the "
            "session)",
            signature="The same pose reads differently when warm. Plotted over the temperature, "
            "the residual is a straight line that rises at one face of the axis and falls at the "
            "other.",
            needs="A temperature change of 10 °C or more that is not proportional to time: repeat "
            "poses after warming the device and again after cooling it. In a single warm-up the "
            "effect looks like a drift.",
            remedy="Add the term and apply it with the sensor's own temperature, or let the device "
            "reach its operating temperature and calibrate there.",
            confirm="Leave the device untouched in one pose, warm it by 10 °C and let it cool "
            "again: while the device warms and while it cools, the reading lies on the same line "
            "over the temperature.",
            source="IEEE Std 1293, model equation of linear accelerometers (temperature "
            "coefficients); Martínez and others, Sensors 21 (2021) 3117.",
        ),
        GYROSCOPE: Story(
            what="The temperature changes the stiffness and the damping of the vibrating "
            "structure, and thereby the small part of the drive motion that leaks into the "
            "read-out: the bias changes.",
            equation="error on an axis = coefficient × (temperature − mean temperature of the "
            "session)",
            signature="Plotted over the temperature, the readings at rest lie on a straight line, "
            "which is the same in every pose.",
            needs="Still poses at temperatures 10 °C or more apart, warm and cold in turn. In a "
            "single warm-up the effect looks like a drift.",
            remedy="Add the term and apply it with the sensor's own temperature, or measure the "
            "mean rate at rest again before each use.",
            confirm="Leave the device at rest, warm it by 10 °C and let it cool again: while the "
            "device warms and while it cools, the rate lies on the same line over the temperature.",
            source="IEEE Std 1431, model equation of Coriolis vibratory gyroscopes (temperature "
            "coefficients).",
        ),
        MAGNETOMETER: Story(
            what="The resistance of the magnetoresistive bridge changes with temperature, by "
            "slightly different amounts in its four arms, and the offset of the amplifier changes "
            "too: the bias moves.",
            equation="error on an axis = coefficient × (temperature − mean temperature of the "
            "session)",
            signature="The same direction reads differently when warm. Plotted over the "
            "temperature, the residuals of one direction lie on a straight line.",
            needs="Whole circles at temperatures 10 °C or more apart, warm and cold in turn. In a "
            "single warm-up the effect looks like a drift.",
            remedy="Add the term and apply it with the sensor's own temperature, or calibrate at "
            "the operating temperature. Many chips can set and reset their film, which removes "
            "most of it.",
            confirm="Leave the device untouched, warm it by 10 °C and let it cool again: the "
            "reading follows the temperature while the device warms and while it cools. A change "
            "of the field in the room does not follow it.",
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
