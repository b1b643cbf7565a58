"""Which gains of the gyroscope are identifiable, and the nominal values of the others."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.rows.source import ENTRIES, MATRIX

CROSS_PRIOR = 0.02
"""Cross-axis gain of MEMS gyroscopes, one standard deviation (datasheets: 1–2 %)."""
SCALE_PRIOR = 0.05
"""Scale error, one standard deviation (datasheets: 1–4 %)."""
CARRIED_SHARE = 0.5
"""A gain is carried when the data know it at least twice as well as a datasheet does."""
UNDETERMINED = 1e-3
"""A gain with more than this share in what the rotations do not determine is not carried."""


@dataclass(frozen=True)
class Nominal:
    """What the gains are without a calibration.

    Attributes:
        channels: for each body axis the sensor axis that feels it: (0, 1, 2) unless swapped.
        signs: +1 or −1, shape (3,).
        known: the readings are in rad/s, so that a scale is 1; of counts nobody knows it.
        clear: the estimate that it comes from gives each body axis a sensor axis of its own.
    """

    channels: tuple[int, ...] = (0, 1, 2)
    signs: tuple[float, ...] = (1.0, 1.0, 1.0)
    known: bool = True
    clear: bool = True

    @property
    def scales(self) -> tuple[int, ...]:
        """Which of the nine gains are scales; the others are cross-axis gains."""
        return tuple(3 * axis + channel for axis, channel in enumerate(self.channels))

    def filled(self, matrix: FloatArray, free: Sequence[int]) -> FloatArray:
        """The matrix with gains that are not free at their nominal value."""
        flat = matrix.flatten()
        fixed = [index for index in range(9) if index not in free]
        signed = dict(zip(self.scales, self.signs, strict=True))
        flat[fixed] = [signed.get(index, 0.0) for index in fixed]
        return flat.reshape(3, 3)

    def parameter(self, index: int) -> str:
        """Name of one of the nine gains as a parameter."""
        row, channel = divmod(index, 3)
        column = self.channels.index(channel)
        return f"sensitivity_{AXES[row]}" if row == column else f"cross_{AXES[row]}{AXES[column]}"

    def ordered(self, matrix: FloatArray) -> FloatArray:
        """The matrix with its columns in the order of the body axes that they feel."""
        return matrix[:, list(self.channels)]

    def check(self, index: int) -> None:
        """Raise when this gain cannot be left at its nominal value.

        Raises:
            DataError: it is a scale, and the readings are counts.
        """
        if index in self.scales and not self.known:
            raise DataError(
                f"the rotations do not determine the gyroscope's scale about {AXES[index // 3]}: "
                "rotate the device about each axis in both senses, with that axis level"
            )


def nominal_of(start: FloatArray, known: bool) -> Nominal:
    """Nominal gains that suit a first estimate of the matrix, whatever axes are swapped in it.

    Where the estimate does not give each body axis its own sensor axis, none is taken as swapped.
    """
    size = np.abs(start)
    channels = tuple(int(channel) for channel in size.argmax(axis=1))
    clear = (size.max(axis=1) > 0.5 * size.max()).all()
    if sorted(channels) != [0, 1, 2] or not clear:
        return Nominal(known=known, clear=False)
    signs = tuple(float(np.sign(start[axis, channel])) for axis, channel in enumerate(channels))
    return Nominal(channels, signs, known)


def least_identifiable(
    covariance: FloatArray, blind: FloatArray, free: Sequence[int], nominal: Nominal
) -> int | None:
    """The gain that the data know worst against what a datasheet says, if it is not carried.

    Args:
        covariance: of the nine gains relative to the overall gain, shape (9, 9).
        blind: share of each in what the rotations do not determine, shape (9,).
        free: which gains are fitted.
        nominal: which of them are scales.
    """
    prior = np.full(9, CROSS_PRIOR)
    prior[list(nominal.scales)] = SCALE_PRIOR
    share = np.sqrt(np.diag(covariance)) / prior
    share = np.where(blind > UNDETERMINED, np.inf, share)
    candidates = [index for index in range(9) if index in free]
    if not candidates:
        return None
    # of equally uncertain ones a cross-axis gain: the rotations are made to determine the scales
    worst = max(candidates, key=lambda index: (share[index], index not in nominal.scales))
    return worst if share[worst] > CARRIED_SHARE else None


def datasheet_precision(nominal: Nominal, matrix: FloatArray) -> FloatArray:
    """Precision of what datasheets say of M and b, shape (12,).

    It fixes what the data do not determine, so that a first fit can show what they do.
    """
    size, out = np.linalg.norm(matrix, 2), np.zeros(ENTRIES)
    out[MATRIX] = (CROSS_PRIOR * size) ** -2.0
    out[list(nominal.scales)] = (SCALE_PRIOR * size) ** -2.0
    return out
