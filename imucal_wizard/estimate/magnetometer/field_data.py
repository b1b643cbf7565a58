"""What was measured of a magnetometer: groups of samples by time and direction."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.directions import group_directions, unit_vectors
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray, Readings
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median, robust_deviation
from imucal_wizard.core.units import COUNT, STANDARD_GRAVITY
from imucal_wizard.estimate.magnetometer.field_disturbances import LeftOut
from imucal_wizard.estimate.magnetometer.field_rounding import field_rounding
from imucal_wizard.estimate.magnetometer.pieces import (
    SMALLEST_NOISE,
    Pieces,
    cut,
    piece_noise,
    visits_of,
)
from imucal_wizard.estimate.magnetometer.start import FieldModel, FieldStart
from imucal_wizard.estimate.magnetometer.surroundings import (
    around,
    by_current,
    flows,
    part_of_current,
    recorded,
    within,
)
from imucal_wizard.estimate.noise import shrunk
from imucal_wizard.measurement.rounding import resolution_of
from imucal_wizard.model.effect import Circumstances, FieldUnit

FIELD_BASE = ("bias", "soft-iron")
"""Terms of the magnetometer's base model. One scale is always fitted: no size of the field is so
well known that it could be left at its nominal value."""
USUAL_FIELD = 50.0
"""Field in µT that a usual size of an effect belongs to where nothing tells the field of counts."""
EQUAL_NOISE = 1.96
"""Standard errors within which the noise of means is that of independent samples: a 5 % test."""
SPIKE_SIGMAS = 8.0
"""Robust standard deviations of a sample from the mean of its neighbours that no motion makes."""
SAME_FIELD = np.radians(6.0)
"""Groups whose directions of the field differ by no more repeat one another. What a model lacks
differs between them by a fifth at most; at 12° it would pass for a lack of repeatability."""
PASSING_SECONDS = 15.0
"""A disturbance that lasts longer is the room or the sensor: it is fitted and judged."""


@dataclass(frozen=True, eq=False)
class FieldData:
    """What was measured of a magnetometer.

    Attributes:
        unit: of the readings, ``uT`` or ``count``.
        error_unit: of corrected readings: ``uT``, or the readings' unit.
        field: magnitude that corrected readings have, in ``error_unit``.
        known: whether that magnitude was given; if not, it follows from ``det M = 1``.
        used: which samples the groups are made of, shape (n,).
        left_out: the samples that they are not made of, sizes in ``error_unit``.
        pieces: means of the readings, by group.
        samples: circumstances of the pieces.
        noise: variance of each group's mean magnitude by noise alone, shape (k,).
        rounding: the part of it that groups share: by how much each of r errors of size one, by
            rounding, moves them, shape (k, r).
        shift: variance of each component of the mean field of a rest by rounding.
        poses: number of the direction that each group repeats, shape (k,).
        visits: number of the visit to that direction, shape (k,).
        circumstances: of the groups.
        start: M, symmetric, and b to begin with, shapes (3, 3) and (3,).
        model: what the directions determine.
        gravity: m/s².
        readings: the recording, or None.
    """

    unit: str
    error_unit: str
    field: float
    known: bool
    used: BoolArray
    left_out: tuple[LeftOut, ...]
    pieces: Pieces
    samples: Circumstances
    noise: FloatArray
    rounding: FloatArray
    shift: float
    poses: IntArray
    visits: IntArray
    circumstances: Circumstances
    start: tuple[FloatArray, FloatArray]
    model: FieldModel
    gravity: float
    readings: Readings | None = None

    def __len__(self) -> int:
        return len(self.noise)

    @property
    def gain(self) -> float:
        """Corrected unit per reading, about."""
        return float(np.cbrt(np.linalg.det(self.start[0])))

    @property
    def field_unit(self) -> FieldUnit:
        """The unit of corrected readings."""
        return field_unit(self.error_unit, self.field)

    @property
    def noise_of_sample(self) -> float:
        """Variance of one sample's magnitude by noise that averages out."""
        return median((self.noise - (self.rounding**2).sum(axis=1)) * self.pieces.samples)

    @property
    def group_of(self) -> IntArray:
        """Group of each of all samples, −1 for those in none, shape (n,)."""
        per_group = np.diff(self.pieces.offsets)
        of_piece = np.repeat(np.arange(len(self)), per_group)
        out = np.full(len(self.used), -1, np.int64)
        out[self.used] = np.repeat(of_piece, self.pieces.count.astype(np.int64))
        return out

    def begin(self, base: Sequence[str]) -> tuple[FloatArray, FloatArray]:
        """M and b to start from; what is not fitted has its nominal value."""
        matrix, bias = self.start
        if "soft-iron" not in base:
            matrix = self.gain * np.eye(3)
        return matrix, bias if "bias" in base else np.zeros(3)


