"""The gyroscope without effects: which entries of M and b the rows determine, and their fit."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import comb

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.notices import Notice, NoticeKind
from imucal_wizard.core.quantities import quantity
from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.core.statistics import median
from imucal_wizard.core.units import COUNT
from imucal_wizard.estimate.accelerometer import BASE
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import Minimum, minimum, residual_table
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment, M
from imucal_wizard.estimate.gyroscope_start import start_matrix
from imucal_wizard.estimate.held_out import items_of
from imucal_wizard.estimate.lack_of_fit import LackOfFit, lack_without
from imucal_wizard.estimate.noise import has_rate
from imucal_wizard.estimate.rest_spectrum import RestSpectrum
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.rotation_set import rotation_set
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.model.effect import GYROSCOPE
from imucal_wizard.model.nominal_gains import (
    Nominal,
    datasheet_precision,
    least_identifiable,
    nominal_of,
)
from imucal_wizard.model.rows.source import Parameters

MAX_CHANCE_OF_JUMPS = 0.05
"""Probability that rotations which do not agree with the rest are by chance those with the largest
jumps, up to which the jumps are said to be the reason: one of 20 rotations."""
MAX_JUMP_TAKEN_BACK = 0.5
"""Share of the largest jump of a rotation that another one takes back, in the median of several, up
to which samples are missing. A sensor that jumps at some rate takes back all of it on the way down;
of several gaps, each takes back any part of another or adds to it."""
TRIED_AT_ONCE = 4
"""One in so many of the rotations with the largest jumps is how many more are tried next."""
MIN_FALL_WITHOUT = 0.9
"""Share of what all rotations leave, above which some of them are not the reason, so that no fit
without them is tried."""
MIN_TILT_COMPARED = np.radians(20.0)
"""Angle between up before and after a rotation, from which on its closure is compared with it: a
full turn ends where it began."""
MAX_SHARE_OF_TILT = 0.3
"""Closure over that angle, medians of the rotations, above which the rates are not those of these
motions: rates of other motions leave more than half, samples lost in most rotations a tenth."""
BLIND = 1e-10
"""Share of a combination of gains in what the rotations show, below which they do not show it."""


def gyroscope_minimum(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    accelerometer: SensorFit,
    unit: str,
    readings: Readings | None = None,
    near: FloatArray | None = None,
    spectrum: RestSpectrum | None = None,
) -> Minimum[GyroscopeExperiment]:
    """The fit without effects of what these rotations determine.

    Args:
        holds: those that the accelerometer was fitted to.
        rotations: between them; those with a problem are left out.
        accelerometer: its fit, with the effects it has.
        unit: of the readings.
        readings: what the holds were found in, for the session's beginning and the temperature.
        near: a matrix to begin from, where one is known, shape (3, 3).
        spectrum: of the readings at rest, where it is known.

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
    matrix = near
    if matrix is None:
        matrix = start_matrix(turned.samples, *ends, turned.up, rest, known)
    nominal = nominal_of(matrix, known)
    start = Parameters(matrix, rest)
    rows = holds, turned, reference, unit, start, nominal
    rough = GyroscopeExperiment(*rows, readings=readings, spectrum=spectrum)
    whole = replace(rough.directions(BASE), precision=datasheet_precision(nominal, matrix))
    found = of_determined(minimum(rough, directions=whole), nominal)
    # closures weigh more once less is lost, and may then show that still less is
    while (refined := found.experiment.refined(found)) is not found.experiment:
        found = minimum(refined)
    return found


def without_lost_samples(
    found: Minimum[GyroscopeExperiment],
    rotations: Sequence[Rotation],
    again: Callable[[Sequence[Rotation]], Minimum[GyroscopeExperiment]],
) -> tuple[Minimum[GyroscopeExperiment], list[Rotation]]:
    """The fit without the rotations in which samples are missing that the times do not show.

    A rate that goes on elsewhere jumps between two samples. If those rotations do not agree with
    the rest that have the largest jumps, samples are missing there: chance, as where the device was
    bumped while it turned, seldom picks the same ones.

    Args:
        found: the fit of all usable rotations.
        rotations: all of them.
        again: the fit of other ones.

    Returns:
        The fit, and the rotations with the problem named.
    """
    usable, unchanged = found.experiment.rotations.usable.tolist(), (found, list(rotations))
    if _lack_without(found, ()).within_noise:
        return unchanged
    jumps = {number: _jump(rotations[number]) for number in usable}
    order = sorted(usable, key=lambda number: jumps[number][0], reverse=True)
    unit = found.experiment.unit

    def without(out: Sequence[int]) -> tuple[Minimum[GyroscopeExperiment], list[Rotation]]:
        left = list(rotations)
        for number in out:
            left[number] = replace(left[number], problem=_jumped(*jumps[number][1:3], unit))
        return again(left), left

    try:
        out, tried = _with_largest_jumps(found, order, lambda out: without(out)[0])
        odd = list(out)

        def by_chance() -> bool:
            """Whether chance picks as many; it picks fewer all the more."""
            chance = tried * comb(len(out), len(odd)) / comb(len(order), len(odd))
            return not odd or chance > MAX_CHANCE_OF_JUMPS

        for number in reversed(out if len(out) > 1 else ()):
            if by_chance():
                return unchanged
            others = [one for one in odd if one != number]
            if _lack_without(without(others)[0], ()).within_noise:  # it closes in spite of its jump
                odd = others
        if len(odd) > 1 and median([jumps[number][3] for number in odd]) > MAX_JUMP_TAKEN_BACK:
            return unchanged  # the sensor jumps at some rate, on the way up and on the way down
        return unchanged if by_chance() else without(odd)
    except DataError:
        return unchanged


