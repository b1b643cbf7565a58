"""From holds and series to what the second stage takes: field at rest, turns between any two rests.

The turns of the gyroscope's fit to gravity leave out those about the vertical, which gravity does
not see; here they count.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.fitting.turning import SMALLEST_TURN
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.procedure.segmentation import OVERLAP
from imucal_wizard.readings import GAP, FloatArray, Series
from imucal_wizard.solver.attitude import advancing, attitudes, lay_out, rotation_vectors
from imucal_wizard.solver.magnetometer.report import MagnetometerFit
from imucal_wizard.solver.quaternions import matrices, quaternions
from imucal_wizard.solver.result import SensorFit
from imucal_wizard.solver.second_stage.clock import Passage

LONGEST_TURN = 30.0
"""Seconds; longer ones gather too much noise of the gyroscope."""
UNSURE = 0.25
"""Share of a hold left out at either end while the clocks are not yet compared."""
FEWEST = 3
RESTLESS = 3.0
"""Scatter of the field in a hold over its noise, from which the device turned."""
STEADY = 0.003
"""Scatter as a share of the field that is always allowed: 0.2°."""


@dataclass(frozen=True, eq=False)
class Crossing:
    """The gyroscope between two holds that follow one another.

    Attributes:
        before: index of the hold before.
        after: index of the hold after.
        time: sample times, s, shape (n,).
        rate: readings, shape (n, 3).
    """

    before: int
    after: int
    time: FloatArray
    rate: FloatArray


def undisturbed(series: Series, found: MagnetometerFit) -> Series:
    """The readings without those that the calibration has found disturbed."""
    return Series(series.time[found.undisturbed], series.values[found.undisturbed], series.unit)


def field_at(
    holds: Sequence[Hold], calm: Series, found: MagnetometerFit, clock: float | None = None
) -> tuple[list[int], FloatArray]:
    """Mean reading of the magnetometer in each hold in which the field stood still.

    Args:
        holds: still periods.
        calm: the magnetometer's undisturbed readings.
        found: its calibration.
        clock: the magnetometer's clock minus the other's, s; None when not known, and then the
            ends of each hold are left out.

    Returns:
        Indices of the holds, and the means, shape (k, 3).
    """
    chosen, means = [], []
    for index, hold in enumerate(holds):
        trim = UNSURE * (hold.end - hold.start) if clock is None else 0.0
        offset = clock or 0.0
        values = calm.between(hold.start + trim + offset, hold.end - trim + offset).values
        if len(values) < FEWEST or _turns(values, found):
            continue
        chosen.append(index)
        means.append(values.mean(axis=0))
    return chosen, np.array(means, float).reshape(-1, 3)


def _turns(values: FloatArray, found: MagnetometerFit) -> bool:
    """Whether the field turned during a hold: about the vertical only the magnetometer sees it."""
    corrected = (values - found.fit.bias) @ found.fit.matrix.T
    floor = max(found.fit.floor or 0.0, STEADY * found.magnitude)
    return bool((corrected.std(axis=0) > RESTLESS * floor).any())


def crossings(holds: Sequence[Hold], gyroscope: Series) -> list[Crossing]:
    """The gyroscope between each hold and the next, where it is whole."""
    interval = float(np.median(np.diff(gyroscope.time))) if len(gyroscope) > 1 else 0.0
    found = (
        _crossing(
            index,
            index + 1,
            gyroscope.between(holds[index].end - OVERLAP, holds[index + 1].start + OVERLAP),
            interval,
        )
        for index in range(len(holds) - 1)
    )
    return [one for one in found if one is not None]


def crossings_of(rotations: Sequence[Rotation], holds: Sequence[Hold]) -> list[Crossing]:
    """The same of motions that were gathered live; those without a problem, between kept holds."""
    places = {id(hold): index for index, hold in enumerate(holds)}
    out = []
    for rotation in rotations:
        before, after = places.get(id(rotation.before)), places.get(id(rotation.after))
        if rotation.problem is not None or before is None or after is None:
            continue
        interval = float(np.median(np.diff(rotation.time)))
        one = _crossing(before, after, Series(rotation.time, rotation.rate, ""), interval)
        out += [] if one is None else [one]
    return out


def _crossing(before: int, after: int, part: Series, interval: float) -> Crossing | None:
    """A motion whose samples are all there and that does not last too long."""
    later = advancing(part.time)
    time, rate = part.time[later], part.values[later]
    whole = len(time) > FEWEST and bool((np.diff(time) <= GAP * interval).all())
    if not whole or time[-1] - time[0] > LONGEST_TURN or not np.isfinite(rate).all():
        return None
    return Crossing(before, after, time, rate)


def passages(
    turns: Sequence[Crossing], gyroscope: SensorFit, series: Series, magnetometer: SensorFit
) -> list[Passage]:
    """The turns with attitude and field, for the comparison of the clocks."""
    out = []
    for turn in turns:
        steps = lay_out([turn.time], [turn.rate])
        phi = rotation_vectors(steps, gyroscope.matrix, gyroscope.bias)
        first, last = attitudes(quaternions(phi), steps.offsets)
        count = len(turn.time)
        whole = np.concatenate([first[:, : count - 1], last[:, count - 2 : count - 1]], axis=1)
        rate = (turn.rate - gyroscope.bias) @ gyroscope.matrix.T
        if np.abs(phi).sum() < SMALLEST_TURN:
            continue
        # with some of the holds on either side, so that no offset of the clocks runs out of it
        near = series.between(float(turn.time[0]) - 1.0, float(turn.time[-1]) + 1.0)
        field = (near.values - magnetometer.bias) @ magnetometer.matrix.T
        if len(near) < FEWEST:
            continue
        field /= np.linalg.norm(field, axis=1)[:, None]
        attitude = np.moveaxis(matrices(whole), -1, 0)
        out.append(Passage(turn.time, attitude, rate, near.time, field))
    return out