def field_data(
    start: FieldStart,
    field: float | None = None,
    readings: Readings | None = None,
    gravity: float = STANDARD_GRAVITY,
) -> FieldData:
    """Groups of samples of a turned magnetometer.

    Args:
        start: the samples and the ellipsoid to begin with.
        field: magnitude of the local field, µT, or None.
        readings: the recording, for temperature, current and the session's beginning.
        gravity: m/s².
    """
    unit = start.series.unit
    error_unit = unit if field is None else "uT"
    magnitude = start.radius if field is None else field
    matrix, bias = start.calibration(magnitude)
    used, left_out = _used(start, readings)
    time, values = start.series.time[used], start.series.values[used]
    gain = float(np.cbrt(np.linalg.det(matrix)))
    by_steps = float((gain * resolution_of(values)).max() ** 2) / 12.0
    beside = recorded(time, readings)
    pieces = cut(time, values, (values - bias) @ matrix.T, beside, by_steps)
    magnetic = (pieces.reading - bias) @ matrix.T
    size = np.linalg.norm(magnetic, axis=1)
    (reading,) = pieces.scatter(values)
    # a current that is switched is no noise
    slope = by_current(values, beside[:, 1])
    without = values - part_of_current(beside[:, 1], slope) - bias
    single, freedom = pieces.noise(np.linalg.norm(without @ matrix.T, axis=1))
    per_sample = pieces.spread(shrunk(single, freedom))
    without = pieces.reading - part_of_current(pieces.beside[:, 1], slope) - bias
    ratio, error = piece_noise(pieces, np.linalg.norm(without @ matrix.T, axis=1), per_sample)
    # thousands of samples know their own scatter far better than the means of pieces do
    white = ratio > 0.0 and abs(np.log(ratio)) < EQUAL_NOISE * error
    noise = (1.0 if white else ratio) * per_sample
    inward = pieces.mean(magnetic @ matrix / size[:, None])
    rounding = field_rounding(pieces, values, reading, inward)
    # noise across the field makes each sample's magnitude too long by σ² (tr MMᵀ − |Mᵀu|²)/2B
    along = ((magnetic @ matrix) ** 2).sum(axis=1) / size**2
    scatter = per_sample + pieces.spread(rounding.rounded + rounding.passing)
    longer = scatter / along.mean() * (np.trace(matrix @ matrix.T) - along) / (2.0 * magnitude)
    corrected = field_unit(error_unit, magnitude)
    samples = around(pieces.time, magnetic, pieces.beside, readings, gravity, corrected)
    seen = unit_vectors(pieces.mean(magnetic))
    poses = group_directions(seen, SAME_FIELD)
    own = np.maximum(pieces.mean(noise) / pieces.samples, (SMALLEST_NOISE * magnitude) ** 2)
    own += rounding.passing
    return FieldData(
        unit=unit,
        error_unit=error_unit,
        field=magnitude,
        known=field is not None,
        used=used,
        left_out=tuple(run.scaled(magnitude / start.radius) for run in left_out),
        pieces=replace(pieces, extra=pieces.extra - longer),
        samples=samples,
        noise=own + rounding.rounded,
        rounding=rounding.shared(pieces, magnetic, (matrix, bias), magnitude, own),
        shift=float(gain**2 * rounding.shift.mean()),
        poses=poses,
        visits=visits_of(pieces, poses),
        circumstances=within(samples, pieces),
        start=(matrix, bias),
        model=start.model,
        gravity=gravity,
        readings=readings,
    )


