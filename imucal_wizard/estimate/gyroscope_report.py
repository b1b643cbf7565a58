"""The gyroscope of a recording: the fit by gravity, and Q's single-axis approaches beside it."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from imucal_wizard.core.attitude import strictly_later
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.notices import Notice, NoticeKind, not_calibrated
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quantities import quantity
from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import lengths, median, median_of_rows
from imucal_wizard.estimate.fit import report
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.gyroscope_fit import (
    check_same_motions,
    gyroscope_minimum,
    misses_rotations,
    without_lost_samples,
)
from imucal_wizard.estimate.method_data import AxisTurns, GyroscopeData
from imucal_wizard.estimate.methods import DEFAULTS, method_of
from imucal_wizard.estimate.methods.single_axis import (
    AxisTurn,
    dynamic_approach,
    static_approach,
)
from imucal_wizard.estimate.noise import rate_noise
from imucal_wizard.estimate.outliers import Outlier
from imucal_wizard.estimate.rest_spectrum import RestSpectrum
from imucal_wizard.estimate.result import AxisComparison, SensorFit
from imucal_wizard.estimate.rotation_set import examined
from imucal_wizard.estimate.rounded import rate_shift, rate_step
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.measurement.rotation_angle import integrated_rate, rotation_between

ONE_AXIS_SHARE = 0.9
"""Share of all turning that is about one body axis, for Q's single-axis methods."""
LEVEL = 0.35
"""Largest component of up along that axis (20° off level): gravity must see the rotation."""
SILENT_RATIO = 2.0
"""Spread of an axis in motion over its noise at rest up to which it says nothing of the motion."""
SILENT_SHARE = 1e-4
"""The same over the spread of the liveliest axis: 0.02 °/s of 200."""
SMALLEST_ROTATION = np.radians(5.0)
"""A motion that turns less than this is a disturbed hold, not a rotation."""


@dataclass(frozen=True, eq=False)
class GyroscopeReport:
    """What became of the gyroscope.

    Attributes:
        fit: the result, or None when it cannot be fitted; its residuals are those of the rotations
            without a problem, in order.
        rotations: all rotations, with axis and problem filled in.
        angles: angle turned in each, rad; None where it is not known.
        comparison: static, dynamic and vector results per axis.
        warnings: why something is missing.
        outlier: the rotation that does not fit with all others (index into ``rotations``), if any.
    """

    fit: SensorFit | None
    rotations: tuple[Rotation, ...]
    angles: tuple[float | None, ...] = ()
    comparison: tuple[AxisComparison, ...] = ()
    warnings: tuple[str, ...] = ()
    outlier: Outlier | None = None


