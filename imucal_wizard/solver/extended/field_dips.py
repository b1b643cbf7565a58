"""The still poses of a magnetometer: mean field, and gravity as the accelerometer shows it."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray, Series
from imucal_wizard.solver.accelerometer import AccelerometerFit
from imucal_wizard.solver.directions import group_directions, unit_vectors
from imucal_wizard.solver.extended.field_data import SMALLEST_NOISE, Dips
from imucal_wizard.solver.second_stage.rotation import quarter_turns, rotation_vector

TRIM = 0.1
"""Share of a hold left out at either end."""
FEWEST = 4
"""Samples of the mean field in a hold."""
ALONG = np.radians(8.0)
"""Angle up to which axes lie along axes: rotations by more do not add up as small ones do."""
RESTLESS = 3.0
"""Scatter of the field in a hold over its noise from which the device turned."""


def still_poses(
    series: Series,
    start: tuple[FloatArray, FloatArray],
    holds: Sequence[Hold],
    accelerometer: AccelerometerFit | None,
    noise: float,
    field: float,
    aligned: FloatArray | None = None,
) -> Dips:
    """The still poses in which the field stood still, too.

    Args:
        series: the magnetometer's readings, times by the accelerometer's clock.
        start: M, symmetric, and b of the plain fit.
        holds: still periods.
        accelerometer: its fit; without it there are no poses.
        noise: variance of a sample of the corrected field.
        field: magnitude that corrected readings have.
        aligned: rotation from the magnetometer's frame to the accelerometer's, where it is known.
    """
    rows, means, counts = [], [], []
    for row, hold in enumerate(holds if accelerometer is not None else ()):
        values = middle_of(series, hold).values
        if len(values) >= FEWEST and not _turns(values @ start[0].T, noise):
            rows.append(row)
            means.append(values.mean(axis=0))
            counts.append(len(values))
    hold_rows, reading = np.array(rows, np.int64), np.array(means).reshape(-1, 3)
    if accelerometer is None or not rows:
        none = np.zeros((0, 3))
        return Dips(hold_rows, none, none, np.zeros((0, 3, 0)), np.zeros(0), hold_rows, np.eye(3))
    up, doubt = accelerometer.up[hold_rows], accelerometer.up_doubt
    doubt = np.zeros((len(accelerometer.up), 3, 0)) if doubt is None else doubt
    corrected = (reading - start[1]) @ start[0].T
    turn = _turn(up, corrected, aligned)
    own = noise / np.array(counts) + field**2 * accelerometer.direction_variance[hold_rows]
    return Dips(
        hold=hold_rows,
        reading=reading,
        up=up @ turn,
        doubt=np.einsum("ji,hjd->hid", turn, doubt[hold_rows]),
        noise=np.maximum(own, (SMALLEST_NOISE * field) ** 2),
        labels=group_directions(unit_vectors(corrected)),
        turn=turn,
    )


def _turn(up: FloatArray, corrected: FloatArray, aligned: FloatArray | None) -> FloatArray:
    """The way in which the axes lie along axes, from which on the misalignment is small.

    Of a sensor that lies along no axes it is the rotation itself, and nothing is left of it.
    """
    if aligned is None:
        return min(
            quarter_turns(), key=lambda one: float(((up @ one) * corrected).sum(axis=1).var())
        )
    nearest = max(quarter_turns(), key=lambda one: float((one * aligned).sum()))
    away = np.linalg.norm(rotation_vector(aligned @ nearest.T))
    return nearest if away <= ALONG else aligned


def _turns(field: FloatArray, noise: float) -> bool:
    """Whether the field turned in a hold: about the vertical nothing else shows it."""
    return bool((field.std(axis=0) > RESTLESS * np.sqrt(noise)).any())


def middle_of(series: Series, hold: Hold) -> Series:
    """The samples of a hold without its ends."""
    trim = TRIM * (hold.end - hold.start)
    return series.between(hold.start + trim, hold.end - trim)
