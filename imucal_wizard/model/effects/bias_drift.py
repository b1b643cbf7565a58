"""Drift of the bias with time."""

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
    since_middle,
)


class BiasDrift(BiasEffect):
    """``ε_i = d (t − t₀)``, ``t₀`` the middle of the session.

    The trend, or rate ramp, of the bias in IEEE 1293 and IEEE 1431; the bias of the base model is
    that of the session's middle.
    """

    name = "bias-drift"
    sensors = (ACCELEROMETER, GYROSCOPE, MAGNETOMETER)
    family = "slow-bias"
    against = "time"
    kind = "time"
    title = "drift of the bias with time"
    equation = "ε_i = dᵢ (t − t₀)"
    order = 31
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg/min",
            MILLI_G,
            0.3,
            {"consumer": (0.05, 1.0), "industrial": (0.005, 0.05), "tactical": (0.0005, 0.005)},
            chosen=("industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "°/s/min",
            DEGREE,
            0.01,
            {"consumer": (0.002, 0.02), "industrial": (2e-4, 0.002), "tactical": (2e-5, 2e-4)},
            chosen=("consumer", "industrial", "tactical"),
        ),
        MAGNETOMETER: Size(
            "µT/min",
            1.0,
            0.2,
            {"consumer": (0.05, 0.5), "industrial": (0.01, 0.05), "tactical": (0.001, 0.01)},
            chosen=("consumer", "industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="Stress relaxes, charge accumulates on the electrodes, or the supply voltage "
            "falls: the bias changes a little every minute. Slow noise can look the same for a "
            "while, but follows no law.",
            equation="error on an axis = coefficient × (time − middle of the session)",
            signature="The same pose reads differently later. The residuals of the poses spread "
            "like a fan from the middle of the session to both ends.",
            needs="The same poses early, in the middle and late. Without repeats the drift cannot "
            "be separated from temperature or warm-up, and slow noise alone can look like it.",
            remedy="Measure the bias again before use, with a few poses. Do not apply the slope "
            "outside the session: it seldom continues.",
            confirm="Leave the device untouched at a steady temperature for an hour: a drift "
            "changes the reading steadily in one direction; slow noise lets it wander in both.",
            source="IEEE Std 528, inertial sensor terminology (drift rate); Allan variance in IEEE "
            "Std 952, annex C.",
        ),
        GYROSCOPE: Story(
            what="The bias of the rate changes a little every minute, because the drive ages or "
            "the supply voltage falls. Slow noise can look the same for a while, but follows no "
            "law.",
            equation="error on an axis = coefficient × (time − middle of the session)",
            signature="The readings at rest rise or fall steadily, by the same amount in every "
            "pose.",
            needs="Still poses over the whole session at a steady temperature.",
            remedy="Measure the mean rate at rest again before each use. Do not apply the slope "
            "outside the session: it seldom continues.",
            confirm="Leave the device at rest at a steady temperature for an hour: a drift "
            "changes the rate steadily in one direction; slow noise lets it wander in both.",
            source="IEEE Std 528, inertial sensor terminology (drift rate); Allan variance in IEEE "
            "Std 952, annex C.",
        ),
        MAGNETOMETER: Story(
            what="The iron of the board becomes magnetised by the field around it, the currents "
            "change as the battery empties, or the offset of the amplifier ages: the hard iron "
            "changes a little every minute.",
            equation="error on an axis = coefficient × (time − middle of the session)",
            signature="The same direction reads differently later. The ellipsoid moves, and the "
            "residuals spread like a fan from the middle of the session to both ends.",
            needs="Whole circles early and late. Without them the drift cannot be separated from "
            "temperature. A change of the field in the room looks the same.",
            remedy="Calibrate again before use. If the battery or a current is the cause, move it "
            "away from the chip.",
            confirm="Leave the device untouched for half an hour, with a second magnetometer "
            "beside it: if both readings change, the field in the room changes.",
            source="IEEE Std 528, inertial sensor terminology (drift rate).",
        ),
    }

    def course(self, c: Circumstances, variant: float | None) -> FloatArray:
        """``t − t₀``, min."""
        del variant
        return since_middle(c)

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "since_middle / 60.0f"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """A session of more than a minute."""
        del sensor
        return requirements.duration(c)