def rescaled(data: FieldData, matrix: FloatArray, bias: FloatArray) -> FieldData:
    """The data of an unknown field with the magnitude by which a fit that found M has det M = 1.

    Args:
        data: of a known field, they stay.
        matrix: M as found, shape (3, 3).
        bias: b as found, shape (3,).
    """
    if data.known:
        return data
    size = float(np.cbrt(np.linalg.det(matrix)))
    return replace(
        data,
        field=data.field / size,
        noise=data.noise / size**2,
        rounding=data.rounding / size,
        shift=data.shift / size**2,
        pieces=replace(data.pieces, extra=data.pieces.extra / size),
        start=(matrix / size, bias),
        left_out=tuple(run.scaled(1.0 / size) for run in data.left_out),
    )


def with_surroundings(data: FieldData, readings: Readings) -> FieldData:
    """The same groups with what a recording says of their temperature, current and time."""
    pieces = replace(data.pieces, beside=recorded(data.pieces.time, readings))
    matrix, bias = data.start
    magnetic = (pieces.reading - bias) @ matrix.T
    samples = around(pieces.time, magnetic, pieces.beside, readings, data.gravity, data.field_unit)
    known = within(samples, pieces)
    return replace(data, pieces=pieces, samples=samples, circumstances=known, readings=readings)


def field_unit(unit: str, magnitude: float) -> FieldUnit:
    """The unit of a field's errors; of counts one µT is what a usual field makes it.

    Args:
        unit: ``uT`` or ``count``.
        magnitude: of the field in it.
    """
    return FieldUnit(unit, magnitude / USUAL_FIELD) if unit == COUNT else FieldUnit()


SWITCHED = 5.0
"""Usual change from one sample to the next, in units of which a switched current is seen."""
BESIDE_SWITCHING = 2
"""Samples before and after, in which the current may be that of before or after."""
MAX_SWITCHED = 0.3
"""Share of samples beside which a current is switched, above which it is never steady."""


def _used(start: FieldStart, readings: Readings | None) -> tuple[BoolArray, tuple[LeftOut, ...]]:
    """Which samples are fitted, and which stretches are not.

    A disturbance that lasts is fitted, and so is one that a current may explain, but never a spike.
    Where a current is switched, nobody knows to which side of it a sample belongs: the sensors are
    not read at one instant.
    """
    series, used = start.series, start.kept.copy()
    current = None if readings is None else readings.current
    explained = [
        run
        for run in start.left_out
        if not run.single and (flows(current) or run.end - run.start > PASSING_SECONDS)
    ]
    if explained:
        size = np.linalg.norm(series.values - start.cloud.bias(start.theta), axis=1)
        off = np.abs(size - 0.5 * (np.roll(size, 1) + np.roll(size, -1)))
        off[[0, -1]] = 0.0
        calm = off <= SPIKE_SIGMAS * max(robust_deviation(off), 1e-9 * float(size.mean()))
        for run in explained:
            used |= calm & (series.time >= run.start) & (series.time <= run.end)
    beside = recorded(series.time, readings)[:, 1]
    slope = by_current(series.values, beside)
    if slope.any():
        change = np.median(np.abs(np.diff(series.values, axis=0)), axis=0)
        usual = np.maximum(change, resolution_of(series.values) / np.sqrt(12.0))
        loud = (np.abs(np.outer(np.diff(beside), slope)) > SWITCHED * usual).any(axis=1)
        near = np.convolve(loud, np.ones(2 * BESIDE_SWITCHING))
        near = near[BESIDE_SWITCHING - 1 :][: len(used)] > 0.0
        if near.mean() < MAX_SWITCHED:
            used &= ~near
    return used, tuple(run for run in start.left_out if run not in explained)
