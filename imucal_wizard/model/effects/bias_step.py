"""Step of the bias."""

from collections.abc import Mapping

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DEGREE,
    GYROSCOPE,
    MILLI_G,
    SMALLEST_SIDE,
    BiasEffect,
    Circumstances,
    Size,
    Story,
    c_step,
    step_moments,
)


class BiasStep(BiasEffect):
    """``ε_i = B`` from a moment on, 0 before: a bias shift, as after a shock (IEEE 1293, 1431).

    The bias of the base model is that before the moment.
    """

    name = "bias-step"
    sensors = (ACCELEROMETER, GYROSCOPE)
    family = "slow-bias"
    against = "time"
    kind = "time"
    sudden = True
    title = "step of the bias"
    equation = "ε_i = Bᵢ from the moment on"
    order = 33
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg",
            MILLI_G,
            3.0,
            {"consumer": (1.0, 6.0), "industrial": (0.1, 1.0), "tactical": (0.01, 0.1)},
            chosen=("consumer", "industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "°/s",
            DEGREE,
            0.1,
            {"consumer": (0.02, 0.3), "industrial": (0.002, 0.02), "tactical": (2e-4, 0.002)},
            chosen=("consumer", "industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="A bump, a fall or a tightened screw strains the package, and the rest position "
            "of the proof mass changes. A power dip that resets an offset inside the chip has the "
            "same effect.",
            equation="error on an axis = 0 before the step, constant after it",
            signature="Plotted over time, the residuals of a face stay at one level, jump, and "
            "stay at another level. A hold in which the step happens lies between the two.",
            needs="Repeated poses before and after the step. If you know when the device was "
            "bumped, calibrate again with the holds after that time.",
            remedy="Calibrate again from the holds after the step, and find its cause: a loose "
            "board, a screw, a power dip. A calibration from before the step is no longer valid.",
            confirm="Hold the first poses again: their readings agree with those after the step, "
            "not with the first ones.",
            source="IEEE Std 528, inertial sensor terminology (bias repeatability).",
        ),
        GYROSCOPE: Story(
            what="A bump strains the package, or a power dip resets an offset inside the chip: "
            "from then on the bias of the rate is different.",
            equation="error on an axis = 0 before the step, constant after it",
            signature="The readings at rest stay at one level, jump, and stay at another level. A "
            "rest in which the step happens lies between the two.",
            needs="At least three still poses on each side of the step.",
            remedy="Measure the mean rate at rest again, and find the cause of the step: a bump, "
            "a loose board, a power dip.",
            confirm="Rest the device once more: the mean rate agrees with that after the step, "
            "not with the first one.",
            source="IEEE Std 528, inertial sensor terminology (bias repeatability).",
        ),
    }

    def variants(self, c: Circumstances) -> tuple[float | None, ...]:
        """Moments half way between neighbouring holds, s; None alone where there are too few."""
        return step_moments(c)

    def course(self, c: Circumstances, variant: float | None) -> FloatArray:
        """0 before the moment, 1 after it; in the middle of the session when none is given."""
        moment = c.reference_time if variant is None else variant
        return c.share_after(moment)

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        return c_step(variant)

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """Enough holds on either side, in a session of more than a minute."""
        return requirements.duration(c) or requirements.holds(sensor, c, 2 * SMALLEST_SIDE)
