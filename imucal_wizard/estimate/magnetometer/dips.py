"""The still poses of a magnetometer: mean field, and gravity as the accelerometer shows it."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.directions import group_directions, unit_vectors
from imucal_wizard.core.quaternions import quarter_turns, rotation_vector
from imucal_wizard.core.readings import FloatArray, IntArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.result import GravityReference
from imucal_wizard.measurement.holds import Hold

SMALLEST_NOISE = 1e-7
"""Of the field; data without any noise keep a weight."""
HOLD_TRIM = 0.1
"""Share of a hold left out at either end."""
MIN_DIP_SAMPLES = 4
"""Samples of the mean field in a hold."""
ALONG_AXES = np.radians(8.0)
"""Angle up to which axes lie along axes: rotations by more do not add up as small ones do."""
RESTLESS_HOLD = 3.0
"""Scatter of the field in a hold over its noise from which the device turned."""


@dataclass(frozen=True, eq=False)
class Dips:
    """Gravity and the field in still poses; h of them.

    Attributes:
        hold: which of all holds, shape (h,).
        reading: mean reading, shape (h, 3).
        up: unit vectors in the magnetometer's own axes, shape (h, 3).
        doubt: change of ``up`` with each doubt about the accelerometer, shape (h, 3, d).
        noise: variance of a component of the mean field and of up, µT², shape (h,).
        labels: number of each direction, shape (h,).
        turn: nearest way in which the magnetometer's axes lie along the accelerometer's, (3, 3).
    """

    hold: IntArray
    reading: FloatArray
    up: FloatArray
    doubt: FloatArray
    noise: FloatArray
    labels: IntArray
    turn: FloatArray

    def __len__(self) -> int:
        return len(self.hold)


NO_DIPS = Dips(
    hold=np.zeros(0, np.int64),
    reading=np.zeros((0, 3)),
    up=np.zeros((0, 3)),
    doubt=np.zeros((0, 3, 0)),
    noise=np.zeros(0),
    labels=np.zeros(0, np.int64),
    turn=np.eye(3),
)


def still_poses(
    series: Series,
    start: tuple[FloatArray, FloatArray],
    holds: Sequence[Hold],
    accelerometer: GravityReference,
    noise: float,
    field: float,
    aligned: FloatArray | None = None,
) -> Dips:
    """The still poses in which the field stood still, too.

    Args:
        series: the magnetometer's readings, times by the accelerometer's clock.
        start: M, symmetric, and b of the plain fit.
        holds: still periods.
        accelerometer: up in these periods.
        noise: variance of a sample of the corrected field.
        field: magnitude that corrected readings have.
        aligned: rotation from the magnetometer's frame to the accelerometer's, where it is known.
    """
    rows, means, counts = [], [], []
    for row, hold in enumerate(holds):
        values = middle_of(series, hold).values
        if len(values) >= MIN_DIP_SAMPLES and not _turns(values @ start[0].T, noise):
            rows.append(row)
            means.append(values.mean(axis=0))
            counts.append(len(values))
    hold_rows, reading = np.array(rows, np.int64), np.array(means).reshape(-1, 3)
    if not rows:
        return NO_DIPS
    up, doubt = accelerometer.up[hold_rows], accelerometer.doubt
    corrected = (reading - start[1]) @ start[0].T
    turn = _turn(up, corrected, aligned)
    own = noise / np.array(counts) + field**2 * accelerometer.variance[hold_rows]
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
    return nearest if away <= ALONG_AXES else aligned


def _turns(field: FloatArray, noise: float) -> bool:
    """Whether the field turned in a hold: about the vertical nothing else shows it."""
    return bool((field.std(axis=0) > RESTLESS_HOLD * np.sqrt(noise)).any())


def middle_of(series: Series, hold: Hold) -> Series:
    """The samples of a hold without its ends."""
    trim = HOLD_TRIM * (hold.end - hold.start)
    return series.between(hold.start + trim, hold.end - trim)
