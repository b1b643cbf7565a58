"""Second-order non-linearity."""

from collections.abc import Mapping

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DEGREE,
    GYROSCOPE,
    MILLI_G,
    AxisEffect,
    Circumstances,
    Size,
    Story,
    sensed,
)


class SecondOrder(AxisEffect):
    """``ε_i = K₂ x_i²``: the term K₂ of the model equations of IEEE 1293 and IEEE 1431."""

    name = "second-order"
    sensors = (ACCELEROMETER, GYROSCOPE)
    family = "even-order"
    kind = "orientation"
    title = "second-order non-linearity"
    equation = "ε_i = K₂ᵢ x_i²"
    order = 10
    # a best-fit-line specification e of full scale F bounds a pure parabola: K₂ ≤ 2e/F
    sizes: Mapping[str, Size] = {
        ACCELEROMETER: Size(
            "mg/g²",
            MILLI_G,
            2.0,
            {"consumer": (0.5, 5.0), "industrial": (0.1, 0.5), "tactical": (0.01, 0.1)},
            chosen=("industrial", "tactical"),
        ),
        GYROSCOPE: Size(
            "ppm/(°/s)",
            1e-6 * DEGREE,
            8.0,
            {"consumer": (1.0, 16.0), "industrial": (0.2, 1.0), "tactical": (0.02, 0.2)},
            chosen=("industrial", "tactical"),
        ),
    }
    stories: Mapping[str, Story] = {
        ACCELEROMETER: Story(
            what="The proof mass hangs between two electrodes. A force narrows one gap and widens "
            "the other by the same distance. A capacitance is proportional to one over its gap, "
            "so one capacitance changes by more than the other. If the mass does not rest exactly "
            "in the middle, or the two sides differ, the read-out does not cancel this "
            "difference. The error that remains has the same sign for both directions of the "
            "force.",
            equation="error on an axis = coefficient × (force on that axis)²",
            signature="Plotted over the force on the axis, the residual is an S: it has opposite "
            "signs at opposite faces and crosses zero about 40° away from each face. The bias "
            "absorbs most of the error, so the fit shows only the rest.",
            needs="Both faces of the axis and poses half way between (edges, corners). At 1 g the "
            "asymmetry looks almost the same, and cross-axis products of equal size on the two "
            "other axes cause exactly the same residuals; forces well above 1 g separate them. "
            "Their directions differ, which a gyroscope's rotations may show.",
            remedy="Add the term and apply it with the calibration; without the term, the fit "
            "counts 60 % of the error as bias. Apply the term above 1 g only if a test there has "
            "confirmed it.",
            confirm="Measure at several g in both directions, on a centrifuge: half the sum of "
            "the two readings, less the bias, grows with the square of the force.",
            source="IEEE Std 1293, model equation of linear accelerometers (K₂); Ang, Khosla and "
            "Riviere, IEEE Sensors Journal 7 (2007).",
        ),
        GYROSCOPE: Story(
            what="The Coriolis force displaces the vibrating mass, to one side for a positive "
            "rate and to the other for a negative one. If the two sides of the read-out differ, "
            "the error has the same sign in both senses and grows with the square of the rate.",
            equation="error on an axis = coefficient × (rate about that axis)²",
            signature="Rotations in one sense are measured too large and those in the other sense "
            "too small; the error grows with the speed.",
            needs="Rotations in both senses and at three speeds or more. With one sense only, the "
            "scale absorbs the error; with one speed only, it looks like the asymmetry.",
            remedy="Add the term and apply it: the error does not average to zero in a device "
            "that swings to and fro.",
            confirm="Turn the sensor on a rate table at the same rates in both senses: half the "
            "sum of the two errors grows with the square of the rate.",
            source="IEEE Std 1431, model equation of Coriolis vibratory gyroscopes.",
        ),
    }

    def shape(self, sensor: str, c: Circumstances, variant: float | None) -> FloatArray:
        """``x_i²``, g² or (°/s)²."""
        del variant
        return sensed(sensor, c) ** 2

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "{x} * {x}"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """A gyroscope must have been turned in both senses."""
        return requirements.both_senses(sensor, c)
