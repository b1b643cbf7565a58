"""The point under the cursor: which hold or turn it is, and what was read there."""

import numpy as np

from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.tui.bench.field_views import field_point
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.bench.views import TURNS, View
from imucal_wizard.tui.bench.words import pose_at
from imucal_wizard.tui.text import Line, clock, number, unit_sign


def point_row(sight: Sight, view: View, place: int) -> Line:
    """Hold, pose, time, what is left, the raw mean, in one row."""
    index = int(view.source[place])
    left = f"left {number(float(view.y[place]), 3)} {view.unit}"
    if view.model is not None:
        pair = float(view.y[place]), float(view.model[place])
        left = f"{number(pair[0], 4)}, model {number(pair[1], 4)} {view.unit}"
    if view.part == TURNS:
        where, mean = _turn(sight, index)
    else:
        where, mean = _hold(sight, index)
    return (("◆ ", "accent"), (where, "strong"), (f"  {left}  ", ""), (mean, "quiet"))


def _hold(sight: Sight, index: int) -> tuple[str, str]:
    measured = sight.measured
    if isinstance(measured, FieldData):
        return field_point(measured, index)
    if isinstance(measured, TurnData):
        row = int(np.searchsorted(measured.still_rows, index))
        reading = measured.stills[row]
    else:
        row, reading = index, measured.holds[index].accelerometer
    time = clock(float(measured.circumstances.time[row]))
    cells = " ".join(number(float(value), 4) for value in reading)
    unit = unit_sign(measured.unit)
    return f"pose {index + 1}, {pose_at(sight, index)}, {time}", f"read {cells} {unit}"


def _turn(sight: Sight, index: int) -> tuple[str, str]:
    measured = sight.measured
    assert isinstance(measured, TurnData), "only a gyroscope has turns"  # noqa: S101 (narrows the type)
    place = int(np.searchsorted(measured.rotations, index))
    first, last = measured.samples.offsets[place : place + 2]
    rate = np.degrees(measured.motion.rate[first:last])
    time = clock(float(measured.motion.time[first]))
    fastest = rate[np.argmax(np.linalg.norm(rate, axis=1))]
    cells = " ".join(number(float(value), 3) for value in fastest)
    return f"turn {index + 1}, {time}", f"fastest {cells} °/s"
