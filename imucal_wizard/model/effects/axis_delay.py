"""Delay of one gyroscope axis."""

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

_SIZE = Size(
    "ms",
    1e-3,
    1.0,
    {"consumer": (0.2, 3.0), "industrial": (0.05, 0.2), "tactical": (0.005, 0.05)},
    chosen=("consumer", "industrial", "tactical"),
)


class AxisDelay(Effect):
    """``y_i(t) = w_i(t − τ_i)`` with ``Σ τ_i = 0``, written as ``ε = Σ τ_i w_i (w × e_i)``.

    A late axis reads ``w_i − τ_i dw_i/dt``. From rest to rest the attitude C turns by
    ``−τ_i ∫ C e_i (dw_i/dt) dt = τ_i ∫ C (w × e_i) w_i dt`` (by parts, w vanishes at both ends),
    so that these products of rates have the same effect without the derivative of a noisy reading.
    They are two cross products of opposite sign: exact aliases in rotations from rest to
    rest. A delay common to all axes adds up to nothing: each τ_i is after the mean of the three.
    """

    name = "axis-delay"
    sensors = (GYROSCOPE,)
    family = "even-order"
    kind = "orientation"
    title = "delay of one axis"
    equation = "y_i(t) = w_i(t − τ_i), Σ τ_i = 0"
    order = 13
    aliases = ("cross-product",)
    gauge = ((1.0, 1.0, 1.0),)
    stories: Mapping[str, Story] = {
        GYROSCOPE: Story(
            what="The three axes are sampled one after the other, or one axis has a filter of its "
            "own. Values that are stored with one time stamp then belong to different times.",
            equation="reading of an axis = rate about that axis some milliseconds earlier; the "
            "delays count from the mean of the three axes",
            signature="Rotations about a single sensor axis close. Rotations about a tilted axis, "
            "and rotations that wobble, end in a wrong direction; the error grows with the speed.",
            needs="Fast rotations about tilted axes, from rest to rest. In such data a late axis "
            "is equivalent to two cross-axis products of equal size and opposite sign, one on each "
            "other axis, and a delay that all axes share cannot be seen.",
            remedy="Read all axes in one burst and give them the same filter, or shift the "
            "samples of the late axis by the delay before use. The term corrects the attitude "
            "after each motion.",
            confirm="Shake the device about a tilted axis and correlate the axes: the late axis "
            "lags behind the others by the same delay at every frequency, which a cross-axis "
            "product does not do.",
            source="Savage, Strapdown inertial navigation integration algorithm design (1998), "
            "pseudo-coning by unequal delays of the axes.",
        ),
    }

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """Delay of ``x``, ``y`` and ``z`` after the mean of the three."""
        del sensor
        return tuple(_SIZE.parameter(axis) for axis in "xyz")

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """``w_i (w × e_i)``, rad/s per ms, shape (n, 3, 3)."""
        del sensor, variant
        w = c.rate
        return np.asarray(
            np.stack([_SIZE.si * w[:, [i]] * np.cross(w, np.eye(3)[i]) for i in range(3)], axis=2)
        )

    def c_columns(
        self, sensor: str, variant: float | None = None
    ) -> tuple[tuple[int, int, str], ...]:
        """See ``Effect``."""
        del sensor, variant
        # w × e_i, the rates in °/s
        factor, found = c_number(_SIZE.si * DEGREE**2), []
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            found += [(j, i, f"{factor} * x{i} * x{k}"), (k, i, f"-{factor} * x{i} * x{j}")]
        return tuple(found)

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """The device must have been turned."""
        return requirements.rotations(sensor, c)
