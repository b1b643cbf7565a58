"""What a fit with effects says."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.accelerometer import AccelerometerFit
from imucal_wizard.solver.extended.linear import Linear
from imucal_wizard.solver.extended.terms import Term, Terms
from imucal_wizard.solver.result import SensorFit

PASSES = 30
EARLY = 2.0 / 3.0
"""Share of what was measured that predicts what comes later."""
FEWEST_LATER = 3
"""Holds or rotations that are left to be predicted, at least."""


@dataclass(frozen=True, eq=False)
class Witness:
    """What one kind of data alone says of the sizes.

    Attributes:
        sizes: of all effects one after the other, shown units, shape (p,).
        covariance: of the sizes, shape (p, p).
    """

    sizes: FloatArray
    covariance: FloatArray


@dataclass(frozen=True, eq=False)
class Extended:
    """The fit of a base model with effects.

    Attributes:
        fit: the calibration; its parameters include the sizes of the effects in shown units
            (``second-order_x``), its model their names.
        base: terms of the base model that are fitted.
        terms: the effects.
        sizes: of each effect, shown units.
        errors: standard errors of the sizes; NaN where nothing is left over to judge by.
        covariance: of all sizes one after the other, shape (p, p), or None.
        linear: the fit made linear, for scoring what is missing.
        rms_late: error of the later part of the data under the fit of the earlier part, in the
            unit of ``fit``; None where the earlier part does not carry the base.
        late: these errors, one per later hold or rotation, or None.
        witnesses: of the gyroscope, what the still means alone and the rotations alone say of all
            sizes; None without effects.
        accelerometer: of the accelerometer, what the gyroscope's fit needs of it; None otherwise.
    """

    fit: SensorFit
    base: tuple[str, ...]
    terms: tuple[Term, ...]
    sizes: tuple[FloatArray, ...]
    errors: tuple[FloatArray, ...]
    covariance: FloatArray | None
    linear: Linear
    rms_late: float | None
    late: FloatArray | None = None
    witnesses: tuple[Witness, Witness] | None = None
    accelerometer: AccelerometerFit | None = None

    @property
    def rms_fitted(self) -> float:
        """Error on the data fitted, in the unit of ``fit``."""
        return self.fit.rms_fitted

    @property
    def rms_held_out(self) -> float | None:
        """Error on directions or rotations left out one at a time."""
        return self.fit.rms_held_out

    @property
    def model(self) -> tuple[str, ...]:
        """Names of all terms, base first."""
        return self.fit.model

    def correct(self, readings: FloatArray, circumstances: Circumstances) -> FloatArray:
        """See ``correct``."""
        return correct(self.fit, self.terms, self.sizes, readings, circumstances)


def correct(
    fit: SensorFit,
    terms: tuple[Term, ...],
    sizes: tuple[FloatArray, ...],
    readings: FloatArray,
    circumstances: Circumstances,
) -> FloatArray:
    """See ``corrected``."""
    return corrected(fit.sensor, (fit.matrix, fit.bias), terms, sizes, readings, circumstances)


def corrected(
    sensor: str,
    calibration: tuple[FloatArray, FloatArray],
    terms: Sequence[Term],
    sizes: Sequence[FloatArray],
    readings: FloatArray,
    circumstances: Circumstances,
) -> FloatArray:
    """``x = M (y − b) − ε(x, circumstances)``, SI, shape (n, 3).

    Args:
        sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
        calibration: matrix M and bias b.
        terms: the effects.
        sizes: of each, shown units.
        readings: y, in the bias's unit, shape (n, 3).
        circumstances: of each reading. What the sensor itself measures (the force of an
            accelerometer, the rate of a gyroscope) is put in here and need not be right.
    """
    matrix, bias = calibration
    linear = (readings - bias) @ matrix.T
    together = Terms(sensor, terms)
    flat = np.concatenate([np.zeros(0), *sizes])
    found = linear
    for _ in range(PASSES if terms else 0):
        moved = linear - together.columns(circumstances.sensing(sensor, found)) @ flat
        change = np.abs(moved - found).max(initial=0.0)
        found = moved
        if not change > 1e-13 * np.abs(linear).max(initial=0.0):
            break
    return np.asarray(found)