def _with_largest_jumps(
    found: Minimum[GyroscopeExperiment],
    order: Sequence[int],
    without: Callable[[Sequence[int]], Minimum[GyroscopeExperiment]],
) -> tuple[Sequence[int], int]:
    """The rotations with the largest jumps without which all others agree within their noise.

    Args:
        found: the fit of all usable rotations.
        order: numbers of these, that with the largest jump first.
        without: the fit without some of them.

    Returns:
        Their numbers, none where no half of all agrees; and how many numbers of them were tried.
    """
    lack, count, tried = _lack_without(found, ()), 0, 0
    while not lack.within_noise:
        count, tried = count + 1 + count // TRIED_AT_ONCE, tried + 1
        if count > len(order) // 2:
            return (), tried
        if _lack_without(found, order[:count]).ratio <= MIN_FALL_WITHOUT * lack.ratio:
            found = without(order[:count])
            lack = _lack_without(found, ())
    return order[:count], tried


def _lack_without(found: Minimum[GyroscopeExperiment], out: Sequence[int]) -> LackOfFit:
    """The test of a fit's residuals without those of some of all rotations."""
    table = residual_table(found)
    closing = table.kind == found.experiment.closure.kind
    return lack_without(table, np.flatnonzero(closing & np.isin(table.index, out)))


def _jumped(size: float, seconds: float, unit: str) -> Notice:
    text = (
        f"the rate jumps by {quantity(size, unit, 2)} between two samples at {seconds:.1f} s and "
        "the angle is wrong, as where samples are missing or repeated"
    )
    return Notice(text, NoticeKind.JUMP, GYROSCOPE)


def check_same_motions(found: Minimum[GyroscopeExperiment]) -> None:
    """That the rates are those of the motions between the holds.

    Raises:
        DataError: they explain little of how gravity turns, so that no parameter means anything.
    """
    closure, tilt = _compared(found)
    if not len(tilt):
        return
    left, turned = median(closure), median(tilt)
    if left > MAX_SHARE_OF_TILT * turned:
        raise DataError(
            f"the rotations tilt the device by {quantity(turned, 'rad', 2)} in the median, and the "
            f"rates miss that by {quantity(left, 'rad', 2)}: they are not the rates of these "
            "motions. Check that both sensors are of one device and one recording, and their times"
        )


def misses_rotations(found: Minimum[GyroscopeExperiment]) -> bool:
    """Whether the rates miss much of several rotations, as of those about a dead axis."""
    closure, tilt = _compared(found)
    return int((closure > MAX_SHARE_OF_TILT * tilt).sum()) > 1


def _compared(found: Minimum[GyroscopeExperiment]) -> tuple[FloatArray, FloatArray]:
    """Closure and tilt of the rotations that tilt the device enough to compare both, rad."""
    source = found.experiment.closure
    closure = items_of(found).each(found.errors)
    tilt = np.arccos(np.clip((source.before * source.after).sum(axis=1), -1.0, 1.0))
    compared = tilt >= MIN_TILT_COMPARED
    return closure[compared], tilt[compared]


def _jump(rotation: Rotation) -> tuple[float, float, float, float]:
    """The largest jump of the rate beyond the slopes on either side, over the mean of all.

    And by how much the rate changes there, when that was, and the share that another jump takes
    back.
    """
    steps = np.diff(rotation.rate, axis=0)
    if len(steps) < 3:
        return 0.0, 0.0, float(rotation.time[0]), 0.0
    jumps = steps[1:-1] - 0.5 * (steps[:-2] + steps[2:])
    beyond = np.linalg.norm(jumps, axis=1)
    place = int(beyond.argmax())
    size = float(np.linalg.norm(steps[place + 1]))
    usual = max(float(beyond.mean()), 1e-300)
    # the steps beside a jump have half of it, with the other sign
    around = np.pad(beyond, 1)
    peak = (beyond >= around[:-2]) & (beyond >= around[2:])
    left = np.linalg.norm(jumps[place] + jumps[peak], axis=1).min(initial=float(beyond[place]))
    back = 1.0 - float(left) / max(float(beyond[place]), 1e-300)
    return float(beyond[place]) / usual, size, float(rotation.time[place + 1]), back


def of_determined(found: Minimum[M], nominal: Nominal) -> Minimum[M]:
    """The fit of what the rows determine.

    Args:
        found: a fit of all entries, in which datasheets hold what the rows do not show.
        nominal: what a gain is that is not fitted.

    Raises:
        DataError: a scale is not determined and has no nominal value.
    """
    rough, free = found.experiment, found.experiment.free
    while True:
        again = determined_entries(found, nominal, free)
        if found.experiment is not rough and again == free:
            return found
        free = again
        found = minimum(rough.moved(found.calibration, free))


def determined_entries(
    found: Minimum[Experiment], nominal: Nominal, free: tuple[int, ...]
) -> tuple[int, ...]:
    """Which of the entries fitted the rows determine; the worst known gain goes first.

    By the measured noise: an effect that is missing in the model makes residuals large, but takes
    no information from the rows; with the gain left out the effect could not be found.

    Raises:
        DataError: a scale is not determined and has no nominal value.
    """
    gain = float(np.linalg.norm(found.calibration.matrix, 2))
    count, entries = len(found.directions), list(free)
    columns = found.system.columns[:, :count]
    whole = columns.T @ (columns / found.system.own[:, None])
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
