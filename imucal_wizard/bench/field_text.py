"""The rows of a magnetometer in words: where the field came from, and when; the dip of a hold."""

import numpy as np

from imucal_wizard.bench.amounts import shown
from imucal_wizard.bench.session import Bench
from imucal_wizard.procedure.poses import DIRECTIONS, nearest
from imucal_wizard.solver.extended.field_data import FieldData

WORST = 12
"""Rows that are listed: those that fit worst."""
ALL = 180.0


def field_rows(bench: Bench, data: FieldData) -> list[str]:
    """Measurement against model, the rows that fit worst."""
    linear = bench.fit.linear
    error = linear.residual * linear.sigma
    ratio = error / linear.floor
    order = np.argsort(-np.abs(ratio), kind="stable")[:WORST]
    worst = f"the {len(order)} means of {len(error)} that fit worst"
    lines = [f"COMPARE  measurement − model, {worst} (× noise)"]
    for row in sorted(order.tolist()):
        cell = f"{shown('uT', float(error[row]))} ({ratio[row]:+.1f})".replace("-", "−")
        lines.append(f"  {place_of(data, row):34} {cell}")
    return lines


def place_of(data: FieldData, row: int) -> str:
    """A row in words: ``field from +x−y, min 2.1`` or ``dip of hold 7``."""
    if row >= len(data):
        return f"dip of hold {int(data.dips.hold[row - len(data)]) + 1}"
    where = data.circumstances
    name = nearest(where.magnetic[row], DIRECTIONS, ALL) or "–"
    return f"field along {name.replace('-', '−')}, min {where.time[row] / 60.0:.1f}"
