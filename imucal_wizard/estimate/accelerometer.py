"""The accelerometer: holds become rows of ``|M (y − b) − ε| = g`` with M upper triangular."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from imucal_wizard.core.directions import group_directions, mean_directions, unit_vectors
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.quantities import plural
from imucal_wizard.core.readings import MAX_READING, FloatArray, IntArray, Readings, distinct
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.core.units import COUNT
from imucal_wizard.estimate.experiment import Beside, Directions, Experiment
from imucal_wizard.estimate.fit import Minimum, minimum
from imucal_wizard.estimate.magnitude import make_problem, sphere, up_changes
from imucal_wizard.estimate.noise import HoldNoise, hold_noise
from imucal_wizard.estimate.parameters import nominal_angle, triangular_parameters, unit_of
from imucal_wizard.estimate.result import GravityReference, SensorFit
from imucal_wizard.estimate.settling import CommonSettling, common_settling
from imucal_wizard.estimate.slow_errors import Fitted, SlowErrors
from imucal_wizard.estimate.slow_kernels import flicker_between
from imucal_wizard.estimate.slow_noise import (
    MIN_REPEATS_OF_POSES,
    estimate_slow_errors,
    spans_of,
)
from imucal_wizard.estimate.slow_rests import flicker_in_holds, long_rest
from imucal_wizard.estimate.split import steps_by_rows
from imucal_wizard.estimate.surroundings import circumstances_of, visits
from imucal_wizard.estimate.variance_components import solved
from imucal_wizard.measurement.blocks import rest_in_words
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.model.effect import ACCELEROMETER, Circumstances
from imucal_wizard.model.identifiability import (
    BIAS,
    NON_ORTHOGONALITY,
    SCALE,
    TYPICAL_SIZE,
    Identifiable,
    identifiable,
    undetermined_modes,
)
from imucal_wizard.model.rows.decorrelation import Decorrelation
from imucal_wizard.model.rows.gravity_magnitude import GravityMagnitude, MagnitudeRows
from imucal_wizard.model.rows.source import ENTRIES, Parameters, RowLabels

BASE = ("bias", "scale", "non-orthogonality")
ENTRY_OF = (9, 10, 11, 0, 1, 2, 4, 5, 8)
"""Which of the twelve entries the nine parameters are: biases, then M's xx, xy, xz, yy, yz, zz."""
PLACES = {"bias": BIAS, "scale": SCALE, "non-orthogonality": NON_ORTHOGONALITY}
"""Which of the nine belong to each term."""
PARAMETERS = {
    "bias": ("bias_x", "bias_y", "bias_z"),
    "scale": ("sensitivity_x", "sensitivity_y", "sensitivity_z"),
    "non-orthogonality": ("theta_yz", "theta_zy", "theta_zx"),
}
NAMES = ("bias_x", "bias_y", "bias_z", "xx", "xy", "xz", "yy", "yz", "zz")
MIN_HOLDS = 4
MIN_NOISE = 1e-7
"""Of gravity; no average is better, and data without any noise keep a weight."""
FIRST_NOISE = 1e-5
"""Of gravity; the first fit ends when its steps are small against it."""
FLAT = 0.02
"""Extent of the readings in one direction, relative to the largest, that is none: 1° of tilt."""


