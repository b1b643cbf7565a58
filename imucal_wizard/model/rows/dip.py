"""The dip of the field in a still pose: ``B (u·x/|x| − s)``, u being up and ``s = −sin(dip)``.

s is one number for the place, shared by all poses. The noise of the field moves its magnitude along
the field and its dip across it, so that both kinds of row are independent though they share
samples.
"""

from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.effect import MAGNETOMETER, Circumstances
from imucal_wizard.model.rows.field_magnitude import SHORTEST
from imucal_wizard.model.rows.source import ENTRIES, Parameters, RowLabels, Rows, RowSource
from imucal_wizard.model.terms import Term, Terms, columns_of, corrected


class DipRows(Rows):
    """Sine of the angle between field and horizon in each pose, in µT.

    Attributes:
        field: corrected mean field of each pose, µT, shape (h, 3).
    """

    def __init__(self, source: "Dip", calibration: Parameters, terms: Terms) -> None:
        self._source, self._calibration = source, calibration
        self.field = corrected(
            (calibration.matrix, calibration.bias),
            terms,
            calibration.sizes,
            source.reading,
            source.circumstances,
        )
        length = np.maximum(np.linalg.norm(self.field, axis=1), SHORTEST)[:, None]
        self.direction = self.field / length
        sine = (source.up * self.direction).sum(axis=1)
        self.residual = source.magnitude * (sine - source.sine)
        self.lever = source.magnitude * (source.up - sine[:, None] * self.direction) / length
        self.own = source.noise * (self.lever**2).sum(axis=1)

    def base_columns(self) -> FloatArray:
        """See ``Rows``."""
        offset = self._source.reading - self._calibration.bias
        out = np.empty((len(offset), ENTRIES))
        out[:, :9] = (self.lever[:, :, None] * offset[:, None, :]).reshape(-1, 9)
        out[:, 9:] = -self.lever @ self._calibration.matrix
        return out

    def term_columns(self, term: Term) -> FloatArray:
        """See ``Rows``."""
        where = replace(self._source.circumstances, magnetic=self.field)
        columns = columns_of(term, MAGNETOMETER, where)
        return np.asarray(-np.einsum("hi,hip->hp", self.lever, columns))

    def shared_columns(self) -> FloatArray:
        """See ``Rows``: by the sine of the dip, in µT, and by each error of up."""
        source = self._source
        doubts = source.magnitude * np.einsum("hi,hid->hd", self.direction, source.doubt)
        return np.column_stack([np.full(len(doubts), -1.0), doubts])


@dataclass(frozen=True, eq=False)
class Dip(RowSource):
    """One row per still pose.

    Attributes:
        reading: mean reading, shape (h, 3).
        up: unit vectors in the magnetometer's own axes, shape (h, 3).
        doubt: change of ``up`` with each error of the accelerometer, shape (h, 3, d).
        noise: variance of a component of the mean field and of up, µT², shape (h,).
        circumstances: of the poses.
        magnitude: of the field, µT.
        sine: s at about the middle of the poses, from which the shared parameter counts.
        labels: see ``RowSource``.
    """

    reading: FloatArray
    up: FloatArray
    doubt: FloatArray
    noise: FloatArray
    circumstances: Circumstances
    magnitude: float
    sine: float
    labels: RowLabels
    kind = "dip"
    unit = "uT"
    repeats_are_noise = False
    group_word = "pose"

    @property
    def shared(self) -> tuple[str, ...]:  # type: ignore[override]  # follows from the reference
        """See ``RowSource``."""
        return ("dip", *(f"accelerometer_{k}" for k in range(self.doubt.shape[2])))

    @property
    def shared_precision(self) -> tuple[float, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return (0.0, *(1.0,) * self.doubt.shape[2])

    def at(self, calibration: Parameters, terms: Terms, near: Rows | None = None) -> DipRows:
        """See ``RowSource``."""
        del near  # these rows need no other ones
        return DipRows(self, calibration, terms)
