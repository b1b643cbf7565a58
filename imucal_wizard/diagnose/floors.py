"""The noise floor, below which no model can go, measured in four ways.

- **within**: noise of an average by the scatter of its block means;
- **slow**: flicker noise from hold to hold, where long holds show it;
- **rounding**: step of the readings / √12, which averaging does not lessen where the noise is too
  small to carry a reading from one step to the next;
- **repeats**: what changes from one visit of a pose to the next (``estimate.repeatability``).
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.quantities import quantity
from imucal_wizard.core.readings import FloatArray, Series, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import SIGMA_PER_MEDIAN, median
from imucal_wizard.estimate.repeatability import Repeatability, rows_at_rest
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.measurement.holds import Hold

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
        within: by block means within the holds; NaN where the sensor never rests.
        slow: by flicker noise from hold to hold; 0 where the holds show none.
        rounding: step / √12; None where the readings are not at hand.
        dithered: whether averaging takes the rounding away.
        repeats: how far the same pose differs from visit to visit; None without repeats.
        unit: ``m/s^2``, ``rad/s`` or ``uT``.
    """

    within: float
    slow: float
    rounding: float | None
    dithered: bool
    repeats: Repeatability | None
    unit: str

    @property
    def within_text(self) -> str:
        """The noise within a hold, and the slow noise that is known beside it, in words."""
        within = quantity(self.within, self.unit)
        return f"{within}, slow noise {quantity(self.slow, self.unit)}" if self.slow else within


def floors_of(extended: SensorFit, rounding: Rounding | None = None) -> Floors:
    """The floors under a fit.

    Args:
        extended: the fit; its residual at rest is what repeats or does not.
        rounding: of its readings, where they are known.
    """
    table = extended.rows
    assert table is not None  # noqa: S101 (narrows the type)
    rest = rows_at_rest(table)
    within, slow = float("nan"), 0.0
    if rest.any():
        # the first hold, whose pose before nobody knows, has no more noise within than the others
        within = float(np.mean((table.floor**2 - table.slow - table.not_shown)[rest]))
        slow = float(np.mean(table.slow[rest]))
    return Floors(
        within=float(np.sqrt(within)),
        slow=float(np.sqrt(slow)),
        rounding=None if rounding is None else rounding.error,
        dithered=rounding is None or rounding.dithered,
        repeats=extended.repeatability,
        unit="rad/s" if extended.unit == "rad" else extended.unit,
    )


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
    step = max(_step(np.concatenate([values[:, k] for values in still])) for k in range(3))
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
    spread = np.array([median(column) for column in changes.T]) * SIGMA_PER_MEDIAN / np.sqrt(2.0)
    gain = float(np.linalg.norm(matrix, ord=2))
    return Rounding(gain * step / np.sqrt(12.0), bool(spread.min() >= MIN_DITHER_STEPS * step))


def _step(values: FloatArray) -> float:
    """The smallest step between readings; 0 for a constant."""
    steps = np.diff(distinct(values))
    return float(steps.min(initial=np.inf)) if len(steps) else 0.0