class AccelerometerExperiment(Experiment):
    """Still periods in the order of time, and the magnitude of gravity in each.

    Args:
        holds: still periods, n of them.
        gravity: m/s².
        unit: of the readings, ``m/s^2`` or ``count``.
        calibration: a first one, from which directions and noise are computed.
        identified: which parameters the directions determine.
        noise: of the holds.
        readings: what the holds were found in: beginning of the session, vibration.
        group: number of each hold's direction, shape (n,), where it is known.
        settling: of the sensor, where the holds share it.
    """

    sensor, error_unit, frame, method = ACCELEROMETER, "m/s^2", "own", "least_squares"
    base_terms = BASE
    covariance_entries = ENTRY_OF

    def __init__(
        self,
        holds: Sequence[Hold],
        gravity: float,
        unit: str,
        calibration: Parameters,
        identified: Identifiable,
        noise: HoldNoise,
        readings: Readings | None = None,
        group: IntArray | None = None,
        settling: CommonSettling | None = None,
    ) -> None:
        self.holds, self.gravity, self.unit = tuple(holds), gravity, unit
        self.identified, self.noise, self.readings = identified, noise, readings
        self._start, self.settling = calibration, settling
        means = np.array([hold.accelerometer for hold in holds])
        self.up = unit_vectors((means - calibration.bias) @ calibration.matrix.T)
        gain = self.gain = float(np.linalg.norm(calibration.matrix, ord=2))
        group = group_directions(self.up) if group is None else group
        means = means if settling is None else means - settling.left
        self.across = noise.across * gain**2
        self.circumstances = circumstances_of(holds, self.up, gravity, gain, readings)
        labels = RowLabels(
            index=np.arange(len(holds)),
            axis=np.full(len(holds), -1),
            group=group,
            visit=visits(holds, self.up, group),
            time=self.circumstances.time,
            span=spans_of(holds),
            component=np.zeros(len(holds), np.int64),
        )
        own = np.maximum(noise.accelerometer * gain**2, (MIN_NOISE * gravity) ** 2)
        self.long_rest = (
            None if readings is None else long_rest(readings.accelerometer, holds, gain * np.eye(3))
        )
        flicker = flicker_in_holds(holds, self.up, noise.accelerometer)
        repeats = len(distinct(labels.visit)) - len(distinct(group))
        self.source = GravityMagnitude(means, own, self.circumstances, gravity, labels)
        if flicker is not None:
            wander = gain * flicker_between(labels.span)
            root = math.sqrt(flicker.variance)
            if root:
                self.source = replace(
                    self.source, wander=root * wander, slow_freedom=flicker.freedom
                )
            else:
                each = math.sqrt(float((wander**2).sum()) / len(wander))
                self.slow_noise_not_excluded = math.sqrt(flicker.most) * each
        shown = self.long_rest is not None or self.source.wander.shape[1] > 0
        self.slow_noise_measured = repeats >= MIN_REPEATS_OF_POSES or shown
        self.sources = (self.source,)

    @property
    def common_errors(self) -> FloatArray:
        """See ``Experiment``."""
        return super().common_errors if self.settling is None else self.settling.errors

    def validated(self, found: SensorFit, holds: Sequence[Hold]) -> SensorFit:
        """See ``Experiment``: the error of the size of gravity."""
        if not holds:
            return found
        means = self.without_settling(np.array([hold.accelerometer for hold in holds]))
        return with_new_holds(found, found.correct(means, self._around(holds)), self.gravity)

    def without_settling(self, means: FloatArray) -> FloatArray:
        """Means of further holds of the session without what settling leaves in them, (m, 3)."""
        if self.settling is None:
            return means
        up = unit_vectors((means - self._start.bias) @ self._start.matrix.T)
        return np.asarray(means - self.settling.in_holds(up))

    def _around(self, holds: Sequence[Hold]) -> Circumstances:
        """Circumstances of further holds of the same session, one row for each."""
        every = sorted((*self.holds, *holds), key=lambda hold: hold.start)
        means = np.array([hold.accelerometer for hold in every])
        up = unit_vectors((means - self._start.bias) @ self._start.matrix.T)
        found = replace(
            circumstances_of(every, up, self.gravity, self.gain, self.readings),
            reference_temperature=self.circumstances.reference_temperature,
            reference_time=self.circumstances.reference_time,
        )
        place = {hold.start: row for row, hold in enumerate(every)}
        return found.select(np.array([place[hold.start] for hold in holds]))

    def under(
        self, reference: GravityReference | None, readings: Readings | None
    ) -> "AccelerometerExperiment":
        """See ``Experiment``: these rows need no reference but the size of gravity."""
        del reference
        if readings is None or readings is self.readings:
            return self
        args = self.holds, self.gravity, self.unit, self._start, self.identified, self.noise
        group = self.source.labels.group
        return AccelerometerExperiment(*args, readings, group, self.settling)

    def beside(self, found: SensorFit) -> Beside:
        """See ``Experiment``."""
        y, force = self.source.reading, self.circumstances.force
        if found.base == BASE:
            corrected = found.correct(y, self.circumstances)
            force = self.gravity * corrected / np.linalg.norm(corrected, axis=1)[:, None]
            model = y - (corrected - force) @ np.linalg.inv(found.matrix).T
        else:
            model = self.predicted(found, force)
        gain, offset = 1.0, np.zeros(3)
        if self.unit == COUNT:
            gain = float(np.cbrt(abs(np.linalg.det(found.matrix))))
            offset = found.bias if "bias" in found.base else y.mean(axis=0)
        read, model = ((one - offset) * gain - force for one in (y, model))
        rows = np.arange(len(y))
        return Beside("read beyond the true force", "m/s^2", read, model, self.source, rows)

    def directions(self, base: Sequence[str]) -> Directions:
        """See ``Experiment``."""
        identified = self.identified
        wanted = {place for term in base for place in PLACES[term]}
        free = [place for place in identified.places if place in wanted]
        common = "scale" in base and not set(identified.places) & set(PLACES["scale"])
        columns = np.zeros((ENTRIES, len(free) + common))
        columns[[ENTRY_OF[place] for place in free], range(len(free))] = 1.0
        if common:
            columns[[ENTRY_OF[place] for place in PLACES["scale"]], -1] = 1.0 / np.sqrt(3.0)
        names = [NAMES[place] for place in free] + ["scale"] * common
        left = [name for term in BASE if term not in base for name in PARAMETERS[term]]
        terms = tuple(term for term in base if term in identified.terms)
        dropped = (*identified.dropped, *left)
        short = common or ("non-orthogonality" in base and bool(identified.dropped))
        reason = identified.reason if short else ""
        return Directions(columns, tuple(names), terms, dropped, reason)

    def begin(self, base: Sequence[str]) -> Parameters:
        """See ``Experiment``."""
        if set(base) == set(BASE):
            return self._start
        nominal = self.before()
        if self.unit == COUNT:
            return nominal
        matrix, bias = np.eye(3), np.zeros(3)
        return Parameters(matrix, bias)

    def before(self) -> Parameters:
        """See ``Experiment``: the nominal unit; of counts, the sphere nearest to the holds."""
        if self.unit != COUNT:
            return Parameters(np.eye(3), np.zeros(3))
        problem = make_problem(self.source.reading, self.gravity)
        return Parameters(*problem.matrix_and_bias(sphere(problem)))

    def constrained(self, calibration: Parameters, base: Sequence[str]) -> Parameters:
        """See ``Experiment``: M_xz where its angle is nominal but the others are not."""
        angles = set(self.identified.places) & set(PLACES["non-orthogonality"])
        if "non-orthogonality" not in base or not angles or 5 in angles:
            return calibration
        return replace(calibration, matrix=nominal_angle(calibration.matrix))

    def named(self, matrix: FloatArray, bias: FloatArray) -> dict[str, float]:
        """See ``Experiment``."""
        return triangular_parameters(matrix, bias)

    def unit_of(self, name: str) -> str:
        """See ``Experiment``."""
        return unit_of(name, self.unit, self.error_unit)

    def in_session(self, found: Minimum[Experiment]) -> FloatArray | None:
        """See ``Experiment``: the bias of each axis wanders by itself.

        Two holds show the same slow error as far as they point the same way.
        """
        balance, basis = found.balance, found.directions.columns
        free = slice(0, len(found.directions))
        fitted = self._fitted(found, basis @ found.pull()[free])
        slow = self._slow_errors(fitted, found)
        if slow is None:
            return None
        by_errors = slow.covariance([fitted])
        by_priors = balance.covariance @ balance.prior @ balance.covariance
        return np.asarray(by_errors + basis @ by_priors[free, free] @ basis.T)

    def foreseen(
        self, found: Minimum[Experiment], combinations: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """See ``Experiment``."""
        fitted = self._fitted(found, combinations)
        slow = self._slow_errors(fitted, found)
        return None if slow is None else slow.foreseen([fitted])

    def _fitted(self, found: Minimum[Experiment], pull: FloatArray) -> Fitted:
        (rows,) = found.rows
        fitted = Fitted(
            errors=found.system.residual,
            columns=np.concatenate([found.system.columns, found.nominal_shown], axis=1),
            variance=found.balance.variance,
            alike=rows.direction @ rows.direction.T,
            pull=pull,
            independent=found.independent,
        )
        if self.long_rest is None or not self.source.wander.shape[1]:
            return fitted
        # the rest tells flicker noise and a walk apart as the fit's weights do not: the holds as
        # they are measured, with white errors alone
        excess = float((found.balance.variance - found.system.own).mean())
        measured = found.independent.measured
        return replace(
            fitted,
            errors=measured(fitted.errors),
            columns=measured(fitted.columns),
            variance=self.source.noise + excess,
            pull=fitted.pull_of_holds,
            independent=Decorrelation(),
        )

    def _slow_errors(self, fitted: Fitted, found: Minimum[Experiment]) -> SlowErrors | None:
        """What of the errors of the holds is slow; None where nothing is left to judge by."""
        if found.balance.freedom[0] < 1.0:
            return None
        return estimate_slow_errors(
            spans_of(self.holds), [fitted], bool(self.slow_noise_measured), self.long_rest
        )

    def unseen(self, found: Minimum[Experiment]) -> FloatArray | None:
        """See ``Experiment``: what the poses leave undetermined, and the doubt about settling."""
        modes = found.nominal_modes[:ENTRIES]
        return np.asarray(modes @ modes.T) if modes.shape[1] else None

    def left_nominal(self, found: Minimum[Experiment]) -> FloatArray:
        """See ``Experiment``: angles and scales that the poses do not determine."""
        del found
        return self.left_by(self.identified.places)

    def left_by(self, places: Sequence[int]) -> FloatArray:
        """Errors of usual size in what is not fitted, shape (12, k).

        Args:
            places: which of b and M's xx, xy, xz, yy, yz, zz are fitted.
        """
        entry_of = np.array(ENTRY_OF)
        left = [place for place in range(len(entry_of)) if place not in places]
        return np.asarray(np.eye(ENTRIES)[:, entry_of[left]] * TYPICAL_SIZE[left] * self.gain)

    def reference(self, found: Minimum[Experiment]) -> GravityReference:
        """See ``Experiment``."""
        # what the rotations show of it they show the sensors that refer to it once more
        found = found.alone
        rows, system = cast("MagnitudeRows", found.rows[0]), found.system
        by_entries = rows.up_columns()
        entries = by_entries[:, :, :ENTRIES] @ found.directions.columns
        both = np.concatenate([entries, by_entries[:, :, ENTRIES:]], axis=2)

        def referred(covariance: FloatArray | None, excess: FloatArray) -> GravityReference:
            steps = steps_by_rows(covariance, found.balance.precision, found.terms)
            none = np.zeros((len(self.holds), 3, 0))
            doubt, left_open = (both @ one if len(one) else none for one in steps)
            basis = self.identified.basis
            return self.referred(rows.direction, doubt, excess, basis, hidden, left_open)

        excess, hidden = found.balance.variance - system.own, rows.hidden.max(axis=1)
        # a bias that wanders tilts gravity as much as it changes its size
        known = referred(found.covariance(), excess + rows.slow)
        if not excess.any():
            return known
        alone = solved(system, system.own, found.balance.precision).covariance
        return replace(known, noise_alone=referred(alone, rows.slow))

    def referred(
        self,
        up: FloatArray,
        doubt: FloatArray,
        excess: FloatArray | float,
        basis: FloatArray,
        hidden: FloatArray | float = 0.0,
        left_open: FloatArray | None = None,
    ) -> GravityReference:
        """Up in each hold with all its errors.

        Parameters that these poses do not determine are wrong by their usual size.

        Args:
            up: unit vectors, shape (n, 3).
            doubt: change of ``up`` with one standard deviation of what was fitted, (n, 3, k).
            excess: variance of the holds beyond their own noise, which counts as tilt, (m/s²)².
            basis: free directions of the nine parameters, shape (9, p).
            hidden: largest error of the force that an effect does not let readings show, m/s².
            left_open: change of ``up`` with what these rows leave open of effects, (n, 3, q).
        """
        left_open = np.zeros((len(up), 3, 0)) if left_open is None else left_open
        modes, most = undetermined_modes(up, basis), hidden / self.gravity * np.ones(len(up))
        across, along = (
            (one + excess) / self.gravity**2 + most**2 / 3.0
            for one in (self.across, self.source.noise)
        )
        return GravityReference(
            up,
            self.source.labels.group,
            across,
            np.concatenate([doubt, left_open, up_changes(up, modes)], axis=2),
            self.gain,
            self.gravity,
            left_open.shape[2] + modes.shape[1],
            left_open.shape[2],
            most,
            np.minimum(along, across) if self.noise.held else np.zeros(0),
        )


def accelerometer_experiment(
    holds: Sequence[Hold], gravity: float, unit: str, readings: Readings | None = None
) -> AccelerometerExperiment:
    """The experiment of these holds, with a first calibration of what they determine.

    Args:
        holds: still periods, in the order of time.
        gravity: local gravity, m/s².
        unit: of the readings, ``m/s^2`` or ``count``.
        readings: what the holds were found in, for the session's beginning and the vibration.

    Raises:
        DataError: the holds do not determine a calibration.
    """
    found = first_fit(holds, gravity, unit)
    identified, system = found.experiment.identified, found.system
    left = system.residual / found.experiment.gain
    noise = found.experiment.noise.bounded(left, system.columns)
    settling = common_settling(holds, found.experiment.up, found.experiment.gain, found.errors)
    args = holds, gravity, unit, found.calibration, identified, noise, readings
    return AccelerometerExperiment(*args, settling=settling)


def first_fit(
    holds: Sequence[Hold], gravity: float, unit: str, shares: FloatArray | None = None
) -> Minimum[AccelerometerExperiment]:
    """A fit from a sphere, in which all holds weigh alike, or by given shares, shape (n,).

    Raises:
        DataError: the holds do not determine a calibration.
    """
    means = np.array([hold.accelerometer for hold in holds], float).reshape(-1, 3)
    check_means(means)
    problem = make_problem(means, gravity)
    first = Parameters(*problem.matrix_and_bias(sphere(problem)))
    vectors = (means - first.bias) @ first.matrix.T
    if not (np.linalg.norm(vectors, axis=1) > 1e-6 * gravity).all():
        raise DataError(
            "a still position reads no gravity: its readings are at the centre of all others. "
            "Check the columns, and measure that position again"
        )
    up, group = unit_vectors(vectors), group_directions(unit_vectors(vectors))
    noise = hold_noise(holds)
    # holds weigh by their noise: a noisy one among them takes nothing from the others
    known = noise.accelerometer[noise.accelerometer > 0.0]
    level = float(1.0 / np.sqrt((1.0 / known).mean())) / problem.span if len(known) else 0.0
    identified = identifiable(mean_directions(up, group), level)
    args = holds, gravity, unit, first, identified, noise
    rough = AccelerometerExperiment(*args, group=group)
    shares = np.ones(len(holds)) if shares is None else shares
    return minimum(rough, variance=(FIRST_NOISE * gravity) ** 2 / shares)


def check_means(means: FloatArray, rate: float = 0.0) -> None:
    """Refuse holds from which no fit can begin.

    Raises:
        DataError: too few, not numbers, or an axis that is dead.
    """
    if len(means) < MIN_HOLDS:
        raise DataError(
            f"{plural(len(means), 'still position')} found, too few for a fit. "
            f"Hold the device still for {rest_in_words(rate)} with each of its six faces up"
        )
    if not (np.abs(means) < MAX_READING).all():
        raise DataError("the accelerometer's readings are not all numbers: check the columns")
    spread = np.ptp(means, axis=0)
    if spread.max() <= 1e-12 * np.abs(means).max():
        raise DataError("the accelerometer always reads the same: it is dead or not connected")
    if (spread < FLAT * spread.max()).any():
        dead = ", ".join(a for a, s in zip("xyz", spread, strict=True) if s < FLAT * spread.max())
        raise DataError(
            f"accelerometer axis {dead} hardly changes between the positions: turn the device so "
            "that it points up and down, and check the axis if you did"
        )
    extent = np.linalg.svd(means - means.mean(axis=0), compute_uv=False)
    if extent[-1] < FLAT * extent[0]:
        raise DataError(
            "the still positions lie in one plane: gravity never acts across it. Hold the device "
            "still with each of its six faces up"
        )


def with_new_holds(fit: SensorFit, corrected: FloatArray, gravity: float) -> SensorFit:
    """A fit with its error on holds that it has not seen.

    Args:
        fit: of the accelerometer.
        corrected: the mean of each of these holds, corrected by the fit, m/s², shape (n, 3).
        gravity: local gravity, m/s².
    """
    errors = np.linalg.norm(corrected, axis=1) - gravity
    return replace(fit, validation_rms=root_mean_square(errors), validation=tuple(errors.tolist()))
