"""Zero that follows the temperature late."""

from collections.abc import Mapping

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DEGREE,
    GYROSCOPE,
    MILLI_G,
    BiasEffect,
    Circumstances,
    Size,
    Story,
)


class ThermalLag(BiasEffect):
    """``ε_i = −τ_i k dT/dt``: to first order a zero that follows ``T(t − τ_i)`` in place of ``T``.

    A zero that moves by b per °C and lags by τ is ``b (T − T₀) − b τ dT/dt``. The product b τ is
    what shows; it is stated in seconds for a zero that moves by ``k``: 1 mg/°C, or 0.01 °/s/°C.
    """

    name = "thermal-lag"
    sensors = (ACCELEROMETER, GYROSCOPE)
    family = "slow-bias"
    against = "time"
    kind = "time"
    title = "bias lags behind the temperature"
    equation = "ε_i = −τᵢ k dT/dt"
    order = 35
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "s",
            MILLI_G,
            30.0,
            {"consumer": (10.0, 120.0), "industrial": (2.0, 10.0), "tactical": (0.2, 2.0)},
            chosen=("consumer", "industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "s",
            0.01 * DEGREE,
            60.0,
            {"consumer": (20.0, 240.0), "industrial": (2.0, 20.0), "tactical": (0.2, 2.0)},
            chosen=("consumer", "industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="The thermometer sits beside the proof mass, in the electronics or on the board. "
            "While the device warms or cools, package and glue are still at the temperature of "
            "half a minute ago, and the zero follows them and not the thermometer.",
            equation="error on an axis = − lag × 1 mg/°C × rate of change of the temperature. For "
            "a zero that moves by b mg/°C the lag is the size divided by b.",
            signature="The same pose at the same temperature reads differently while the device "
            "warms and while it cools: over the temperature the residuals form a loop. At a "
            "temperature that stands still nothing is wrong.",
            needs="The same poses while the device warms and while it cools, with the temperature "
            "recorded. In a single warm-up whose temperature settles exponentially, the lag is "
            "exactly a part of the temperature coefficient of the bias and of the warm-up: these "
            "data cannot separate them. While the temperature rises evenly, it is exactly a bias.",
            remedy="Wait until the temperature stands still, in calibration and in use. Or add the "
            "term together with the temperature coefficient, and apply both with the recorded "
            "temperature.",
            confirm="Leave the device untouched in one pose, warm it by 10 °C within a few minutes "
            "and let it cool: the readings over the temperature run on two lines, twice the lag "
            "times the rate of change apart.",
            source="IEEE Std 1293, model equation of linear accelerometers (temperature and "
            "temperature-gradient sensitivity).",
        ),
        GYROSCOPE: Story(
            what="The thermometer sits beside the vibrating structure. While the device warms or "
            "cools, the structure is still at the temperature of half a minute ago, and the zero "
            "follows it and not the thermometer.",
            equation="error on an axis = − lag × 0.01 °/s/°C × rate of change of the temperature. "
            "For a zero that moves by b °/s/°C the lag is the size times 0.01 / b.",
            signature="The readings at rest at the same temperature differ while the device warms "
            "and while it cools. At a temperature that stands still nothing is wrong.",
            needs="Rests while the device warms and while it cools, with the temperature recorded. "
            "In a single warm-up whose temperature settles exponentially, the lag is exactly a "
            "part of the temperature coefficient of the bias and of the warm-up.",
            remedy="Wait until the temperature stands still, in calibration and in use. Or add the "
            "term together with the temperature coefficient, and apply both with the recorded "
            "temperature.",
            confirm="Leave the device at rest, warm it by 10 °C within a few minutes and let it "
            "cool: the rate over the temperature runs on two lines, twice the lag times the rate "
            "of change apart.",
            source="IEEE Std 1431, model equation of Coriolis vibratory gyroscopes (sensitivity to "
            "temperature and to its rate of change).",
        ),
    }

    def course(self, c: Circumstances, variant: float | None) -> FloatArray:
        """``−dT/dt``, °C/s."""
        del variant
        return -c.warming

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "(-warming)"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """Temperatures that differ, in a session of more than a minute."""
        del sensor
        return requirements.duration(c) or requirements.temperatures(c)
