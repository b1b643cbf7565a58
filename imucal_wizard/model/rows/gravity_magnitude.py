"""The magnitude of gravity in a hold: ``|x| − g`` with ``x = M (y − b) − ε(x)``.

ε depends on x itself; it is small, so that x is found by inserting it a few times, each of which
adds two to three digits.
"""

from collections.abc import Callable, Sequence
from dataclasses import field

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import lengths
from imucal_wizard.model.effect import ACCELEROMETER, Circumstances
from imucal_wizard.model.rows.source import (
    ENTRIES,
    Influence,
    Loading,
    Parameters,
    RowLabels,
    Rows,
    RowSource,
    hold_influences,
    hold_place,
    unmeasured,
)
from imucal_wizard.model.terms import (
    Term,
    Terms,
    columns_of,
    slope_of_corrected,
    true_input,
)

DIVERGED = 1e6
"""Factor on the residual where effects are so large that x is not determined."""
SHORTEST_FORCE = 1e-12
"""A force shorter than this, in units of gravity, has no direction."""


class MagnitudeRows(Rows):
    """|x| − g of each hold.

    Attributes:
        force: corrected, m/s², shape (n, 3).
        hidden: largest error of the force that readings do not show, on each axis, m/s², (n, 3).
            It counts as noise of the magnitude as far as the axis lies along the force.
    """

    def __init__(self, source: "GravityMagnitude", calibration: Parameters, terms: Terms) -> None:
        self._source, self._calibration, self._terms = source, calibration, terms
        linear = (source.reading - calibration.bias) @ calibration.matrix.T
        force = true_input(linear, self._errors, source.gravity) if len(terms) else linear
        diverged = not np.abs(force - linear).max() <= source.gravity
        force = linear if diverged else force
        length = lengths(force)
        self.force = force
        self.residual = (length - source.gravity) * (DIVERGED if diverged else 1.0)
        self.direction = force / np.maximum(length, SHORTEST_FORCE * source.gravity)[:, None]
        self.hidden = self._hidden()
        self.own = source.noise + self.not_shown
        self.lever = self.direction
        self._inverse: FloatArray | None = None

    def _errors(self, force: FloatArray) -> FloatArray:
        where = self._source.circumstances.sensing(ACCELEROMETER, force)
        return np.asarray(self._terms.columns(where) @ self._calibration.sizes)

    @property
    def inverse(self) -> FloatArray:
        """``∂x/∂(M (y − b)) = (I + ∂ε/∂x)⁻¹``, shape (n, 3, 3)."""
        if self._inverse is None:
            where = self._source.circumstances
            self._inverse = slope_of_corrected(
                self._terms, self._calibration.sizes, self.force, where
            )
        return self._inverse

    @property
    def _along(self) -> FloatArray:
        """How |x| moves with ``M (y − b)``, shape (n, 3)."""
        if not len(self._terms):
            return self.direction
        return np.asarray(np.einsum("ni,nij->nj", self.direction, self.inverse))

    def base_columns(self) -> FloatArray:
        """See ``Rows``: ``∂|x|/∂M_ij = l_i (y − b)_j`` and ``∂|x|/∂b = −l M``."""
        along, out = self._along, np.empty((len(self.force), ENTRIES))
        offset = self._source.reading - self._calibration.bias
        out[:, :9] = (along[:, :, None] * offset[:, None, :]).reshape(-1, 9)
        out[:, 9:] = -along @ self._calibration.matrix
        return out

    def term_columns(self, terms: Sequence[Term]) -> FloatArray:
        """See ``Rows``."""
        return np.asarray(-np.einsum("ni,nip->np", self._along, self._of_effects(terms)))

    def up_columns(self) -> FloatArray:
        """Derivative of the direction of x by M, b and the sizes in turn, shape (n, 3, 12 + p)."""
        offset = self._source.reading - self._calibration.bias
        moved = np.zeros((len(self.force), 3, ENTRIES))
        for axis in range(3):
            moved[:, axis, 3 * axis : 3 * axis + 3] = offset
        moved[:, :, 9:] = -self._calibration.matrix
        effects = -self._of_effects(self._terms.terms)
        change = self.inverse @ np.concatenate([moved, effects], axis=2)
        length = lengths(self.force)[:, None, None]
        along = np.einsum("ni,nip->np", self.direction, change)
        return np.asarray((change - self.direction[:, :, None] * along[:, None, :]) / length)

    def loading(self) -> Loading | None:
        """See ``Rows``: the bias of each axis wanders by itself."""
        wander = self._source.wander
        if not wander.shape[1]:
            return None
        weight = (self.direction[:, :, None] * wander[:, None, :]).reshape(len(wander), -1)
        return Loading(np.tile(np.arange(weight.shape[1]), (len(wander), 1)), weight)

    @property
    def slow(self) -> FloatArray:
        """See ``Rows``."""
        loading = self.loading()
        none = np.zeros(len(self.residual))
        return none if loading is None else np.asarray((loading.weight**2).sum(axis=1))

    @property
    def not_shown(self) -> FloatArray:
        """See ``Rows``: every error up to the largest is as likely."""
        return np.asarray((self.direction**2 * self.hidden**2).sum(axis=1) / 3.0)

    def _hidden(self) -> FloatArray:
        where = self._source.circumstances.sensing(ACCELEROMETER, self.force)
        found = np.zeros((len(self.force), 3))
        sizes = self._terms.split(self._calibration.sizes)
        for term, own in zip(self._terms.terms, sizes, strict=True):
            found += term.effect.hidden(ACCELEROMETER, where, own)
        return found

    def _of_effects(self, terms: Sequence[Term]) -> FloatArray:
        where = self._source.circumstances.sensing(ACCELEROMETER, self.force)
        return columns_of(terms, ACCELEROMETER, where)


