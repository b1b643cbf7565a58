"""Gathers what is known of a magnetometer from its readings, the holds and the accelerometer."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.ellipsoid.robust import spread
from imucal_wizard.errors import DataError
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray, Readings, Series
from imucal_wizard.solver.accelerometer import AccelerometerFit
from imucal_wizard.solver.extended.field_around import around, flows, recorded
from imucal_wizard.solver.extended.field_data import SMALLEST_NOISE, Dips, FieldData, within
from imucal_wizard.solver.extended.field_dips import middle_of, still_poses
from imucal_wizard.solver.extended.field_groups import cut, noise_of, visits_of
from imucal_wizard.solver.magnetometer.disturbances import LeftOut
from imucal_wizard.solver.magnetometer.repeats import measured
from imucal_wizard.solver.magnetometer.report import MagnetometerFit
from imucal_wizard.solver.second_stage.found import SecondStage
from imucal_wizard.units import COUNT, STANDARD_GRAVITY

ASSUMED = 50.0
"""Field in µT on which the sizes rest where readings are in counts and nothing tells it."""
SPIKE = 8.0
"""Robust standard deviations of a sample from the mean of its neighbours that no motion makes."""
PASSING = 15.0
"""Seconds: what the plain fit has left out for longer is the room or the sensor, and is judged."""
FEWEST = 4
"""Samples from which there is anything to look at."""


def field_data(
    found: MagnetometerFit,
    readings: Readings,
    holds: Sequence[Hold] = (),
    accelerometer: AccelerometerFit | None = None,
    gravity: float = STANDARD_GRAVITY,
    second_stage: SecondStage | None = None,
) -> FieldData:
    """All that is known of a magnetometer.

    Args:
        found: its plain fit, to start from.
        readings: the recording.
        holds: those that the accelerometer was fitted to.
        accelerometer: its fit where it is complete; without it the dip is not looked at.
        gravity: m/s².
        second_stage: what it found, of the clocks and of the rotation between the sensors.

    Raises:
        DataError: the recording has no magnetometer, or too few samples are left.
    """
    if readings.magnetometer is None or len(readings.magnetometer) < FEWEST:
        raise DataError("there is no magnetometer in these readings")
    series = measured(readings.magnetometer)
    field = ASSUMED if found.fit.unit == COUNT else found.magnitude
    start = found.fit.matrix * (field / found.magnitude), found.fit.bias
    series = _kept(series, start, () if flows(readings.current) else found.left_out)
    series = _on_one_clock(series, second_stage)
    corrected = (series.values - start[1]) @ start[0].T
    beside = recorded(series.time, readings, holds)
    pieces = cut(series.time, series.values, corrected, beside)
    magnetic = (pieces.reading - start[1]) @ start[0].T
    noise = noise_of(pieces, np.linalg.norm(magnetic, axis=1))
    samples = around(pieces.time, magnetic, pieces.beside, readings, gravity)
    aligned = None if second_stage is None else second_stage.alignment.rotation
    dips = still_poses(series, start, holds, accelerometer, noise, field, aligned)
    still = _still(series, dips, start, holds, readings, samples)
    return FieldData(
        unit=series.unit,
        field=field,
        assumed=found.fit.unit == COUNT,
        pieces=pieces,
        samples=samples,
        noise=np.maximum(noise / pieces.samples, (SMALLEST_NOISE * field) ** 2),
        visits=visits_of(pieces),
        dips=dips,
        circumstances=within(samples, pieces).joined(still),
        start=start,
        carried=found.fit.model,
        gravity=gravity,
    )


def _on_one_clock(series: Series, second_stage: SecondStage | None) -> Series:
    """The readings at times by the accelerometer's clock, by which holds and the rest are told."""
    if second_stage is None or second_stage.clock is None:
        return series
    return Series(series.time - second_stage.clock.seconds, series.values, series.unit)


def _kept(
    series: Series, start: tuple[FloatArray, FloatArray], left_out: Sequence[LeftOut]
) -> Series:
    """The samples without spikes and without what passed by for a moment."""
    size = np.linalg.norm((series.values - start[1]) @ start[0].T, axis=1)
    beside = 0.5 * (np.roll(size, 1) + np.roll(size, -1))
    off = np.abs(size - beside)
    off[[0, -1]] = 0.0
    good = off <= SPIKE * max(spread(off), 1e-9 * float(size.mean()))
    for run in left_out:
        if not run.single and run.end - run.start <= PASSING:
            good &= (series.time < run.start) | (series.time > run.end)
    return Series(series.time[good], series.values[good], series.unit)


def _still(
    series: Series,
    dips: Dips,
    start: tuple[FloatArray, FloatArray],
    holds: Sequence[Hold],
    readings: Readings,
    samples: Circumstances,
) -> Circumstances:
    """Circumstances of the still poses, told from the references of the samples."""
    times, means = np.zeros(len(dips)), np.zeros((len(dips), 2))
    for place, row in enumerate(dips.hold):
        time = middle_of(series, holds[row]).time
        times[place], means[place] = time.mean(), recorded(time, readings, holds).mean(axis=0)
    magnetic = (dips.reading - start[1]) @ start[0].T
    own = around(times, magnetic, means, readings, samples.gravity)
    return replace(
        own,
        force=samples.gravity * dips.up,
        reference_temperature=samples.reference_temperature,
        reference_time=samples.reference_time,
    )
