"""The gyroscope by gravity: rates at rest and closures of rotations, in the accelerometer's frame.

Means at rest determine the biases, rotations the nine gains and a little of the biases; both are
rows of one fit, each weighed by its own scatter.
"""

import itertools
import math
from abc import abstractmethod
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import TypeVar

import numpy as np

from imucal_wizard.core.attitude import RotationSamples
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quantities import plural, quantity
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray, Readings
from imucal_wizard.core.statistics import median
from imucal_wizard.core.units import COUNT
from imucal_wizard.estimate.accelerometer import BASE
from imucal_wizard.estimate.experiment import Beside, Directions, Experiment
from imucal_wizard.estimate.fit import Minimum
from imucal_wizard.estimate.noise import has_rate, rest_of
from imucal_wizard.estimate.parameters import full_parameters, unit_of
from imucal_wizard.estimate.rest_spectrum import RestSpectrum
from imucal_wizard.estimate.result import GravityReference, SensorFit
from imucal_wizard.estimate.rotation_set import RotationSet
from imucal_wizard.estimate.rounded import noise_of_coarse_means, unseen_rounding
from imucal_wizard.estimate.rounding_in_motion import RoundingInMotion
from imucal_wizard.estimate.sampling_loss import SamplingLoss, borne_out, sampling_loss
from imucal_wizard.estimate.slow_errors import Between, Fitted, SlowErrors
from imucal_wizard.estimate.slow_noise import (
    estimate_slow_errors,
    slow_rate,
    spans_of,
)
from imucal_wizard.estimate.slow_rests import RestPieces, long_rest
from imucal_wizard.estimate.surroundings import circumstances_of, first_time, visits
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.measurement.segmentation import rest_numbers
from imucal_wizard.model.effect import GYROSCOPE, Circumstances
from imucal_wizard.model.nominal_gains import Nominal, datasheet_precision
from imucal_wizard.model.rows.earth import earth_axes
from imucal_wizard.model.rows.gravity_closure import GravityClosure
from imucal_wizard.model.rows.rate_at_rest import RateAtRest
from imucal_wizard.model.rows.source import (
    BIAS,
    ENTRIES,
    Parameters,
    RowLabels,
    RowSource,
)
from imucal_wizard.model.terms import Terms

M = TypeVar("M", bound="Movable")
MIN_CLOSING_NOISE = 1e-7
"""No closure is better known, rad; data without any noise keep a weight."""
MIN_REST_NOISE = 1e-9
"""The same of a mean at rest, rad/s."""
NEGLIGIBLE_SHIFT = 1e-4
"""Variance by rounding over that of the mean of all rests, below which rounding is no matter."""
LEAST_QUIET = 1e-6
"""Of the upper limit of a sensor's noise, as a variance; it has some."""
UNSTEADY = 9.0
"""Noise of a closure, as a variance, over that of most, from which on it is worth a word."""


class Movable(Experiment):
    """An experiment that can begin elsewhere, with other entries determined."""

    free: tuple[int, ...]

    @abstractmethod
    def moved(self: M, start: Parameters, free: Sequence[int]) -> M:
        """The same rows from another start, with other entries determined."""


