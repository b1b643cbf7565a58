"""Rotation of the magnetometer against the accelerometer."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.effect import (
    DEGREE,
    MAGNETOMETER,
    Circumstances,
    Effect,
    EffectParameter,
    Size,
    Story,
    c_number,
)


class Misalignment(Effect):
    """``ε = m × φ``: the axes of the magnetometer are those of the accelerometer turned by φ.

    To first order a sensor turned by φ sees ``m − φ × m``. Chips that are mounted a quarter of a
    turn apart are counted from the nearest such position.
    """

    name = "misalignment"
    sensors = (MAGNETOMETER,)
    kind = "orientation"
    title = "rotation against the accelerometer"
    equation = "ε = m × φ"
    order = 5
    size = Size(
        "°",
        DEGREE,
        2.0,
        {"consumer": (0.5, 3.0), "industrial": (0.1, 0.5), "tactical": (0.02, 0.1)},
        chosen=("consumer", "industrial", "tactical"),
    )
    stories: Mapping[str, Story] = {
        MAGNETOMETER: Story(
            what="Two chips are never soldered exactly parallel: the axes of the magnetometer are "
            "rotated by a small angle against those of the accelerometer.",
            equation="error = field × small angles about x, y and z (a vector product)",
            signature="The magnitude of the field does not show it. The measured angle between "
            "field and gravity (the dip) differs from pose to pose, although the dip of a place "
            "is constant.",
            needs="Six still poses or more in all directions, with rotations about the vertical "
            "in between.",
            remedy="Keep the term: the matrix then includes the rotation, and headings of a tilted "
            "device are right.",
            confirm="Rotate the level device about the vertical by known angles, then repeat this "
            "with the device tilted by 30°: after the correction the headings agree.",
            source="Kok and Schön, Magnetometer calibration using inertial sensors, IEEE Sensors "
            "Journal 16 (2016).",
        ),
    }

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """The angles about ``x``, ``y``, ``z``."""
        del sensor
        return tuple(self.size.parameter(axis) for axis in AXES)

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """``m × e_j`` per degree, shape (n, 3, 3)."""
        del sensor, variant
        turned = np.cross(c.magnetic[:, None, :], np.eye(3))
        return np.asarray(self.size.si * np.swapaxes(turned, 1, 2))

    def c_columns(
        self, sensor: str, variant: float | None = None
    ) -> tuple[tuple[int, int, str], ...]:
        """See ``Effect``."""
        del sensor, variant
        factor, found = c_number(self.size.si), []
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            found += [(j, i, f"{factor} * x{k}"), (k, i, f"-{factor} * x{j}")]
        return tuple(found)

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """The magnitude of the field does not depend on it: the dip in still poses does."""
        del sensor, c
        return (
            "the sensors are aligned by the dip of the field; hold the device still in six or more "
            "poses, all round, so that accelerometer and magnetometer are both calibrated"
        )
