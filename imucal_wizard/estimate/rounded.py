"""The effect of the resolution of the readings on the averages of holds."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.notices import Notice, NoticeKind
from imucal_wizard.core.quantities import quantity
from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.core.statistics import median
from imucal_wizard.measurement.data_quality import finer_steps
from imucal_wizard.measurement.holds import Collected, Hold, Rotation
from imucal_wizard.measurement.rounding import (
    NO_ROUNDING,
    in_steps,
    noise_at_one_place,
    resolution_of,
    rounding_step,
    rounding_variance,
    shift_at_places,
    variance_before_rounding,
)

FEW_SAMPLES = 4
"""Added to a count of samples so that its square root covers small counts, too: the rule of Agresti
and Coull (1998) for a share."""

Steps = tuple[FloatArray, FloatArray | None]
"""Smallest step of each accelerometer and gyroscope axis."""


def resolution_in(collected: Collected) -> Steps:
    """The resolution of the readings where only those of the rotations were kept, if any.

    Without rotations the smallest steps that were ever seen, which one odd sample may make smaller.
    """
    rotations = collected.rotations
    if not rotations and collected.steps is not None:
        return collected.steps
    forces = _forces_of(rotations)
    return (
        resolution_of(np.concatenate(forces)) if forces else np.zeros(3),
        rate_step(rotations) if rotations else None,
    )


def steps_in(collected: Collected, resolution: Steps, readings: Readings | None = None) -> Steps:
    """The steps of the readings, 0 on axes of the accelerometer where they have none.

    Args:
        collected: what was measured.
        resolution: of its readings.
        readings: all samples, where they are at hand and no rotation has kept any.
    """
    forces = _forces_of(collected.rotations)
    if not forces and readings is not None and len(readings):
        forces = [readings.accelerometer.values]
    return (rounding_step(np.concatenate(forces)) if forces else resolution[0]), resolution[1]


def _forces_of(rotations: Sequence[Rotation]) -> list[FloatArray]:
    return [one.accelerometer for one in rotations if one.accelerometer is not None]


def with_rounding(holds: Sequence[Hold], steps: Steps) -> list[Hold]:
    """The holds with what rounding does to their accelerations added to the covariance of these.

    The gyroscope reads its bias in all of them, which rounding shifts everywhere alike: see
    ``rate_shift``.
    """
    return [
        replace(
            hold,
            accelerometer_covariance=hold.accelerometer_covariance + np.diag(shift),
            accelerometer_scatter=None
            if hold.accelerometer_scatter is None
            else hold.accelerometer_scatter + shift,
        )
        for hold, shift in zip(holds, shift_of_means(holds, steps[0]), strict=True)
    ]


def shift_of_means(holds: Sequence[Hold], step: FloatArray) -> FloatArray:
    """Variance by rounding of each axis of the accelerometer's mean, shape (h, 3).

    How far noise carries readings from one step to the next is taken from the samples of all holds:
    the covariances of means have few degrees of freedom.
    """
    out = np.zeros((len(holds), 3))
    scatters = [one.accelerometer_scatter for one in holds]
    samples = np.array([one.samples for one in holds])
    known = np.array([one is not None and bool(np.isfinite(one).all()) for one in scatters], bool)
    if not known.all():
        averages = [(one.accelerometer_covariance, one.samples) for one in holds]
        out += rounding_variance(variance_before_rounding(_single_samples(averages), step), step)
    single = np.array([s for s, k in zip(scatters, known, strict=True) if k]).reshape(-1, 3)
    for axis in np.flatnonzero(step > 0.0):
        variance = single[:, axis] * samples[known]
        out[known, axis] = shift_at_places(variance, float(step[axis]), samples[known])
    return out


def rate_shift(holds: Sequence[Hold], step: FloatArray) -> FloatArray:
    """Variance, shape (3,), by which rounding shifts the mean rate of all holds together.

    Args:
        holds: still periods.
        step: of the readings, shape (3,).
    """
    return noise_at_one_place(_rates_at_rest(holds), step)[1]


def rate_place(holds: Sequence[Hold], step: FloatArray) -> FloatArray:
    """The same if the rests could lie at any place between two steps."""
    return rounding_variance(noise_at_one_place(_rates_at_rest(holds), step)[0], step)


def rate_step(rotations: Sequence[Rotation]) -> FloatArray:
    """The step of a gyroscope's readings on each axis in rotations, at least one, shape (3,).

    0 where they have none: the least change of smooth readings is not one.
    """
    rates = np.concatenate([rotation.rate for rotation in rotations])
    step = resolution_of(rates)
    return step if in_steps(rates, step) else np.zeros_like(step)


def noise_of_coarse_means(holds: Sequence[Hold], step: FloatArray) -> FloatArray:
    """Variance of each mean rate whose readings stand on a step most of the time, shape (h, 3).

    Mean and scatter of such readings depend on one another: both count the samples on the next
    step. The scatter of all holds together gives the noise, with ``FEW_SAMPLES`` more, since a
    small count is not normal. Rounding shifts each mean, too: inside a step the reading shows
    nothing of what the rates differ by from hold to hold, and at the edge of one several times as
    much. NaN on an axis whose noise carries the readings over the steps.

    Args:
        holds: those with a mean rate.
        step: of the readings, shape (3,).
    """
    known = _rates(holds)
    if not known:
        return np.full((len(holds), 3), np.nan)
    single = np.mean([covariance.diagonal() * samples for covariance, samples in known], axis=0)
    shift = rate_place(holds, step)
    count = np.array([hold.samples for hold in holds])[:, None]
    out = single / count + FEW_SAMPLES * (step / count) ** 2 + shift
    return np.where(shift > single / median(count[:, 0]), out, np.nan)


def rounding_warnings(plain: Sequence[Hold], steps: Steps, units: dict[str, str]) -> list[Notice]:
    """A warning for each sensor whose steps, and not its noise, decide what an average is worth.

    Args:
        plain: the holds without what rounding does to them.
        steps: of the readings.
        units: unit of the readings by sensor.
    """
    notes = []
    step_a, step_g = steps
    for sensor, step, shift_of, averages in (
        (
            "accelerometer",
            step_a,
            shift_of_means,
            [(h.accelerometer_covariance, h.samples) for h in plain],
        ),
        ("gyroscope", step_g, rate_place, _rates(plain)),
    ):
        if step is None or sensor not in units or not averages:
            continue
        shift = float(np.sqrt(shift_of(plain, step).mean()))
        noise = float(np.sqrt(median([np.trace(covariance) / 3.0 for covariance, _ in averages])))
        if shift > noise:
            width, error = (quantity(v, units[sensor], 2) for v in (float(step.max()), shift))
            advice = finer_steps(float(step.max()), units[sensor])
            text = (
                f"the {sensor}'s readings come in steps of {width}, larger than their noise: "
                f"averages err by about {error}, however long the device is held still. {advice}"
            )
            notes.append(Notice(text, NoticeKind.STEPS_OF_HOLDS, sensor))
    return notes


def unseen_rounding(holds: Sequence[Hold], step: FloatArray) -> FloatArray:
    """Variance by rounding of a rate that moves fast, beyond what samples at rest show, shape (3,).

    Rounding adds q²/12 to moving readings. At rest it adds as much where noise carries the readings
    over the steps q, nothing where they stand still, and more where they change between two steps.

    Args:
        holds: still periods.
        step: of the readings, shape (3,).
    """
    rounded = _rates_at_rest(holds)
    carried = rounded > NO_ROUNDING * step**2
    rounded = np.where(carried, 0.0, rounded)
    unseen = step**2 / 12.0 - (rounded - noise_at_one_place(rounded, step)[0])
    return np.where(carried, 0.0, unseen)


def _rates_at_rest(holds: Sequence[Hold]) -> FloatArray:
    """Variance of single rates on each axis, by the samples themselves if it is known, (3,)."""
    scatters = [(one.gyroscope_scatter, one.samples) for one in holds]
    known = [(np.diag(scatter), samples) for scatter, samples in scatters if scatter is not None]
    return _single_samples(known or _rates(holds))


def _rates(holds: Sequence[Hold]) -> list[tuple[FloatArray, int]]:
    """Covariance of each mean rate, and how many samples it is the mean of."""
    known = [(hold.gyroscope_covariance, hold.samples) for hold in holds]
    return [(covariance, samples) for covariance, samples in known if covariance is not None]


def _single_samples(averages: Sequence[tuple[FloatArray, int]]) -> FloatArray:
    """Variance of single samples on each axis, shape (3,), from covariances of averages of n.

    Each axis is between other steps in each hold, so their mean variance gives the noise; the
    liveliest tenth may have been disturbed. Infinite without any average.
    """
    single = [covariance.diagonal() * samples for covariance, samples in averages]
    finite = np.sort([variance for variance in single if np.isfinite(variance).all()], axis=0)
    if not len(finite):
        return np.full(3, np.inf)
    return np.asarray(finite[: max(len(finite) - len(finite) // 10, 1)].mean(axis=0))