class GyroscopeExperiment(Movable):
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
        lost: what sampling loses of the rotations; None for what the spectrum of the rates allows.
        spectrum: of the readings at rest, where it is known.
        rounded: what rounding does to these rotations, where it is known.
    """

    sensor, error_unit, frame, method = GYROSCOPE, "rad", "accelerometer", "vector"
    base_terms = BASE

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
        lost: SamplingLoss | None = None,
        spectrum: RestSpectrum | None = None,
        rounded: RoundingInMotion | None = None,
    ) -> None:
        self.holds, self.rotations, self.gravity = tuple(holds), rotations, reference.gravity
        self.unit, self.nominal, self.free = unit, nominal, tuple(free)
        self._start, self.of, self.readings = start, reference, readings
        if hidden := int(np.count_nonzero(reference.hidden)):
            most = quantity(float(reference.hidden.max()), "rad", 2)
            self.assumption = (
                f"In {plural(hidden, 'hold')} the accelerometer's effects hide up to {most} of the "
                "direction of gravity, which counts as noise here."
            )
        self.noise_at_rest = rest_of(holds, start.matrix, start.bias, reference)
        self.samples, self.recorded, self._happened = rotations.between_means(
            holds, self.noise_at_rest.carried
        )
        known = circumstances_of(holds, reference.up, reference.gravity, reference.gain, readings)
        self._resting = np.array([i for i, one in enumerate(holds) if has_rate(one)], np.int64)
        self._rounded = rotations.rounding_in_motion(holds) if rounded is None else rounded
        if lost is None:
            interval = median(rotations.samples.dt[rotations.samples.dt > 0.0])
            rounding = start.matrix**2 @ unseen_rounding(holds, rotations.step) * interval
            rest = self.noise_at_rest
            at_rest = RestSpectrum(rest.per_second, rest.per_sample, rest.per_sample)
            if spectrum is not None:
                at_rest = spectrum.of_rates(start.matrix)
            args = rotations.samples, rotations.rates(start), at_rest, float(rest.per_second.mean())
            lost = sampling_loss(*args, float(rounding.mean()), rest.held)
        self.lost = lost
        self.long_rest = None
        if readings is not None and readings.gyroscope is not None:
            self.long_rest = long_rest(readings.gyroscope, holds, start.matrix)
        rows = self._resting
        self.resting = [holds[i] for i in rows]
        noise = self._noise()
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
            coarse=self._coarse()[1],
        )
        self.closure = self._closures(known, *noise[1:])
        self.sources = (self.rest, self.closure, *more)
        self._on_earth()
        if more:
            self.method = "vector + field"

    def _on_earth(self) -> None:
        """Give all rows the Earth's rate, with the headings that these rotations have here."""
        ends = self.closure.at(self._start, Terms(GYROSCOPE, ())).ends
        one, numbers = self.rotations, rest_numbers(self.holds)
        earth = earth_axes(self.of.up, numbers, one.before, one.after, ends)
        alone = self.rest.noise + earth.unknown[self._resting]
        self.rest = replace(self.rest, noise=alone).on_earth(earth)
        self.closure = self.closure.on_earth(earth)
        more = (one.on_earth(earth) for one in self.sources[2:])
        self.sources = (self.rest, self.closure, *more)

    def _noise(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Variance of each mean at rest, (h, 3), and of each closure by its own noise, (m,).

        The closures with the rate noise of the quietest axis; that of each axis follows, (m, 3).
        """
        rest, one = self.noise_at_rest, self.rotations
        span = one.seconds
        walk = rest.per_second + self._rounded.variance @ (self._start.matrix**2).T / span[:, None]
        walked = (walk.min(axis=1) + self.lost.aliased) * span + self._of_its_own
        ends = rest.end + self._carried_on(self._tilts_of_means())
        closing = ends[one.before] + ends[one.after] + walked
        coarse, mostly = self._coarse()
        resting = np.where(mostly, coarse, rest.mean[self._resting])
        return (
            np.maximum(resting, MIN_REST_NOISE**2),
            np.maximum(closing, MIN_CLOSING_NOISE**2),
            walk,
        )

    def _coarse(self) -> tuple[FloatArray, BoolArray]:
        """Variance of each mean at rest by its steps, and whether these decide it, (h, 3)."""
        coarse = noise_of_coarse_means(self.resting, self.rotations.step)
        gains = self._start.matrix**2  # of axes that may be mounted otherwise
        return (
            np.nan_to_num(coarse) @ gains.T,
            np.isfinite(coarse) @ gains.T > 0.5 * gains.sum(axis=1),
        )

    @property
    def _of_its_own(self) -> FloatArray:
        """Variance of each closure by what only that rotation has: missing samples, noise, (m,)."""
        across = (self.rotations.across_gaps @ (self._start.matrix**2).T).max(axis=1)
        return np.asarray(across + self.lost.white * self.rotations.seconds)

    def _closures(
        self, known: Circumstances, noise: FloatArray, walk: FloatArray
    ) -> GravityClosure:
        one, reference = self.rotations, self.of
        resting = begun = None
        if self.rest.rounding.any():
            # what stands for the samples of a hold errs like the holds
            resting = np.ones((len(self.recorded), 3), bool)
            resting[self.recorded] = self._rounded.resting
            begun = np.zeros(resting.shape)
            begun[self.recorded] = self._rounded.begun * np.sqrt(one.place)
        count, span, origin = len(one.usable), one.spans, first_time(self.holds, self.readings)
        return GravityClosure(
            samples=self.samples,
            before=reference.up[one.before],
            after=reference.up[one.after],
            before_doubt=reference.doubt[one.before],
            after_doubt=reference.doubt[one.after],
            usual=reference.undetermined,
            left_open=reference.decided,
            noise=noise,
            motion=motion_of(
                known,
                one.before,
                self.samples,
                self._happened - origin,
                self._start,
                self.readings,
                origin,
            ),
            gravity=self.gravity,
            rounding=self.rest.rounding,
            resting=resting,
            begun=begun,
            holds=np.column_stack([one.before, one.after]),
            tilts=self._tilts(),
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

    def turned_in_holds(self) -> dict[int, tuple[FloatArray, FloatArray, BoolArray]]:
        """See ``Experiment``."""
        parts = [slice(*pair) for pair in itertools.pairwise(self.samples.offsets.tolist())]
        return {
            number: (self.samples.time[own], self.samples.reading[own], self.recorded[own])
            for number, own in zip(self.rotations.usable.tolist(), parts, strict=True)
            if not self.recorded[own].all()
        }

    def temperature_at(self, time: FloatArray) -> FloatArray:
        """See ``Experiment``."""
        origin = first_time(self.holds, self.readings)
        return temperature_at(time - origin, self.circumstances, self.readings, origin)

    def _tilts(self) -> FloatArray:
        """Variance of up across gravity by which closures share each hold, (n,)."""
        tilts = self._tilts_of_means()
        return tilts - self._carried_on(tilts)

    def _tilts_of_means(self) -> FloatArray:
        """Variance of up across gravity in each hold, without a sway that is followed, (n,)."""
        known, own = self.of, (self.of.noise_alone or self.of).variance
        tilts = known.variance - np.maximum(own - self.noise_at_rest.tilt, 0.0)
        least = np.minimum(known.least, tilts) if len(known.least) else tilts
        return np.asarray(least + self.lost.tilted * (tilts - least))

    def _carried_on(self, tilts: FloatArray) -> FloatArray:
        """What the noise of a hold's rates adds to both closures that it joins, rad², (n,).

        Integrated from the beginning to the mean and from the mean to the end, with the variance
        ``T/3`` each, it has the covariance ``T/6``: in all ``T``. A tilt of the mean has the
        opposite sign in the two closures. So that much of it is no tilt that they share.
        """
        rest = self.noise_at_rest
        return np.where(rest.carried, np.minimum(0.5 * rest.end, tilts), 0.0)

    def moved(self, start: Parameters, free: Sequence[int]) -> "GyroscopeExperiment":
        """The same experiment from another start, with other entries determined."""
        other = copy(self)
        other._start, other.free = start, tuple(free)
        other.noise_at_rest = rest_of(self.holds, start.matrix, start.bias, self.of)
        if (other.noise_at_rest.carried != self.noise_at_rest.carried).any():
            args = self.holds, self.rotations, self.of, self.unit, start, self.nominal, free
            return GyroscopeExperiment(*args, self.readings, self.sources[2:], self.lost)
        resting, closing, walk = other._noise()
        rate = (self.samples.reading - start.bias) @ start.matrix.T
        motion = replace(self.closure.motion, rate=rate)
        other.rest = replace(self.rest, noise=resting)
        other.closure = replace(
            self.closure, noise=closing, walk=walk, motion=motion, tilts=other._tilts()
        )
        other._on_earth()
        return other

    def refined(self, found: Minimum[Experiment]) -> "GyroscopeExperiment":
        """See ``Experiment``: closures that are too small show less loss, and a calmer sensor.

        In a hand the holds give no more than an upper limit of how far their means are tilted, or
        the spectrum at rest of the sensor's noise.
        """
        unsure = self._unsure()
        if not unsure.any():
            return self
        first, system = len(self.rest.labels), found.system
        own, part = slice(first, first + len(self.closure.labels)), np.zeros(len(system.own))
        part[own] = np.repeat(unsure, 2)
        squares, shares = found.independent.combined(system.own, part, system.residual)
        share = borne_out(squares[own], shares[own], float(found.balance.spare[own].sum()))
        return self if share == 1.0 else self._with_share(share)

    def _unsure(self) -> FloatArray:
        """Variance of a component of each closure that the spectra only bound, (m,)."""
        if self.noise_at_rest.held:
            return self._variance() - self._with_share(0.0)._variance()
        return (self.lost.aliased + self.lost.white) * self.rotations.seconds

    def _variance(self) -> FloatArray:
        """Of a component of each closure by noise of the rates and of both directions, (m,)."""
        one = self.closure
        uneven = (one.walk.mean(axis=1) - one.walk.min(axis=1)) * self.rotations.seconds
        return np.asarray(one.noise + uneven + one.tilts[one.holds].sum(axis=1))

    def _with_share(self, share: float) -> "GyroscopeExperiment":
        """The same with a share of what may be a hand's motion and not the sensor's noise."""
        other = copy(self)
        lost = self.lost
        other.lost = replace(lost, aliased=share * lost.aliased, white=share * lost.white)
        if self.noise_at_rest.held and lost.level:
            other.lost = replace(other.lost, tilted=share * lost.tilted)
        elif self.noise_at_rest.held:
            quiet = max(share, LEAST_QUIET)
            other.holds = tuple(
                one
                if one.gyroscope_quiet is None
                else replace(one, gyroscope_quiet=quiet * one.gyroscope_quiet)
                for one in self.holds
            )
            other.resting = [other.holds[k] for k in self._resting]
        return other.moved(self._start, self.free)

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
        lost = self.lost.with_more(len(rotations.usable) - len(self.rotations.usable))
        return GyroscopeExperiment(*args, self.readings, more, lost)

    def under(
        self, reference: GravityReference | None, readings: Readings | None
    ) -> "GyroscopeExperiment":
        """See ``Experiment``."""
        reference, readings = reference or self.of, readings or self.readings
        if reference is self.of and readings is self.readings:
            return self
        known = reference.up, reference.doubt, reference.undetermined, reference.decided
        more = [source.under(*known) for source in self.sources[2:]]
        args = self.holds, self.rotations, reference, self.unit, self._start, self.nominal
        return GyroscopeExperiment(
            *args, self.free, readings, more, self.lost, rounded=self._rounded
        )

    @property
    def by_noise_alone(self) -> "GyroscopeExperiment":
        """See ``Experiment``."""
        return self.under(self.of.noise_alone, None)

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
                f"the rotations do not determine {', '.join(missing)}: nominal values are used. "
                "Rotate about each axis in both senses, with that axis level"
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

    @property
    def largest_error(self) -> float:
        """See ``Experiment``: the largest angle between two directions."""
        return math.pi

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
        """See ``Experiment``."""
        return in_session_by_rests(found, self.resting, self.long_rest)

    def foreseen(
        self, found: Minimum[Experiment], combinations: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """See ``Experiment``; few rests show slow noise, which may be small in them by chance."""
        rests = _Rests(found, self.resting, combinations)
        slow = rests.slow_errors(self.long_rest)
        if slow is None:
            return None
        return replace(slow, apart=False).foreseen(rests.axes, rests.between)

    def unseen(self, found: Minimum[Experiment]) -> FloatArray | None:
        """See ``Experiment``: gains left nominal, errors of the reference, slow noise."""
        known, plain, balance = found.of_entries, found.covariance(), found.balance
        if known is None or plain is None or found.base != BASE:
            return None
        basis, free = found.directions.columns, slice(0, len(found.directions))
        by_priors = (balance.covariance * balance.precision) @ balance.covariance
        modes = found.nominal_modes[:ENTRIES]
        beyond = known - basis @ (plain - by_priors)[free, free] @ basis.T
        return np.asarray(beyond + modes @ modes.T)

    def left_nominal(self, found: Minimum[Experiment]) -> FloatArray:
        """See ``Experiment``: gains that the rotations do not determine, by datasheets."""
        left = [entry for entry in range(9) if entry not in self.free]
        usual = datasheet_precision(self.nominal, found.calibration.matrix)[left] ** -0.5
        return np.eye(ENTRIES)[:, left] * usual

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
        # noise that most rotations have beyond that at rest is motion, too
        lost = 2.0 * float(((self.lost.aliased + median(self.lost.white)) * span).mean())
        tilts = self._tilts()[self.closure.holds].sum(axis=1)
        whole = 2.0 * float((self.closure.noise + tilts).mean())
        return float(np.sqrt(lost)) if lost > 0.5 * whole else None

    @property
    def unsteady(self) -> int:
        """How many rotations begin or end where the device was far from being at rest."""
        noise = self.closure.noise + self._tilts()[self.closure.holds].sum(axis=1)
        return int((noise - self._of_its_own > UNSTEADY * median(noise)).sum())


def in_session_by_rests(
    found: Minimum[Experiment], resting: Sequence[Hold], rest: RestPieces | None = None
) -> FloatArray | None:
    """Covariance of M and b, (12, 12), the bias being its mean over the session.

    Args:
        found: a fit whose first rows are the rates at rest.
        resting: their holds.
        rest: one so long that it shows slow noise by itself.

    Returns:
        None where nothing is left to judge by.
    """
    balance = found.balance
    basis, free = found.directions.columns, slice(0, len(found.directions))
    rests = _Rests(found, resting, basis @ found.pull()[free])
    slow = rests.slow_errors(rest)
    if slow is None:
        return None
    by_priors = (balance.covariance * balance.precision) @ balance.covariance
    by_errors = slow.covariance(rests.axes, rests.between)
    return np.asarray(by_errors + basis @ by_priors[free, free] @ basis.T)


class _Rests:
    """The rates at rest and the rotations between them, whose errors have the same slow part.

    The bias of each axis wanders by itself. It wanders in the rotations, too, and the rests show
    by how much.

    Args:
        found: a fit whose first rows are the rates at rest.
        resting: their holds.
        pull: combinations of the rows, shape (k, n).

    Attributes:
        axes: the rates at rest on each axis.
        between: the rotations.
    """

    def __init__(
        self, found: Minimum[Experiment], resting: Sequence[Hold], pull: FloatArray
    ) -> None:
        self._found, self._spans = found, spans_of(resting)
        balance, system, sources = found.balance, found.system, found.experiment.sources
        alike = np.ones(2 * (len(self._spans),))
        count = len(sources[0].labels)
        turned = np.concatenate([one.labels.span for one in sources[1:]])
        moments, which = np.unique(turned, axis=0, return_inverse=True)
        lever = np.concatenate([rows.lever for rows in found.rows[1:]])
        shown = system.columns[:count] ** 2 / balance.variance[:count, None]
        slow = np.zeros((len(system.residual), 3, len(moments)))
        slow[np.arange(count, len(slow))[:, None], [[0, 1, 2]], which.reshape(-1, 1)] = lever
        slow = found.independent.rows(slow.reshape(len(slow), -1)).reshape(slow.shape)[count:]
        self.axes = [
            Fitted(
                system.residual[rows],
                # a column that only its prior holds leaves the rows their freedom
                system.columns[rows][:, shown[rows].sum(axis=0) > system.precision],
                balance.variance[rows],
                alike,
                pull[:, rows],
            )
            for rows in (slice(axis, count, 3) for axis in range(3))
        ]
        self.between = Between(
            moments,
            np.moveaxis(slow, 1, 0),
            pull[:, count:],
            system.own[count:],
            found.white_variance[count:],
        )

    def slow_errors(self, rest: RestPieces | None) -> SlowErrors | None:
        """Estimated from the residuals; None where nothing is left to judge by."""
        if self._found.balance.freedom.min() < 1.0:
            return None
        return estimate_slow_errors(self._spans, self.axes, True, rest, self.between)


def motion_of(
    known: Circumstances,
    before: IntArray,
    samples: RotationSamples,
    time: FloatArray,
    start: Parameters,
    readings: Readings | None,
    origin: float,
) -> Circumstances:
    """Circumstances of the samples; time and temperature have the references of the holds.

    Args:
        known: circumstances of the holds.
        before: the hold before each rotation, shape (m,).
        samples: of the rotations, n of them.
        time: that the reading of each of them comes from, s after the origin, shape (n,).
        start: calibration for the rates.
        readings: what the holds were found in.
        origin: time that counts as 0, s.
    """
    hold = before[samples.rotation]
    return replace(
        known.select(hold),
        rate=(samples.reading - start.bias) @ start.matrix.T,
        temperature=temperature_at(time, known, readings, origin),
        time=time,
        previous=known.force[hold],
        seconds=np.zeros(len(time)),
    )


def temperature_at(
    time: FloatArray, known: Circumstances, readings: Readings | None, origin: float
) -> FloatArray:
    """Temperature at some times, NaN where none was recorded; see ``motion_of``, shape (n,)."""
    recorded = np.isfinite(known.temperature)
    if readings is not None and readings.temperature is not None and len(readings.temperature):
        series = readings.temperature
        return np.interp(time, series.time - origin, series.values[:, 0])
    if recorded.any():
        return np.interp(time, known.time[recorded], known.temperature[recorded])
    return np.full(len(time), np.nan)
