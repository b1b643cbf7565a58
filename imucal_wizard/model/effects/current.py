"""Field of the board's own currents."""

from collections.abc import Mapping

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import MAGNETOMETER, BiasEffect, Circumstances, Size, Story

AMPERE, PERCENT = "A", "%"
_SIZES = {
    AMPERE: Size(
        "µT/A",
        1.0,
        0.5,
        {"consumer": (0.1, 1.5), "industrial": (0.02, 0.1), "tactical": (0.002, 0.02)},
        chosen=("consumer", "industrial", "tactical"),
    ),
    PERCENT: Size(
        "µT/%",
        1.0,
        0.1,
        {"consumer": (0.02, 0.3), "industrial": (0.004, 0.02), "tactical": (4e-4, 0.004)},
        chosen=("consumer", "industrial", "tactical"),
    ),
}


class Current(BiasEffect):
    """``ε_i = k_i I``, the field of a conductor by Biot and Savart, fixed to the board.

    ``I`` is the current in A where it was recorded, else the throttle in per cent.
    """

    name = "current"
    sensors = (MAGNETOMETER,)
    against = "current"
    kind = "time"
    title = "field of the board's own current"
    equation = "ε_i = kᵢ I"
    order = 6
    stories: Mapping[str, Story] = {
        MAGNETOMETER: Story(
            what="Every current has a magnetic field. The leads to motor or battery are a few "
            "centimetres from the chip and fixed to the board, so their field acts as hard iron "
            "that changes with the throttle.",
            equation="error on an axis = coefficient × current (or throttle)",
            signature="The same direction reads differently while the motor runs. Plotted over "
            "the current, the residuals of one direction lie on a straight line. The bias absorbs "
            "the field of the mean current.",
            needs="A column current[A] or throttle[%] in the recording, and each direction at "
            "high and at low current.",
            remedy="Twist the leads, route the return lead beside the supply lead, or move the "
            "chip away. Then add the term for the remaining field and apply it with the measured "
            "current.",
            confirm="Leave the device untouched and switch the motor on and off: the reading "
            "jumps by coefficient × current.",
            source="ArduPilot, compass-motor calibration (compassmot); the law of Biot and Savart.",
        ),
    }

    def __init__(self, recorded: str = AMPERE) -> None:
        self.sizes = {MAGNETOMETER: _SIZES[recorded]}

    def suited(self, c: Circumstances) -> "Current":
        """Per ampere, or per per cent of the throttle, as recorded."""
        made = super(Current, Current(c.current_unit)).suited(c)
        assert isinstance(made, Current)  # noqa: S101 (narrows the type)
        return made

    def stored_units(self, sensor: str) -> tuple[str, ...]:
        """Per ampere and per per cent."""
        del sensor
        return tuple(one.unit for one in _SIZES.values())

    def course(self, c: Circumstances, variant: float | None) -> FloatArray:
        """``I``, A or %."""
        del variant
        return c.current

    def c_shape(self, variant: float | None) -> str:
        """See ``AxisEffect``."""
        del variant
        return "current"

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """A known current that changes."""
        del sensor
        return requirements.currents(c)
