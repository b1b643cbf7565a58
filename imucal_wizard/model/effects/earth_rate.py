"""The rotation of the Earth."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    DEGREE,
    GYROSCOPE,
    Circumstances,
    Effect,
    EffectParameter,
    Size,
    Story,
    c_number,
)

EARTH_RATE = 7.292115e-5
"""Sidereal rate of the Earth, rad/s (WGS 84): 15.041 °/h."""
DEGREE_PER_HOUR = DEGREE / 3600.0


class EarthRate(Effect):
    """``ε = Ω_up u``: the part of the Earth's rate along the vertical, ``u`` the up direction.

    IEEE 1431 adds the Earth's rate to the input of every test, and so do the rows of rests and
    rotations between them (``model/rows/earth.py``), but not those of a rate table alone. Of its
    two parts, ``Ω sin φ`` lies along up and is known in the body frame wherever gravity is; added
    as an effect, it is reported with its size.
    ``Ω cos φ`` points north: it belongs to the headings of one session, and no calibration holds
    it. The vertical part looks exactly like a g-sensitivity that is the same on all axes; only the
    narrow prior of a known planet separates them.
    """

    name = "earth-rate"
    sensors = (GYROSCOPE,)
    against = "force"
    kind = "orientation"
    title = "the rotation of the Earth"
    equation = "ε = Ω_up u"
    order = 60
    bounded = True
    stories: Mapping[str, Story] = {
        GYROSCOPE: Story(
            what="Nothing is wrong with the sensor. The Earth rotates by 15° per hour, and a "
            "gyroscope at rest measures this rate. One component is about the vertical, largest "
            "at the poles and zero at the equator; the other is about the horizontal direction to "
            "north.",
            equation="error = one rate × the direction that is up, on all three axes",
            signature="The readings at rest follow the up direction with the same small slope on "
            "each axis: positive on the northern half of the Earth.",
            needs="A gyroscope whose bias is stable to a few degrees per hour, and still poses in "
            "all directions. A g-sensitivity that is the same on all three axes has the same "
            "pattern; only its size can tell. Gravity does not show the heading of a pose, "
            "but the rotations from pose to pose do, except for that of the first pose: the "
            "component towards north, at most 0.0042 °/s, is fitted along two level directions.",
            remedy="No repair is needed. Every fit of rests and rotations between them allows for "
            "both components, whether the term is added or not, so that neither is counted as "
            "bias; adding the term shows the vertical one. The fit of a rate table alone does not "
            "know how the table lies on the Earth: its biases contain what the sensor felt of it. "
            "A navigation filter subtracts both by latitude and heading.",
            confirm="The size is 15.04 °/h times the sine of the latitude: compare it with the "
            "value for your latitude.",
            source="WGS 84: the Earth turns by 7.292115·10⁻⁵ rad/s.",
        ),
    }

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """``up``: the rate about the vertical; ``Ω sin φ`` with the sign of the latitude."""
        del sensor
        whole = EARTH_RATE / DEGREE_PER_HOUR
        grades = dict.fromkeys(("consumer", "industrial", "tactical"), (0.0, whole))
        return (Size("°/h", DEGREE_PER_HOUR, whole / np.sqrt(2.0), grades).parameter("up"),)

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """``u``, shape (n, 3, 1)."""
        del sensor, variant
        length = np.linalg.norm(c.force, axis=1, keepdims=True)
        up = np.divide(c.force, length, out=np.zeros_like(c.force), where=length > 0.0)
        return np.asarray(DEGREE_PER_HOUR * up[:, :, None], np.float64)

    def c_columns(
        self, sensor: str, variant: float | None = None
    ) -> tuple[tuple[int, int, str], ...]:
        """See ``Effect``."""
        del sensor, variant
        factor, length = c_number(DEGREE_PER_HOUR), "sqrtf(f0 * f0 + f1 * f1 + f2 * f2)"
        return tuple((i, 0, f"{factor} * f{i} / {length}") for i in range(3))

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """More than one pose; the heading is lacking always and is in the lesson."""
        del sensor
        return requirements.directions(c)
