"""The dip of the field in a still pose: ``B (u·x/|x| − s)``, u being up and ``s = −sin(dip)``.

s is one number for the place, shared by all poses, and so is a small rotation between the sensors,
which the second stage has found but for its error. The noise of the field moves its magnitude along
the field and its dip across it, so that both kinds of row are independent though they share
samples.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quantities import unit_sign
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.effect import MAGNETOMETER, Circumstances
from imucal_wizard.model.rows.field_magnitude import SHORTEST_FIELD
from imucal_wizard.model.rows.source import (
    ENTRIES,
    Influence,
    Parameters,
    RowLabels,
    Rows,
    RowSource,
    hold_place,
    reference_names,
    slow_names,
)
from imucal_wizard.model.terms import Term, Terms, columns_of, corrected, slope_of_corrected

ROTATION = tuple(f"misalignment_{axis}" for axis in AXES)
"""Names of the rotation between the sensors, which all rows share."""


class DipRows(Rows):
    """Sine of the angle between field and horizon in each pose, in the field's unit."""

    def __init__(self, source: "Dip", calibration: Parameters, terms: Terms) -> None:
        self._source, self._calibration, self._terms = source, calibration, terms
        self.field = corrected(
            (calibration.matrix, calibration.bias),
            terms,
            calibration.sizes,
            source.reading,
            source.circumstances,
        )
        length = np.maximum(np.linalg.norm(self.field, axis=1), SHORTEST_FIELD)[:, None]
        self.direction = self.field / length
        sine = (source.up * self.direction).sum(axis=1)
        self.residual = source.magnitude * (sine - source.sine)
        self.lever = source.magnitude * (source.up - sine[:, None] * self.direction) / length
        self.own = source.noise * (self.lever**2).sum(axis=1)

    @cached_property
    def _moved(self) -> FloatArray:
        """How the rows move with ``M (y − b)``, shape (h, 3)."""
        where, sizes = self._source.circumstances, self._calibration.sizes
        inverse = slope_of_corrected(self._terms, sizes, self.field, where)
        return np.asarray(np.einsum("hi,hij->hj", self.lever, inverse))

    def base_columns(self) -> FloatArray:
        """See ``Rows``."""
        offset = self._source.reading - self._calibration.bias
        out = np.empty((len(offset), ENTRIES))
        out[:, :9] = (self._moved[:, :, None] * offset[:, None, :]).reshape(-1, 9)
        out[:, 9:] = -self._moved @ self._calibration.matrix
        return out

    def term_columns(self, terms: Sequence[Term]) -> FloatArray:
        """See ``Rows``."""
        where = replace(self._source.circumstances, magnetic=self.field)
        columns = columns_of(terms, MAGNETOMETER, where)
        return np.asarray(-np.einsum("hi,hip->hp", self._moved, columns))

    def shared_columns(self) -> FloatArray:
        """See ``Rows``: by the dip's sine, a rotation of the field, errors of up, slow noise."""
        source = self._source
        turned = source.magnitude * np.cross(self.direction, source.up)
        doubts = source.magnitude * np.einsum("hi,hid->hd", self.direction, source.doubt)
        return np.column_stack([np.full(len(doubts), -1.0), turned, doubts, source.loading])


@dataclass(frozen=True, eq=False)
class Dip(RowSource):
    """One row per still pose.

    Attributes:
        hold: which of all holds each pose is, shape (h,).
        reading: mean reading, shape (h, 3).
        up: unit vectors in the frame of the fit, shape (h, 3).
        doubt: change of ``up`` with each error of the accelerometer, shape (h, 3, d).
        noise: variance of a component of the mean field and of up, squared unit, shape (h,).
        circumstances: of the poses.
        magnitude: of the field.
        sine: s at about the middle of the poses, from which the shared parameter counts.
        labels: see ``RowSource``.
        loading: by how much each of m slow errors of size one moves the rows, shape (h, m).
        unit: of corrected readings.
    """

    hold: IntArray
    reading: FloatArray
    up: FloatArray
    doubt: FloatArray
    noise: FloatArray
    circumstances: Circumstances
    magnitude: float
    sine: float
    labels: RowLabels
    loading: FloatArray
    unit: str = "uT"
    kind = "dip"
    judged, confirms, at_rest, repeats_are_noise = False, False, True, False
    needs_reference = True
    group_word = "pose"
    part, prefix = "dip at rest", "dip-"

    @property
    def shared(self) -> tuple[str, ...]:  # type: ignore[override]  # follows from the reference
        """See ``RowSource``."""
        return ("dip", *ROTATION, *reference_names(self.doubt), *self.slow)

    @property
    def shared_precision(self) -> tuple[float, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        priors = self.doubt.shape[2] + self.loading.shape[1]
        return (0.0, 0.0, 0.0, 0.0, *(1.0,) * priors)

    @property
    def slow(self) -> tuple[str, ...]:  # type: ignore[override]  # follows from the slow noise
        """See ``RowSource``."""
        return slow_names(self.loading)

    def influences(self) -> tuple[Influence, ...]:
        """See ``RowSource``."""
        c = self.circumstances
        unit = unit_sign(c.field_unit.name)
        return (
            *(Influence(f"field-{axis}", f"field along {axis}, {unit}", c.magnetic[:, k])
              for k, axis in enumerate(AXES)),
            Influence("time", "time, min", self.labels.time / 60.0),
            Influence("temperature", "temperature, °C", c.temperature),
            Influence("current", f"current, {c.current_unit}", c.current),
        )  # fmt: skip

    def per_item(self, of: Callable[[Circumstances], FloatArray]) -> FloatArray:
        """See ``RowSource``."""
        return of(self.circumstances)

    def measured(self, row: int) -> tuple[FloatArray, str]:
        """See ``RowSource``."""
        return self.reading[row], ""

    def item(self, row: int) -> int:
        """See ``RowSource``."""
        return int(self.hold[row])

    def place(self, row: int) -> str:
        """See ``RowSource``."""
        return f"dip of {hold_place(self.item(row), self.up[row])}"

    def at(self, calibration: Parameters, terms: Terms, near: Rows | None = None) -> DipRows:
        """See ``RowSource``."""
        del near  # these rows need no other ones
        return DipRows(self, calibration, terms)
