"""Virtual sensors: a perfect one, one read as raw counts, and what calibrates each of them."""

from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import COUNT
from imucal_wizard.simulate.sensor import SensorModel, Triad


def ideal() -> SensorModel:
    """No bias, no error, no noise, no rounding."""
    return SensorModel(
        Triad(np.eye(3), np.zeros(3), "m/s^2"),
        Triad(np.eye(3), np.zeros(3), "rad/s"),
        temperature_step=0.0,
    )


def offset_binary(model: SensorModel) -> SensorModel:
    """Read as unsigned 16-bit counts around 32768, with the gains of an Xsens MTi-G."""
    return replace(
        model,
        accelerometer=_in_counts(model.accelerometer, 415.0, 32768.0),
        gyroscope=_in_counts(model.gyroscope, 4778.0, 32768.0),
    )


def _in_counts(triad: Triad, gain: float, offset: float) -> Triad:
    """The same axes by a 16-bit converter: ``gain`` counts per SI unit around ``offset``."""
    lowest = offset - 2.0**15
    return replace(
        triad,
        sensitivity=triad.sensitivity * gain,
        bias=triad.bias * gain + offset,
        unit=COUNT,
        step=1.0,
        lowest=lowest,
        highest=lowest + 2.0**16 - 1.0,
    )


@dataclass(frozen=True, eq=False)
class Truth:
    """What a perfect calibration of a virtual sensor finds: ``x = M·(y − b)``.

    Attributes:
        accelerometer_matrix: ``M``, upper triangular, SI unit per reading unit, shape (3, 3).
        accelerometer_bias: ``b``, reading unit, shape (3,).
        gyroscope_matrix: ``M`` in the accelerometer's frame.
        gyroscope_bias: ``b``.
    """

    accelerometer_matrix: FloatArray
    accelerometer_bias: FloatArray
    gyroscope_matrix: FloatArray
    gyroscope_bias: FloatArray


def truth(seed: int = 0, model: SensorModel | None = None) -> Truth:
    """The true calibration of ``model``, or of the sensor that ``seed`` draws."""
    sensor = SensorModel.drawn(seed) if model is None else model
    force, rate = sensor.accelerometer, sensor.gyroscope
    return Truth(_correction(force), force.bias, _correction(rate), rate.bias)


def _correction(triad: Triad) -> FloatArray:
    """``M = S⁻¹``, SI unit per reading unit."""
    return np.asarray(np.linalg.inv(triad.sensitivity), np.float64)
