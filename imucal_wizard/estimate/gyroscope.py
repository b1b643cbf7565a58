"""The gyroscope by gravity: rates at rest and closures of rotations, in the accelerometer's frame.

Means at rest tell the biases, rotations the nine gains and a little of the biases; both are rows of
one fit, each weighed by its own scatter.
"""

import itertools
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import partial

import numpy as np

from imucal_wizard.core.attitude import RotationSamples, rotation_samples, strictly_later
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import MAX_READING, BoolArray, FloatArray, IntArray, Readings
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import lengths, median
from imucal_wizard.core.units import COUNT
from imucal_wizard.estimate.accelerometer import BASE
from imucal_wizard.estimate.experiment import Beside, Directions, Experiment
from imucal_wizard.estimate.fit import Minimum, minimum
from imucal_wizard.estimate.gyroscope_start import start_matrix
from imucal_wizard.estimate.noise import has_rate, rest_of
from imucal_wizard.estimate.parameters import full_parameters, unit_of
from imucal_wizard.estimate.result import GravityReference, SensorFit
from imucal_wizard.estimate.rounded import rate_shift
from imucal_wizard.estimate.sampling_loss import sampling_loss, spectrum_at_rest
from imucal_wizard.estimate.slow_noise import Between, Fitted, in_session, slow_rate, spans_of
from imucal_wizard.estimate.surroundings import circumstances_of, first_time, visits
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.measurement.rounding import resolution_of
from imucal_wizard.model.effect import GYROSCOPE, Circumstances
from imucal_wizard.model.nominal_gains import (
    CROSS_PRIOR,
    SCALE_PRIOR,
    Nominal,
    least_identifiable,
    nominal_of,
)
from imucal_wizard.model.rows.gravity_closure import GravityClosure
from imucal_wizard.model.rows.rate_at_rest import RateAtRest
from imucal_wizard.model.rows.source import (
    BIAS,
    ENTRIES,
    MATRIX,
    Parameters,
    RowLabels,
    RowSource,
)

MIN_ROTATION_SAMPLES = 3
"""Of a rotation."""
MIN_CLOSING_NOISE = 1e-7
"""No closure is better known, rad; data without any noise keep a weight."""
MIN_REST_NOISE = 1e-9
"""The same of a mean at rest, rad/s."""
MIN_ROUNDING_SHARE = 0.01
"""Least noise of a mean at rest, as a share of what rounding shifts it: constant readings show no
noise, but do not prove that there is less."""
NEGLIGIBLE_SHIFT = 1e-4
"""Variance by rounding over that of the mean of all rests, below which rounding is no matter."""
BLIND = 1e-10
"""Share of a combination of gains in what the rotations show, below which they do not show it."""
UNSTEADY = 9.0
"""Noise of a closure, as a variance, over that of most, from which on it is worth a word."""


@dataclass(frozen=True, eq=False)
class RotationSet:
    """The usable rotations between holds, ready to be integrated.

    Attributes:
        samples: of the m usable rotations.
        usable: which of all rotations they are, shape (m,); the recording's own come first, those
            that only a field makes useful have numbers beyond them.
        before: the hold that each starts from, shape (m,).
        after: the hold that it ends in, shape (m,).
        up: direction of the calibrated specific force at each sample, shape (n, 3); None where
            the accelerometer in the rotations was not kept.
        rounding: variance by which the steps of the readings shift the mean rate of all holds
            alike, reading units², shape (3,).
    """

    samples: RotationSamples
    usable: IntArray
    before: IntArray
    after: IntArray
    up: FloatArray | None
    rounding: FloatArray

    @property
    def spans(self) -> FloatArray:
        """Times of the first and last sample of each, s, shape (m, 2)."""
        offsets = self.samples.offsets
        return self.samples.time[np.column_stack([offsets[:-1], offsets[1:] - 1])]

    def rates(self, calibration: Parameters) -> FloatArray:
        """Corrected rate of each sample, rad/s, shape (n, 3)."""
        return np.asarray((self.samples.reading - calibration.bias) @ calibration.matrix.T)

    def joined(
        self,
        first: int,
        ends: Sequence[tuple[int, int]],
        times: Sequence[FloatArray],
        readings: Sequence[FloatArray],
    ) -> "RotationSet":
        """With further rotations.

        Args:
            first: number of the first of them.
            ends: the hold before and the hold after each.
            times: of the samples of each, s.
            readings: of the gyroscope in each, its unit.
        """
        if not ends:
            return self
        own = self.samples
        parts = [slice(*pair) for pair in itertools.pairwise(own.offsets.tolist())]
        before, after = np.array(ends, np.int64).T
        return replace(
            self,
            samples=rotation_samples(
                [*(own.time[part] for part in parts), *times],
                [*(own.reading[part] for part in parts), *readings],
            ),
            usable=np.concatenate([self.usable, first + np.arange(len(ends))]),
            before=np.concatenate([self.before, before]),
            after=np.concatenate([self.after, after]),
            up=None,
        )


