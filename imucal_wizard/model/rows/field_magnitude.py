"""The mean magnitude of the field in a group of samples, ``|x| − B``, ``x = M (y − b) − ε(x)``."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from imucal_wizard.core.poses import AXES, DIRECTIONS, nearest_pose
from imucal_wizard.core.quantities import true_minus, unit_sign
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.effect import MAGNETOMETER, Circumstances
from imucal_wizard.model.rows.source import (
    ENTRIES,
    Influence,
    Loading,
    Parameters,
    RowLabels,
    Rows,
    RowSource,
    slow_names,
    unmeasured,
)
from imucal_wizard.model.terms import Term, Terms, columns_of, corrected, slope_of_corrected

SHORTEST_FIELD = 1e-12
"""A field shorter than this, µT, has no direction."""


class FieldRows(Rows):
    """|x| − B of each group.

    Attributes:
        field: corrected field of the pieces, µT, shape (q, 3).
        length: mean magnitude of each of them, µT, shape (q,).
    """

    def __init__(self, source: "FieldMagnitude", calibration: Parameters, terms: Terms) -> None:
        self._source, self._calibration = source, calibration
        where = source.circumstances
        self.field = corrected(
            (calibration.matrix, calibration.bias), terms, calibration.sizes, source.reading, where
        )
        length = np.linalg.norm(self.field, axis=1)
        self._unit = self.field / np.maximum(length, SHORTEST_FIELD)[:, None]
        self._terms = terms
        self.length = length + source.extra
        self.residual = source.mean(self.length) - source.magnitude
        self.own = source.noise
        self.lever = source.mean(self._unit)
        size = np.linalg.norm(self.lever, axis=1)
        self.direction = self.lever / np.maximum(size, SHORTEST_FIELD)[:, None]

    @cached_property
    def _along(self) -> FloatArray:
        """How |x| moves with ``M (y − b)``, shape (q, 3)."""
        where, sizes = self._source.circumstances, self._calibration.sizes
        inverse = slope_of_corrected(self._terms, sizes, self.field, where)
        return np.asarray(np.einsum("qi,qij->qj", self._unit, inverse))

    def base_columns(self) -> FloatArray:
        """See ``Rows``."""
        offset = self._source.reading - self._calibration.bias
        out = np.empty((len(offset), ENTRIES))
        out[:, :9] = (self._along[:, :, None] * offset[:, None, :]).reshape(-1, 9)
        out[:, 9:] = -self._along @ self._calibration.matrix
        return self._source.mean(out)

    def term_columns(self, terms: Sequence[Term]) -> FloatArray:
        """See ``Rows``."""
        where = replace(self._source.circumstances, magnetic=self.field)
        columns = columns_of(terms, MAGNETOMETER, where)
        return -self._source.mean(np.einsum("qi,qip->qp", self._along, columns))

    def shared_columns(self) -> FloatArray:
        """See ``Rows``: by slow noise."""
        return self._source.loading

    def loading(self) -> Loading | None:
        """See ``Rows``: by rounding, which shifts rests at one place between two steps alike."""
        rounding = self._source.rounding
        if not rounding.shape[1]:
            return None
        return Loading(np.tile(np.arange(rounding.shape[1]), (len(rounding), 1)), rounding)


@dataclass(frozen=True, eq=False)
class FieldMagnitude(RowSource):
    """One row per group of samples among which direction, current and time differ little.

    Attributes:
        reading: means of pieces of samples that follow one another, shape (q, 3).
        count: samples in each piece, shape (q,).
        extra: by how much the mean magnitude of a piece exceeds the magnitude of its mean, (q,).
        offsets: first piece of each group and the end, shape (k + 1,).
        noise: variance of each group's mean magnitude by noise that it shares with no other, µT²,
            shape (k,).
        rounding: by how much each of r errors of size one, by rounding, moves the groups, µT,
            shape (k, r).
        circumstances: of the pieces.
        magnitude: of the field that corrected readings have, µT.
        labels: see ``RowSource``.
        unit: of corrected readings.
        repeated: number of the direction that each group repeats, shape (k,).
        loading: by how much each of m slow errors of size one moves the groups, µT, shape (k, m).
    """

    reading: FloatArray
    count: FloatArray
    extra: FloatArray
    offsets: IntArray
    noise: FloatArray
    rounding: FloatArray
    circumstances: Circumstances
    magnitude: float
    labels: RowLabels
    repeated: IntArray
    loading: FloatArray
    unit: str = "uT"
    kind, part, left = "field", "magnitude of the field", "|m| − B"

    @property
    def poses(self) -> IntArray:
        """See ``RowSource``."""
        return self.repeated

    @property
    def shared(self) -> tuple[str, ...]:  # type: ignore[override]  # follows from the slow noise
        """See ``RowSource``."""
        return self.slow

    @property
    def shared_precision(self) -> tuple[float, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return tuple(np.ones(len(self.slow)).tolist())

    @property
    def slow(self) -> tuple[str, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return slow_names(self.loading)

    def influences(self) -> tuple[Influence, ...]:
        """See ``RowSource``."""
        c, field = self.circumstances, self.mean(self.circumstances.magnetic)
        unit = unit_sign(c.field_unit.name)
        return (
            *(Influence(f"field-{a}", f"field along {a}, {unit}", field[:, k])
              for k, a in enumerate(AXES)),
            Influence("time", "time, min", self.labels.time / 60.0),
            Influence("temperature", "temperature, °C", self.mean(c.temperature)),
            Influence("current", f"current, {c.current_unit}", self.mean(c.current)),
        )  # fmt: skip

    def per_item(self, of: Callable[[Circumstances], FloatArray]) -> FloatArray:
        """See ``RowSource``."""
        return self.mean(of(self.circumstances))

    def measured(self, row: int) -> tuple[FloatArray, str]:
        """See ``RowSource``."""
        return self.mean(self.reading)[row], ""

    def place(self, row: int) -> str:
        """See ``RowSource``."""
        field = self.mean(self.circumstances.magnetic)[row]
        name = nearest_pose(field, DIRECTIONS, 180.0) or "–"
        return f"field along {true_minus(name)}, min {self.labels.time[row] / 60.0:.1f}"

    def elsewhere(
        self, directions: FloatArray, calibration: Parameters, terms: Terms
    ) -> "FieldMagnitude":
        """See ``RowSource``: pieces of the session, spread over it, in another field."""
        count = len(directions)
        rows = np.linspace(0, len(self.reading) - 1, count).astype(np.intp)
        field = self.magnitude * directions
        where = self.circumstances.select(rows).sensing(MAGNETOMETER, field)
        felt = field + terms.columns(where) @ calibration.sizes
        return replace(
            self,
            reading=felt @ np.linalg.inv(calibration.matrix).T + calibration.bias,
            count=np.ones(count),
            extra=np.zeros(count),
            offsets=np.arange(count + 1),
            noise=np.resize(self.noise, count),
            rounding=np.zeros((count, 0)),
            circumstances=where,
            labels=unmeasured(count),
            repeated=np.full(count, -1),
            loading=np.zeros((count, 0)),
        )

    def at(self, calibration: Parameters, terms: Terms, near: Rows | None = None) -> FieldRows:
        """See ``RowSource``."""
        del near  # these rows need no other ones
        return FieldRows(self, calibration, terms)

    def mean(self, values: FloatArray) -> FloatArray:
        """Means over the groups of values of the pieces, shape (q, …) to (k, …)."""
        shape = (-1, *[1] * (values.ndim - 1))
        sums = np.add.reduceat(values * self.count.reshape(shape), self.offsets[:-1], axis=0)
        return np.asarray(sums / np.add.reduceat(self.count, self.offsets[:-1]).reshape(shape))
