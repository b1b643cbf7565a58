"""A calibrated device as a compass: its heading before and after, and how well that is known."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.ellipsoid.shape import parameters, symmetric_matrix
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.directions import unit_vectors
from imucal_wizard.solver.result import FitReport, SensorFit
from imucal_wizard.solver.second_stage.dip import Alignment
from imucal_wizard.solver.second_stage.heading import Bearings, heading, heading_error
from imucal_wizard.solver.second_stage.rotation import exponential
from imucal_wizard.units import COUNT


def up_in(fit: SensorFit, force: FloatArray) -> FloatArray:
    """Unit up in the body frame from readings of a calibrated accelerometer, both (n, 3)."""
    return unit_vectors((force - fit.bias) @ fit.matrix.T)


@dataclass(frozen=True, eq=False)
class Compass:
    """What a heading needs.

    Attributes:
        accelerometer: its fit.
        magnetometer: its fit, in its own frame.
        alignment: how the magnetometer lies in the accelerometer's frame.
    """

    accelerometer: SensorFit
    magnetometer: SensorFit
    alignment: Alignment

    def field(self, readings: FloatArray) -> FloatArray:
        """Corrected field in the body frame from magnetometer readings, shape (n, 3)."""
        matrix = self.alignment.rotation @ self.magnetometer.matrix
        return np.asarray((readings - self.magnetometer.bias) @ matrix.T)

    def bearings(self, force: FloatArray, readings: FloatArray) -> Bearings:
        """Headings before and after, and the error expected after.

        Args:
            force: accelerometer readings, shape (n, 3).
            readings: magnetometer readings at the same moments, shape (n, 3).
        """
        up, fit = up_in(self.accelerometer, force), self.magnetometer
        before = heading(up if self.accelerometer.bias_unit == COUNT else force, readings)

        def after(theta: FloatArray) -> FloatArray:
            rotation = exponential(theta[9:]) @ self.alignment.rotation
            matrix = rotation @ symmetric_matrix(theta[:9])
            return heading(up, (readings - theta[:3]) @ matrix.T)

        theta = np.concatenate([parameters(fit.matrix, fit.bias), np.zeros(3)])
        covariance = np.zeros((12, 12))
        if fit.covariance is not None:
            covariance[:9, :9] = fit.covariance
        covariance[9:, 9:] = self.alignment.covariance
        return Bearings(before, after(theta), heading_error(after, theta, covariance))


def compass_of(report: FitReport) -> Compass | None:
    """The compass that a report makes, or None where its sensors are not aligned."""
    if report.magnetic is None or report.second_stage is None:
        return None
    alignment = report.second_stage.alignment
    return Compass(report.sensors["accelerometer"], report.magnetic.fit, alignment)
