"""A fit made linear at its end: what the bench scores its suspects with."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from imucal_wizard.effects.effect import Effect
from imucal_wizard.readings import FloatArray, IntArray


@dataclass(frozen=True)
class RowInfo:
    """What one row of residuals is.

    Attributes:
        kind: ``hold`` (|x| − g of the accelerometer), ``still`` (the gyroscope's mean at rest),
            ``rotation`` (its closure), ``field`` (|x| − B of the magnetometer, means by time and
            direction), ``dip`` (its dip in a still pose).
        index: which hold or rotation, of those measured; of the magnetometer, the row itself.
        axis: body axis 0, 1, 2 of a still mean; 0 or 1 of a closure, whose two components lie
            across gravity; None for the accelerometer.
    """

    kind: Literal["hold", "still", "rotation", "field", "dip"]
    index: int
    axis: int | None = None


@dataclass(frozen=True, eq=False)
class Seen:
    """What the rows of a magnetometer look at.

    Attributes:
        direction: of the field in the body, unit vectors, shape (n, 3).
        shown: how much of an error of each axis each row shows, shape (n, 3).
    """

    direction: FloatArray
    shown: FloatArray


@dataclass(frozen=True, eq=False)
class Linear:
    """Residuals of a fit and how they move with each parameter, all divided by the noise.

    With small changes ``d`` of the parameters of ``base`` and ``s`` of those of a new effect the
    residual becomes ``residual + base·d + lift·s``. ``base`` holds what is fitted already; a column
    with ``precision`` is held to its prior, so that the normal matrix of the fit is
    ``baseᵀ base + diag(precision)``.

    Attributes:
        residual: shape (n,).
        base: shape (n, pb).
        precision: of the priors of the columns of ``base``, 0 where there is none, shape (pb,).
        names: of the columns of ``base``.
        rows: what each row is.
        groups: what is left out together when the fit is judged on what it has not seen, a
            direction or a rotation; −1 for rows that always stay, shape (n,).
        visits: number of the rest that a row is a piece of, −1 for rotations, shape (n,).
        order: time of each row, s, shape (n,).
        sigma: standard deviation each row was divided by, that which the fit itself finds, m/s²,
            rad/s (still means) or rad (closures), shape (n,).
        floor: standard deviation of each row by noise within holds and rotations alone.
        lift_of: see ``lift``.
        seen: what the rows look at, where the holds do not tell it.
    """

    residual: FloatArray
    base: FloatArray
    precision: FloatArray
    names: tuple[str, ...]
    rows: tuple[RowInfo, ...]
    groups: IntArray
    visits: IntArray
    order: FloatArray
    sigma: FloatArray
    floor: FloatArray
    lift_of: Callable[[Effect, float | None], FloatArray]
    seen: Seen | None = None

    def lift(self, effect: Effect, variant: float | None = None) -> FloatArray:
        """Derivative of ``residual`` by the effect's parameters, per shown unit, shape (n, p)."""
        return self.lift_of(effect, variant)
