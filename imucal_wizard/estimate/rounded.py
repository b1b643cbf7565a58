"""What the steps of the readings do to the averages of holds."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.quantities import quantity
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import median
from imucal_wizard.measurement.holds import Collected, Hold, Rotation
from imucal_wizard.measurement.rounding import (
    resolution_of,
    rounding_variance,
    variance_before_rounding,
)

Steps = tuple[FloatArray, FloatArray | None]
"""Smallest step of each accelerometer and gyroscope axis."""


def steps_in(collected: Collected) -> Steps:
    """The steps of the readings where only those of the rotations were kept, if any.

    Without rotations the smallest ones that were ever seen, which one odd sample may make smaller.
    """
    rotations = collected.rotations
    if not rotations and collected.steps is not None:
        return collected.steps
    forces = [one.accelerometer for one in rotations if one.accelerometer is not None]
    rates = [one.rate for one in rotations]
    return (
        resolution_of(np.concatenate(forces)) if forces else np.zeros(3),
        resolution_of(np.concatenate(rates)) if rates else None,
    )


def with_rounding(holds: Sequence[Hold], steps: Steps) -> list[Hold]:
    """The holds with what rounding does to their accelerations added to the covariance of these.

    How far noise carries readings from one step to the next is taken from all holds together. The
    gyroscope reads its bias in all of them, which rounding shifts everywhere alike: see
    ``rate_shift``.
    """
    averages = [(hold.accelerometer_covariance, hold.samples) for hold in holds]
    shift = _shift(averages, steps[0])
    return [
        replace(
            hold,
            accelerometer_covariance=hold.accelerometer_covariance + np.diag(shift),
            accelerometer_scatter=None
            if hold.accelerometer_scatter is None
            else hold.accelerometer_scatter + shift,
        )
        for hold in holds
    ]


def rate_shift(holds: Sequence[Hold], rotations: Sequence[Rotation]) -> FloatArray:
    """Variance, shape (3,), by which rounding shifts the mean rate of all holds together.

    Args:
        holds: still periods.
        rotations: those of which the readings' steps are taken; at least one.
    """
    known = [(hold.gyroscope_covariance, hold.samples) for hold in holds]
    step = resolution_of(np.concatenate([rotation.rate for rotation in rotations]))
    return _shift([(covariance, n) for covariance, n in known if covariance is not None], step)


def rounding_warnings(plain: Sequence[Hold], steps: Steps, units: dict[str, str]) -> list[str]:
    """A warning for each sensor whose steps, and not its noise, decide what an average is worth.

    Args:
        plain: the holds without what rounding does to them.
        steps: of the readings.
        units: unit of the readings by sensor.
    """
    notes = []
    step_a, step_g = steps
    rates = [(h.gyroscope_covariance, h.samples) for h in plain]
    for sensor, step, averages in (
        ("accelerometer", step_a, [(h.accelerometer_covariance, h.samples) for h in plain]),
        ("gyroscope", step_g, [(c, n) for c, n in rates if c is not None]),
    ):
        if step is None or sensor not in units or not averages:
            continue
        shift = float(np.sqrt(_shift(averages, step).mean()))
        noise = float(np.sqrt(median([np.trace(covariance) / 3.0 for covariance, _ in averages])))
        if shift > noise:
            width, error = (quantity(v, units[sensor], 2) for v in (float(step.max()), shift))
            notes.append(
                f"the {sensor}'s readings come in steps of {width}, larger than their noise: "
                f"averages err by {error} however long the device is held still. Print more "
                "digits, or set a smaller range"
            )
    return notes


def _shift(averages: Sequence[tuple[FloatArray, int]], step: FloatArray) -> FloatArray:
    """Variance by rounding of each axis, shape (3,), from covariances of averages of n samples.

    Each axis is between other steps in each hold, so their mean variance gives the noise; the
    liveliest tenth may have been disturbed.
    """
    single = [np.diag(covariance) * samples for covariance, samples in averages]
    finite = np.sort([variance for variance in single if np.isfinite(variance).all()], axis=0)
    if not len(finite):
        return np.zeros(3)
    kept = finite[: max(len(finite) - len(finite) // 10, 1)]
    return rounding_variance(variance_before_rounding(kept.mean(axis=0), step), step)
