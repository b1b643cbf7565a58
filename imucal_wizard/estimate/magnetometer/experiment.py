"""The magnetometer: mean magnitudes of the field.

Magnitudes leave the frame open. M is symmetric in the sensor's own frame, and ``R P`` with the same
symmetric P in the accelerometer's, R being the rotation that the second stage finds from the dip.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quaternions import rotation_matrix, rotation_vector
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray, Readings, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import COUNT
from imucal_wizard.estimate.experiment import Beside, Directions, Experiment
from imucal_wizard.estimate.magnetometer.field_data import (
    FIELD_BASE,
    USUAL_FIELD,
    FieldData,
    rescaled,
    with_surroundings,
)
from imucal_wizard.estimate.magnetometer.pieces import SMALLEST_NOISE
from imucal_wizard.estimate.magnetometer.start import CROSS_NAMES
from imucal_wizard.estimate.magnetometer.surroundings import around, recorded
from imucal_wizard.estimate.magnitude import TRIANGLE
from imucal_wizard.estimate.result import Parameter
from imucal_wizard.estimate.second_stage.alignment import Alignment
from imucal_wizard.estimate.slow_errors import Fitted, SlowErrors
from imucal_wizard.estimate.slow_noise import MIN_REPEATS_OF_POSES, estimate_slow_errors
from imucal_wizard.estimate.slow_rests import RestPieces
from imucal_wizard.model.effect import MAGNETOMETER
from imucal_wizard.model.rows.dip import ROTATION, Dip
from imucal_wizard.model.rows.field_magnitude import FieldMagnitude, FieldRows
from imucal_wizard.model.rows.source import ENTRIES, Parameters, RowLabels

if TYPE_CHECKING:
    from imucal_wizard.estimate.fit import Minimum
    from imucal_wizard.estimate.result import GravityReference, SensorFit

BIASES = tuple(f"bias_{axis}" for axis in AXES)
SOFT_IRON = tuple(f"soft_iron_{AXES[i]}{AXES[j]}" for i, j in TRIANGLE)
DIAGONAL = (0, 4, 8)


MAX_SLOW_NOISE = 3.0
"""What a fit leaves, rms in units of the samples' noise, above which it is structure of the
place or the sensor: as noise it would weigh rows by what the model lacks."""
MIN_PARTS_OF_REST, MOST_PARTS_OF_REST = 3, 12
"""Parts of a held pose, between which slow noise is looked for: two show a change but no noise, and
more than a dozen only add moments in which white noise is largest."""
WHITE_LEVELS = np.geomspace(0.3, 3.0, 24)
"""White variance of such a part, over that told by pieces that follow one another. A filter in the
sensor makes the two differ; by more than three times it would be slow noise itself."""
SOFT_IRON_SIZE = 0.05
"""Standard deviation of the soft iron's entries on boards; N's figure 7 has 0.06, 0.04 and 0.03."""


@dataclass(frozen=True, eq=False)
class StillPoses:
    """The field in holds in which it stood still.

    Attributes:
        hold: which of all holds, shape (h,).
        span: beginning and end of the samples behind each mean, s, shape (h, 2).
        reading: mean reading, shape (h, 3).
        samples: behind each mean, shape (h,).
        reference: up in all holds, as the accelerometer sees it.
        doubt: change of up with each error mode of the accelerometer, those of the parameters that
            its holds do not determine among them, shape (h, 3, k).
    """

    hold: IntArray
    span: FloatArray
    reading: FloatArray
    samples: FloatArray
    reference: "GravityReference"
    doubt: FloatArray


class MagnetometerExperiment(Experiment):
    """Magnitudes by time and direction.

    Args:
        data: what was measured.
        alignment: how the sensor lies in the accelerometer's frame; None for its own frame.
        poses: still poses in that frame, whose dip is one; None without any.
        known: the slow errors of the rows, estimated by a fit of them; None where none
            of them matters, or before a fit.
        loading: by how much the latent slow errors move the rows, shape (n, m).
    """

    sensor, frame, method = MAGNETOMETER, "own", "orthogonal"
    base_terms, at_rest = FIELD_BASE, False
    # a drift of the field while no direction comes again passes for bias and soft iron
    unmeasured_slow_noise = (
        "slow noise and a drift of the field were not measured, and the standard errors may be too "
        "small for them"
    )
    shows_slow_noise = "turn it through the same directions again"
    covariance_entries: tuple[int, ...] = (9, 10, 11, 0, 1, 2, 4, 5, 8)

    def __init__(
        self,
        data: FieldData,
        alignment: Alignment | None = None,
        poses: "StillPoses | None" = None,
        known: SlowErrors | None = None,
        loading: FloatArray | None = None,
    ) -> None:
        self.data, self.unit, self.gravity = data, data.unit, data.gravity
        self._alignment, self._rotation, self._poses = alignment, np.eye(3), poses
        if alignment is not None:
            self.frame, self._rotation = "accelerometer", alignment.rotation
            self.settled = mounting(alignment)
            self.covariance_entries = ()
        self.error_unit = data.error_unit
        samples, self.circumstances = (
            replace(one, magnetic=one.magnetic @ self._rotation.T)
            for one in (data.samples, data.circumstances)
        )
        self.readings = data.readings
        if data.field_unit.name == COUNT:
            self.assumption = (
                "The field's magnitude is not known: sizes are in counts, and which of them are "
                f"usual rests on a field of {USUAL_FIELD:.0f} µT."
            )
        time = data.circumstances.time
        count = len(data)
        self._slow_errors = known
        self._told_by: Minimum[Experiment] | None = None
        loading = np.zeros((count, 0)) if loading is None else loading
        self.magnitude = FieldMagnitude(
            reading=data.pieces.reading,
            count=data.pieces.count,
            extra=data.pieces.extra,
            offsets=data.pieces.offsets,
            noise=data.noise - (data.rounding**2).sum(axis=1),
            rounding=data.rounding,
            circumstances=samples,
            magnitude=data.field,
            unit=data.error_unit,
            repeated=data.poses,
            loading=loading[:count],
            labels=RowLabels(
                index=np.arange(count),
                axis=np.full(count, -1),
                group=np.unique(data.pieces.cell, return_inverse=True)[1],
                visit=data.visits,
                time=time[:count],
                span=data.pieces.span,
                component=np.zeros(count, np.int64),
            ),
        )
        self.sources = (self.magnitude, *([] if poses is None else [self._dip(poses, loading)]))

    def _dip(self, poses: "StillPoses", loading: FloatArray) -> Dip:
        data, reference, count = self.data, poses.reference, len(poses.hold)
        matrix, bias = data.start
        field = (poses.reading - bias) @ (self._rotation @ matrix).T
        # a motor may start within a pose: the mean of the field goes with that of the current
        beside = np.array(
            [
                recorded(np.linspace(start, end, int(samples)), data.readings).mean(axis=0)
                for (start, end), samples in zip(poses.span, poses.samples, strict=True)
            ]
        ).reshape(-1, 2)
        around_poses = around(
            poses.span.mean(axis=1), field, beside, data.readings, data.gravity, data.field_unit
        )
        still = replace(
            around_poses,
            reference_temperature=data.samples.reference_temperature,
            reference_time=data.samples.reference_time,
        )
        up = reference.up[poses.hold]
        own = data.noise_of_sample / poses.samples + data.shift
        own = own + data.field**2 * reference.variance[poses.hold]
        return Dip(
            hold=poses.hold,
            reading=poses.reading,
            up=up,
            doubt=poses.doubt,
            noise=np.maximum(own, (SMALLEST_NOISE * data.field) ** 2),
            circumstances=still,
            magnitude=data.field,
            sine=float(((up * field).sum(axis=1) / np.linalg.norm(field, axis=1)).mean()),
            unit=data.error_unit,
            loading=np.resize(loading[len(data) :], (count, loading.shape[1])),
            labels=RowLabels(
                index=len(data) + np.arange(count),
                axis=np.full(count, -1),
                group=np.full(count, -1),
                visit=poses.hold,
                time=still.time,
                span=poses.span,
                component=np.zeros(count, np.int64),
            ),
        )

    def under(
        self, reference: "GravityReference | None", readings: Readings | None
    ) -> "MagnetometerExperiment":
        """See ``Experiment``: only the dip has up in it."""
        data, poses = self.data, self._poses
        if readings is not None and readings is not self.readings:
            data = with_surroundings(data, readings)
        if poses is not None and reference is not None and reference is not poses.reference:
            poses = replace(poses, reference=reference)
        if data is self.data and poses is self._poses:
            return self
        return MagnetometerExperiment(data, self._alignment, poses)

    def still_means(self) -> dict[int, FloatArray]:
        """See ``Experiment``."""
        poses = self._poses
        return {} if poses is None else dict(zip(poses.hold.tolist(), poses.reading, strict=True))

    def refined(self, found: "Minimum[Experiment]") -> "MagnetometerExperiment":
        """See ``Experiment``: rows weigh by the slow noise that they share.

        And the second stage took for rotation what the effects do to the dip.
        """
        alignment, data = self._alignment, self.data
        if len(found.terms) and self._poses is not None and alignment is not None:
            turned = rotation_matrix(found.shared_values(ROTATION)) @ alignment.rotation
            alignment = replace(alignment, rotation=turned)
        slow = self._estimated(found, self._fitted(found))
        loading = None
        if slow is not None and np.mean(found.residual**2 / found.system.own) < MAX_SLOW_NOISE**2:
            loading = slow.loading(found.independent)
        had = self.magnitude.loading.shape[1]
        if alignment is self._alignment and (loading is None or not loading.shape[1]) and not had:
            self._slow_errors, self._told_by = slow, found
            return self
        return MagnetometerExperiment(data, alignment, self._poses, slow, loading)

    def at_unit_determinant(self, calibration: Parameters) -> "MagnetometerExperiment":
        """The same rows with the magnitude of the field by which this fit of them has det M = 1."""
        data = rescaled(self.data, calibration.matrix, calibration.bias)
        factor = data.field / self.data.field
        slow = None if self._slow_errors is None else self._slow_errors.scaled(factor)
        loading = factor * self.magnitude.loading
        return MagnetometerExperiment(data, known=slow, loading=loading)

    @property
    def slow_noise_measured(self) -> bool | None:  # type: ignore[override]  # told by a fit
        """See ``Experiment``: directions that come again for as long as one is usually measured.

        What is passed in a turn hardly repeats a pose that was held.
        """
        if self._slow_errors is None:
            return None
        poses, samples = self.data.poses, self.data.pieces.samples
        of_visit = np.bincount(self.data.visits, samples)[self.data.visits]
        longest = np.zeros(int(poses.max()) + 1)
        np.maximum.at(longest, poses, of_visit)
        usual = float(samples.sum()) / len(distinct(poses))
        again = float(samples.sum() - longest.sum())
        return again >= MIN_REPEATS_OF_POSES * usual and self._slow_errors.measured

    @property
    def _spans(self) -> FloatArray:
        return np.concatenate([source.labels.span for source in self.sources])

    def _fitted(self, found: "Minimum[Experiment]") -> Fitted:
        """What a fit leaves of all rows: the bias wanders, and the field's strength.

        Two rows show the same error as far as the field has the same direction in them.
        """
        lever = np.concatenate([rows.lever for rows in found.rows])
        basis, free, of_model = (
            found.directions.columns,
            slice(0, len(found.directions)),
            ~found.slow,
        )
        return Fitted(
            errors=found.residual,
            columns=found.system.columns[:, of_model],
            variance=found.white_variance,
            alike=lever @ lever.T,
            pull=basis @ found.pull()[free],
            strength=(np.arange(len(lever)) < len(self.magnitude.labels)).astype(float),
            still=self._still,
            independent=found.independent,
            own=found.system.own,
        )

    def beside(self, found: "SensorFit") -> Beside:
        """See ``Experiment``."""
        source, table = self.magnitude, found.rows
        y, field = source.mean(source.reading), self.circumstances.magnetic
        if found.base == FIELD_BASE and table is not None:
            corrected = found.correct(y, self.circumstances)
            along = table.residual[: len(y)] / np.linalg.norm(corrected, axis=1)
            field = corrected * (1.0 - along[:, None])
            model = y - (corrected - field) @ np.linalg.inv(found.matrix).T
        else:
            model = self.predicted(found, field)
        counts = self.unit == COUNT
        gain, offset = (self.data.gain, found.bias) if counts else (1.0, np.zeros(3))
        # what was read, in the frame of the true field
        read, model = (((one - offset) * gain) @ self._rotation.T - field for one in (y, model))
        rows, title = np.arange(len(y)), "read beyond the true field"
        return Beside(title, self.error_unit, read, model, source, rows)

    def directions(self, base: Sequence[str]) -> Directions:
        """See ``Experiment``; one scale is always fitted."""
        model = self.data.model
        own = "soft-iron" in base and model.scales
        cross = own and model.cross
        columns, names = self._directions(bias="bias" in base, scales=own, cross=cross)
        dropped = [*(BIASES if "bias" not in base else ()), *(CROSS_NAMES if not cross else ())]
        terms = model.terms if tuple(base) == self.base_terms else tuple(base)
        terms += ("misalignment",) * (self._alignment is not None)
        reason = model.reason if "soft-iron" in base else ""
        return Directions(columns, tuple(names), terms, tuple(dropped), reason)

    def _directions(self, *, bias: bool, scales: bool, cross: bool) -> tuple[FloatArray, list[str]]:
        """Directions of the twelve entries, shape (12, p), and their names."""
        columns, names = [], []
        for axis in range(3 if bias else 0):
            columns.append(np.eye(ENTRIES)[9 + axis])
            names.append(BIASES[axis])
        for name, (i, j) in zip(SOFT_IRON, TRIANGLE, strict=True):
            if cross if i != j else scales:
                column = np.zeros(ENTRIES)
                column[[3 * i + j, 3 * j + i]] = 1.0
                columns.append(self._turned(column))
                names.append(name)
        if not scales:
            column = np.zeros(ENTRIES)
            column[list(DIAGONAL)] = 1.0 / np.sqrt(3.0)
            columns.append(self._turned(column))
            names.append("scale")
        return np.array(columns).T, names

    def _turned(self, column: FloatArray) -> FloatArray:
        """The twelve entries in the frame of the fit."""
        column[:9] = (self._rotation @ column[:9].reshape(3, 3)).ravel()
        return column

    def begin(self, base: Sequence[str]) -> Parameters:
        """See ``Experiment``."""
        matrix, bias = self.data.begin(base)
        return Parameters(self._rotation @ matrix, bias)

    def before(self) -> Parameters:
        """See ``Experiment``."""
        data = self.data
        bias = np.zeros(3) if self.unit != COUNT else data.start[1]
        gain = data.gain
        if not data.known:  # only the size's constancy counts where nobody knows it
            sizes = np.linalg.norm(data.pieces.reading - bias, axis=1) + data.pieces.extra / gain
            gain = data.field / float(data.pieces.mean(sizes).mean())
        elif self.unit == data.error_unit:
            gain = 1.0
        return Parameters(gain * np.eye(3), bias)

    @property
    def scale_before(self) -> float:
        """See ``Experiment``: where nobody knows the field, readings in its unit are not scaled."""
        unscaled = not self.data.known and self.unit == self.data.error_unit
        return 1.0 / float(self.before().matrix[0, 0]) if unscaled else 1.0

    def named(self, matrix: FloatArray, bias: FloatArray) -> dict[str, float]:
        """See ``Experiment``; of an unknown field its size follows from ``det M = 1``."""
        matrix = self._rotation.T @ matrix
        size = 1.0 if self.data.known else float(np.cbrt(np.linalg.det(matrix)))
        values = dict(zip(BIASES, map(float, bias), strict=True))
        for name, (i, j) in zip(SOFT_IRON, TRIANGLE, strict=True):
            values[name] = float(matrix[i, j]) / size
        return values if self.data.known else values | {"field": self.data.field / size}

    def unit_of(self, name: str) -> str:
        """See ``Experiment``."""
        if not name.startswith("soft_iron"):
            return self.unit
        return "1" if self.unit == self.error_unit else f"{self.error_unit}/{self.unit}"

    def foreseen(
        self, found: "Minimum[Experiment]", combinations: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """See ``Experiment``; what is known of slow errors may be by a fit with fewer effects."""
        fitted = replace(self._fitted(found), pull=combinations)
        slow = self._estimated(found, fitted)
        return None if slow is None else slow.foreseen([fitted])

    def _told(self, found: "Minimum[Experiment]") -> SlowErrors | None:
        """What of the errors of the rows is slow."""
        slow = self._slow_errors
        if slow is None or (self._told_by is not None and self._told_by is not found):
            slow = self._estimated(found, self._fitted(found))
        return slow

    def _estimated(self, found: "Minimum[Experiment]", fitted: Fitted) -> SlowErrors | None:
        return estimate_slow_errors(self._spans, [fitted], measured=False, rests=self._rests(found))

    def _rests(self, found: "Minimum[Experiment]") -> RestPieces | None:
        """The poses that are held, cut into pieces; None where none is.

        Magnitudes do not show that a hand sways. Where rounding moves whole rests, steps within
        them are no noise.
        """
        pieces, rows = self.data.pieces, cast("FieldRows", found.rows[0])
        sizes = np.diff(pieces.offsets)
        held = np.flatnonzero(self._still[: len(self.data)] & (sizes >= MIN_PARTS_OF_REST))
        if not len(held) or self.data.rounding.shape[1]:
            return None
        parts = np.minimum(sizes[held], MOST_PARTS_OF_REST)
        rest = np.repeat(held, parts)
        number = np.arange(len(rest)) - np.repeat(np.cumsum(parts) - parts, parts)
        first, last = (
            pieces.offsets[rest] + one * sizes[rest] // np.repeat(parts, parts)
            for one in (number, number + 1)
        )

        def summed(values: FloatArray) -> FloatArray:
            until = np.append(0.0, np.cumsum(values))
            return np.asarray(until[last] - until[first])

        count = summed(pieces.count)
        white = (self.data.noise * pieces.samples)[rest] / count
        return RestPieces(
            spans=np.column_stack([pieces.edges[first, 0], pieces.edges[last - 1, 1]]),
            means=(summed(pieces.count * (rows.length - self.data.field)) / count)[:, None],
            white=white[:, None],
            levels=WHITE_LEVELS,
            lever=np.linalg.norm(rows.lever, axis=1)[rest],
            rest=rest,
        )

    @cached_property
    def _still(self) -> BoolArray:
        """Which rows were measured at rest, shape (n,)."""
        still = self.data.pieces.still(self.data.samples.magnetic)
        return np.append(still, np.ones(len(self._spans) - len(still), bool))

    def in_session(self, found: "Minimum[Experiment]") -> FloatArray | None:
        """See ``Experiment``: the sensor's bias wanders, and the field differs between places."""
        if found.freedom.min() < 1.0:
            return None
        slow = self._told(found)
        if slow is None:
            return None
        by_errors = slow.covariance_of_intervals(self._fitted(found), float(found.freedom.min()))
        basis, free = found.directions.columns, slice(0, len(found.directions))
        balance = found.balance
        precision = np.where(found.slow, 0.0, balance.precision)
        by_priors = (balance.covariance * precision) @ balance.covariance
        by_priors = basis @ by_priors[free, free] @ basis.T
        return np.asarray(by_errors + by_priors)

    def unseen(self, found: "Minimum[Experiment]") -> FloatArray | None:
        """See ``Experiment``: soft iron that is left at none, and slow errors of rows."""
        known, plain = found.of_entries, found.covariance()
        if known is None or plain is None:
            return None
        basis, free = found.directions.columns, slice(0, len(found.directions))
        modes = found.nominal_modes[:ENTRIES]
        return np.asarray(known - basis @ plain[free, free] @ basis.T + modes @ modes.T)

    def left_nominal(self, found: "Minimum[Experiment]") -> FloatArray:
        """See ``Experiment``: soft iron that is left at none, which no sensor has."""
        free = found.directions.columns
        whole = self._directions(bias=True, scales=True, cross=True)[0]
        chosen = np.linalg.lstsq(whole, free, rcond=None)[0]
        left = whole @ np.linalg.svd(chosen)[0][:, free.shape[1] :]
        return np.asarray(SOFT_IRON_SIZE * self.data.gain * left)


def mounting(alignment: Alignment) -> tuple[Parameter, ...]:
    """The rotation between the sensors as a vector, with its standard errors."""
    vector = rotation_vector(alignment.rotation)
    errors = np.sqrt(np.diag(alignment.covariance))
    return tuple(
        Parameter(f"misalignment_{axis}", float(value), float(error), "rad")
        for axis, value, error in zip(AXES, vector, errors, strict=True)
    )