def fit_gyroscope(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    accelerometer: SensorFit,
    unit: str,
    method: str = DEFAULTS["gyroscope"],
    readings: Readings | None = None,
    spectrum: RestSpectrum | None = None,
) -> GyroscopeReport:
    """Fit the gyroscope with gravity, as the accelerometer saw it, as the reference.

    Args:
        holds: those that the accelerometer was fitted to.
        rotations: between them.
        accelerometer: its fit.
        unit: of the gyroscope's readings.
        method: the default, or a published one; ``offset`` looks at the holds alone.
        readings: what the holds were found in, for the effects that are fitted to them later.
        spectrum: of the gyroscope's readings in the holds, where it is known.

    Raises:
        DataError: the method needs what these data do not have.
        UsageError: no method of that name.
    """
    rotations, reference = examined(rotations), accelerometer.reference
    if reference is None:
        raise DataError("there is no fitted accelerometer to go on from")
    args = holds, rotations, accelerometer, unit, readings, None, spectrum
    if method == "offset":  # needs no rotation, so nothing below may refuse it
        turned = [rotation for rotation in rotations if rotation.problem is None]
        rounding = rate_shift(holds, rate_step(turned)) if turned else 0.0
        data = GyroscopeData(tuple(holds), reference.labels, unit, rounding)
        offset = method_of("gyroscope", method).run(data)
        with suppress(DataError):
            offset = replace(offset, experiment=gyroscope_minimum(*args).experiment)
        return replace(_none(rotations, ""), fit=offset, warnings=offset.warnings)

    # all gains by the closures, whatever the method: the others begin with or stand beside them
    silent: tuple[str, ...] = ()
    try:
        silent = silent_axes(holds, rotations)
        fitted = gyroscope_minimum(*args)
        fitted, rotations = without_lost_samples(
            fitted,
            rotations,
            lambda some: gyroscope_minimum(holds, some, *args[2:]),
        )
        if silent and misses_rotations(fitted):
            raise DataError(
                "one axis reads the same in motion as at rest, and rotations do not close without "
                "it, so that they cannot calibrate the other axes. Repair the sensor, or correct "
                "its columns, and measure again"
            )
        if not silent:
            check_same_motions(fitted)
        experiment, found = fitted.experiment, report(fitted)
    except DataError as error:
        return _none(rotations, str(error), silent)
    usable = experiment.rotations.usable
    if found.outlier is not None:
        odd = replace(found.outlier, index=int(usable[found.outlier.index]))
        found = replace(found, outlier=odd)
    if not silent:  # a motion about a silent axis counts as rest, and as noise of its end
        found = replace(found, warnings=(*found.warnings, *noise_notes(experiment)))

    # the rotations by name, then the published methods about single axes
    named, angles = _named(rotations, found, reference.up, holds)
    single = single_axis(named, experiment, found)
    result = found
    if method != DEFAULTS["gyroscope"]:
        published = method_of("gyroscope", method).run(
            GyroscopeData(
                holds=tuple(holds),
                labels=reference.labels,
                unit=unit,
                full=found,
                axes=single,
                channels=experiment.nominal.channels,
                slow={axis: experiment.shift(own.places) for axis, own in single.items()},
                closure=experiment.closure.closures,
            )
        )
        result = replace(published, experiment=experiment)
    table = comparison(single, experiment, found)
    warnings = (*silent, *result.warnings)
    return GyroscopeReport(result, named, angles, table, warnings, found.outlier)


def noise_notes(experiment: GyroscopeExperiment) -> list[str]:
    """What makes the rotations noisier than the gyroscope, and what to do about it."""
    notes = []
    if experiment.unsteady:
        count = len(experiment.rotations.usable)
        notes.append(
            f"{experiment.unsteady} of {count} rotations begin or end while the device was not "
            "steady: they have less weight, and their closure contains the motion of the hand"
        )
    if experiment.undersampled is not None:
        angle = quantity(experiment.undersampled, "rad")
        notes.append(
            "the device trembles in the hand or is bumped faster than the gyroscope is sampled, "
            "single readings are wrong or noisier in motion, or samples are lost that its times do "
            f"not show, which may leave {angle} in a rotation, more than all other noise: sample "
            "faster or turn more calmly, and put it down gently"
        )
    return notes


def _none(rotations: Sequence[Rotation], why: str, besides: Sequence[str] = ()) -> GyroscopeReport:
    return GyroscopeReport(
        None,
        tuple(rotations),
        (None,) * len(rotations),
        warnings=(*besides, not_calibrated("gyroscope", why)),
    )


def silent_axes(holds: Sequence[Hold], rotations: Sequence[Rotation]) -> tuple[str, ...]:
    """A warning for each axis that says no more in motion than at rest.

    Args:
        holds: still periods, for the noise.
        rotations: those with a problem are left out.
    """
    usable = [rotation for rotation in rotations if rotation.problem is None]
    density = rate_noise(holds)
    if not usable or density is None:
        return ()
    single = [
        (hold.end - hold.start) * hold.gyroscope_scatter
        for hold in holds
        if hold.gyroscope_scatter is not None
    ]
    if single:  # in holds that sway, most of the noise of the means is motion
        density = np.minimum(density, median_of_rows(np.array(single)))
    steps = np.concatenate([np.diff(one.time[strictly_later(one.time)]) for one in usable])
    spread = np.concatenate([one.rate for one in usable]).std(axis=0)
    noise = np.sqrt(density / median(steps))
    still = (spread <= SILENT_RATIO * noise) | (spread <= SILENT_SHARE * spread.max())
    return tuple(
        Notice(
            f"gyroscope axis {axis} reads the same while the device turns as at rest: it is dead, "
            "or nothing turned about it",
            NoticeKind.DEAD,
            "gyroscope",
        )
        for axis, silent in zip(AXES, still, strict=True)
        if silent
    )


