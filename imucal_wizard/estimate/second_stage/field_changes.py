"""Changes of the field's direction about the vertical, which the magnetometer alone does not show.

Magnitude and dip stay the same when the field turns about the vertical: a table with iron in it is
moved, or the device is carried to another place. The gyroscope shows it, for it carries gravity and
field from one hold to the next. Where gravity closes and the field does not, the field has changed.
A gyroscope that reads a rotation wrongly errs about the axis of that rotation, and gravity shows
this unless that axis is vertical.
"""

import math
from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.quantities import listed
from imucal_wizard.core.readings import BoolArray, FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import robust_deviation
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.second_stage.alignment import FAR_OFF
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.model.rows.field_closure import FieldClosure, HeadingRows
from imucal_wizard.model.rows.gravity_closure import carry
from imucal_wizard.model.rows.table import ResidualTable

ENDS_OF_HOLD = 0.1
"""Part of a hold at either end whose mean field is compared."""
MIN_SAMPLES_AT_END = 3
ALLOWED_TURN = 0.003
"""Rad by which a field seems to turn with a device that a hand or a soft table lets turn: 0.2°."""
MAX_PLACES_LISTED = 3
"""Changes that are told one by one; of more the number and the largest."""


@dataclass(frozen=True)
class FieldChange:
    """A rotation that gravity closes and the field does not, or a hold in which the field turned.

    Attributes:
        before: index of the hold before.
        after: index of the hold after; the same where the field turned in a hold.
        angle: by which the field turned about the vertical meanwhile, rad.
        error: standard deviation of the angle, rad.
    """

    before: int
    after: int
    angle: float
    error: float


def where_field_turned(source: FieldClosure, rows: HeadingRows) -> tuple[BoolArray, FloatArray]:
    """In which rotations the field turned about the vertical.

    Args:
        source: the rotations whose field is known at both ends.
        rows: their rows, by a gyroscope that fits most of them.

    Returns:
        Whether the field turned in each, and the standard deviation of each heading, shape (m,).
    """
    sigma = _deviations(rows.residual, rows.own, rows.shared_columns())
    gravity = rows.by_gravity
    across = _deviations(gravity.residual, gravity.own, gravity.shared_columns())
    shown = FAR_OFF * across.reshape(-1, 2).max(axis=1)
    closes = np.linalg.norm(gravity.residual.reshape(-1, 2), axis=1) <= shown
    far = np.abs(rows.residual) > FAR_OFF * sigma
    return far & closes & ~_may_be_the_gyroscope(source, rows, 2.0 * shown), sigma


def turned_in_hold(
    index: int, hold: Hold, series: Series, fits: tuple[SensorFit, SensorFit], noise: float
) -> FieldChange | None:
    """By how much the field turned about the vertical while the device was at rest; None if not.

    A device that turned about the vertical has the gyroscope read that.

    Args:
        index: of the hold.
        hold: with a mean reading of the gyroscope.
        series: of the magnetometer during the hold.
        fits: of the accelerometer and the gyroscope.
        noise: of a reading of the corrected field, uT.
    """
    by_force, by_rate = fits
    field, count = series.values, math.ceil(ENDS_OF_HOLD * len(series))
    if hold.gyroscope is None or len(field) < 2 * MIN_SAMPLES_AT_END:
        return None
    count = max(count, MIN_SAMPLES_AT_END)
    up = unit_vectors(by_force.matrix @ (hold.accelerometer - by_force.bias))
    first, last = field[:count].mean(axis=0), field[-count:].mean(axis=0)
    level = [one - up * (one @ up) for one in (first, last)]
    length = max(float(np.linalg.norm(level[0])), np.finfo(float).tiny)
    angle = math.atan2(float(np.cross(*level) @ up), float(level[0] @ level[1]))
    seconds = float(series.time[-count:].mean() - series.time[:count].mean())
    # in the body, the field turns back as the device turns
    angle += float(by_rate.matrix @ (hold.gyroscope - by_rate.bias) @ up) * seconds
    error = math.hypot(noise * math.sqrt(2.0 / count) / length, ALLOWED_TURN)
    return FieldChange(index, index, angle, error) if abs(angle) > FAR_OFF * error else None


