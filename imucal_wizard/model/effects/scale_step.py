"""Step of the scale factor."""

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
    sudden = True
    paired = False
    title = "step of the scale"
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
            what="The supply or the reference voltage of the converter changes to another value, "
            "a reset changes the trim of the range, or a shock changes the strain of the package. "
            "From then on the gain is different.",
            equation="error on an axis = 0 before the step, coefficient × force on that axis "
            "after it",
            signature="After the step both faces of the axis read too large, or both too small; "
            "poses with the axis level do not change. Plotted over time, the residuals jump at "
            "one moment.",
            needs="Both faces of the axis before and after the step. While the temperature only "
            "rises, a step in the middle of the session resembles a temperature coefficient of "
            "the scale factor.",
            remedy="Calibrate again with the holds after the step, and find its cause: a supply "
            "that sags, a reset, a knock. A calibration from before the step is no longer valid.",
            confirm="Hold the two faces of the axis again: half the difference of their readings "
            "is the scale after the step, not the first one. Measure the supply voltage as well.",
            source="IEEE Std 528, inertial sensor terminology (scale factor repeatability).",
        ),
        GYROSCOPE: Story(
            what="After a reset or a knock the drive amplitude settles at another value, or the "
            "supply voltage changes. From then on the gain is different.",
            equation="error on an axis = 0 before the step, coefficient × rate about that axis "
            "after it",
            signature="After the step, rotations about the axis are measured too large, or too "
            "small, in both senses by the same share of their angle; before it, the other way "
            "round, because the fitted scale is a compromise.",
            needs="Rotations about the axis before and after the step, in both senses.",
            remedy="Calibrate again with the rotations after the step, and find its cause: a "
            "reset, a supply that sags, a knock.",
            confirm="Rotate the device by one full circle against a stop, early and late: the "
            "measured angles of the same rotation differ.",
            source="IEEE Std 528, inertial sensor terminology (scale factor repeatability).",
        ),
    }

    def variants(self, c: Circumstances) -> tuple[float | None, ...]:
        """Moments half way between neighbouring holds, s; None alone where there are too few."""
        return step_moments(c)

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """``x_i`` from the moment on, g or °/s; the middle of the session when none is given."""
        moment = c.reference_time if variant is None else variant
        return np.asarray(sensed(sensor, c) * c.share_after(moment)[:, None])

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        return f"{c_step(variant)} * {{x}}"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """Enough holds on either side, in a session of more than a minute; rotations."""
        return (
            requirements.rotations(sensor, c)
            or requirements.duration(c)
            or requirements.holds(sensor, c, 2 * SMALLEST_SIDE)
        )
