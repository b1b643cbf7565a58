"""Gathers what is known of a gyroscope from holds, rotations and the accelerometer's fit."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.errors import DataError
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.readings import FloatArray, IntArray, Readings
from imucal_wizard.solver.accelerometer import AccelerometerFit
from imucal_wizard.solver.closure import BIAS, SIZE
from imucal_wizard.solver.extended.samples import Samples, lay_samples
from imucal_wizard.solver.extended.surroundings import circumstances_of, first_time, visits
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.solver.gains import nominal_of
from imucal_wizard.solver.noise import has_rate
from imucal_wizard.solver.rest import Rest, rest_of
from imucal_wizard.solver.result import SensorFit
from imucal_wizard.solver.slow_noise import slow_rate
from imucal_wizard.units import COUNT

SMALLEST_CLOSING = 1e-7
"""No closure is better known, rad; data without any noise keep a weight."""
SMALLEST_STILL = 1e-9
"""The same of a still mean, rad/s."""


def turn_data(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    accelerometer: AccelerometerFit,
    fit: SensorFit,
    gravity: float,
    readings: Readings | None = None,
) -> TurnData:
    """All that is known of a gyroscope.

    Args:
        holds: those that the accelerometer was fitted to.
        rotations: between them; those with a problem are left out.
        accelerometer: its fit, with the effects it has (``Extended.accelerometer``).
        fit: the gyroscope's base fit, to start from.
        gravity: m/s².
        readings: what the holds were found in: beginning of the session, temperature.

    Raises:
        DataError: no usable rotation, or no mean at rest.
    """
    usable, before, after = _usable(holds, rotations)
    rows = np.array([i for i, hold in enumerate(holds) if has_rate(hold)], np.int64)
    if not len(usable) or not len(rows):
        raise DataError("the gyroscope has no usable rotation between two holds")
    samples = lay_samples([rotations[i].time for i in usable], [rotations[i].rate for i in usable])
    gain = float(np.linalg.norm(accelerometer.fit.matrix, ord=2))
    known = circumstances_of(holds, accelerometer.up, gravity, gain, readings)
    doubt = accelerometer.up_doubt
    doubt = np.zeros((len(holds), 3, 0)) if doubt is None else doubt
    rest = rest_of(holds, fit.matrix)
    start = (fit.matrix, fit.bias)
    nominal = nominal_of(fit.matrix, fit.bias_unit != COUNT)
    dropped = {parameter.name for parameter in fit.parameters if not parameter.carried}
    return TurnData(
        unit=fit.bias_unit,
        gravity=gravity,
        samples=samples,
        rotations=usable,
        before=accelerometer.up[before],
        after=accelerometer.up[after],
        before_doubt=doubt[before],
        after_doubt=doubt[after],
        closing_noise=_closing_noise(samples, before, after, accelerometer, rest),
        motion=_motion(known, samples, before, start, first_time(holds, readings), readings),
        stills=np.array([holds[i].gyroscope for i in rows]),
        still_rows=rows,
        labels=accelerometer.labels[rows],
        visits=visits(holds, accelerometer.up)[rows],
        still_noise=np.maximum(rest.mean[rows], SMALLEST_STILL**2),
        slow=slow_rate([holds[i] for i in rows]),
        circumstances=known.select(rows),
        start=start,
        carried=tuple(
            i for i in range(SIZE) if i >= BIAS.start or nominal.parameter(i) not in dropped
        ),
        nominal=nominal,
    )


def _usable(
    holds: Sequence[Hold], rotations: Sequence[Rotation]
) -> tuple[IntArray, IntArray, IntArray]:
    """Which rotations can be used, and the holds before and after each."""
    places = {(hold.start, hold.end): index for index, hold in enumerate(holds)}
    found = []
    for index, one in enumerate(rotations):
        before = places.get((one.before.start, one.before.end))
        after = places.get((one.after.start, one.after.end))
        if one.problem is None and before is not None and after is not None:
            found.append((index, before, after))
    table = np.array(found, np.int64).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def _closing_noise(
    samples: Samples,
    before: IntArray,
    after: IntArray,
    accelerometer: AccelerometerFit,
    rest: Rest,
) -> FloatArray:
    """Variance of a closure component by noise alone: both directions, and the rates between."""
    ends = accelerometer.direction_variance + rest.end
    durations = samples.time[samples.offsets[1:] - 1] - samples.time[samples.offsets[:-1]]
    walk = float(rest.per_second.mean()) * durations
    return np.maximum(ends[before] + ends[after] + walk, SMALLEST_CLOSING**2)


def _motion(
    known: Circumstances,
    samples: Samples,
    before: IntArray,
    start: tuple[FloatArray, FloatArray],
    origin: float,
    readings: Readings | None,
) -> Circumstances:
    """Circumstances of the samples; time and temperature have the references of the holds."""
    hold = before[samples.rotation]
    time = samples.time - origin
    matrix, bias = start
    return replace(
        known.select(hold),
        rate=(samples.reading - bias) @ matrix.T,
        temperature=_temperature(known, time, origin, readings),
        time=time,
        previous=known.force[hold],
    )


def _temperature(
    known: Circumstances, time: FloatArray, origin: float, readings: Readings | None
) -> FloatArray:
    """As recorded, else between the holds; NaN where nothing is known."""
    if readings is not None and readings.temperature is not None and len(readings.temperature):
        series = readings.temperature
        return np.interp(time, series.time - origin, series.values[:, 0])
    told = np.isfinite(known.temperature)
    if not told.any():
        return np.full(len(time), np.nan)
    return np.interp(time, known.time[told], known.temperature[told])
