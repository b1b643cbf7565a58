"""Change of the bias after power-on, or after handling."""

from collections.abc import Mapping

import numpy as np

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

TIME_CONSTANTS = (60.0, 100.0, 180.0, 300.0, 600.0, 1200.0)
"""Time constants tried, s; the fit then settles on one between them."""
USUAL_TIME_CONSTANT = 180.0


class WarmUp(BiasEffect):
    """``ε_i = W exp(−t/τ)``, ``t`` from the session's first sample.

    The turn-on transient of IEEE 1293 and IEEE 1431 as a single exponential. The bias of the base
    model is that of the warm sensor.
    """

    name = "warm-up"
    sensors = (ACCELEROMETER, GYROSCOPE)
    family = "slow-bias"
    against = "time"
    kind = "time"
    aliases_while_settling = ("thermal-lag",)
    graded = True
    title = "warm-up or relaxation, after power-on or handling"
    equation = "ε_i = Wᵢ exp(−t/τ)"
    order = 32
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg",
            MILLI_G,
            3.0,
            {"consumer": (1.0, 6.0), "industrial": (0.1, 1.0), "tactical": (0.01, 0.1)},
            chosen=("industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "°/s",
            DEGREE,
            0.2,
            {"consumer": (0.05, 0.5), "industrial": (0.005, 0.05), "tactical": (0.0005, 0.005)},
            chosen=("consumer", "industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="After power-on the chip heats itself by a few degrees and the stress in the "
            "package settles. The bias changes until the temperature is constant. A device that "
            "was screwed down, bent or knocked just before the session relaxes by the same curve: "
            "these data do not tell the two apart.",
            equation="error on an axis = size at the start × exp(−time / time constant)",
            signature="The residuals are largest in the first poses and have opposite signs at "
            "opposite faces. Later they level off at a smaller value of the other sign, because "
            "the fitted bias is a mean over the session.",
            needs="Begin the session when the cold device is switched on, and repeat the first "
            "poses at the end. Or let the device warm up for ten minutes first; then no term is "
            "needed.",
            remedy="Wait about three time constants until the warm-up is over, in calibration and "
            "in use. If that is not possible, apply the term with the time since power-on; the "
            "session must have begun at power-on, too. After handling, wait for as long.",
            confirm="Switch the cold device on and leave it untouched for twenty minutes, on two "
            "days: a warm-up shows the same curve both times. If the curve comes only after the "
            "device was handled, it is relaxation.",
            source="IEEE Std 528, inertial sensor terminology (warm-up time).",
        ),
        GYROSCOPE: Story(
            what="After power-on the chip heats itself by a few degrees and the drive settles. "
            "The bias changes until the temperature is constant. A device that was screwed down, "
            "bent or knocked just before the session relaxes by the same curve: these data do not "
            "tell the two apart.",
            equation="error on an axis = size at the start × exp(−time / time constant)",
            signature="The readings at rest approach a final value, fast at first and then more "
            "slowly.",
            needs="Begin the session when the cold device is switched on, with still poses from "
            "the first minute to the last. Or let the device warm up for ten minutes first; then "
            "no term is needed.",
            remedy="Wait about three time constants until the warm-up is over, in calibration and "
            "in use. If that is not possible, apply the term with the time since power-on; the "
            "session must have begun at power-on, too. After handling, wait for as long.",
            confirm="Switch the cold device on and leave it at rest for twenty minutes, on two "
            "days: a warm-up shows the same curve both times. If the curve comes only after the "
            "device was handled, it is relaxation.",
            source="IEEE Std 528, inertial sensor terminology (warm-up time).",
        ),
    }

    def variants(self, c: Circumstances) -> tuple[float | None, ...]:
        """Time constants, s."""
        del c
        return TIME_CONSTANTS

    def course(self, c: Circumstances, variant: float | None) -> FloatArray:
        """``exp(−t/τ)``."""
        return np.exp(-c.time / (USUAL_TIME_CONSTANT if variant is None else variant))

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        return f"expf(-time / {float(USUAL_TIME_CONSTANT if variant is None else variant)!r}f)"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """A session of more than a minute."""
        del sensor
        return requirements.duration(c)