@dataclass(frozen=True, eq=False)
class GravityMagnitude(RowSource):
    """One row per hold.

    Attributes:
        reading: mean of each hold, shape (n, 3).
        noise: variance of each row by the noise within holds alone, (m/s²)², shape (n,).
        circumstances: of the holds; their force is replaced by the corrected one.
        gravity: m/s².
        labels: see ``RowSource``.
        wander: by how much each of m independent slow errors of size one moves the bias of an axis
            in each hold, m/s², shape (n, m).
        slow_freedom: see ``RowSource``.
    """

    reading: FloatArray
    noise: FloatArray
    circumstances: Circumstances
    gravity: float
    labels: RowLabels
    wander: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    slow_freedom: float = float("inf")
    kind, part, left, at_rest = "hold", "holds", "|a| − g", True
    unit = "m/s^2"

    def influences(self) -> tuple[Influence, ...]:
        """See ``RowSource``."""
        return hold_influences(self.circumstances, self.labels.index)

    def per_item(self, of: Callable[[Circumstances], FloatArray]) -> FloatArray:
        """See ``RowSource``."""
        return of(self.circumstances)

    def measured(self, row: int) -> tuple[FloatArray, str]:
        """See ``RowSource``."""
        return self.reading[row], ""

    def place(self, row: int) -> str:
        """See ``RowSource``."""
        return hold_place(int(self.labels.index[row]), self.circumstances.force[row])

    def elsewhere(
        self, directions: FloatArray, calibration: Parameters, terms: Terms
    ) -> "GravityMagnitude":
        """See ``RowSource``: each hold of the session with other sides up."""
        rows = np.arange(len(directions)) * len(self.reading) // len(directions)
        force = self.gravity * directions
        where = self.circumstances.select(rows).sensing(ACCELEROMETER, force)
        felt = force + terms.columns(where) @ calibration.sizes
        return GravityMagnitude(
            felt @ np.linalg.inv(calibration.matrix).T + calibration.bias,
            self.noise[rows],
            where,
            self.gravity,
            unmeasured(len(directions)),
        )

    def at(self, calibration: Parameters, terms: Terms, near: Rows | None = None) -> MagnitudeRows:
        """See ``RowSource``."""
        del near  # these rows need no other ones
        return MagnitudeRows(self, calibration, terms)
