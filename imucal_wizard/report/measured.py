"""What was measured, as the calibration file keeps it: enough to prove the calibration from it.

Holds are kept as means with covariance, rotations as increments of the integrated reading over
short intervals, the field as means of samples that follow one another. An increment is linear in
the reading, so that any other bias and matrix can be applied to it later:

    w_k = M (Δ_k / dt_k − b),    φ_k = w_k dt_k + (dt_k³/12) w_k × w_k′

with slopes w′ from the neighbouring intervals; the last part is the coning within an interval. What
this misses of the whole rotation, up to 0.0005°, is spread over its increments: the calibration
leaves the same error on them as on the samples.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from imucal_wizard.core.attitude import Attitudes, rotation_samples, strictly_later
from imucal_wizard.core.quantities import finite_or_none
from imucal_wizard.core.quaternions import matrices, quaternions
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.statistics import is_covariance
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.measurement.holds import Hold, Rotation, times_in_hold

if TYPE_CHECKING:  # the second is imported where a rate table turned the device
    from imucal_wizard.estimate.experiment import Experiment
    from imucal_wizard.estimate.table_steps import TableTurn

MAX_INCREMENT_ERROR = np.radians(5e-4)
"""Of a rotation that is integrated from its increments instead of its samples, rad: half of what
the file promises, so that other biases and matrices stay within the promise."""
TEMPERATURE_DIGITS = 4
"""Decimals of the temperatures in rotations: far below what any sensor shows."""
SAMPLES_PER_INCREMENT = (32, 24, 16, 12, 8, 6, 4, 3, 2, 1)
"""Tried in turn until the error is small enough."""
INCREMENT_DIGITS = 10
"""Decimal digits of an increment below the largest of its rotation."""
MAX_FIELD_MEANS = 800
"""Means of a magnetometer in the file; of more, every second row of the fit, or every third …"""
MAX_SHORTENED = 5e-4
"""Share by which a mean of the field may be shorter than the field: beyond it, the device turns too
far for one mean to stand for the magnitude under any other calibration."""


class HoldMeans(msgspec.Struct, frozen=True):
    """One hold.

    Attributes:
        start: s.
        end: s.
        accelerometer: mean reading in the accelerometer's ``bias_unit``.
        accelerometer_covariance: of that mean, 3×3.
        gyroscope: mean reading in the gyroscope's ``bias_unit``, or None.
        temperature: °C, or None.
        pose: name, or None.
        gyroscope_covariance: of the gyroscope's mean, 3×3, or None.
        magnetometer: mean reading where the field was calm, or None.
        time: of its middle, s after the session's first sample; None in files of version 0.1.
        previous: direction that pointed up in the pose before, or None.
        vibration: mean square of the accelerometer about its mean, sum of the axes, (m/s²)².
        samples: averaged; 0 where it is not known.
        noise_freedom: degrees of freedom per axis of the covariances.
        accelerometer_scatter: variance of each axis of the mean if samples were independent.
        gyroscope_scatter: the same of the gyroscope.
        gyroscope_turn: how far the gyroscope turned from the mean direction to that at the end,
            beyond its mean reading, reading × s, or None.
        gyroscope_quiet: variance of the gyroscope's mean by its quietest frequencies, or None.
        sway: covariance of the accelerometer's mean, of the mean integral of the gyroscope and of
            the mean time, 7×7, or None.
        allan_covariances: of the accelerometer over halves, quarters … of the hold, k×3×3, or None.
        course: length, s, and mean of the accelerometer in pieces of the rest, k×4, or None.
        settling: what settling leaves in the mean, which is taken off it, or None.
        hand_held: taken on the operator's command although the device was not still.
    """

    start: float
    end: float
    accelerometer: list[float]
    accelerometer_covariance: list[list[float]]
    gyroscope: list[float] | None = None
    temperature: float | None = None
    pose: str | None = None
    gyroscope_covariance: list[list[float]] | None = None
    magnetometer: list[float] | None = None
    time: float | None = None
    previous: list[float] | None = None
    vibration: float | None = None
    samples: int = 0
    noise_freedom: int = 4
    accelerometer_scatter: list[float] | None = None
    gyroscope_scatter: list[float] | None = None
    gyroscope_turn: list[float] | None = None
    gyroscope_quiet: list[float] | None = None
    sway: list[list[float]] | None = None
    allan_covariances: list[list[list[float]]] | None = None
    course: list[list[float]] | None = None
    settling: list[float] | None = None
    hand_held: bool = False

    def hold(self) -> Hold:
        """The hold, for a fit of the same data with another model."""
        return Hold(
            start=self.start,
            end=self.end,
            accelerometer=np.array(self.accelerometer) + np.array(self.settling or 0.0),
            accelerometer_covariance=np.array(self.accelerometer_covariance),
            gyroscope=_array(self.gyroscope),
            gyroscope_covariance=_array(self.gyroscope_covariance),
            samples=max(self.samples, 2),
            temperature=self.temperature,
            pose=self.pose,
            hand_held=self.hand_held,
            accelerometer_scatter=_array(self.accelerometer_scatter),
            gyroscope_scatter=_array(self.gyroscope_scatter),
            noise_freedom=self.noise_freedom,
            gyroscope_turn=_array(self.gyroscope_turn),
            gyroscope_quiet=_array(self.gyroscope_quiet),
            sway=_array(self.sway),
            allan_covariances=_array(self.allan_covariances),
            course=_array(self.course),
        )


HALF_A_HOLD = 0.3
"""Part of a hold that a rotation begins or ends in, from which on a reading stands for the hold:
half of one, while a few samples at the end of a hold are those of the rotation."""


class RotationIncrements(msgspec.Struct, frozen=True):
    """One rotation between two holds, k intervals long.

    It begins and ends at the mean direction of each hold: where the device turned in a hold, with
    an interval for that turn.

    Attributes:
        before: number of the hold before.
        after: number of the hold after.
        edges: ends of the intervals, s, k + 1 of them.
        gyroscope: integral of the reading over each, ``bias_unit`` times s, k×3.
        accelerometer: mean reading over each, k×3, or None where it was not kept.
        axis: body axis of the rotation, or None for any other axis.
        temperature: mean in each interval, °C; None where it is not known and in older files, whose
            rotations have the mean of the two holds.
    """

    before: int
    after: int
    edges: list[float]
    gyroscope: list[list[float]]
    accelerometer: list[list[float]] | None = None
    axis: str | None = None
    temperature: list[float] | None = None

    def readings(self) -> FloatArray:
        """Mean reading of the gyroscope over each interval, shape (k, 3)."""
        return np.asarray(np.array(self.gyroscope) / np.diff(self.edges)[:, None])

    def moments(self, before: HoldMeans, after: HoldMeans) -> FloatArray:
        """Times that the readings of the intervals come from, s, rising, shape (k + 1,).

        See ``_moments_of``.
        """
        return _moments_of(np.array(self.edges), before, after)

    def attitudes(self, rates: FloatArray) -> FloatArray:
        """Attitude at each edge from that at the beginning, body to body, shape (k + 1, 3, 3).

        Args:
            rates: corrected mean rate over each interval, rad/s, shape (k, 3).
        """
        return _reintegrated(np.array(self.edges), rates)


def _moments_of(times: FloatArray, before: HoldMeans | Hold, after: HoldMeans | Hold) -> FloatArray:
    """Times that the readings of a rotation come from, s, rising, shape (n,).

    A constant reading replaces the samples of half a hold in which the device turned. It is a
    weighted mean over the whole hold (see ``RotationSet.between_means``).

    Args:
        times: from the beginning of the rotation to its end, s, shape (n,).
        before: the hold before.
        after: the hold after.
    """
    out, last = times.copy(), times[-1]
    if before.end - out[0] > HALF_A_HOLD * (before.end - before.start):
        own = out < before.end
        part = (out[own] - out[0]) / (before.end - out[0])
        out[own] = times_in_hold(before.start, before.end, part, 1)
    if last - after.start > HALF_A_HOLD * (after.end - after.start):
        own = out > after.start
        part = (out[own] - after.start) / (last - after.start)
        out[own] = times_in_hold(after.start, after.end, part, -1)
    return out


class FieldMean(msgspec.Struct, frozen=True):
    """Mean of samples of the magnetometer that follow one another.

    Attributes:
        time: s.
        reading: in the magnetometer's ``bias_unit``.
        shortened: by how much the mean magnitude exceeds that of the mean, corrected unit.
        samples: averaged.
        temperature: °C, or None.
        current: of the board, or None.
        group: number of the row of the fit that it is a part of; None in older files.
        session_time: s after the session's first sample; None in older files.
    """

    time: float
    reading: list[float]
    shortened: float
    samples: int
    temperature: float | None = None
    current: float | None = None
    group: int | None = None
    session_time: float | None = None


class TableMeans(msgspec.Struct, frozen=True):
    """A step of a rate table, a turn of a turntable, or a rest of either, in k pieces.

    Attributes:
        start: s.
        end: s.
        angle: by which the table turned meanwhile, rad; 0 at rest.
        seconds: duration of each piece, s.
        gyroscope: mean reading in each, ``bias_unit``, k×3.
        covariance: of the mean of a step or rest, 3×3; None of a turn.
        scatter: variance of each axis of that mean if samples were independent.
        samples: averaged; 0 of a turn.
        noise_freedom: degrees of freedom per axis of the covariance.
        time: of the middle of each piece, s after the session's first sample; None in older files.
        temperature: °C in each piece, or None.
    """

    start: float
    end: float
    angle: float
    seconds: list[float]
    gyroscope: list[list[float]]
    covariance: list[list[float]] | None = None
    scatter: list[float] | None = None
    samples: int = 0
    noise_freedom: int = 0
    time: list[float] | None = None
    temperature: list[float | None] | None = None

    def times(self, first: float) -> FloatArray:
        """Of the middle of each piece, s after the first sample.

        Args:
            first: time of that sample, for an older file.
        """
        if self.time is not None:
            return np.array(self.time)
        seconds = np.array(self.seconds)
        return np.asarray(self.start - first + np.cumsum(seconds) - 0.5 * seconds)

    def turned(self) -> "TableTurn":
        """The step or turn, for a fit of the same data with another model."""
        from imucal_wizard.estimate.table_steps import TableTurn

        pieces = np.array(self.gyroscope), np.array(self.seconds)
        hold = None if self.covariance is None else self._hold(self.covariance)
        return TableTurn(self.start, self.end, *pieces, self.angle, hold)

    def _hold(self, covariance: list[list[float]]) -> Hold:
        mean, spread, scatter = (
            np.array(one) for one in (self.gyroscope[0], covariance, self.scatter)
        )
        return Hold(
            start=self.start,
            end=self.end,
            accelerometer=mean,
            accelerometer_covariance=spread,
            gyroscope=mean,
            gyroscope_covariance=spread,
            samples=self.samples,
            accelerometer_scatter=scatter,
            gyroscope_scatter=scatter,
            noise_freedom=self.noise_freedom,
        )


def table_means(report: FitReport) -> list[TableMeans]:
    """What a rate table did, where it alone calibrated the gyroscope."""
    fit = report.sensors.get("gyroscope")
    experiment = None if fit is None else fit.experiment
    data = None if experiment is None else experiment.on_table
    if experiment is None or data is None:
        return []
    from imucal_wizard.estimate.table_steps import TableTurn

    rests = [
        TableTurn(
            hold.start,
            hold.end,
            np.array([hold.gyroscope]),
            np.array([hold.end - hold.start]),
            0.0,
            hold,
        )
        for hold in data.rests
    ]
    parts, where = (*rests, *data.turned), experiment.circumstances  # rests first in both
    ends = np.cumsum([len(one.seconds) for one in parts])[:-1]
    each = zip(parts, np.split(where.time, ends), np.split(where.temperature, ends), strict=True)
    return [
        TableMeans(
            start=one.start,
            end=one.end,
            angle=one.angle,
            seconds=one.seconds.tolist(),
            gyroscope=one.reading.tolist(),
            covariance=None if one.hold is None else _listed(one.hold.gyroscope_covariance),
            scatter=None if one.hold is None else _listed(one.hold.gyroscope_scatter),
            samples=0 if one.hold is None else one.hold.samples,
            noise_freedom=0 if one.hold is None else one.hold.noise_freedom,
            time=time.tolist(),
            temperature=[finite_or_none(one) for one in warm],
        )
        for one, time, warm in sorted(each, key=lambda row: row[0].start)
    ]


def wrong_measurements(
    holds: Sequence[HoldMeans],
    rotations: Sequence[RotationIncrements],
    fields: Sequence[FieldMean],
    table: Sequence[TableMeans],
) -> str:
    """What of the measurements cannot be used, or "" if all can."""
    for hold in holds:
        which = f"the hold at {hold.start:g} s"
        spreads = (
            hold.accelerometer_covariance,
            hold.gyroscope_covariance,
            *(hold.allan_covariances or ()),
        )
        scatters = hold.accelerometer_scatter, hold.gyroscope_scatter, hold.gyroscope_quiet
        means = hold.accelerometer, hold.gyroscope, hold.magnetometer
        vectors = (*means, *scatters, hold.previous, hold.gyroscope_turn, hold.settling)
        if any(one is not None and len(one) != 3 for one in vectors):
            return f"{which} does not have three numbers of each sensor"
        if any(one is not None and not is_covariance(one, 3) for one in spreads):
            return f"{which} does not have a valid covariance of three axes"
        if hold.sway is not None and not is_covariance(hold.sway, 7):
            return f"{which} does not have a valid covariance of its sway"
        course = hold.course
        if course is not None and not (
            course and all(len(one) == 4 and one[0] > 0.0 for one in course)
        ):
            return f"{which} does not have a valid course: a length and three readings each"
        if any(value < 0.0 for one in scatters for value in one or ()):
            return f"{which} has a negative variance"
        if not hold.end > hold.start:
            return f"{which} ends before it begins"
    for one in rotations:
        if not all(0 <= place < len(holds) for place in (one.before, one.after)):
            return "a rotation names a missing hold"
        if not one.gyroscope or len(one.edges) != len(one.gyroscope) + 1:
            return "a rotation has not one edge more than intervals"
        if not all(later > edge for edge, later in pairwise(one.edges)):
            return "the times of a rotation do not increase"
        beside = one.accelerometer
        if beside is not None and [len(row) for row in beside] != [3] * len(one.gyroscope):
            return "a rotation does not have the accelerometer's reading in each interval"
        if one.temperature is not None and len(one.temperature) != len(one.gyroscope):
            return "a rotation does not have the temperature of each interval"
    for step in table:
        spread, scatter = step.covariance, step.scatter
        if spread is not None and not is_covariance(spread, 3):
            return f"the step at {step.start:g} s does not have a valid covariance of three axes"
        if scatter is not None and (len(scatter) != 3 or min(scatter) < 0.0):
            return f"the step at {step.start:g} s does not have three variances"
    turned = [row for one in rotations for row in one.gyroscope]
    on_table = [row for step in table for row in step.gyroscope]
    if any(len(row) != 3 for row in (*turned, *on_table, *(one.reading for one in fields))):
        return "a reading does not have three numbers"
    for step in table:
        counts = {
            len(one) for one in (step.seconds, step.time, step.temperature) if one is not None
        }
        if not step.seconds or counts != {len(step.gyroscope)}:
            return "a step of the rate table has not one duration for each reading"
    return ""


def _reintegrated(edges: FloatArray, rates: FloatArray) -> FloatArray:
    """Rotation up to each edge by mean rates over intervals, shape (k + 1, 3, 3); see the module.

    Args:
        edges: ends of the intervals, s, shape (k + 1,).
        rates: rad/s, shape (k, 3).
    """
    length, middle = np.diff(edges)[:, None], 0.5 * (edges[1:] + edges[:-1])
    slope = np.zeros_like(rates) if len(rates) < 2 else np.gradient(rates, middle, axis=0)
    steps = rates * length + length**3 / 12.0 * np.cross(rates, slope)
    out = [np.eye(3)]
    for step in np.moveaxis(matrices(quaternions(steps.T)), 2, 0):
        out.append(out[-1] @ step)
    return np.array(out)


def hold_means(report: FitReport) -> list[HoldMeans]:
    """The holds of a fit."""
    fit = report.sensors.get("accelerometer")
    where = None if fit is None or fit.experiment is None else fit.experiment.circumstances
    settling = None if fit is None or fit.experiment is None else fit.experiment.settling
    off = np.zeros((len(report.holds), 3)) if settling is None else settling.left
    fields = _calm_fields(report)
    return [
        HoldMeans(
            start=hold.start,
            end=hold.end,
            accelerometer=(hold.accelerometer - off[row]).tolist(),
            accelerometer_covariance=hold.accelerometer_covariance.tolist(),
            gyroscope=_listed(hold.gyroscope),
            temperature=hold.temperature,
            pose=hold.pose,
            gyroscope_covariance=_listed(hold.gyroscope_covariance),
            magnetometer=fields.get(row),
            time=None if where is None else float(where.time[row]),
            previous=None if where is None else _direction(where.previous[row]),
            vibration=None if where is None else finite_or_none(where.vibration[row]),
            samples=hold.samples,
            noise_freedom=hold.noise_freedom,
            accelerometer_scatter=_listed(hold.accelerometer_scatter),
            gyroscope_scatter=_listed(hold.gyroscope_scatter),
            gyroscope_turn=_listed(hold.gyroscope_turn),
            gyroscope_quiet=_listed(hold.gyroscope_quiet),
            sway=_listed(hold.sway),
            allan_covariances=_listed(hold.allan_covariances),
            course=_listed(hold.course),
            settling=None if settling is None else off[row].tolist(),
            hand_held=hold.hand_held,
        )
        for row, hold in enumerate(report.holds)
    ]


def rotation_increments(report: FitReport) -> list[RotationIncrements]:
    """The rotations of a fit that can be used."""
    fit = report.sensors.get("gyroscope")
    if fit is None:
        return []
    places = {(hold.start, hold.end): row for row, hold in enumerate(report.holds)}
    turned = {} if fit.experiment is None else fit.experiment.turned_in_holds()
    return [
        increments_of(
            _from_means(one, *turned[number]) if number in turned else one,
            places[before],
            places[after],
            fit.matrix,
            fit.bias,
            fit.experiment,
        )
        for number, one in enumerate(report.rotations)
        if one.problem is None
        and (before := (one.before.start, one.before.end)) in places
        and (after := (one.after.start, one.after.end)) in places
    ]


def _from_means(
    rotation: Rotation, time: FloatArray, reading: FloatArray, recorded: BoolArray
) -> Rotation:
    """A rotation with how the device turned in its holds; for the arguments see ``Experiment``."""
    force = rotation.accelerometer
    if force is not None:
        force = force[strictly_later(rotation.time)]
        first, past = np.flatnonzero(recorded)[[0, -1]] + [0, 1]
        ahead = np.tile(rotation.before.accelerometer, (first, 1))
        behind = np.tile(rotation.after.accelerometer, (len(time) - past, 1))
        force = np.concatenate([ahead, force, behind])
    return replace(rotation, time=time, rate=reading, accelerometer=force)


def increments_of(
    rotation: Rotation,
    before: int,
    after: int,
    matrix: FloatArray,
    bias: FloatArray,
    experiment: "Experiment | None" = None,
) -> RotationIncrements:
    """A rotation in as few intervals as keep its attitude.

    Args:
        rotation: its samples.
        before: number of the hold before.
        after: number of the hold after.
        matrix: about right, rad/s per reading unit.
        bias: about right, reading unit.
        experiment: knows the temperature.
    """
    kept = strictly_later(rotation.time)
    time, reading = rotation.time[kept], rotation.rate[kept]
    samples = rotation_samples([time], [reading])
    steps = quaternions(samples.rotation_vectors((reading - bias) @ matrix.T))
    true = matrices(Attitudes(steps, samples.step_offsets).whole)[:, :, 0]
    whole = _integral(time, reading)
    for count in SAMPLES_PER_INCREMENT:
        rows = np.append(np.arange(0, max(len(time) - count, 1), count), len(time) - 1)
        edges, parts = time[rows], np.diff(whole[rows], axis=0)
        rates = (parts / np.diff(edges)[:, None] - bias) @ matrix.T
        attitudes = _reintegrated(edges, rates)
        away = true.T @ attitudes[-1]
        twice = away[[2, 0, 1], [1, 2, 0]] - away[[1, 2, 0], [2, 0, 1]]
        sine = 0.5 * np.linalg.norm(twice)
        if np.arctan2(sine, 0.5 * (np.trace(away) - 1.0)) < MAX_INCREMENT_ERROR:
            # the rotation vector of what is missed, in the body frame of each interval
            missed = -0.5 * twice @ attitudes[-1].T @ attitudes[1:]
            share = np.diff(edges)[:, None] / (edges[-1] - edges[0])
            parts = parts + share * missed @ np.linalg.inv(matrix).T
            break
    force = rotation.accelerometer
    means = None
    if force is not None:
        whole = _integral(time, force[kept])
        means = _rounded(np.diff(whole[rows], axis=0) / np.diff(edges)[:, None])
    temperature = None
    if experiment is not None:
        warm = experiment.temperature_at(_moments_of(time, rotation.before, rotation.after))
        if np.isfinite(warm).all():
            own = np.diff(_integral(time, np.tile(warm[:, None], 3))[rows, 0]) / np.diff(edges)
            temperature = own.round(TEMPERATURE_DIGITS).tolist()
    sums, axis = _rounded(parts), rotation.axis
    return RotationIncrements(before, after, edges.tolist(), sums, means, axis, temperature)


def field_means(report: FitReport) -> list[FieldMean]:
    """What the magnetometer's fit is made of."""
    if report.magnetic is None:
        return []
    pieces, since_first = report.magnetic.data.pieces, report.magnetic.data.samples.time
    matrix, bias = report.magnetic.fit.matrix, report.magnetic.fit.bias
    sizes = np.linalg.norm((pieces.reading - bias) @ matrix.T, axis=1) + pieces.extra

    def means(group: int, rows: IntArray) -> list[FieldMean]:
        samples = pieces.count[rows]
        reading, size, time, beside, since = (
            np.average(one[rows], axis=0, weights=samples)
            for one in (pieces.reading, sizes, pieces.time, pieces.beside, since_first)
        )
        shortened = float(size - np.linalg.norm(matrix @ (reading - bias)))
        if len(rows) > 1 and abs(shortened) > MAX_SHORTENED * size:
            half = len(rows) // 2
            return means(group, rows[:half]) + means(group, rows[half:])
        return [
            FieldMean(
                time=float(time),
                reading=reading.tolist(),
                shortened=shortened,
                samples=int(samples.sum()),
                temperature=finite_or_none(beside[0]),
                current=finite_or_none(beside[1]),
                group=group,
                session_time=float(since),
            )
        ]

    edges = pairwise(pieces.offsets)
    found = [means(group, np.arange(*ends)) for group, ends in enumerate(edges)]
    every = -(-sum(map(len, found)) // MAX_FIELD_MEANS)
    return [mean for group in found[::every] for mean in group]


def _calm_fields(report: FitReport) -> dict[int, list[float]]:
    """Mean reading of the magnetometer in the holds in which it stood still, by hold."""
    fit = report.sensors.get("magnetometer")
    if fit is None or fit.experiment is None:
        return {}
    return {row: mean.tolist() for row, mean in fit.experiment.still_means().items()}


def _integral(time: FloatArray, values: FloatArray) -> FloatArray:
    """Integral from the first sample, by cubics with the slopes of parabolas, shape (n, 3)."""
    step = np.diff(time)[:, None]
    slope = np.gradient(values, time, axis=0, edge_order=2 if len(time) > 2 else 1)
    parts = 0.5 * step * (values[1:] + values[:-1]) + step**2 / 12.0 * (slope[:-1] - slope[1:])
    return np.vstack([np.zeros(3), np.cumsum(parts, axis=0)])


def _rounded(values: FloatArray) -> list[list[float]]:
    """Numbers without digits that say nothing."""
    largest = float(np.abs(values).max(initial=0.0))
    decimals = INCREMENT_DIGITS - (int(np.ceil(np.log10(largest))) if largest > 0.0 else 0)
    rows: list[list[float]] = np.round(values, decimals).tolist()
    return rows


def _direction(vector: FloatArray) -> list[float] | None:
    return _listed(vector / np.linalg.norm(vector)) if np.isfinite(vector).all() else None


def _listed(values: FloatArray | None) -> Any:  # lists as deep as the array
    return None if values is None else values.tolist()


def _array(values: Sequence[object] | None) -> FloatArray | None:
    return None if values is None else np.array(values, np.float64)
