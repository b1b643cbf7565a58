"""The honest floor: what no model can go below, seen in three ways.

- **within**: noise of an average by the scatter of its block means;
- **rounding**: step of the readings / √12, which averaging does not lessen where the noise is too
  small to carry a reading from one step to the next;
- **repeats**: scatter of visits to one direction about their mean, the pure error. It alone sees
  what changes from hold to hold, so it is tested first, by F against the noise within. Pieces of
  one rest, cut by a disturbance, are one visit.

A steady drift makes repeats scatter too; that part a model can take away. ``steady`` is the scatter
without it, and what the floor is made of where the repeats are worse than the noise.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.readings import FloatArray, IntArray, Series, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.estimate.distributions import exceeded
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.model.catalogue import effect

WITHIN_FREEDOM = 0.6 * 12.0
"""Degrees of freedom per hold behind the noise within: three axes of five block means, pooled by
their median, which knows about 0.6 as much as their mean would."""
MIN_REPEAT_FREEDOM = 4
"""Degrees of freedom from which repeats may overrule the noise within."""
REPEATABLE_P = 0.01
"""An F ratio rarer than this says that poses do not repeat."""
MIN_DITHER_STEPS = 0.5
"""With noise of half a step, averages of rounded readings are as good as of exact ones."""


@dataclass(frozen=True)
class Rounding:
    """What rounding does to an average.

    Attributes:
        error: step of the readings / √12, in SI.
        dithered: the noise is large enough to average it away.
    """

    error: float
    dithered: bool


@dataclass(frozen=True)
class Floors:
    """The floors of one sensor, of holds (the gyroscope: of the rates at rest), in SI.

    Attributes:
        within: by block means within the holds.
        rounding: step / √12; None where the readings are not at hand.
        dithered: whether averaging takes the rounding away.
        repeats: pure error; None without repeats.
        freedom: its degrees of freedom.
        p: chance of repeats as bad as these by the noise within; None without repeats.
        steady: pure error without a steady drift; None where nothing is left to judge it by, and
            for a magnetometer, whose place differs from time to time.
        unit: ``m/s^2``, ``rad/s`` or ``uT``.
    """

    within: float
    rounding: float | None
    dithered: bool
    repeats: float | None
    freedom: int
    p: float | None
    steady: float | None
    unit: str

    @property
    def repeatable(self) -> bool | None:
        """Whether the same pose reads the same again; None without repeats."""
        return None if self.p is None else self.p > REPEATABLE_P

    @property
    def floor(self) -> float:
        """What is left of a hold's error by any model."""
        floor = self.within
        if self.rounding is not None and not self.dithered:
            floor = max(floor, self.rounding)
        if (
            self.repeatable is False
            and self.freedom >= MIN_REPEAT_FREEDOM
            and self.steady is not None
        ):
            floor = max(floor, self.steady)
        return floor


def floors_of(extended: SensorFit, rounding: Rounding | None = None) -> Floors:
    """The floors under a fit.

    Args:
        extended: the fit; its residual at rest is what repeats or does not.
        rounding: of its readings, where they are known.
    """
    table = extended.rows
    assert table is not None  # noqa: S101 (narrows the type)
    rest = ~table.moving & (table.group >= 0)
    axis = np.maximum(table.axis, 0)[rest]
    noise = table.floor[rest]
    residual = table.residual[rest] / noise
    drift = table.design_columns(effect("bias-drift"))[rest] / noise[:, None]
    group = 3 * table.group[rest] + axis
    within = float(np.sqrt(np.mean(noise**2)))
    visit = 3 * table.visit[rest] + axis
    both, group = _visited(np.column_stack([residual, drift]), visit, group)
    share, freedom = _pure(both[:, 0], group, np.zeros((len(both), 0)))
    # where repeats are no noise (another place in the room's field) they tell no floor
    steady = (
        None
        if not table.repeats_are_noise[rest].all()
        else _pure(both[:, 0], group, both[:, 1:])[0]
    )
    return Floors(
        within=within,
        rounding=None if rounding is None else rounding.error,
        dithered=rounding is None or rounding.dithered,
        repeats=None if share is None else within * float(np.sqrt(share)),
        freedom=freedom,
        p=None if share is None else exceeded(share, freedom, WITHIN_FREEDOM * len(residual)),
        steady=None if steady is None else within * float(np.sqrt(steady)),
        unit=extended.unit.replace("rad", "rad/s"),
    )


def _visited(rows: FloatArray, visit: IntArray, group: IntArray) -> tuple[FloatArray, IntArray]:
    """The pieces of each rest taken together, as exact as they are together; and their groups."""
    _, first, number, count = np.unique(
        visit, return_index=True, return_inverse=True, return_counts=True
    )
    sums = np.array([np.bincount(number, column) for column in rows.T]).T
    return sums / np.sqrt(count)[:, None], group[first]


def _pure(residual: FloatArray, group: IntArray, columns: FloatArray) -> tuple[float | None, int]:
    """Mean square of rows about the mean of their group, and its degrees of freedom.

    Args:
        residual: rows divided by the noise within, shape (n,).
        group: which rows repeat one another, shape (n,).
        columns: what may be fitted to them besides, shape (n, k).
    """
    _, number, count = np.unique(group, return_inverse=True, return_counts=True)
    both = np.column_stack([residual, columns])
    means = np.array([np.bincount(number, column) / count for column in both.T])
    centred = both - means[:, number].T
    left, values, _ = np.linalg.svd(centred[:, 1:], full_matrices=False)
    inner = left[:, values > 1e-9 * values.max(initial=1.0)]
    rest = centred[:, 0] - inner @ (inner.T @ centred[:, 0])
    freedom = len(residual) - len(count) - inner.shape[1]
    return (float(rest @ rest) / freedom if freedom > 0 else None), max(freedom, 0)


def rounding_of(series: Series | None, holds: Sequence[Hold], gain: float) -> Rounding | None:
    """What rounding does to the averages of a recording; None where nothing is rounded, or known.

    Args:
        series: the sensor's readings.
        holds: where they rest.
        gain: SI per reading unit.
    """
    if series is None or not holds:
        return None
    still = [hold.readings(series).values for hold in holds]
    still = [values for values in still if len(values) > 1]
    if not still:
        return None
    step = max(_step(np.concatenate(still)[:, axis]) for axis in range(3))
    spread = min(median([values[:, k].std() for values in still]) for k in range(3))
    return Rounding(gain * step / np.sqrt(12.0), spread >= MIN_DITHER_STEPS * step)


def rounding_while_turning(series: Series, matrix: FloatArray) -> Rounding:
    """What rounding does to the averages of a sensor that need not rest.

    Args:
        series: its readings; the noise is what differs from one to the next.
        matrix: M, SI per reading.
    """
    step = max(_step(series.values[:, axis]) for axis in range(3))
    changes = np.abs(np.diff(series.values, axis=0))
    spread = np.array([median(column) for column in changes.T]) / (0.6745 * np.sqrt(2.0))
    gain = float(np.linalg.norm(matrix, ord=2))
    return Rounding(gain * step / np.sqrt(12.0), bool(spread.min() >= MIN_DITHER_STEPS * step))


def _step(values: FloatArray) -> float:
    """The smallest step between readings; 0 for a constant."""
    steps = np.diff(distinct(values))
    return float(steps.min(initial=np.inf)) if len(steps) else 0.0