def _named(
    rotations: Sequence[Rotation], found: SensorFit, up: FloatArray, holds: Sequence[Hold]
) -> tuple[tuple[Rotation, ...], tuple[float | None, ...]]:
    """Each rotation with the axis it was about, and its angle, rad, where that is known."""
    places = {id(hold): index for index, hold in enumerate(holds)}
    named: list[Rotation] = []
    angles: list[float | None] = []
    for rotation in rotations:
        place = places.get(id(rotation.before))
        total, turned = np.full(3, np.nan), np.nan
        if place is not None and len(rotation.time) >= 2:
            with np.errstate(over="ignore", invalid="ignore"):  # of readings that are no rates
                rate = (rotation.rate - found.bias) @ found.matrix.T
                total = integrated_rate(rotation.time, rate)
                turned = float(integrated_rate(rotation.time, lengths(rate)[:, None])[0])
        if place is None or not np.isfinite([*total, turned]).all():
            named.append(rotation)
            angles.append(None)
            continue
        axis = int(np.argmax(np.abs(total)))
        about = abs(total[axis]) > ONE_AXIS_SHARE * np.linalg.norm(total)
        clear = about and abs(total[axis]) > SMALLEST_ROTATION and abs(up[place, axis]) < LEVEL
        named.append(replace(rotation, axis=AXES[axis] if clear else None))
        angles.append(float(total[axis] if clear else turned))
    return tuple(named), tuple(angles)


def single_axis(
    named: Sequence[Rotation], experiment: GyroscopeExperiment, found: SensorFit
) -> dict[str, AxisTurns]:
    """The rotations about one axis each, as Q's two approaches take them.

    Args:
        named: all rotations, those about one axis named.
        experiment: the usable ones.
        found: the nine-parameter fit, for counting whole turns.
    """
    rows: dict[str, list[tuple[AxisTurn, int]]] = {axis: [] for axis in AXES}
    source, samples = experiment.closure, experiment.samples
    for place, index in enumerate(experiment.rotations.usable):
        rotation = named[index]
        if rotation.axis is None or rotation.before.gyroscope is None:
            continue
        k = AXES.index(rotation.axis)
        channel = experiment.nominal.channels[k]
        # from the direction before to that after, like the angle between them
        own = slice(*samples.offsets[place : place + 2])
        time, reading = samples.time[own], samples.reading[own]
        turned = float(integrated_rate(time, (reading - found.bias) @ found.matrix.T)[k])
        before, after = source.before[place], source.after[place]
        angle = rotation_between(before, after, rotation.axis, turned)
        if angle is None:
            continue
        turn = AxisTurn(
            angle=angle,
            integral=float(integrated_rate(time, reading)[channel]),
            duration=float(time[-1] - time[0]),
            bias=float(rotation.before.gyroscope[channel]),
        )
        rows[rotation.axis].append((turn, place))
    return {
        axis: AxisTurns(tuple(turn for turn, _ in own), tuple(place for _, place in own))
        for axis, own in rows.items()
    }


def comparison(
    single: Mapping[str, AxisTurns], experiment: GyroscopeExperiment, found: SensorFit
) -> tuple[AxisComparison, ...]:
    """The three methods side by side, a row per axis (Q's table III).

    The scale and bias of a body axis are those of the sensor axis that feels it.
    """
    sigma = np.zeros(12) if found.covariance is None else np.sqrt(np.diag(found.covariance))
    rows = []
    for k, axis in enumerate(AXES):
        turns = single[axis]
        static, dynamic = static_approach(turns.turns), dynamic_approach(turns.turns)
        channel = experiment.nominal.channels[k]
        rows.append(
            AxisComparison(
                axis=axis,
                rotations=len(turns),
                static_bias=static.bias if static else None,
                static_scale=static.scale if static else None,
                static_scale_error=static.scale_error if static else None,
                dynamic_bias=dynamic.bias if dynamic else None,
                dynamic_bias_error=dynamic.bias_error if dynamic else None,
                dynamic_scale=dynamic.scale if dynamic else None,
                dynamic_scale_error=dynamic.scale_error if dynamic else None,
                vector_bias=float(found.bias[channel]),
                vector_scale=float(found.matrix[k, channel]),
                vector_scale_error=float(sigma[3 * k + channel]),
            )
        )
    return tuple(rows)
