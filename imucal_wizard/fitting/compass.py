"""A calibrated device as a compass: its heading before and after, and how well that is known."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.directions import unit_vectors
from imucal_wizard.solver.result import FitReport, SensorFit
from imucal_wizard.solver.second_stage.dip import Alignment
from imucal_wizard.solver.second_stage.doubts import Doubts, field_moved, up_moved
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
        doubts: about the two calibrations, which move the alignment too.
    """

    accelerometer: SensorFit
    magnetometer: SensorFit
    alignment: Alignment
    doubts: Doubts

    def field(self, readings: FloatArray) -> FloatArray:
        """Corrected field in the body frame from magnetometer readings, shape (n, 3)."""
        return np.asarray(self._own(readings) @ self.alignment.rotation.T)

    def bearings(self, force: FloatArray, readings: FloatArray) -> Bearings:
        """Headings before and after, and the error expected after.

        Args:
            force: accelerometer readings, shape (n, 3).
            readings: magnetometer readings at the same moments, shape (n, 3).
        """
        up, own, doubts = up_in(self.accelerometer, force), self._own(readings), self.doubts
        before = heading(up if self.accelerometer.bias_unit == COUNT else force, readings)
        iron = doubts.magnetometer.shape[1]
        both = iron + doubts.accelerometer.shape[1]

        def after(parameters: FloatArray) -> FloatArray:
            """Each doubt by how many standard deviations, then a rotation by itself."""
            turn = self.alignment.shifts @ parameters[:both] + parameters[both:]
            field = field_moved(self.magnetometer, own, doubts.magnetometer @ parameters[:iron])
            tilted = up_moved(up, doubts.accelerometer @ parameters[iron:both])
            return heading(tilted, field @ (exponential(turn) @ self.alignment.rotation).T)

        covariance = np.eye(both + 3)
        covariance[both:, both:] = self.alignment.own
        theta = np.zeros(both + 3)
        return Bearings(before, after(theta), heading_error(after, theta, covariance))

    def _own(self, readings: FloatArray) -> FloatArray:
        """Corrected field in the magnetometer's own frame, shape (n, 3)."""
        fit = self.magnetometer
        return np.asarray((readings - fit.bias) @ fit.matrix.T)


def compass_of(report: FitReport) -> Compass | None:
    """The compass that a report makes, or None where its sensors are not aligned."""
    stage = report.second_stage
    if report.magnetic is None or stage is None:
        return None
    fit = report.sensors["accelerometer"]
    return Compass(fit, report.magnetic.fit, stage.alignment, stage.doubts)
