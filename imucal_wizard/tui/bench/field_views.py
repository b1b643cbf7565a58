"""What the magnetometer's pictures show: means by direction, dips at rest, reading beside model."""

from collections.abc import Iterator

import numpy as np

from imucal_wizard.bench.field_text import place_of
from imucal_wizard.readings import FloatArray, IntArray
from imucal_wizard.solver.extended.field_data import FIELD_BASE, FieldData
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.terms import Terms
from imucal_wizard.tui.text import clock, number, unit_sign
from imucal_wizard.units import COUNT

AXES = "xyz"


def field_abscissae(measured: FieldData, source: IntArray) -> Iterator[tuple[str, FloatArray]]:
    """What the rows may depend on, each with its label; shape (n,) like ``source``."""
    known = measured.circumstances
    for k, axis in enumerate(AXES):
        yield f"field along {axis}, µT", known.magnetic[source, k]
    yield "time, min", known.time[source] / 60.0
    yield "temperature, °C", known.temperature[source]
    yield f"current, {known.current_unit}", known.current[source]


def field_compared(fit: Extended, measured: FieldData) -> tuple[FloatArray, FloatArray]:
    """What was read beyond the true field, and the model's reading, µT, shape (k + h, 3).

    The true field has the place's magnitude in the direction that the model finds (with a part of
    the base left out: that the whole base finds).
    """
    where, sensor = measured.circumstances, fit.fit
    y = np.concatenate([measured.pieces.mean(measured.pieces.reading), measured.dips.reading])
    inverse = np.linalg.inv(sensor.matrix)
    if fit.base == FIELD_BASE:
        corrected = fit.correct(y, where)
        left = (fit.linear.residual * fit.linear.sigma)[:, None]
        along = left * corrected / np.linalg.norm(corrected, axis=1)[:, None]
        along[len(measured) :] = 0.0
        field, model = corrected - along, y - along @ inverse.T
    else:
        field, sizes = where.magnetic, np.concatenate([np.zeros(0), *fit.sizes])
        felt = field + Terms(sensor.sensor, fit.terms).columns(where) @ sizes
        model = felt @ inverse.T + sensor.bias
    gain = measured.gain if measured.unit == COUNT else 1.0
    offset = sensor.bias if measured.unit == COUNT else np.zeros(3)
    return (y - offset) * gain - field, (model - offset) * gain - field


def field_point(measured: FieldData, row: int) -> tuple[str, str]:
    """A row in words, and its mean reading."""
    still = row - len(measured)
    reading = measured.pieces.mean(measured.pieces.reading)[row] if still < 0 else (
        measured.dips.reading[still]
    )  # fmt: skip
    cells = " ".join(number(float(value), 4) for value in reading)
    time = clock(float(measured.circumstances.time[row]))
    return f"{place_of(measured, row)}, {time}", f"read {cells} {unit_sign(measured.unit)}"


def field_span(measured: FieldData, row: int) -> tuple[float, float]:
    """First and last time of a row's samples, s."""
    first, past = measured.pieces.offsets[row : row + 2]
    return float(measured.pieces.time[first]), float(measured.pieces.time[past - 1])
