"""The gyroscope's offset from several still positions, without scale or axes (N, VIII).

Every position counts once, however long it was held, unless the device moved in it: what differs
between positions (temperature, the pull of gravity) is more than the noise within one. Scale and
axes stay nominal. Its standard error follows from the scatter between positions, and from slow
noise and rounding, which all positions share.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, IntArray, distinct
from imucal_wizard.core.statistics import (
    MEDIAN_CHI_SQUARE,
    median,
    median_of_rows,
    root_mean_square,
)
from imucal_wizard.core.units import COUNT
from imucal_wizard.estimate.method_data import GyroscopeData
from imucal_wizard.estimate.methods import Method
from imucal_wizard.estimate.noise import rest_of
from imucal_wizard.estimate.result import Parameter, SensorFit
from imucal_wizard.estimate.slow_noise import slow_rate
from imucal_wizard.measurement.holds import Hold

MIN_OFFSET_POSITIONS = 2


def run(data: GyroscopeData) -> SensorFit:
    """The offset from the rests alone."""
    return fit_offset(data.holds, data.labels, data.unit, data.rounding)


def fit_offset(
    holds: Sequence[Hold], labels: IntArray, unit: str, rounding: FloatArray | float = 0.0
) -> SensorFit:
    """``b`` as the mean of the still positions' means; errors are of the rate at rest, rad/s.

    Args:
        holds: still periods with a gyroscope.
        labels: number of each hold's position, shape (n,).
        unit: of the readings, ``rad/s``.
        rounding: variance by which the steps of the readings shift all positions alike, shape (3,).

    Raises:
        DataError: fewer than two positions, or readings whose scale is not known.
    """
    if unit == COUNT:
        raise DataError(
            "the offset alone gives no scale, and the gyroscope's counts have none: turn the "
            "device between holds, or give the unit",
            settings=("gyroscope_unit",),
        )
    known = [i for i, hold in enumerate(holds) if hold.gyroscope is not None]
    places = distinct(labels[known])
    if len(places) < MIN_OFFSET_POSITIONS:
        raise DataError(
            "the offset needs the gyroscope at rest in two positions at least: hold the device "
            "still on several of its faces"
        )
    resting, own = [holds[i] for i in known], labels[known]
    readings = np.array([hold.gyroscope for hold in resting], float)
    means = np.array([readings[own == place].mean(axis=0) for place in places])
    shares = _shares(means, resting, own)
    return _report(means, shares, _variance(means, shares, resting, own) + rounding, unit)


def _shares(means: FloatArray, holds: Sequence[Hold], labels: IntArray) -> FloatArray:
    """With which share each position counts, shape (n,): all alike but where the device moved."""
    places = distinct(labels)
    moved = rest_of(holds, np.eye(3)).moved
    own = np.array([moved[labels == place].mean() / np.sum(labels == place) for place in places])
    usual = median((means - median_of_rows(means)) ** 2) / MEDIAN_CHI_SQUARE
    if not usual > 0.0:
        return np.full(len(means), 1.0 / len(means))
    weight = 1.0 / (usual + own)
    return np.asarray(weight / weight.sum())


def _variance(
    means: FloatArray, shares: FloatArray, holds: Sequence[Hold], labels: IntArray
) -> FloatArray:
    """Of the mean of the positions, by their scatter and by slow noise, shape (3,)."""
    count = len(means)
    scatter = shares**2 @ (means - shares @ means) ** 2 * count / (count - 1.0)
    place = np.unique(labels, return_inverse=True)[1]
    each = shares[place] / np.bincount(place)[place]
    return np.asarray(scatter + slow_rate(holds, each))


def _report(means: FloatArray, shares: FloatArray, variance: FloatArray, unit: str) -> SensorFit:
    count, bias = len(means), shares @ means
    left = np.linalg.norm(means - bias, axis=1)
    # the mean of the others is off by 1/(1 − s) times as much, s being the share left out
    without = left / (1.0 - shares)
    return SensorFit(
        sensor="gyroscope",
        model=("bias",),
        method="offset",
        frame="accelerometer",
        matrix=np.eye(3),
        bias=bias,
        bias_unit=unit,
        parameters=tuple(
            Parameter(f"bias_{axis}", float(b), float(e), unit)
            for axis, b, e in zip("xyz", bias, np.sqrt(variance), strict=True)
        ),
        unit="rad/s",
        rms_before=root_mean_square(means),
        rms_fitted=root_mean_square(left),
        rms_held_out=root_mean_square(without),
        floor=None,
        residuals=left,
        held_out=without,
        warnings=(f"the offset alone, from {count} still positions: scale and axes are nominal",),
        degrees_of_freedom=count - 1,
    )


METHODS = (
    Method("offset", ("gyroscope",), "offset from still positions (section VIII)", "N", run),
)
