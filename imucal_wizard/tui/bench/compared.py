"""Measurement beside model, axis by axis: what was read beyond the true input, and what should be.

The true force of a hold is gravity in the direction that the model finds (with a part of the base
left out: that the whole base finds). At rest the true rate is zero. So a model of nothing is a flat
line, a bias lifts it, a scale tilts it, and what the model lacks lies between the two signs.
"""

from collections.abc import Iterator

import numpy as np

from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.fit import Measured
from imucal_wizard.solver.extended.hold_data import BASE, HoldData
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.terms import Terms
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.tui.bench.field_views import field_compared
from imucal_wizard.tui.report_rows import SHOWN
from imucal_wizard.units import COUNT

AXES = "xyz"
COMPARED = tuple(f"{axis} axis" for axis in AXES)
"""Parts of the data in which measurement and model stand side by side."""
TITLES = {
    "accelerometer": "read beyond the true force: ∘ measured, × model",
    "gyroscope": "read at rest: ∘ measured, × model",
    "magnetometer": "read beyond the true field: ∘ measured, × model",
}


def compared(
    fit: Extended, measured: Measured
) -> Iterator[tuple[str, str, FloatArray, FloatArray]]:
    """For each axis: part, unit, measured and model in shown units, both of shape (n,)."""
    if isinstance(measured, HoldData):
        read, model = _holds(fit, measured)
        factor, unit = SHOWN["m/s^2"]
    elif isinstance(measured, FieldData):
        read, model = field_compared(fit, measured)
        factor, unit = SHOWN["uT"]
    else:
        read, model = _stills(fit, measured)
        factor, unit = SHOWN["rad/s"]
    for k, part in enumerate(COMPARED):
        yield part, unit, read[:, k] * factor, model[:, k] * factor


def _holds(fit: Extended, measured: HoldData) -> tuple[FloatArray, FloatArray]:
    """What an accelerometer read beyond the true force, and the model's reading, m/s², (n, 3)."""
    y = np.array([hold.accelerometer for hold in measured.holds])
    where, sensor = measured.circumstances, fit.fit
    if fit.base == BASE:
        corrected = fit.correct(y, where)
        size = np.linalg.norm(corrected, axis=1)[:, None]
        force = measured.gravity * corrected / size
        model = y - (corrected - force) @ np.linalg.inv(sensor.matrix).T
    else:
        force, sizes = where.force, np.concatenate([np.zeros(0), *fit.sizes])
        felt = force + Terms(sensor.sensor, fit.terms).columns(where) @ sizes
        model = felt @ np.linalg.inv(sensor.matrix).T + sensor.bias
    gain, offset = _nominal(fit, y)
    return (y - offset) * gain - force, (model - offset) * gain - force


def _stills(fit: Extended, measured: TurnData) -> tuple[FloatArray, FloatArray]:
    """What a gyroscope read at rest, and the model's reading, rad/s, shape (h, 3)."""
    linear = fit.linear
    rows = [k for k, row in enumerate(linear.rows) if row.kind == "still"]
    left = (linear.residual * linear.sigma)[rows].reshape(-1, 3)
    gain, offset = _nominal(fit, measured.stills)
    read = (measured.stills - offset) * gain
    return read, read - left


def _nominal(fit: Extended, readings: FloatArray) -> tuple[float, FloatArray]:
    """SI per reading unit, and what counts stand about; readings in SI stand for themselves."""
    sensor = fit.fit
    if sensor.bias_unit != COUNT:
        return 1.0, np.zeros(3)
    gain = float(np.cbrt(abs(np.linalg.det(sensor.matrix))))
    return gain, sensor.bias if "bias" in fit.base else readings.mean(axis=0)
