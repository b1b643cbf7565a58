"""Lag of the bias behind the temperature."""

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
    aliases_while_settling = ("bias-temperature", "warm-up")
    title = "lag of the bias behind the temperature"
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
            what="The thermometer is in the electronics or on the board, not at the proof mass. "
            "While the device warms or cools, package and glue still have the temperature of half "
            "a minute earlier, and the bias follows their temperature, not the measured one.",
            equation="error on an axis = − lag × 1 mg/°C × rate of change of the temperature. If "
            "the bias changes by b mg/°C, the lag is the size divided by b.",
            signature="The same pose at the same temperature reads differently while the device "
            "warms and while it cools: plotted over the temperature, the residuals form a loop. "
            "At a constant temperature there is no error.",
            needs="The same poses while the device warms and while it cools, with the temperature "
            "recorded. In a single warm-up whose temperature settles exponentially, the lag is "
            "equivalent to a temperature coefficient of the bias, and to a warm-up with the same "
            "time constant: such data cannot separate them. While the temperature rises at a "
            "constant rate, it is equivalent to a bias.",
            remedy="Wait until the temperature is constant, in calibration and in use. Or add the "
            "term together with the temperature coefficient, and apply both with the recorded "
            "temperature.",
            confirm="Leave the device untouched in one pose, warm it by 10 °C within a few "
            "minutes and let it cool: plotted over the temperature, the readings lie on two "
            "lines. Their distance along the temperature is twice the lag times the rate of "
            "change.",
            source="IEEE Std 1293, model equation of linear accelerometers (temperature and "
            "temperature-gradient sensitivity).",
        ),
        GYROSCOPE: Story(
            what="The thermometer is beside the vibrating structure. While the device warms or "
            "cools, the structure still has the temperature of half a minute earlier, and the "
            "bias follows its temperature, not the measured one.",
            equation="error on an axis = − lag × 0.01 °/s/°C × rate of change of the temperature. "
            "If the bias changes by b °/s/°C, the lag is the size times 0.01 / b.",
            signature="At the same temperature, the readings at rest differ between warming and "
            "cooling. At a constant temperature there is no error.",
            needs="Rests while the device warms and while it cools, with the temperature "
            "recorded. In a single warm-up whose temperature settles exponentially, the lag is "
            "equivalent to a temperature coefficient of the bias, and to a warm-up with the same "
            "time constant.",
            remedy="Wait until the temperature is constant, in calibration and in use. Or add the "
            "term together with the temperature coefficient, and apply both with the recorded "
            "temperature.",
            confirm="Leave the device at rest, warm it by 10 °C within a few minutes and let it "
            "cool: plotted over the temperature, the rate lies on two lines. Their distance along "
            "the temperature is twice the lag times the rate of change.",
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