def examined(rotations: Sequence[Rotation]) -> list[Rotation]:
    """The rotations, with the problem named of those that cannot be integrated."""
    return [replace(one, problem=one.problem or _problem(one)) for one in rotations]


def _problem(rotation: Rotation) -> str | None:
    if (
        len(rotation.time) < MIN_ROTATION_SAMPLES
        or strictly_later(rotation.time).sum() < MIN_ROTATION_SAMPLES
    ):
        return "no gyroscope samples in it"
    if not (np.abs(rotation.rate) < MAX_READING).all() or not np.isfinite(rotation.time).all():
        return "its gyroscope samples are not all numbers"
    force = rotation.accelerometer
    if force is not None and not (np.abs(force) < MAX_READING).all():
        return "its accelerometer samples are not all numbers"
    return None


def rotation_set(
    holds: Sequence[Hold], rotations: Sequence[Rotation], accelerometer: SensorFit
) -> RotationSet:
    """The usable ones of examined rotations.

    Raises:
        DataError: there is none, or no mean of the gyroscope at rest.
    """
    places = {(hold.start, hold.end): index for index, hold in enumerate(holds)}
    found = []
    for index, one in enumerate(rotations):
        before = places.get((one.before.start, one.before.end))
        after = places.get((one.after.start, one.after.end))
        if one.problem is None and before is not None and after is not None:
            found.append((index, before, after))
    if not found or not any(has_rate(hold) for hold in holds):
        raise DataError("no usable rotation between two holds")
    table = np.array(found, np.int64)
    turned = [rotations[i] for i in table[:, 0]]
    samples = rotation_samples([one.time for one in turned], [one.rate for one in turned])
    forces = [
        one.accelerometer[strictly_later(one.time)]
        for one in turned
        if one.accelerometer is not None
    ]
    up = None
    if len(forces) == len(turned):
        force = (np.concatenate(forces) - accelerometer.bias) @ accelerometer.matrix.T
        length = lengths(force)[:, None]
        up = force / np.maximum(length, 1e-9 * max(float(length.max()), 1e-300))
    return RotationSet(
        samples, table[:, 0], table[:, 1], table[:, 2], up, rate_shift(holds, turned)
    )