def only_headings_differ(table: ResidualTable, items: Sequence[int]) -> bool:
    """Whether gravity closes these rotations, so that the field alone disagrees.

    Args:
        table: the rows.
        items: the rotations, see ``ResidualTable.item``.
    """
    rows = np.isin(table.item, items)
    far = np.abs(table.residual) > FAR_OFF * table.sigma
    field = rows & (table.kind == FieldClosure.kind)
    return bool(field.any() and table.moving[rows].all() and not far[rows & ~field].any())


def field_angles(source: FieldClosure, rows: HeadingRows) -> FloatArray:
    """By how much the field turned about the vertical in each rotation, rad, shape (m,).

    The residual is this angle where it is small.
    """
    up, after = source.by_gravity.after, source.by_field.after
    carried = carry(rows.by_field.ends, source.by_field.before)
    sine = (np.cross(carried, after) * up).sum(axis=1)
    level = (carried * after).sum(axis=1) - (carried * up).sum(axis=1) * (after * up).sum(axis=1)
    return np.asarray(np.arctan2(sine, level))


def _deviations(residual: FloatArray, own: FloatArray, shared: FloatArray) -> FloatArray:
    """Standard deviation of each row, at least by what most of the rows show."""
    sigma = np.sqrt(own + (shared**2).sum(axis=1))
    return np.asarray(np.maximum(sigma, robust_deviation(residual)))


def _may_be_the_gyroscope(source: FieldClosure, rows: HeadingRows, shown: FloatArray) -> BoolArray:
    """Rotations in which a gyroscope that errs about the axis of rotation may have made the error.

    An error ψ about the vertical by rates at an angle α to it comes with ψ·tan α across it. The
    gyroscope is no explanation where the rates at which gravity would not show that do not add up
    to ψ.

    Args:
        source: the rotations.
        rows: their rows.
        shown: error across the vertical that surely shows in each rotation, rad, shape (m,).
    """
    samples, gravity = source.by_gravity.samples, rows.by_gravity
    up = gravity.force / source.by_gravity.gravity
    upright = np.abs((gravity.rate * up).sum(axis=1))
    level = np.linalg.norm(gravity.rate - up * (gravity.rate * up).sum(axis=1)[:, None], axis=1)
    psi = np.abs(rows.residual)
    hidden = psi[samples.rotation] * level <= shown[samples.rotation] * upright
    angle = samples.sample_weights(samples.dt[None])[0] * upright * hidden
    return np.asarray(np.add.reduceat(angle, samples.offsets[:-1]) >= psi)


def changes_text(changes: Sequence[FieldChange], sensor_fits: bool) -> str:
    """Between which holds the field turned about the vertical, or in which, and by how much.

    Args:
        changes: in the order of time.
        sensor_fits: whether the magnetometer's own model leaves only noise, so that it has not
            changed itself.
    """
    places, last = [], len(changes) - 1
    at = 0
    while at <= last:
        one = changes[at]
        angle = f"{abs(np.degrees(one.angle)):.1f}°"
        if one.before == one.after:
            places.append(f"during hold {one.after + 1} by {angle}")
        elif at < last and _one_hold(one, changes[at + 1]):
            places.append(f"in hold {one.after + 1} by {angle}")
            at += 1
        else:
            places.append(f"between holds {one.before + 1} and {one.after + 1} by {angle}")
        at += 1
    said = listed(places)
    if len(places) > MAX_PLACES_LISTED:
        most = max(abs(one.angle) for one in changes)
        said = f"{len(places)} times by up to {np.degrees(most):.1f}°, first {places[0]}"
    causes = (
        "Iron or a magnet was moved, the device was carried to another place, or the magnetometer "
        "moved against the other sensors"
    )
    if not sensor_fits:
        causes = "Iron, a magnet or a current changed nearby, or the magnetometer itself"
    at_rest = sum(one.before == one.after for one in changes)
    why = ["gravity closes the rotations there and the field does not"] * (at_rest < len(changes))
    why += ["gyroscope and accelerometer were at rest in it"] * (at_rest > 0)
    return (
        f"the field turned about the vertical {said}: {'; '.join(why)}. {causes}; headings in "
        "different fields cannot be compared, and the gyroscope is fitted without them"
    )


def _one_hold(one: FieldChange, other: FieldChange) -> bool:
    """Whether the field turned for one hold and back."""
    both = np.hypot(one.error, other.error)
    adjoin = one.after == other.before and other.before < other.after
    return adjoin and abs(one.angle + other.angle) < FAR_OFF * both
