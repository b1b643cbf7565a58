"""Closure of a rotation about the vertical, which gravity does not show, against the field.

Gravity carried through a rotation shows its error θ across the vertical, ``e_g = θ − u (u·θ)``; the
field shows it across the field, ``e_f = θ − f (f·θ)``. With ``n = (u − f (f·u))/s``,
``s² = 1 − (f·u)²``, the part about the vertical follows,

    ψ = u·θ = ( e_f·n + (f·u) (e_g·f)/s ) / s.

It is one row per rotation, a linear combination of the rows of the two closures, and so are its
derivatives. An error of the accelerometer moves up, and with it the alignment of the magnetometer,
which was made by up: where poses leave angles undetermined, headings are off by these. Errors of
the magnetometer's calibration and of its alignment turn the field alike in all rotations.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.rows.earth import EarthAxes
from imucal_wizard.model.rows.gravity_closure import ClosureRows, GravityClosure
from imucal_wizard.model.rows.source import (
    Influence,
    Parameters,
    RowLabels,
    Rows,
    RowSource,
)
from imucal_wizard.model.terms import Term, Terms

MIN_SINE_SQUARE = 1e-6
"""Of the angle between field and vertical; at the poles the field gives no heading."""


class HeadingRows(Rows):
    """ψ of each rotation."""

    def __init__(
        self, source: "FieldClosure", by_gravity: ClosureRows, by_field: ClosureRows
    ) -> None:
        self._source, self.by_gravity, self.by_field = source, by_gravity, by_field
        self.residual = self._combined(by_gravity.residual, by_field.residual)
        self.own = source.noise
        self.direction = np.full((len(source.noise), 3), np.nan)

    @property
    def lever(self) -> FloatArray:  # type: ignore[override]  # computed when it is asked for
        """See ``Rows``."""
        return self._combined(self.by_gravity.lever, self.by_field.lever)

    def _combined(self, gravity: FloatArray, field: FloatArray) -> FloatArray:
        """Rows of ψ from rows of both closures, (2 m, …) each to (m, …)."""
        parts = 0.0
        for weight, rows in zip(self._source.weights, (gravity, field), strict=True):
            pairs = rows.reshape(len(weight), 2, *rows.shape[1:])
            parts = parts + np.einsum("ma,ma...->m...", weight, pairs)
        return np.asarray(parts)

    def base_columns(self) -> FloatArray:
        """See ``Rows``."""
        return self._combined(self.by_gravity.base_columns(), self.by_field.base_columns())

    def term_columns(self, terms: Sequence[Term]) -> FloatArray:
        """See ``Rows``."""
        gravity = self.by_gravity.term_columns(terms)
        return self._combined(gravity, self.by_field.term_columns(terms))

    def design_columns(self, terms: Sequence[Term]) -> FloatArray:
        """See ``Rows``."""
        gravity = self.by_gravity.design_columns(terms)
        return self._combined(gravity, self.by_field.design_columns(terms))

    def shared_columns(self) -> FloatArray:
        """See ``Rows``: the errors of the accelerometer, those of the magnetometer, and Ω."""
        source = self._source
        gravity = self.by_gravity.shared_columns()
        place = np.full(source.field_doubt.shape[2], source.by_gravity.before_doubt.shape[2])
        gravity = np.insert(gravity, place, 0.0, axis=1)
        return self._combined(gravity, self.by_field.shared_columns())


@dataclass(frozen=True, eq=False)
class FieldClosure(RowSource):
    """One row per rotation, those about the vertical included.

    Attributes:
        by_gravity: the closures of these rotations against gravity.
        by_field: the same against the field's direction.
        holds: the holds at both ends of each rotation, shape (m, 2).
        noise: variance of each row by measured noise alone, rad², shape (m,).
        labels: see ``RowSource``.
        leaning: by how much small changes of up in each hold turn the field of all holds, rotation
            vector, shape (3, h, 3).
        field_doubt: change of the unit field in each hold with each error mode of the magnetometer
            and of its alignment, shape (h, 3, k).
    """

    by_gravity: GravityClosure
    by_field: GravityClosure
    holds: IntArray
    noise: FloatArray
    labels: RowLabels
    leaning: FloatArray
    field_doubt: FloatArray
    kind = "heading"
    unit = "rad"
    judged, confirms, moving, noise_is_measured = False, False, True, False
    needs_reference = True
    group_word = "rotation"
    part, prefix = "rotations about the vertical, against the field", "heading-"

    @property
    def joined(self) -> IntArray:
        """See ``RowSource``."""
        return self.holds

    def influences(self) -> tuple[Influence, ...]:
        """See ``RowSource``."""
        return self.by_gravity.influences()

    def per_item(self, of: Callable[[Circumstances], FloatArray]) -> FloatArray:
        """See ``RowSource``."""
        return self.by_gravity.per_item(of)

    def measured(self, row: int) -> tuple[FloatArray, str]:
        """See ``RowSource``."""
        return self.by_gravity.measured(row)

    def samples_of(self, row: int) -> tuple[FloatArray, FloatArray]:
        """See ``RowSource``."""
        return self.by_gravity.samples_of(row)

    @property
    def shared(self) -> tuple[str, ...]:  # type: ignore[override]  # follows from the reference
        """See ``RowSource``."""
        modes, own = range(self.field_doubt.shape[2]), self.by_gravity.shared
        count = self.by_gravity.before_doubt.shape[2]
        return (*own[:count], *(f"magnetometer_{k}" for k in modes), *own[count:])

    @property
    def undetermined(self) -> tuple[str, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return self.by_gravity.undetermined

    @property
    def decided(self) -> tuple[str, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return self.by_gravity.decided

    @property
    def shared_precision(self) -> tuple[float, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return (1.0,) * len(self.shared)

    def under(self, up: FloatArray, doubt: FloatArray, usual: int, decided: int) -> "FieldClosure":
        """See ``RowSource``; the field's direction stays that of the alignment."""
        before, after = up[self.holds[:, 0]], up[self.holds[:, 1]]
        moved = replace(self, by_gravity=replace(self.by_gravity, before=before, after=after))
        return moved.doubting(doubt, usual, decided)

    def on_earth(self, earth: EarthAxes) -> "FieldClosure":
        """See ``RowSource``."""
        rates = earth.rates(self.holds[:, 0])
        gravity, field = (replace(one, earth=rates) for one in (self.by_gravity, self.by_field))
        return replace(self, by_gravity=gravity, by_field=field)

    def doubting(self, doubt: FloatArray, usual: int, decided: int) -> "FieldClosure":
        """The same rows with other errors of the accelerometer, by the arguments of ``under``."""
        first, last = self.holds.T
        turned = np.einsum("ihj,hjk->ik", self.leaning, doubt)

        def moved(field: FloatArray, hold: IntArray) -> FloatArray:
            by_up = np.cross(turned.T, field[:, None], axisc=1)
            return np.concatenate([by_up, self.field_doubt[hold]], axis=2)

        gravity = replace(
            self.by_gravity,
            before_doubt=doubt[first],
            after_doubt=doubt[last],
            usual=usual,
            left_open=decided,
        )
        field = self.by_field
        field = replace(
            field,
            before_doubt=moved(field.before, first),
            after_doubt=moved(field.after, last),
        )
        return replace(self, by_gravity=gravity, by_field=field)

    @property
    def level(self) -> FloatArray:
        """Square of the level part of the unit field after each rotation, shape (m,)."""
        along = (self.by_gravity.after * self.by_field.after).sum(axis=1)
        return np.asarray(np.maximum(1.0 - along**2, MIN_SINE_SQUARE))

    @property
    def weights(self) -> tuple[FloatArray, FloatArray]:
        """Shares of the rows of both closures in ψ, shape (m, 2) each."""
        up, field = self.by_gravity.after, self.by_field.after
        along = (up * field).sum(axis=1)[:, None]
        square = self.level[:, None]
        across, flat = (up - field * along) / square, (field - up * along) * along / square
        return (
            np.asarray(np.einsum("mai,mi->ma", self.by_gravity.basis, flat)),
            np.asarray(np.einsum("mai,mi->ma", self.by_field.basis, across)),
        )

    def at(self, calibration: Parameters, terms: Terms, near: Rows | None = None) -> HeadingRows:
        """See ``RowSource``."""
        close = near if isinstance(near, HeadingRows) else None
        alone = Parameters(calibration.matrix, calibration.bias, calibration.sizes)
        gravity = self.by_gravity.at(alone, terms, None if close is None else close.by_gravity)
        # the force on the gyroscope is that of gravity here, too
        by_field = replace(self.by_field, up=self.by_gravity.before)
        field = by_field.at(alone, terms, None if close is None else close.by_field)
        return HeadingRows(self, gravity, field)
