"""The gyroscope by gravity and field, once the magnetometer is aligned; and the clocks.

Rotations about the vertical, which the fit by gravity leaves out, count here.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from imucal_wizard.core.attitude import Attitudes, rotation_samples, strictly_later
from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.limits.stillness import ROTATION_OVERLAP_SECONDS
from imucal_wizard.core.quantities import plural
from imucal_wizard.core.quaternions import matrices, quaternions
from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median, root_mean_square
from imucal_wizard.estimate.accelerometer import BASE
from imucal_wizard.estimate.fit import fit, minimum
from imucal_wizard.estimate.gyroscope import MIN_CLOSING_NOISE, GyroscopeExperiment, motion_of
from imucal_wizard.estimate.gyroscope_fit import determined_entries
from imucal_wizard.estimate.gyroscope_report import SMALLEST_ROTATION
from imucal_wizard.estimate.lack_of_fit import lack_without
from imucal_wizard.estimate.magnetometer.fit import MagnetometerFit
from imucal_wizard.estimate.methods import DEFAULTS
from imucal_wizard.estimate.noise import rest_of
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.estimate.rotation_set import RotationSet
from imucal_wizard.estimate.second_stage.alignment import leaning
from imucal_wizard.estimate.second_stage.clock_offset import Passage, clock_offset
from imucal_wizard.estimate.second_stage.field_changes import (
    FieldChange,
    field_angles,
    turned_in_hold,
    where_field_turned,
)
from imucal_wizard.estimate.second_stage.found import Added, SecondStage
from imucal_wizard.estimate.second_stage.heading import up_in
from imucal_wizard.estimate.split import principal_steps
from imucal_wizard.estimate.surroundings import circumstances_of, first_time
from imucal_wizard.measurement.gaps import gap_problem
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.model.rows.field_closure import FieldClosure
from imucal_wizard.model.rows.gravity_closure import GravityClosure
from imucal_wizard.model.rows.source import Parameters, RowLabels
from imucal_wizard.model.terms import Terms

MIN_SEGMENTS = 6
"""Rotations with the field known at both ends, from which headings are fitted."""
MAX_SEGMENT_SECONDS = 30.0
"""Seconds; longer ones gather too much noise of the gyroscope."""
END_SHARE = 0.25
"""Share of a hold left out at either end while the clocks are not yet compared."""
MIN_SAMPLES = 3
MAX_SCATTER = 3.0
"""Scatter of the field in a hold over its noise, from which the device turned."""
ALLOWED_SCATTER = 0.003
"""Scatter as a share of the field that is always allowed: 0.2°."""


@dataclass(frozen=True, eq=False)
class Segment:
    """The gyroscope between two holds that follow one another.

    Attributes:
        before: index of the hold before.
        after: index of the hold after.
        time: sample times, s, shape (n,).
        rate: readings, shape (n, 3).
    """

    before: int
    after: int
    time: FloatArray
    rate: FloatArray


def undisturbed(series: Series, found: MagnetometerFit) -> Series:
    """The readings without those that the calibration has found disturbed."""
    return Series(series.time[found.undisturbed], series.values[found.undisturbed], series.unit)


def inner_span(hold: Hold) -> tuple[float, float]:
    """The part of a hold that is inside it by the clock of another sensor, too, s."""
    trim = END_SHARE * (hold.end - hold.start)
    return hold.start + trim, hold.end - trim


def field_at(
    holds: Sequence[Hold], calm: Series, found: MagnetometerFit, clock: float | None = None
) -> tuple[list[int], FloatArray, FloatArray]:
    """Mean reading of the magnetometer in each hold in which the field stood still.

    Args:
        holds: still periods.
        calm: the magnetometer's undisturbed readings.
        found: its calibration.
        clock: the magnetometer's clock minus the other's, s; None when not known, and then the
            ends of each hold are left out.

    Returns:
        Indices of the holds, the means, shape (k, 3), and the samples behind each, shape (k,).
    """
    chosen, means, counts = [], [], []
    for index, hold in enumerate(holds):
        start, end = inner_span(hold) if clock is None else (hold.start + clock, hold.end + clock)
        values = calm.between(start, end).values
        if len(values) < MIN_SAMPLES or _turns(values, found):
            continue
        chosen.append(index)
        means.append(values.mean(axis=0))
        counts.append(len(values))
    return chosen, np.array(means, float).reshape(-1, 3), np.array(counts, float)


def _turns(values: FloatArray, found: MagnetometerFit) -> bool:
    """Whether the field turned during a hold: about the vertical only the magnetometer sees it."""
    corrected = (values - found.fit.bias) @ found.fit.matrix.T
    floor = max(found.noise, ALLOWED_SCATTER * found.magnitude)
    return bool((corrected.std(axis=0) > MAX_SCATTER * floor).any())


def segments(holds: Sequence[Hold], gyroscope: Series) -> list[Segment]:
    """The gyroscope between each hold and the next, where it is whole."""
    interval = median(np.diff(gyroscope.time)) if len(gyroscope) > 1 else 0.0
    out = []
    for index, (before, after) in enumerate(itertools.pairwise(holds)):
        part = gyroscope.between(
            before.end - ROTATION_OVERLAP_SECONDS, after.start + ROTATION_OVERLAP_SECONDS
        )
        one = _segment(index, index + 1, part)
        if one is None:
            continue
        whole = Series(one.time, one.rate, gyroscope.unit)
        if gap_problem(whole, interval, before, after) is None:
            out.append(one)
    return out


def segments_of(rotations: Sequence[Rotation], holds: Sequence[Hold]) -> list[Segment]:
    """The same of motions that were gathered live; those without a problem, between kept holds."""
    places = {id(hold): index for index, hold in enumerate(holds)}
    out = []
    for rotation in rotations:
        before, after = places.get(id(rotation.before)), places.get(id(rotation.after))
        if rotation.problem is not None or before is None or after is None:
            continue
        one = _segment(before, after, Series(rotation.time, rotation.rate, ""))
        out += [] if one is None else [one]
    return out


def _segment(before: int, after: int, part: Series) -> Segment | None:
    """A motion with samples that does not last too long."""
    later = strictly_later(part.time)
    time, rate = part.time[later], part.values[later]
    if (
        len(time) <= MIN_SAMPLES
        or time[-1] - time[0] > MAX_SEGMENT_SECONDS
        or not np.isfinite(rate).all()
    ):
        return None
    return Segment(before, after, time, rate)


def passages(
    turns: Sequence[Segment], gyroscope: SensorFit, series: Series, magnetometer: SensorFit
) -> list[Passage]:
    """The turns with attitude and field, for the comparison of the clocks."""
    out = []
    for turn in turns:
        samples = rotation_samples([turn.time], [turn.rate])
        rate = (samples.reading - gyroscope.bias) @ gyroscope.matrix.T
        phi = samples.rotation_vectors(rate)
        whole = samples.at_samples(*Attitudes(quaternions(phi), samples.step_offsets).each)
        if np.abs(phi).sum() < SMALLEST_ROTATION:
            continue
        # with some of the holds on either side, so that no offset of the clocks runs out of it
        near = series.between(float(turn.time[0]) - 1.0, float(turn.time[-1]) + 1.0)
        field = (near.values - magnetometer.bias) @ magnetometer.matrix.T
        if len(near) < MIN_SAMPLES:
            continue
        field /= np.linalg.norm(field, axis=1)[:, None]
        attitude = np.moveaxis(matrices(whole), -1, 0)
        out.append(Passage(turn.time, attitude, rate, near.time, field))
    return out


def up_of(fit: SensorFit, holds: list[Hold]) -> FloatArray:
    """Unit up in the body frame in each hold, shape (n, 3)."""
    force = np.array([hold.accelerometer for hold in holds]).reshape(-1, 3)
    return up_in(fit, force)


def with_gyroscope(
    report: FitReport,
    stage: SecondStage,
    turns: Sequence[Segment],
    calm: Series,
    found: MagnetometerFit,
    aligned: SensorFit,
) -> tuple[SecondStage, SensorFit]:
    """Clock offset, and the gyroscope by both references.

    Args:
        report: of each sensor by itself.
        stage: what is known so far.
        turns: the gyroscope between the holds of the report.
        calm: all the magnetometer's undisturbed readings.
        found: its calibration in its own frame.
        aligned: the magnetometer in the accelerometer's frame.

    Returns:
        The stage with clock and gain, and the better of both fits; a method that was asked for is
        kept.
    """
    fit_before = report.sensors["gyroscope"]
    clock = clock_offset(passages(turns, fit_before, calm, aligned))
    stage = replace(stage, clock=clock)
    offset = 0.0 if clock is None else clock.seconds
    places, readings, counts = field_at(report.holds, calm, found, offset)
    field = (readings - aligned.bias) @ aligned.matrix.T
    known = dict(zip(places, unit_vectors(field), strict=True))
    # of a component of the unit vector, by the noise of the samples
    doubts = dict(zip(places, (found.noise / found.magnitude) ** 2 / counts, strict=True))
    holds = report.holds
    by_force = report.sensors["accelerometer"]
    during = []
    for index in sorted(set(range(len(holds))) - known.keys()):
        part = calm.between(holds[index].start + offset, holds[index].end + offset)
        series = replace(part, values=(part.values - aligned.bias) @ aligned.matrix.T)
        fits = by_force, fit_before
        during.append(turned_in_hold(index, holds[index], series, fits, found.noise))
    stage = replace(stage, changes=tuple(one for one in during if one is not None))
    faulty = {(one.before.start, one.after.start) for one in report.rotations if one.problem}
    turns = [
        turn
        for turn in turns
        if turn.before in known
        and turn.after in known
        and (holds[turn.before].start, holds[turn.after].start) not in faulty
    ]
    if len(turns) < MIN_SEGMENTS:
        some = f"{plural(len(turns), 'rotation')} with the field known at both ends"
        note = f"too few to close the gyroscope by both references: {some}"
        return replace(stage, notes=(*stage.notes, note)), fit_before
    try:
        if fit_before.experiment is None:
            raise DataError("the gyroscope has no rotations to close by both references")
        known_fit = cast("GyroscopeExperiment", fit_before.experiment)
        rotations = _with_unseen(known_fit.rotations, turns, len(report.rotations))
        moved = _field_moved(stage, found, readings, unit_vectors(field))
        of_field = np.zeros((len(holds), *moved.shape[1:]))
        of_field[places] = moved
        source, better, changes = _without_changes(
            known_fit,
            rotations,
            turns,
            lambda some: _heading_rows(known_fit, rotations, some, known, doubts, of_field),
        )
    except DataError as error:
        return replace(stage, notes=(*stage.notes, str(error))), fit_before
    added = _added(source, fit_before, better)
    every = sorted((*stage.changes, *changes), key=lambda one: one.before + one.after)
    stage = replace(stage, added=added, changes=tuple(every))
    note = _why_gravity_alone(fit_before, better, added, found)
    return (replace(stage, notes=(*stage.notes, note)), fit_before) if note else (stage, better)


def _without_changes(
    known: GyroscopeExperiment,
    rotations: RotationSet,
    turns: Sequence[Segment],
    rows_of: Callable[[Sequence[Segment]], FieldClosure],
) -> tuple[FieldClosure, SensorFit, tuple[FieldChange, ...]]:
    """The fit to both references without the headings between which the field turned.

    Args:
        known: the fit to gravity.
        rotations: all of them.
        turns: those with the field known at both ends.
        rows_of: the rows of some of these.

    Returns:
        The rows that were used, the fit, and where the field turned.
    """
    every, none = rows_of(turns), Terms("gyroscope", ())
    turned = np.zeros(len(turns), bool)
    while True:
        some = [turn for turn, out in zip(turns, turned, strict=True) if not out]
        source = rows_of(some) if turned.any() else every
        both = known.with_rows(rotations, [source], tuple(range(12)))
        free = determined_entries(minimum(both), both.nominal, tuple(range(12)))
        better = fit(known.with_rows(rotations, [source], free))
        rows = every.at(Parameters(better.matrix, better.bias), none)
        found, sigma = where_field_turned(every, rows)
        far = np.where(found & ~turned, np.abs(rows.residual) / sigma, 0.0)
        # a large one pulls the fit, and others seem far off until it is left out
        found = far > 0.5 * far.max()
        if not found.any() or (~turned & ~found).sum() < MIN_SEGMENTS:
            break
        turned |= found
    angles = field_angles(every, rows)
    changes = [
        FieldChange(turn.before, turn.after, angle, error)
        for turn, out, angle, error in zip(turns, turned, angles, sigma, strict=True)
        if out
    ]
    return source, better, tuple(changes)


def _why_gravity_alone(
    alone: SensorFit, both: SensorFit, added: Added, found: MagnetometerFit
) -> str:
    """Why the gyroscope's fit to gravity alone is kept; "" where that to both references is.

    Args:
        alone: the fit to gravity.
        both: the fit to gravity and field.
        added: what the field adds.
        found: the magnetometer in its own frame.
    """
    if both.degrees_of_freedom < 1:
        return "the rotations leave no residual by which to judge a fit to both references"
    if not added.better:
        return (
            "the gyroscope's fit to gravity alone predicts rotations left out better than the fit "
            "to both references, so it is kept"
        )
    if alone.method != DEFAULTS["gyroscope"]:
        return f"the gyroscope stays with the method that was asked for: {alone.method}"
    more = (both.fitted_entries & ~alone.fitted_entries).any()
    useless = not more and added.standard_errors is not None and added.standard_errors >= 1.0
    # errors of the field that are not noise would count as errors of the gyroscope
    if useless and not within_noise(found.fit):
        return (
            "the magnetometer's model leaves more than noise, and headings make no gain of the "
            "gyroscope more certain: it is fitted to gravity alone"
        )
    return ""


def within_noise(fit: SensorFit) -> bool:
    """Whether measured noise makes what a fit leaves, where it can be judged."""
    return fit.rows is None or lack_without(fit.rows, np.zeros(0, np.intp)).within_noise


def _field_moved(
    stage: SecondStage, found: MagnetometerFit, readings: FloatArray, field: FloatArray
) -> FloatArray:
    """Change of the unit field with each error mode of the magnetometer and of its alignment.

    Args:
        stage: alignment and error modes.
        found: the magnetometer in its own frame.
        readings: of it, in n holds, shape (n, 3).
        field: unit field there in the accelerometer's frame, shape (n, 3).

    Returns:
        Modes of the calibration, which move the alignment, too, then those of the alignment by the
        errors of the dip, shape (n, 3, k + 3).
    """
    alignment = stage.alignment
    own = (readings - found.fit.bias) @ found.fit.matrix.T
    modes = stage.modes.of_field(found.fit, own)
    shifts = np.column_stack(
        [alignment.shifts[:, : modes.shape[2]], principal_steps(alignment.own)]
    )
    turned = np.cross(shifts.T, field[:, None], axisc=1)
    turned[:, :, : modes.shape[2]] += np.einsum("ij,njk->nik", alignment.rotation, modes)
    return np.asarray(turned)


def _with_unseen(rotations: RotationSet, turns: Sequence[Segment], count: int) -> RotationSet:
    """All rotations: those about the vertical, too, whose tilt gravity closes as that of others.

    Args:
        rotations: those of the fit by gravity.
        turns: the gyroscope between holds.
        count: how many rotations the recording has; the others are numbered from there on.
    """
    known = set(zip(rotations.before.tolist(), rotations.after.tolist(), strict=True))
    unseen = [turn for turn in turns if (turn.before, turn.after) not in known]
    ends = [(turn.before, turn.after) for turn in unseen]
    times, rates = [turn.time for turn in unseen], [turn.rate for turn in unseen]
    return rotations.joined(count, ends, times, rates)


def _heading_rows(
    known: GyroscopeExperiment,
    rotations: RotationSet,
    turns: Sequence[Segment],
    field: dict[int, FloatArray],
    doubts: dict[int, float],
    of_field: FloatArray,
) -> FieldClosure:
    """Rows for all rotations at whose ends the field is known."""
    before, after = (
        np.array(side) for side in zip(*((t.before, t.after) for t in turns), strict=True)
    )
    count, reference, readings = len(turns), known.of, known.readings
    around = circumstances_of(
        known.holds,
        reference.up,
        reference.gravity,
        reference.gain,
        readings,
    )
    start = known.begin(BASE)
    rest = rest_of(known.holds, start.matrix, start.bias, reference)
    turned = RotationSet(
        rotation_samples([turn.time for turn in turns], [turn.rate for turn in turns]),
        np.arange(count),
        before,
        after,
        None,
        np.zeros(3),
        rotations.step,
    )
    samples, _, happened = turned.between_means(known.holds, rest.carried)
    origin = first_time(known.holds, readings)
    labels = _labels(rotations, turns, origin)
    lost = known.lost.with_more(len(rotations.usable) - len(known.rotations.usable))
    per_second = rest.per_second.mean() + (lost.aliased + lost.white)[labels.group]
    walk = per_second * np.diff(labels.span)[:, 0]
    rounded = turned.rounding_in_motion(known.holds).variance
    rounded = (rounded @ (start.matrix**2).T).mean(axis=1)
    missing = (turned.across_gaps @ (start.matrix**2).T).max(axis=1)
    noise = rest.end[before] + rest.end[after] + walk + rounded + missing
    noise = np.maximum(noise, MIN_CLOSING_NOISE**2)
    by_gravity = GravityClosure(
        samples=samples,
        before=reference.up[before],
        after=reference.up[after],
        before_doubt=np.zeros((count, 3, 0)),
        after_doubt=np.zeros((count, 3, 0)),
        noise=noise,
        motion=motion_of(around, before, samples, happened - origin, start, readings, origin),
        gravity=reference.gravity,
        labels=labels,
    )
    by_field = replace(
        by_gravity,
        before=np.array([field[hold] for hold in before]),
        after=np.array([field[hold] for hold in after]),
    )
    aligned, up = list(field), reference.up
    turns_field = np.zeros((3, *up.shape))
    turns_field[:, aligned] = leaning(up[aligned], np.array(list(field.values())))
    ends = np.column_stack([before, after])
    found = FieldClosure(by_gravity, by_field, ends, noise, labels, turns_field, of_field)
    found = found.doubting(reference.doubt, reference.undetermined, reference.decided)
    by_magnetometer = np.array([doubts[i] + doubts[j] for i, j in found.holds])
    return replace(found, noise=noise + by_magnetometer / found.level)


def _labels(rotations: RotationSet, turns: Sequence[Segment], origin: float) -> RowLabels:
    """Labels of one row for each turn, in the group of its closure against gravity.

    Both closures of a rotation are left out together.

    Args:
        rotations: those of the fit by gravity, all turns among them.
        turns: the gyroscope between holds.
        origin: time that the times are counted from, s.
    """
    pairs = zip(rotations.before.tolist(), rotations.after.tolist(), strict=True)
    places = {pair: place for place, pair in enumerate(pairs)}
    group = np.array([places[turn.before, turn.after] for turn in turns])
    span = np.array([[turn.time[0], turn.time[-1]] for turn in turns])
    count = len(turns)
    return RowLabels(
        index=rotations.usable[group],
        axis=np.full(count, -1),
        group=group,
        visit=np.full(count, -1),
        time=span.mean(axis=1) - origin,
        span=span,
        component=np.zeros(count, np.int64),
    )


def _added(source: FieldClosure, fit: SensorFit, better: SensorFit) -> Added:
    """What the headings add, each rotation left out; the tilts are those of the same rotations."""
    none = Terms("gyroscope", ())
    at_first = source.at(Parameters(fit.matrix, fit.bias), none)
    first = np.linalg.norm(at_first.by_gravity.closure, axis=1)
    numbered = zip(source.labels.index.tolist(), first.tolist(), strict=True)
    tilt_before: dict[int, float] = dict(numbered)
    tilt_after = _tilts(better)
    if fit.method == DEFAULTS["gyroscope"]:
        tilt_before = _tilts(fit)
    both = [index for index in tilt_before if index in tilt_after]
    tilts = [
        root_mean_square(np.array([one[index] for index in both]))
        for one in (tilt_before, tilt_after)
    ]
    ratio = None
    if fit.covariance is not None and better.covariance is not None:
        before, after = np.diag(fit.covariance)[:9], np.diag(better.covariance)[:9]
        seen = fit.fitted_entries[:9]
        ratio = float(np.sqrt(after[seen] / before[seen]).mean()) if seen.any() else None
    table = better.rows
    assert table is not None  # noqa: S101 (narrows the type)
    out = table.reported if table.held_out is None else table.held_out
    return Added(
        len(at_first.residual),
        tilts[0],
        tilts[1],
        root_mean_square(at_first.residual),
        root_mean_square(out[table.kind == "heading"]),
        ratio,
    )


def _tilts(fit: SensorFit) -> dict[int, float]:
    """Closure against gravity of each rotation, left out if the others determine the model, rad."""
    table = fit.rows
    assert table is not None  # noqa: S101 (narrows the type)
    out = table.reported if table.held_out is None else table.held_out
    closing = table.judged & table.moving
    squares = np.bincount(table.index[closing], out[closing] ** 2)
    return {index: float(np.sqrt(squares[index])) for index in set(table.index[closing].tolist())}
