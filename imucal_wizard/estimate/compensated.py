"""Detection of readings that were already corrected: the calibration finds nothing to correct.

Two hypotheses about the deviations d of bias and matrix from their nominal values (0 and 1), known
with covariance C: the readings are compensated, so that d is no larger than what such a routine
leaves behind, ``d ~ N(0, Δ² + C)``; or they are an ordinary sensor's, ``d ~ N(0, S² + C)`` with the
errors of the datasheets. Their likelihood ratio counts how well d is known: where C is as large as
S, it is one. An ordinary sensor reaches a ratio of r by chance less often than once in r (Markov).
"""

import numpy as np

from imucal_wizard.core.quantities import quantity
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import COUNT, STANDARD_GRAVITY
from imucal_wizard.estimate.magnitude import TRIANGLE
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.identifiability import TYPICAL_SIZE

CONVINCING = 100.0
"""Likelihood ratio from which it is said."""
LEFT_BEHIND = {"accelerometer": 2e-3 * STANDARD_GRAVITY, "gyroscope": np.radians(0.02)}
"""Bias that a compensation leaves, SI: 2 mg and 0.02 °/s."""
LEFT_IN_MATRIX = {"accelerometer": 1.5e-3, "gyroscope": 3e-3}
"""Error of a gain, or of an angle in rad, that it leaves."""
ORDINARY_BIAS = {
    "accelerometer": TYPICAL_SIZE[:3] * STANDARD_GRAVITY,
    "gyroscope": np.full(3, np.radians(0.5)),
}
"""Bias of an ordinary sensor, SI, one standard deviation (datasheets of gyroscopes: 0.3–5 °/s)."""
_BIAS_ENTRIES = {"accelerometer": slice(0, 3), "gyroscope": slice(9, 12)}
"""Of the covariance of a fit."""
_BIAS_UNIT = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}
ORDINARY_GAIN = 0.02
"""Error of its gains."""
WORTH = 0.8
"""A held-out error above this share of the one before is no gain."""


@dataclass(frozen=True, eq=False)
class Deviation:
    """How far one group of parameters is from its nominal values.

    Attributes:
        size: d, SI, shape (n,).
        covariance: C, shape (n, n).
        left: Δ, shape (n,).
        ordinary: S, shape (n,).
    """

    size: FloatArray
    covariance: FloatArray
    left: FloatArray
    ordinary: FloatArray

    @property
    def nominal(self) -> bool:
        """Whether these are convincingly those of compensated readings."""
        ratio = self._log_likelihood(self.left) - self._log_likelihood(self.ordinary)
        return bool(ratio > np.log(CONVINCING))

    def _log_likelihood(self, spread: FloatArray) -> float:
        total = self.covariance + np.diag(spread**2)
        return float(
            -0.5 * (np.linalg.slogdet(total)[1] + self.size @ np.linalg.solve(total, self.size))
        )


def noticed(fit: SensorFit) -> str:
    """What shows that the readings are compensated, and what to do; "" where nothing does."""
    if fit.covariance is None:
        return ""
    bias = _of_bias(fit)
    if not bias.nominal:
        return ""
    matrix = _of_matrix(fit)
    whole = matrix is not None and matrix.nominal
    largest = quantity(max(float(np.abs(bias.size).max()), 1e-6), _BIAS_UNIT[fit.sensor], 2)
    if whole:
        what = f"bias (at most {largest}) and matrix are nominal within the accuracy of these data"
        return f"the {fit.sensor}'s {what}: {_ALREADY} {_worth(fit)} {_RAW[fit.sensor]}"
    advice = _OFFSET[fit.sensor]
    return f"the {fit.sensor}'s bias is nominal (at most {largest}): {advice} {_RAW[fit.sensor]}"


_ALREADY = "its readings are already compensated, or it is exceptionally good."
_OFFSET = {
    "accelerometer": "its offset is already compensated, or exceptionally small. This calibration "
    "holds for readings compensated in the same way.",
    "gyroscope": "the device removes it by itself (automatic calibration at rest), or it is "
    "exceptionally small. This correction may change: leave the bias at zero, use the matrix.",
}
_RAW = {
    "accelerometer": "To calibrate the sensor itself, switch the compensation off (BNO055: a mode "
    "without fusion) and measure again.",
    "gyroscope": "To calibrate the sensor itself, switch the compensation off (BNO055: a mode "
    "without fusion; WitMotion: register 0x63 = 1) and measure again.",
}


def _worth(fit: SensorFit) -> str:
    before, after = fit.rms_before, fit.rms_held_out
    if before is None or after is None:
        return "This calibration holds for these readings only, not for raw ones."
    errors = f"{quantity(before, fit.unit)} before, {quantity(after, fit.unit)} held out"
    if after > WORTH * before:
        return f"Use the readings as they are: the calibration hardly improves them ({errors})."
    return (
        f"This calibration is a small correction on top of that ({errors}): never apply it to raw "
        "readings."
    )


def _of_bias(fit: SensorFit) -> Deviation:
    """The bias as an input, ``M b``; for counts that needs no nominal scale."""
    covariance = np.asarray(fit.covariance)
    rows = _BIAS_ENTRIES[fit.sensor]
    return Deviation(
        fit.matrix @ fit.bias,
        fit.matrix @ covariance[rows, rows] @ fit.matrix.T,
        np.full(3, LEFT_BEHIND[fit.sensor]),
        ORDINARY_BIAS[fit.sensor],
    )


def _of_matrix(fit: SensorFit) -> Deviation | None:
    """The matrix against one; None for counts, of which nobody knows the nominal scale."""
    if fit.bias_unit == COUNT:
        return None
    covariance = np.asarray(fit.covariance)
    if fit.sensor == "accelerometer":
        rows, columns = (list(places) for places in zip(*TRIANGLE, strict=True))
        size, covariance = (fit.matrix - np.eye(3))[rows, columns], covariance[3:, 3:]
        ordinary, known = TYPICAL_SIZE[3:], fit.fitted_entries[3:]
    else:
        size, covariance = (fit.matrix - np.eye(3)).ravel(), covariance[:9, :9]
        ordinary, known = np.full(9, ORDINARY_GAIN), fit.fitted_entries[:9]
    if not known.any():
        return None
    left = np.full(len(size), LEFT_IN_MATRIX[fit.sensor])
    inner = covariance[np.ix_(known, known)]
    return Deviation(size[known], inner, left[known], ordinary[known])
