"""What is known of a gyroscope: rotations, still means, their noise and circumstances."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.readings import FloatArray, IntArray
from imucal_wizard.solver.closure import BIAS, SIZE
from imucal_wizard.solver.extended.samples import Samples
from imucal_wizard.solver.gains import Nominal
from imucal_wizard.units import COUNT


@dataclass(frozen=True, eq=False)
class TurnData:
    """What is known of a gyroscope.

    Attributes:
        unit: of the readings, ``rad/s`` or ``count``.
        gravity: m/s².
        samples: of the m usable rotations.
        rotations: which of all rotations they are, shape (m,).
        before: up at the hold before each, unit vectors, shape (m, 3).
        after: up at the hold after, shape (m, 3).
        before_doubt: change of ``before`` with each of the k ways in which the accelerometer may
            be wrong by one standard deviation, shape (m, 3, k).
        after_doubt: the same of ``after``.
        closing_noise: variance of a closure component by the noise of both directions and of the
            rates between them, rad², shape (m,).
        motion: circumstances of the samples; force and rate are those of the base fit.
        stills: mean reading of each hold, shape (h, 3).
        still_rows: which of all holds they are, shape (h,).
        labels: number of each hold's direction, shape (h,).
        visits: number of the rest that each is a piece of, shape (h,).
        still_noise: variance of their means by noise alone, (rad/s)², shape (h, 3).
        slow: variance by which slow noise shifts the mean of all stills, reading², shape (3,).
        circumstances: of the holds with a mean.
        start: matrix and bias of the base fit, shapes (3, 3) and (3,).
        carried: which of the twelve base parameters the rotations carry.
        nominal: what a gain is that is not fitted.
    """

    unit: str
    gravity: float
    samples: Samples
    rotations: IntArray
    before: FloatArray
    after: FloatArray
    before_doubt: FloatArray
    after_doubt: FloatArray
    closing_noise: FloatArray
    motion: Circumstances
    stills: FloatArray
    still_rows: IntArray
    labels: IntArray
    visits: IntArray
    still_noise: FloatArray
    slow: FloatArray
    circumstances: Circumstances
    start: tuple[FloatArray, FloatArray]
    carried: tuple[int, ...]
    nominal: Nominal

    def __len__(self) -> int:
        return len(self.before)

    def free(self, base: Sequence[str]) -> tuple[int, ...]:
        """Which of the twelve parameters are fitted: of ``base`` what the rotations carry."""
        wanted = set(range(BIAS.start, SIZE)) if "bias" in base else set()
        wanted |= set(self.nominal.scales) if "scale" in base else set()
        if "non-orthogonality" in base:
            wanted |= set(range(9)) - set(self.nominal.scales)
        return tuple(index for index in self.carried if index in wanted)

    def begin(self, free: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """Matrix and bias to start from; what is not free has its nominal value."""
        matrix, bias = self.start
        nominal = self.nominal.filled(matrix, free)
        if self.unit == COUNT:
            flat, scales = nominal.ravel(), list(self.nominal.scales)
            common = float(np.abs(matrix.ravel()[scales]).mean())
            fixed = [index for index in scales if index not in free]
            signs = dict(zip(scales, self.nominal.signs, strict=True))
            flat[fixed] = [common * signs[index] for index in fixed]
            nominal = flat.reshape(3, 3)
        if not set(range(BIAS.start, SIZE)) & set(free):
            bias = self.stills.mean(axis=0) if self.unit == COUNT else np.zeros(3)
        return nominal, bias

    def everything(self) -> Circumstances:
        """The circumstances of holds and of samples in motion, one after the other."""
        return self.circumstances.joined(self.motion)
