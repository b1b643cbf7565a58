"""The gyroscope's mean rate in a hold, the Earth's: ``M (y − b) − ε − Ω``, three rows per hold.

Rounding shifts the readings of all rests alike, as far as their noise does not carry them from one
step to the next; in motion it averages out. The shift of each axis is a shared parameter. What the
rates differ by between the rests shifts each of them otherwise, which is noise of its own.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.effect import GYROSCOPE, Circumstances
from imucal_wizard.model.rows.earth import EarthAxes, earth_names
from imucal_wizard.model.rows.source import (
    ENTRIES,
    Influence,
    Parameters,
    RowLabels,
    Rows,
    RowSource,
    hold_influences,
    hold_place,
    rounding_names,
)
from imucal_wizard.model.terms import Term, Terms, columns_of


class RestRows(Rows):
    """Corrected mean rates, hold by hold."""

    def __init__(self, source: "RateAtRest", calibration: Parameters, terms: Terms) -> None:
        self._source, self._calibration = source, calibration
        rate = (source.reading - calibration.bias) @ calibration.matrix.T
        self._error = np.zeros_like(rate)
        if len(terms):
            self._error = terms.columns(source.circumstances) @ calibration.sizes
            rate = rate - self._error
        self.residual = rate.ravel()
        self.own = source.noise.ravel()
        force = source.circumstances.force
        length = np.linalg.norm(force, axis=1)[:, None]  # 0 where there is no accelerometer
        up = force / np.where(length > 0.0, length, 1.0)
        self.direction = np.repeat(up, 3, axis=0)
        self.lever = np.tile(np.eye(3), (len(rate), 1))

    def base_columns(self) -> FloatArray:
        """See ``Rows``: ``∂w/∂M_ij = e_i (y − b)_j`` and ``∂w/∂b = −M``.

        ``y − b`` is taken as the model predicts it, ``M⁻¹ ε``. As it was read it is mostly noise,
        and a fit that follows noise would lower the residual by shrinking M.
        """
        out = np.zeros((len(self._source.reading), 3, ENTRIES))
        predicted = self._error @ np.linalg.pinv(self._calibration.matrix).T
        for axis in range(3):
            out[:, axis, 3 * axis : 3 * axis + 3] = predicted
        out[:, :, 9:] = -self._calibration.matrix
        return out.reshape(-1, ENTRIES)

    def term_columns(self, terms: Sequence[Term]) -> FloatArray:
        """See ``Rows``."""
        columns = columns_of(terms, GYROSCOPE, self._source.circumstances)
        return -columns.reshape(3 * len(columns), columns.shape[2])

    def shared_columns(self) -> FloatArray:
        """See ``Rows``: change with a shift of each axis by one standard deviation, and with Ω."""
        rounding, earth = self._source.rounding, self._source.earth
        moved = -self._calibration.matrix * np.sqrt(rounding)
        shifted = np.tile(moved[:, rounding > 0.0], (len(self._source.reading), 1))
        if earth is None:
            return shifted
        return np.concatenate([shifted, -earth.reshape(len(shifted), earth.shape[2])], axis=1)


@dataclass(frozen=True, eq=False)
class RateAtRest(RowSource):
    """Three rows per hold.

    Attributes:
        reading: mean of each hold, shape (h, 3).
        noise: variance of each corrected mean by noise alone, (rad/s)², shape (h, 3).
        circumstances: of these holds.
        labels: see ``RowSource``; one variance component per axis.
        rounding: variance by which rounding shifts the readings of all holds alike, reading
            units², shape (3,).
        coarse: whether ``noise`` is mostly what rounding may do to the mean, shape (h, 3).
        earth: rate by each part of the Earth's rate of usual size, shape (h, 3, p); None where it
            is left out.
        group_word: see ``RowSource``.
    """

    reading: FloatArray
    noise: FloatArray
    circumstances: Circumstances
    labels: RowLabels
    rounding: FloatArray
    coarse: BoolArray | None = None
    group_word: str = "direction"
    earth: FloatArray | None = None
    kind = "still"
    unit = "rad/s"
    judged, at_rest, by_axis, exact_slope = False, True, True, False
    part, prefix = "at rest", "rest-"

    @property
    def shared(self) -> tuple[str, ...]:  # type: ignore[override]  # follows from the rounding
        """See ``RowSource``."""
        return (*rounding_names(self.rounding), *earth_names(self.earth))

    @property
    def indifferent(self) -> BoolArray:
        """See ``RowSource``."""
        return super().indifferent if self.coarse is None else self.coarse.ravel()

    @property
    def undetermined(self) -> tuple[str, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return earth_names(self.earth)

    @property
    def bounded(self) -> tuple[str, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return earth_names(self.earth)

    def on_earth(self, earth: EarthAxes) -> "RateAtRest":
        """See ``RowSource``."""
        return replace(self, earth=earth.rates(self.labels.index[::3]))

    @property
    def shared_precision(self) -> tuple[float, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return tuple(np.ones(len(self.shared)).tolist())

    def influences(self) -> tuple[Influence, ...]:
        """See ``RowSource``."""
        return tuple(
            Influence(one.name, one.label, np.repeat(one.values, 3))
            for one in hold_influences(self.circumstances, self.labels.index[::3])
        )

    def per_item(self, of: Callable[[Circumstances], FloatArray]) -> FloatArray:
        """See ``RowSource``."""
        return of(self.circumstances)

    def measured(self, row: int) -> tuple[FloatArray, str]:
        """See ``RowSource``."""
        return self.reading[row // 3], ""

    def place(self, row: int) -> str:
        """See ``RowSource``."""
        return hold_place(int(self.labels.index[row]), self.circumstances.force[row // 3])

    def at(self, calibration: Parameters, terms: Terms, near: Rows | None = None) -> RestRows:
        """See ``RowSource``."""
        del near  # these rows need no other ones
        return RestRows(self, calibration, terms)
