"""A rotation of known angle about an axis that stays fixed: ``|∫ w dt| − θ``, one row for each.

``w = M (y − b) − ε(w)``. A rate table gives ``θ = Ω T`` over the T seconds of a step of constant
rate Ω, a turntable the angle between two rests. The mounting of the device is unknown, so the axis
is the direction of the integral itself. The rows leave M free up to a rotation from the left, which
other rows must determine or a convention must choose.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.effect import GYROSCOPE, Circumstances
from imucal_wizard.model.rows.source import (
    ENTRIES,
    Influence,
    Parameters,
    RowLabels,
    Rows,
    RowSource,
    unmeasured,
)
from imucal_wizard.model.terms import Term, Terms, columns_of, corrected, slope_of_corrected

MIN_INTEGRAL = 1e-12
"""An angle smaller than this, rad, has no axis."""


class KnownRotationRows(Rows):
    """``|∫ w dt| − θ`` of each rotation.

    Attributes:
        rate: corrected, of each piece, rad/s, shape (q, 3).
        integral: of the corrected rate over each rotation, rad, shape (m, 3).
        axis: its direction, unit vectors, shape (m, 3).
    """

    def __init__(self, source: "KnownRotation", calibration: Parameters, terms: Terms) -> None:
        self._source, self._calibration, self._terms = source, calibration, terms
        both = calibration.matrix, calibration.bias
        self.rate = corrected(both, terms, calibration.sizes, source.reading, source.circumstances)
        self.integral = source.summed(self.rate)
        length = np.linalg.norm(self.integral, axis=1)
        self.axis = self.integral / np.maximum(length, MIN_INTEGRAL)[:, None]
        self.residual = length - source.angle
        self.own = source.noise
        self.direction = np.full((len(length), 3), np.nan)
        self.lever = self.axis * source.duration[:, None]

    @cached_property
    def _along(self) -> FloatArray:
        """How ``|∫ w dt|`` moves with ``M (y − b)`` in each piece, per second, shape (q, 3)."""
        source = self._source
        where, sizes = source.circumstances, self._calibration.sizes
        inverse = slope_of_corrected(self._terms, sizes, self.rate, where)
        axis = np.repeat(self.axis, np.diff(source.offsets), axis=0)
        return np.asarray(np.einsum("qi,qij->qj", axis, inverse))

    def base_columns(self) -> FloatArray:
        """See ``Rows``: ``∫ a_i (y − b)_j dt`` by M_ij, ``−Mᵀ ∫ a dt`` by b; a is ``_along``."""
        offset = self._source.reading - self._calibration.bias
        out = np.empty((len(offset), ENTRIES))
        out[:, :9] = (self._along[:, :, None] * offset[:, None, :]).reshape(-1, 9)
        out[:, 9:] = -self._along @ self._calibration.matrix
        return self._source.summed(out)

    def term_columns(self, terms: Sequence[Term]) -> FloatArray:
        """See ``Rows``."""
        where = replace(self._source.circumstances, rate=self.rate)
        columns = columns_of(terms, GYROSCOPE, where)
        return -self._source.summed(np.einsum("qi,qip->qp", self._along, columns))


@dataclass(frozen=True, eq=False)
class KnownRotation(RowSource):
    """One row per step of constant rate, or per turn of known angle.

    Attributes:
        reading: mean readings of pieces that follow one another, shape (q, 3).
        seconds: duration of each piece, s, shape (q,).
        offsets: first piece of each of the m rotations and the end, shape (m + 1,).
        angle: θ, rad, shape (m,).
        noise: variance of each row by measured noise, rad², shape (m,).
        circumstances: of the pieces.
        labels: see ``RowSource``; the group is the axis of the table in the body.
        judged: see ``RowSource``.
    """

    reading: FloatArray
    seconds: FloatArray
    offsets: IntArray
    angle: FloatArray
    noise: FloatArray
    circumstances: Circumstances
    labels: RowLabels
    judged: bool = True
    kind, unit, group_word = "table", "rad", "mounting"
    moving, repeats_are_noise = True, True
    part, prefix, left = "rate table", "table-", "the angle that is too large"

    @property
    def duration(self) -> FloatArray:
        """Of each rotation, s, shape (m,)."""
        return np.asarray(np.add.reduceat(self.seconds, self.offsets[:-1]))

    @property
    def rate(self) -> FloatArray:
        """Mean rate of each rotation by the table, rad/s, shape (m,)."""
        return np.asarray(self.angle / self.duration)

    def summed(self, values: FloatArray) -> FloatArray:
        """Integrals over the rotations of values of the pieces, shape (q, …) to (m, …)."""
        weighed = values * self.seconds.reshape(-1, *(1,) * (values.ndim - 1))
        return np.asarray(np.add.reduceat(weighed, self.offsets[:-1], axis=0))

    def means(self, values: FloatArray) -> FloatArray:
        """Means over the rotations of values of the pieces, shape (q, …) to (m, …)."""
        return self.summed(values) / self.duration.reshape(-1, *(1,) * (values.ndim - 1))

    def influences(self) -> tuple[Influence, ...]:
        """See ``RowSource``."""
        rate = np.degrees(self.means(self.circumstances.rate))
        return (
            Influence("rate", "rate of the table, °/s", np.degrees(self.rate)),
            *(
                Influence(f"rate-{axis}", f"mean rate about {axis}, °/s", rate[:, k])
                for k, axis in enumerate(AXES)
            ),
            Influence("time", "time, min", self.labels.time / 60.0),
            Influence("temperature", "temperature, °C", self.means(self.circumstances.temperature)),
            Influence("number", "number of the step", np.asarray(self.labels.index + 1.0)),
        )

    def per_item(self, of: Callable[[Circumstances], FloatArray]) -> FloatArray:
        """See ``RowSource``."""
        return self.means(of(self.circumstances))

    def measured(self, row: int) -> tuple[FloatArray, str]:
        """See ``RowSource``: the mean rate, °/s."""
        return np.degrees(self.means(self.circumstances.rate)[row]), "deg/s"

    @property
    def item_word(self) -> str:
        """See ``RowSource``."""
        return "step of the table"

    def place(self, row: int) -> str:
        """See ``RowSource``."""
        rate = np.degrees(self.rate[row])
        return f"step {self.labels.index[row] + 1} of the table, {rate:.4g} °/s"

    def elsewhere(
        self, directions: FloatArray, calibration: Parameters, terms: Terms
    ) -> "KnownRotation":
        """See ``RowSource``: as many steps at the same rates about axes in these directions."""
        count = len(self.angle)
        rows = np.linspace(0, len(self.reading) - 1, count).astype(np.intp)
        rate = self.rate[:, None] * directions[np.arange(count) % len(directions)]
        where = replace(self.circumstances.select(rows), rate=rate)
        felt = rate + terms.columns(where) @ calibration.sizes
        return replace(
            self,
            reading=felt @ np.linalg.inv(calibration.matrix).T + calibration.bias,
            seconds=self.duration,
            offsets=np.arange(count + 1),
            circumstances=where,
            labels=unmeasured(count),
        )

    def at(
        self, calibration: Parameters, terms: Terms, near: Rows | None = None
    ) -> KnownRotationRows:
        """See ``RowSource``."""
        del near  # these rows need no other ones
        return KnownRotationRows(self, calibration, terms)
