"""What each motion turned about, and which axis of the gyroscope says nothing of it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.fitting.comparison import integral
from imucal_wizard.fitting.turns import Bench
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.solver.accelerometer import AccelerometerFit
from imucal_wizard.solver.gyroscope import VectorFit

ONE_AXIS_SHARE = 0.9
"""Share of all turning that is about one body axis, for Q's single-axis methods."""
LEVEL = 0.35
"""Largest component of up along that axis (20° off level): gravity must see the turn."""
SILENT_RATIO = 2.0
"""Spread of an axis in motion over its noise at rest up to which it says nothing of the motion."""
SILENT_SHARE = 1e-4
"""The same over the spread of the liveliest axis: 0.02 °/s of 200."""
SMALLEST_TURN = np.radians(5.0)
"""A motion that turns less than this is a disturbed hold, not a rotation."""


def silent_axes(rotations: Sequence[Rotation], bench: Bench) -> tuple[str, ...]:
    """A warning for each axis that says no more in motion than at rest."""
    rates = np.concatenate([rotation.rate for rotation in rotations])
    intervals = bench.turns.steps.dt
    interval = float(np.median(intervals[intervals > 0.0]))
    spread = rates.std(axis=0)
    noise = np.sqrt(bench.density / interval)
    still = (spread <= SILENT_RATIO * noise) | (spread <= SILENT_SHARE * spread.max())
    return tuple(
        f"gyroscope axis {axis} reads the same while the device turns as at rest: it is dead, or "
        "nothing turned about it"
        for axis, silent in zip("xyz", still, strict=True)
        if silent
    )


def name_axes(
    rotations: Sequence[Rotation],
    vector: VectorFit,
    accelerometer: AccelerometerFit,
    holds: Sequence[Hold],
) -> tuple[tuple[Rotation, ...], tuple[float | None, ...]]:
    """Each rotation with the axis it was about, and its angle, rad, where that can be told."""
    places = {id(hold): index for index, hold in enumerate(holds)}
    named: list[Rotation] = []
    angles: list[float | None] = []
    for rotation in rotations:
        place = places.get(id(rotation.before))
        if place is None or len(rotation.time) < 2 or not np.isfinite(rotation.rate).all():
            named.append(rotation)
            angles.append(None)
            continue
        rate = (rotation.rate - vector.bias) @ vector.matrix.T
        total = integral(rate, rotation.time)
        turned = float(integral(np.linalg.norm(rate, axis=1)[:, None], rotation.time)[0])
        axis = int(np.argmax(np.abs(total)))
        up = accelerometer.up[place]
        about = abs(total[axis]) > ONE_AXIS_SHARE * np.linalg.norm(total)
        clear = about and abs(total[axis]) > SMALLEST_TURN and abs(up[axis]) < LEVEL
        named.append(replace(rotation, axis="xyz"[axis] if clear else None))
        angles.append(float(total[axis] if clear else turned))
    return tuple(named), tuple(angles)
