"""Scale factor that jumps once."""

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
    SMALLEST_SIDE,
    AxisEffect,
    Circumstances,
    Size,
    Story,
    c_step,
    sensed,
    step_moments,
)


class ScaleStep(AxisEffect):
    """``ε_i = S x_i`` from a moment on, 0 before: a scale factor that is another one ever after.

    The scale of the base model is that before the moment.
    """

    name = "scale-step"
    sensors = (ACCELEROMETER, GYROSCOPE)
    family = "slow-scale"
    against = "time"
    kind = "time"
    paired = False
    title = "scale jumps once"
    equation = "ε_i = Sᵢ x_i from the moment on"
    order = 42
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "ppm",
            PPM * ACCELERATION_UNITS["g"],
            1500.0,
            {"consumer": (500.0, 5000.0), "industrial": (50.0, 500.0), "tactical": (5.0, 50.0)},
            chosen=("consumer", "industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "ppm",
            PPM * DEGREE,
            1500.0,
            {"consumer": (500.0, 5000.0), "industrial": (50.0, 500.0), "tactical": (5.0, 50.0)},
            chosen=("consumer", "industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="The supply or the reference voltage of the converter settles at another value, "
            "a range is trimmed anew after a reset, or a shock changes the strain of the package: "
            "every force is measured with another ruler ever after.",
            equation="error on an axis = 0 before the moment, coefficient × force on that axis "
            "ever after",
            signature="Both faces of the axis come out too large after the moment, or too small, "
            "while a level axis does not care; over time the residuals jump between two holds.",
            needs="Both faces of the axis before and after. While the temperature only rises, a "
            "jump in the middle resembles the scale factor's temperature coefficient.",
            remedy="Calibrate again from the holds after the step and find its cause: a supply "
            "that sags, a reset, a knock. The calibration before the step no longer holds.",
            confirm="Hold the two faces of the axis again: half the difference of their readings "
            "is the later scale, not the first one. Measure the supply voltage as well.",
            source="IEEE Std 528, inertial sensor terminology (scale factor repeatability).",
        ),
        GYROSCOPE: Story(
            what="The drive amplitude is regulated to another value after a reset or a knock, or "
            "the supply jumps: every rate is measured with another ruler ever after.",
            equation="error on an axis = 0 before the moment, coefficient × rate about that axis "
            "ever after",
            signature="Rotations about the axis end too far after the moment, in both senses by "
            "the same share of their angle; rotations before it close.",
            needs="Rotations about the axis before and after, in both senses.",
            remedy="Calibrate again from the rotations after the step, and find its cause: a "
            "reset, a supply that sags, a knock.",
            confirm="Turn the device by one full turn against a stop, early and late: the reading "
            "of the same turn differs.",
            source="IEEE Std 528, inertial sensor terminology (scale factor repeatability).",
        ),
    }

    def variants(self, c: Circumstances) -> tuple[float | None, ...]:
        """Moments half way between neighbouring holds, s; None alone where there are too few."""
        return step_moments(c)

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """``x_i`` from the moment on, g or °/s; the middle of the session when none is given."""
        moment = c.reference_time if variant is None else variant
        return np.asarray(sensed(sensor, c) * (c.time >= moment)[:, None], np.float64)

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        return f"{c_step(variant)} * {{x}}"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """Enough holds on either side, in a session of more than a minute; rotations."""
        return (
            requirements.rotations(sensor, c)
            or requirements.duration(c)
            or requirements.rows(c, 2 * SMALLEST_SIDE)
        )
