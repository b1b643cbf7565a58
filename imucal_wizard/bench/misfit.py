"""What a fit leaves, in the one form that every question about it is asked of.

Rows are whitened: each is divided by the standard deviation that noise alone gives it. A row is a
hold of the accelerometer (its error along gravity), one axis of a hold of the gyroscope, one
component of a rotation's closure, a mean magnitude of the magnetometer or its dip in a still pose.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from imucal_wizard.readings import BoolArray, FloatArray, IntArray


class RowKind(IntEnum):
    """Where a row comes from."""

    HOLD = 0
    STILL = 1
    ROTATION = 2
    FIELD = 3
    DIP = 4


@dataclass(frozen=True, eq=False)
class Candidate:
    """One way in which one effect would show, with one setting of what is not linear in it.

    Attributes:
        term: name of the effect.
        family: name shared by effects that 1 g cannot split, or the term itself.
        variant: the setting, or None.
        names: the parameters, one per column.
        columns: whitened change of every row per shown unit, shape (n, p).
        typical: prior standard deviation of each parameter, shown unit, shape (p,).
        unit: the shown unit.
    """

    term: str
    family: str
    variant: float | None
    names: tuple[str, ...]
    columns: FloatArray
    typical: FloatArray
    unit: str


@dataclass(frozen=True, eq=False)
class Misfit:
    """What is left of every row, and what may move it.

    Attributes:
        residual: whitened, shape (n,).
        base: whitened derivative by all parameters that are in the model, shape (n, b).
        kind: where each row comes from, shape (n,).
        source: index of its hold or rotation, shape (n,).
        direction: up at the row's hold (of a magnetometer: the field's direction), unit vectors,
            shape (n, 3); NaN for rotations.
        axis: the gyroscope's axis of a still row, -1 otherwise, shape (n,).
        time: s, shape (n,).
        sigma: standard deviation that noise alone gives each row, in the sensor's error unit, (n,).
        group: what is left out together: directions, or rotations; -1 for rows that always stay,
            shape (n,).
        visit: number of the rest that a row is a piece of, −1 for rotations, shape (n,).
        lever: how far each row moves with the bias of each axis, in the sensor's error unit: a mean
            at rest by one, a closure by the seconds that its rotation lasts, a magnitude by the
            share along the field, shape (n, 3).
        candidates: the effects that are not in the model.
    """

    residual: FloatArray
    base: FloatArray
    kind: IntArray
    source: IntArray
    direction: FloatArray
    axis: IntArray
    time: FloatArray
    sigma: FloatArray
    group: IntArray
    visit: IntArray
    lever: FloatArray
    candidates: tuple[Candidate, ...]

    def __len__(self) -> int:
        return len(self.residual)

    @property
    def judged(self) -> BoolArray:
        """The rows whose error is reported: rotations, or all rows without any still mean; (n,)."""
        rotations = self.kind == RowKind.ROTATION
        return np.asarray(rotations if rotations.any() else self.kind != RowKind.STILL)