class GyroscopeExperiment(Experiment):
    """Rates at rest and closures against gravity.

    Args:
        holds: those that the accelerometer was fitted to.
        rotations: between them.
        reference: up in each hold.
        unit: of the readings, ``rad/s`` or ``count``.
        start: matrix and bias to begin from.
        nominal: what a gain is that is not fitted.
        free: which of the twelve entries the rotations determine.
        readings: what the holds were found in: beginning of the session, temperature.
        more: rows of other kinds.
        lost: variance per second by what sampling loses, rad²/s; None for what the spectrum of the
            rates allows.
    """

    sensor, error_unit, frame, method = GYROSCOPE, "rad", "accelerometer", "vector"
    base_terms, needs_reference = BASE, True

    def __init__(
        self,
        holds: Sequence[Hold],
        rotations: RotationSet,
        reference: GravityReference,
        unit: str,
        start: Parameters,
        nominal: Nominal,
        free: Sequence[int] = tuple(range(ENTRIES)),
        readings: Readings | None = None,
        more: Sequence[RowSource] = (),
        lost: float | None = None,
    ) -> None:
        self.holds, self.rotations, self.gravity = tuple(holds), rotations, reference.gravity
        self.unit, self.nominal, self.free = unit, nominal, tuple(free)
        self._start, self.of, self.readings = start, reference, readings
        known = circumstances_of(
            holds, reference.up, reference.labels, reference.gravity, reference.gain, readings
        )
        self._resting = np.array([i for i, one in enumerate(holds) if has_rate(one)], np.int64)
        if lost is None:
            per_sample = rest_of(holds, start.matrix).per_sample
            series, resting = None if readings is None else readings.gyroscope, None
            if series is not None:
                resting = partial(spectrum_at_rest, series, holds, start.matrix)
            lost = sampling_loss(rotations.samples, rotations.rates(start), per_sample, resting)
        self.lost = lost
        rows, noise = self._resting, self._noise()
        self.resting = [holds[i] for i in rows]
        self.circumstances = known.select(rows)
        shifted = (start.matrix**2 @ rotations.rounding) * len(rows)
        matters = bool((shifted > NEGLIGIBLE_SHIFT * noise[0].mean()).any())
        self.rest = RateAtRest(
            reading=np.array([hold.gyroscope for hold in self.resting]),
            noise=noise[0],
            circumstances=self.circumstances,
            labels=RowLabels(
                index=np.repeat(rows, 3),
                axis=np.tile([0, 1, 2], len(rows)),
                group=np.repeat(reference.labels[rows], 3),
                visit=np.repeat(visits(holds, reference.up, reference.labels)[rows], 3),
                time=np.repeat(self.circumstances.time, 3),
                span=np.repeat(spans_of(self.resting), 3, axis=0),
                component=np.tile([0, 1, 2], len(rows)),
            ),
            rounding=rotations.rounding if matters else np.zeros(3),
        )
        self.closure = self._closures(known, *noise[1:])
        self.sources = (self.rest, self.closure, *more)
        if more:
            self.method = "vector + field"

    def _noise(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Variance of each mean at rest, (h, 3), and of each closure by its own noise, (m,).

        The closures with the rate noise of the quietest axis; that of each axis follows, (3,).
        """
        rest, one = rest_of(self.holds, self._start.matrix), self.rotations
        first, last = one.spans.T
        walk = (float(rest.per_second.min()) + self.lost) * (last - first)
        closing = rest.end[one.before] + rest.end[one.after] + walk
        least = MIN_REST_NOISE**2 + MIN_ROUNDING_SHARE**2 * (self._start.matrix**2 @ one.rounding)
        return (
            np.maximum(rest.mean[self._resting], least),
            np.maximum(closing, MIN_CLOSING_NOISE**2),
            rest.per_second,
        )

    def _closures(
        self, known: Circumstances, noise: FloatArray, walk: FloatArray
    ) -> GravityClosure:
        one, reference = self.rotations, self.of
        count, span, origin = len(one.usable), one.spans, first_time(self.holds, self.readings)
        return GravityClosure(
            samples=one.samples,
            before=reference.up[one.before],
            after=reference.up[one.after],
            before_doubt=reference.doubt[one.before],
            after_doubt=reference.doubt[one.after],
            usual=reference.undetermined,
            noise=noise,
            motion=motion_of(known, one, self._start, origin, self.readings),
            gravity=self.gravity,
            rounding=self.rest.rounding,
            resting=self._still_samples() if self.rest.rounding.any() else None,
            holds=np.column_stack([one.before, one.after]),
            tilts=reference.variance,
            walk=walk,
            labels=RowLabels(
                index=np.repeat(one.usable, 2),
                axis=np.tile([0, 1], count),
                group=np.repeat(np.arange(count), 2),
                visit=np.full(2 * count, -1),
                time=np.repeat(span.mean(axis=1) - origin, 2),
                span=np.repeat(span, 2, axis=0),
                component=np.zeros(2 * count, np.int64),
            ),
        )

    def _still_samples(self) -> BoolArray:
        """Samples at either end of a rotation that still show what the rests show, shape (n,)."""
        samples = self.rotations.samples
        away = np.abs(samples.reading - self.rest.reading.mean(axis=0))
        near = (away < resolution_of(samples.reading)).all(axis=1)
        out = np.zeros(len(near), bool)
        for first, past in itertools.pairwise(samples.offsets.tolist()):
            own = near[first:past]
            ahead, behind = np.logical_and.accumulate(own), np.logical_and.accumulate(own[::-1])
            out[first:past] = ahead | behind[::-1]
        return out

    def moved(self, start: Parameters, free: Sequence[int]) -> "GyroscopeExperiment":
        """The same experiment from another start, with other entries determined."""
        other = copy(self)
        other._start, other.free = start, tuple(free)
        resting, closing, walk = other._noise()
        motion = replace(self.closure.motion, rate=self.rotations.rates(start))
        other.rest = replace(self.rest, noise=resting)
        other.closure = replace(self.closure, noise=closing, walk=walk, motion=motion)
        other.sources = (other.rest, other.closure, *self.sources[2:])
        return other

    def with_rows(
        self, rotations: RotationSet, more: Sequence[RowSource], free: Sequence[int]
    ) -> "GyroscopeExperiment":
        """The same experiment with more rotations and other kinds of rows.

        Args:
            rotations: all of them.
            more: the rows of other kinds.
            free: which of the twelve entries all rows together determine.
        """
        args = self.holds, rotations, self.of, self.unit, self._start, self.nominal, free
        return GyroscopeExperiment(*args, self.readings, more, self.lost)

    def under(
        self, reference: GravityReference | None, readings: Readings | None
    ) -> "GyroscopeExperiment":
        """See ``Experiment``."""
        reference, readings = reference or self.of, readings or self.readings
        if reference is self.of and readings is self.readings:
            return self
        more = [source.under(reference.up) for source in self.sources[2:]]
        args = self.holds, self.rotations, reference, self.unit, self._start, self.nominal
        return GyroscopeExperiment(*args, self.free, readings, more, self.lost)

    def beside(self, found: SensorFit) -> Beside:
        """See ``Experiment``."""
        table, read = found.rows, self.rest.reading
        assert table is not None, "only a fit of these rows is shown"  # noqa: S101 (narrows)
        left = table.residual[: read.size].reshape(-1, 3)
        if self.unit == COUNT:
            offset = found.bias if "bias" in found.base else read.mean(axis=0)
            read = (read - offset) * float(np.cbrt(abs(np.linalg.det(found.matrix))))
        rows = np.arange(0, read.size, 3)
        return Beside("read at rest", "rad/s", read, read - left, self.rest, rows)

    def directions(self, base: Sequence[str]) -> Directions:
        """See ``Experiment``."""
        scales = set(self.nominal.scales)
        wanted = set(range(BIAS.start, ENTRIES)) if "bias" in base else set()
        wanted |= scales if "scale" in base else set()
        wanted |= set(range(9)) - scales if "non-orthogonality" in base else set()
        free = [entry for entry in self.free if entry in wanted]
        columns = np.zeros((ENTRIES, len(free)))
        columns[free, range(len(free))] = 1.0
        dropped = tuple(self.name(entry) for entry in range(ENTRIES) if entry not in free)
        missing = [self.name(entry) for entry in range(9) if entry not in self.free]
        reason = ""
        if missing and set(base) == set(BASE):
            reason = (
                f"the rotations do not determine {', '.join(missing)}: left at the nominal value. "
                "Turn about each axis in both senses, with that axis level"
            )
        names = tuple(self.name(entry) for entry in free)
        return Directions(columns, names, tuple(base), dropped, reason)

    def name(self, entry: int) -> str:
        """Name of the parameter that one of the twelve entries is."""
        return self.nominal.parameter(entry) if entry < 9 else f"bias_{AXES[entry - 9]}"

    def begin(self, base: Sequence[str]) -> Parameters:
        """See ``Experiment``."""
        free = np.flatnonzero(self.directions(base).columns.any(axis=1)).tolist()
        matrix = self.nominal.filled(self._start.matrix, free)
        if self.unit == COUNT:
            common, scales = self._common(), list(self.nominal.scales)
            fixed = [entry for entry in scales if entry not in free]
            matrix.flat[fixed] = common.flat[fixed]
        bias = self._start.bias if "bias" in base else self.before().bias
        return Parameters(matrix, bias)

    def before(self) -> Parameters:
        """See ``Experiment``: of counts, one common scale and the mean at rest."""
        if self.unit != COUNT:
            return Parameters(np.eye(3), np.zeros(3))
        return Parameters(self._common(), self.rest.reading.mean(axis=0))

    def _common(self) -> FloatArray:
        """One scale for all axes, with the axes in their places."""
        out, scales = np.zeros((3, 3)), list(self.nominal.scales)
        size = np.abs(self._start.matrix.ravel()[scales]).mean()
        out.flat[scales] = size * np.array(self.nominal.signs)
        return out

    def named(self, matrix: FloatArray, bias: FloatArray) -> dict[str, float]:
        """See ``Experiment``."""
        return full_parameters(self.nominal.ordered(matrix), bias)

    def unit_of(self, name: str) -> str:
        """See ``Experiment``."""
        return unit_of(name, self.unit, "rad/s")

    def in_session(self, found: Minimum[Experiment]) -> FloatArray | None:
        """See ``Experiment``: the bias of each axis wanders by itself, and the rests show it.

        It wanders in the rotations, too, and the rests tell by how much.
        """
        balance, system, spans = found.balance, found.system, spans_of(self.resting)
        if balance.freedom.min() < 1.0:
            return None
        basis, free = found.directions.columns, slice(0, len(found.directions))
        pull, alike = basis @ found.pull()[free], np.ones(2 * (len(spans),))
        resting = self.rest.reading.size
        axes = [slice(axis, resting, 3) for axis in range(3)]
        turned = np.concatenate([one.labels.span for one in self.sources[1:]])
        moments, which = np.unique(turned, axis=0, return_inverse=True)
        lever = np.concatenate([rows.lever for rows in found.rows[1:]])
        slow = np.zeros((len(system.residual), 3, len(moments)))
        slow[np.arange(resting, len(slow))[:, None], [[0, 1, 2]], which.reshape(-1, 1)] = lever
        slow = found.independent.rows(slow.reshape(len(slow), -1)).reshape(slow.shape)[resting:]
        out = in_session(
            spans,
            [
                Fitted(
                    system.residual[rows],
                    system.columns[rows],
                    balance.variance[rows],
                    alike,
                    pull[:, rows],
                )
                for rows in axes
            ],
            measured=True,
            between=Between(
                moments,
                np.moveaxis(slow, 1, 0),
                pull[:, resting:],
                system.own[resting:],
                found.white_variance[resting:],
            ),
        )
        if out is None:
            return None
        by_priors = (balance.covariance * balance.precision) @ balance.covariance
        return np.asarray(out + basis @ by_priors[free, free] @ basis.T)

    def shift(self, rotations: Sequence[int]) -> FloatArray:
        """Variance by which the mean of the rests before rotations is off, reading units², (3,).

        On top of what their scatter shows: by slow noise and by rounding.
        """
        before = self.rotations.before[list(rotations)]
        times = np.bincount(before, minlength=len(self.holds))[self._resting]
        return slow_rate(self.resting, times / max(times.sum(), 1)) + self.rotations.rounding

    def everything(self) -> Circumstances:
        """See ``Experiment``."""
        return self.circumstances.joined(self.closure.motion)

    @property
    def undersampled(self) -> float | None:
        """Rms closure by what sampling loses, rad, where it is most of the noise; else None."""
        span = np.diff(self.rotations.spans, axis=1)[:, 0]
        lost = 2.0 * float((self.lost * span).mean())
        tilts = self.of.variance[self.closure.holds].sum(axis=1)
        whole = 2.0 * float((self.closure.noise + tilts).mean())
        return float(np.sqrt(lost)) if lost > 0.5 * whole else None

    @property
    def unsteady(self) -> int:
        """How many rotations begin or end where the device was far from being at rest."""
        noise = self.closure.noise + self.of.variance[self.closure.holds].sum(axis=1)
        return int((noise > UNSTEADY * median(noise)).sum())


def gyroscope_experiment(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    accelerometer: SensorFit,
    unit: str,
    readings: Readings | None = None,
) -> GyroscopeExperiment:
    """The experiment of these rotations, with a first calibration of what they determine.

    The arguments and errors are those of ``gyroscope_minimum``.
    """
    return gyroscope_minimum(holds, rotations, accelerometer, unit, readings).experiment


def gyroscope_minimum(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    accelerometer: SensorFit,
    unit: str,
    readings: Readings | None = None,
) -> Minimum[GyroscopeExperiment]:
    """The fit without effects of what these rotations determine.

    Args:
        holds: those that the accelerometer was fitted to.
        rotations: between them; those with a problem are left out.
        accelerometer: its fit, with the effects it has.
        unit: of the readings.
        readings: what the holds were found in, for the session's beginning and the temperature.

    Raises:
        DataError: no usable rotation, no mean at rest, or the rotations do not determine a scale
            that has no nominal value.
    """
    if accelerometer.reference is None:
        raise DataError("there is no fitted accelerometer to go on from")
    turned, known = rotation_set(holds, rotations, accelerometer), unit != COUNT
    reference = accelerometer.reference
    rest = np.array([hold.gyroscope for hold in holds if has_rate(hold)], float).mean(axis=0)
    ends = reference.up[turned.before], reference.up[turned.after]
    matrix = start_matrix(turned.samples, *ends, turned.up, rest, known)
    nominal = nominal_of(matrix, known)
    start = Parameters(matrix, rest)
    rough = GyroscopeExperiment(holds, turned, reference, unit, start, nominal, readings=readings)
    # datasheets hold what the rotations do not show, so that the first fit can tell what they do
    prior = np.zeros(ENTRIES)
    prior[MATRIX] = (CROSS_PRIOR * np.linalg.norm(matrix, 2)) ** -2.0
    prior[list(nominal.scales)] = (SCALE_PRIOR * np.linalg.norm(matrix, 2)) ** -2.0
    whole = replace(rough.directions(BASE), precision=prior)
    found = minimum(rough, directions=whole)
    free = determined_entries(found, nominal, tuple(range(ENTRIES)))
    while True:
        found = minimum(rough.moved(found.calibration, free))
        again = determined_entries(found, nominal, free)
        if again == free:
            break
        free = again
    return found


def determined_entries(
    found: Minimum[Experiment], nominal: Nominal, free: tuple[int, ...]
) -> tuple[int, ...]:
    """Which of the entries fitted the rows determine; the worst known gain goes first.

    Raises:
        DataError: a scale is not determined and has no nominal value.
    """
    gain = float(np.linalg.norm(found.calibration.matrix, 2))
    count, entries = len(found.directions), list(free)
    columns = found.system.columns[:, :count]
    whole = columns.T @ (columns / found.balance.variance[:, None])
    while True:
        rows = [free.index(entry) for entry in entries]
        inverse, blind = _inverse(whole[np.ix_(rows, rows)])
        covariance, share = np.zeros((9, 9)), np.zeros(9)
        gains = [place for place, entry in enumerate(entries) if entry < 9]
        at = [entries[place] for place in gains]
        covariance[np.ix_(at, at)] = inverse[np.ix_(gains, gains)] / gain**2
        share[at] = blind[gains]
        drop = least_identifiable(covariance, share, entries, nominal)
        if drop is None:
            return tuple(entries)
        nominal.check(drop)
        entries.remove(drop)
        if not set(nominal.scales) & set(entries):
            raise DataError(
                "the rotations determine none of the gyroscope's scales: turn the device about "
                "each axis in both senses between still positions, with that axis level"
            )


def _inverse(normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Inverse over what is determined, and each parameter's share in what is not."""
    scale = np.sqrt(np.diag(normal))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    seen = values > BLIND
    inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T
    return inverse / np.outer(scale, scale), (vectors[:, ~seen] ** 2).sum(axis=1)


def motion_of(
    known: Circumstances,
    rotations: RotationSet,
    start: Parameters,
    origin: float,
    readings: Readings | None,
) -> Circumstances:
    """Circumstances of the samples; time and temperature have the references of the holds."""
    samples = rotations.samples
    hold = rotations.before[samples.rotation]
    time = samples.time - origin
    temperature, told = np.full(len(time), np.nan), np.isfinite(known.temperature)
    if readings is not None and readings.temperature is not None and len(readings.temperature):
        series = readings.temperature
        temperature = np.interp(time, series.time - origin, series.values[:, 0])
    elif told.any():
        temperature = np.interp(time, known.time[told], known.temperature[told])
    return replace(
        known.select(hold),
        rate=rotations.rates(start),
        temperature=temperature,
        time=time,
        previous=known.force[hold],
    )
