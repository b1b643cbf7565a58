"""Tilt-compensated magnetic heading of a calibrated device, and its standard deviation.

North is the field's part across the vertical, ``n = m − u (u·m)``, east is ``n × u``; the heading
of the body's x axis is ``atan2(x·east, x·north)``, clockwise from magnetic north. Where x stands
upright there is none.
"""

from collections.abc import Callable

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.quaternions import rotation_matrix
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import COUNT
from imucal_wizard.estimate.magnitude import up_moved
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.estimate.second_stage.alignment import Alignment
from imucal_wizard.estimate.second_stage.error_modes import ErrorModes, field_moved

UPRIGHT = np.cos(np.radians(25.0))
"""The x axis nearer to the vertical than this has no heading worth a number."""


@dataclass(frozen=True, eq=False)
class Bearings:
    """Tilt-compensated heading of the x axis for each pair of readings.

    Attributes:
        before: by the readings as they come, rad; NaN where x is upright.
        after: by the calibration, rad.
        error: standard deviation by the errors of the calibration, rad.
    """

    before: FloatArray
    after: FloatArray
    error: FloatArray


def heading(up: FloatArray, field: FloatArray) -> FloatArray:
    """Heading of the body's x axis, rad from −π to π; NaN where x is upright.

    Args:
        up: up in the body frame, any length, shape (n, 3).
        field: field in the same frame, any length, shape (n, 3).
    """
    unit = up / np.linalg.norm(up, axis=1)[:, None]
    north = field - unit * (unit * field).sum(axis=1)[:, None]
    east = np.cross(north, unit)
    value = np.arctan2(east[:, 0], north[:, 0])
    return np.asarray(np.where(np.abs(unit[:, 0]) > UPRIGHT, np.nan, value))


def heading_error(
    of: Callable[[FloatArray], FloatArray], theta: FloatArray, covariance: FloatArray
) -> FloatArray:
    """Standard deviation of each heading by the errors of the calibration, rad, (n,).

    Args:
        of: headings from the parameters.
        theta: parameters.
        covariance: of them.
    """
    scale = np.sqrt(np.diag(covariance))
    columns = []
    for place in np.flatnonzero(scale):
        step = np.zeros_like(theta)
        step[place] = 1e-2 * scale[place]
        columns.append(turned(of(theta + step), of(theta - step)) / (2.0 * step[place]))
    slope = np.array(columns).T
    seen = covariance[np.ix_(scale > 0.0, scale > 0.0)]
    return np.asarray(np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", slope, seen, slope), 0.0)))


def turned(after: FloatArray, before: FloatArray) -> FloatArray:
    """From one heading to another the short way, rad."""
    return np.asarray(np.angle(np.exp(1j * (after - before))))


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
        modes: error modes of the two calibrations, which move the alignment too.
    """

    accelerometer: SensorFit
    magnetometer: SensorFit
    alignment: Alignment
    modes: ErrorModes

    def field(self, readings: FloatArray) -> FloatArray:
        """Corrected field in the body frame from magnetometer readings, shape (n, 3)."""
        return np.asarray(self._own(readings) @ self.alignment.rotation.T)

    def bearings(self, force: FloatArray, readings: FloatArray) -> Bearings:
        """Headings before and after, and the error expected after.

        Args:
            force: accelerometer readings, shape (n, 3).
            readings: magnetometer readings at the same moments, shape (n, 3).
        """
        up, own, modes = up_in(self.accelerometer, force), self._own(readings), self.modes
        before = heading(up if self.accelerometer.bias_unit == COUNT else force, readings)
        iron = modes.magnetometer.shape[1]
        both = iron + modes.accelerometer.shape[1]

        def after(parameters: FloatArray) -> FloatArray:
            """Each error mode by how many standard deviations, then a rotation by itself."""
            turn = self.alignment.shifts @ parameters[:both] + parameters[both:]
            field = field_moved(self.magnetometer, own, modes.magnetometer @ parameters[:iron])
            tilted = up_moved(up, modes.accelerometer @ parameters[iron:both])
            return heading(tilted, field @ (rotation_matrix(turn) @ self.alignment.rotation).T)

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
    return Compass(fit, report.magnetic.fit, stage.alignment, stage.modes)
