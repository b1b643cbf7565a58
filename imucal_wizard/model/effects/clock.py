"""Drift of the sample clock."""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    DEGREE,
    GYROSCOPE,
    PPM,
    Circumstances,
    Effect,
    EffectParameter,
    Size,
    Story,
    c_number,
    sensed,
    since_middle,
)

_SIZE = Size(
    "ppm/min",
    PPM * DEGREE,
    100.0,
    {"consumer": (20.0, 300.0), "industrial": (2.0, 20.0), "tactical": (0.1, 2.0)},
    chosen=("consumer", "industrial", "tactical"),
)


class Clock(Effect):
    """``ε_i = c (t − t₀) w_i``: one share of every rate on all axes, which changes with time.

    ``t₀`` is the middle of the session. A constant error of the clock is exactly one scale error
    of all three axes, and no data of the sensor distinguish these. A changing one is exactly a
    drift of the scale by three equal coefficients.
    """

    name = "clock"
    sensors = (GYROSCOPE,)
    family = "slow-scale"
    against = "time"
    kind = "time"
    title = "drift of the sample clock"
    equation = "ε_i = c (t − t₀) w_i"
    order = 39
    aliases = ("scale-drift",)
    stories: Mapping[str, Story] = {
        GYROSCOPE: Story(
            what="The frequency of the oscillator that times the samples changes as it warms up "
            "or ages. If its second is too long, every integrated angle is too small, by the same "
            "share about all axes.",
            equation="error on an axis = coefficient × (time − middle of the session) × rate about "
            "that axis, the same coefficient for all axes",
            signature="Early rotations are measured too large and late ones too small, or vice "
            "versa, by the same share about every axis and in both senses.",
            needs="Rotations about all axes early and late. A clock that is wrong by a constant "
            "share is equivalent to a scale error and cannot be seen, and one that changes is "
            "equivalent to a drift of the three scales by equal coefficients. While the "
            "temperature only rises, three scale factors with the same temperature coefficient "
            "look the same.",
            remedy="Use the sensor's own sample counter or time stamps with a better clock, let "
            "the device warm up first, or add the term.",
            confirm="Count the samples in a quarter of an hour of an accurate clock, once cold "
            "and once warm: the sampling rate differs by the same share. A drift of the scales "
            "leaves it as it is.",
            source="IEEE Std 1139, frequency stability; data sheets of sensors with an RC or PLL "
            "oscillator state its drift with temperature.",
        ),
    }

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """``all``: one coefficient for the three axes."""
        del sensor
        return (_SIZE.parameter("all"),)

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Shape (n, 3, 1)."""
        del variant
        share = _SIZE.si * since_middle(c)
        return np.asarray((sensed(sensor, c) * share[:, None])[:, :, None])

    def c_columns(
        self, sensor: str, variant: float | None = None
    ) -> tuple[tuple[int, int, str], ...]:
        """See ``Effect``."""
        del sensor, variant
        factor = c_number(_SIZE.si)
        return tuple((i, 0, f"{factor} * since_middle / 60.0f * x{i}") for i in range(3))

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """Rotations in a session of more than a minute."""
        return requirements.rotations(sensor, c) or requirements.duration(c)
