"""What is known of a magnetometer: means by time and direction, and the dip in still poses."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.readings import FloatArray, IntArray
from imucal_wizard.solver.carried import basis_of
from imucal_wizard.solver.extended.field_groups import Pieces
from imucal_wizard.solver.magnitude import BIAS, NON_ORTHOGONALITY, SCALE

FIELD_BASE = ("bias", "soft-iron")
"""Terms of the magnetometer's base model. One scale is always fitted: no size of the field is so
well known that it could be left at its nominal value."""
SMALLEST_NOISE = 1e-7
"""Of the field; data without any noise keep a weight."""


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


@dataclass(frozen=True, eq=False)
class FieldData:
    """What is known of a magnetometer.

    Attributes:
        unit: of the readings, ``uT`` or ``count``.
        field: magnitude that corrected readings have, µT.
        assumed: nothing tells that magnitude, so that all sizes rest on a usual one.
        pieces: means of the readings, by group.
        samples: circumstances of the pieces.
        noise: variance of each group's mean magnitude by noise alone, µT², shape (k,).
        visits: number of the visit to a direction that each group is, shape (k,).
        dips: the still poses.
        circumstances: of the groups, then of the still poses.
        start: M, symmetric, and b of the plain fit, shapes (3, 3) and (3,).
        carried: names of the base terms that the directions carry.
        gravity: m/s².
    """

    unit: str
    field: float
    assumed: bool
    pieces: Pieces
    samples: Circumstances
    noise: FloatArray
    visits: IntArray
    dips: Dips
    circumstances: Circumstances
    start: tuple[FloatArray, FloatArray]
    carried: tuple[str, ...]
    gravity: float

    def __len__(self) -> int:
        return len(self.noise)

    @property
    def gain(self) -> float:
        """µT per reading, about."""
        return float(np.cbrt(np.linalg.det(self.start[0])))

    @property
    def still(self) -> Circumstances:
        """Circumstances of the still poses."""
        return self.circumstances.select(slice(len(self), None))

    @property
    def kinds(self) -> IntArray:
        """0 for the magnitude of a group, 1 for the dip of a still pose, shape (k + h,)."""
        return np.repeat([0, 1], [len(self), len(self.dips)]).astype(np.int64)

    def basis(self, base: Sequence[str]) -> FloatArray:
        """Free directions of the nine parameters b, M: of ``base`` what is carried, (9, p)."""
        free: set[int] = set(BIAS) if "bias" in base else set()
        own = "soft-iron" in base and bool({"soft-iron", "scale"} & {*self.carried})
        free |= set(SCALE) if own else set()
        free |= set(NON_ORTHOGONALITY) if own and "soft-iron" in self.carried else set()
        return basis_of(tuple(sorted(free)), common_scale=not own)

    def begin(self, base: Sequence[str]) -> tuple[FloatArray, FloatArray]:
        """M and b to start from; what is not fitted has its nominal value."""
        matrix, bias = self.start
        if "soft-iron" not in base:
            matrix = self.gain * np.eye(3)
        return matrix, bias if "bias" in base else np.zeros(3)


def within(data: Circumstances, pieces: Pieces) -> Circumstances:
    """Circumstances of the groups from those of their pieces."""
    field = pieces.mean(data.magnetic)
    count = len(field)
    return replace(
        data,
        force=np.full((count, 3), np.nan),
        rate=np.zeros((count, 3)),
        temperature=pieces.mean(data.temperature),
        time=pieces.mean(data.time),
        previous=np.full((count, 3), np.nan),
        vibration=np.full(count, np.nan),
        magnetic=field,
        current=pieces.mean(data.current),
    )
