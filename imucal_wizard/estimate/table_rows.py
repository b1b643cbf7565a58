"""The rows of a rate table: each step or turn with its noise and its circumstances."""

from dataclasses import replace

import numpy as np

from imucal_wizard.core.directions import group_directions, unit_vectors
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.estimate.gyroscope import MIN_CLOSING_NOISE
from imucal_wizard.estimate.noise import rest_of
from imucal_wizard.estimate.rounded import shift_of_means
from imucal_wizard.estimate.table_steps import TableData, one_sense
from imucal_wizard.measurement.rounding import rounding_step
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.rows.known_rotation import KnownRotation
from imucal_wizard.model.rows.source import Parameters, RowLabels


def known_rotations(
    data: TableData,
    series: Series,
    start: Parameters,
    readings: Readings | None,
    force: Parameters | None,
    *,
    judged: bool,
) -> KnownRotation:
    """The rows of all steps and turns.

    Args:
        data: the steps and turns.
        series: all readings of the gyroscope.
        start: an approximate calibration, for the axes and the noise.
        readings: the recording, for temperature and force; None where it is not at hand.
        force: calibration of the accelerometer; None where it is unknown.
        judged: whether the errors reported for the gyroscope are those of these rows.
    """
    turned, count = data.turned, len(data.turned)
    pieces = np.array([len(one.seconds) for one in turned])
    axis = unit_vectors(np.array([(one.mean - start.bias) @ start.matrix.T for one in turned]))
    seconds = np.array([one.seconds.sum() for one in turned])
    span = np.array([[one.start, one.end] for one in turned])
    edges = [one.start + np.cumsum(np.append(0.0, one.seconds)) for one in turned]
    each = np.concatenate([np.column_stack([own[:-1], own[1:]]) for own in edges])
    where = circumstances_during(each, series, readings, force)
    reading = np.concatenate([one.reading for one in turned])
    kinds = [one.hold is None for one in turned]
    return KnownRotation(
        reading=reading,
        seconds=np.concatenate([one.seconds for one in turned]),
        offsets=np.concatenate([[0], np.cumsum(pieces)]).astype(np.int64),
        angle=np.array([one.angle for one in turned]),
        noise=_noise(data, series, start, axis, seconds),
        circumstances=replace(where, rate=(reading - start.bias) @ start.matrix.T),
        labels=RowLabels(
            index=np.arange(count),
            axis=np.full(count, -1),
            group=group_directions(one_sense(axis)),
            visit=np.full(count, -1),
            time=span.mean(axis=1) - float(series.time[0]),
            span=span,
            component=np.unique(kinds, return_inverse=True)[1].astype(np.int64),
        ),
        judged=judged,
    )


def _noise(
    data: TableData, series: Series, start: Parameters, axis: FloatArray, seconds: FloatArray
) -> FloatArray:
    """Variance of the angle of each step or turn by measured noise, rad², shape (m,).

    A step has the scatter of its own readings, which contains the table's ripple; a turn has the
    noise of the rests.
    """
    out = np.zeros(len(data.turned))
    of_steps = [k for k, one in enumerate(data.turned) if one.hold is not None]
    of_turns = [k for k, one in enumerate(data.turned) if one.hold is None]
    if of_steps:
        holds = [one.hold for one in data.turned if one.hold is not None]
        shifts = shift_of_means(holds, rounding_step(series.values))
        shift = start.matrix**2 @ shifts.mean(axis=0)
        variance = rest_of(holds, start.matrix).mean + shift
        out[of_steps] = (axis[of_steps] ** 2 * variance).sum(axis=1) * seconds[of_steps] ** 2
    if of_turns:
        walk = rest_of(data.rests, start.matrix).per_second
        out[of_turns] = (axis[of_turns] ** 2 @ walk) * seconds[of_turns]
    return np.maximum(out, MIN_CLOSING_NOISE**2)


def circumstances_during(
    spans: FloatArray, series: Series, readings: Readings | None, force: Parameters | None
) -> Circumstances:
    """Circumstances of n spans of time, as far as they were recorded.

    Args:
        spans: beginning and end of each, s, shape (n, 2).
        series: all readings of the gyroscope.
        readings: the recording.
        force: calibration of its accelerometer; without one the force counts as zero.
    """
    middle, felt = spans.mean(axis=1), np.zeros((len(spans), 3))
    temperature = np.full(len(spans), np.nan)
    if readings is not None:
        if force is not None and len(readings):
            felt = (_means_during(readings.accelerometer, spans) - force.bias) @ force.matrix.T
        known = readings.temperature
        if known is not None and len(known):
            temperature = np.interp(middle, known.time, known.values[:, 0])
    return Circumstances(
        force=felt,
        rate=np.zeros_like(felt),
        temperature=temperature,
        time=middle - float(series.time[0]),
        previous=felt.copy(),
        vibration=np.zeros(len(spans)),
        seconds=np.diff(spans)[:, 0],
    )


def _means_during(series: Series, spans: FloatArray) -> FloatArray:
    """Mean reading in each span, shape (n, 3), by differences of the running sum."""
    whole = np.vstack([np.zeros(3), np.cumsum(series.values, axis=0)])
    first, past = (np.searchsorted(series.time, edge) for edge in spans.T)
    first = np.minimum(first, len(series) - 1)
    past = np.maximum(past, first + 1)
    return np.asarray((whole[past] - whole[first]) / (past - first)[:, None])
