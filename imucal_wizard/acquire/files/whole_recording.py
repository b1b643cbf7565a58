"""What only all readings of a file show: silent samples, lost signs, and the unit of the field.

The first rows of a file are read like those of a stream; these steps follow on the whole file.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from imucal_wizard.acquire.clock import LONG_GAP_SECONDS
from imucal_wizard.acquire.column_guess import (
    UnitGuess,
    guess_accelerometer_unit,
    guess_magnetometer_unit,
)
from imucal_wizard.core.limits.data_quality import MAX_STEP_RATIO, RESTART_GAP_SECONDS
from imucal_wizard.core.quantities import plural
from imucal_wizard.core.readings import ComplexArray, FloatArray, Series, across_restarts
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median, true_on_all_axes
from imucal_wizard.core.units import COUNT, si_unit, unit_factor
from imucal_wizard.measurement.data_quality import as_signed
from imucal_wizard.measurement.field_quality import measured_rows, repeats_note

_INERTIAL = ("accelerometer", "gyroscope")
_FIELD = "magnetometer"
_JITTER_SAMPLES = 100
"""Samples over which a jitter averages to nothing, and times that wander have wandered off."""
_MIN_JITTER = 0.05
"""Jitter of the steps in sampling intervals below which it does not matter."""
_MAX_WANDER = 0.3
"""Growth of the deviation from even times in that many samples, over that of independent steps."""
_MIN_RESULTANT = 0.3
"""Mean resultant length of the phases of so many samples, below which they lie about no even times:
a uniform jitter by ±0.375 intervals gives 0.3, and independent phases give 0.06."""
_MAX_SILENT_SHARE = {"accelerometer": 0.5, _FIELD: 1.0}
"""Share of samples that are zero on all axes above which they are what the device sends: one that
removes gravity sends zero at rest. Nothing removes the field, and a file with a line for each
measurement of a faster sensor may be filled up with zeros to any share."""


@dataclass(frozen=True, eq=False)
class FileSamples:
    """The content of one file.

    Attributes:
        series: the samples of each sensor by its name.
        warnings: messages to the user.
    """

    series: dict[str, Series]
    warnings: tuple[str, ...] = ()


def known_by_all_readings(samples: FileSamples, guesses: Mapping[str, UnitGuess]) -> FileSamples:
    """The samples with the signs and the unit that all of them show, and without silent ones.

    Args:
        samples: of one file.
        guesses: the units that were guessed from its first rows, by sensor.
    """
    samples = _evenly_timed(_measured_once(_answered(samples)))
    return _in_unit_of_field(_signed(samples, guesses), guesses)


def _measured_once(samples: FileSamples) -> FileSamples:
    """With each measurement of the inertial sensors once, where a faster loop repeats it.

    The steps between the repeats look like noise, and the repeats themselves like the end of the
    range. A magnetometer's are left to its fit.
    """
    main = next((samples.series[name] for name in _INERTIAL if name in samples.series), None)
    if main is None:
        return samples
    own = [name for name in _INERTIAL if name in samples.series]
    if any(samples.series[name].time is not main.time for name in own):  # not read together
        return samples
    rows = measured_rows(*(samples.series[name].values for name in own))
    if rows is None:
        return samples
    time, series = main.time[rows], dict(samples.series)
    for name in own:
        series[name] = replace(series[name], time=time, values=series[name].values[rows])
    note = repeats_note(" and the ".join(own), main, series[own[0]])
    return FileSamples(series, (*samples.warnings, *note))


def _evenly_timed(samples: FileSamples) -> FileSamples:
    """With even times where the given ones only jitter about them."""
    found: dict[int, FloatArray | None] = {}
    for one in samples.series.values():
        if id(one.time) not in found:
            found[id(one.time)] = without_jitter(one.time)
    series = dict(samples.series)
    for name, one in samples.series.items():
        even = found[id(one.time)]
        if even is not None:
            series[name] = replace(one, time=even)
    if all(even is None for even in found.values()):
        return samples
    note = (
        "the times jitter about even ones, as if they were rounded or taken on arrival: the even "
        "ones are used"
    )
    return FileSamples(series, (*samples.warnings, note))


def without_jitter(time: FloatArray) -> FloatArray | None:
    """The even times about which given ones jitter; None if they do not jitter, or wander.

    A sensor measures by its own clock, and whoever reads it takes the time later, by a delay that
    varies but does not add up. Where the steps themselves vary, their sum wanders off any even
    course: then each sample was measured at its own time.

    Args:
        time: s, shape (n,), never decreasing.
    """
    steps = np.diff(time)
    usual = steps[steps <= MAX_STEP_RATIO * median(steps)] if len(steps) else steps
    period = float(usual.mean()) if len(usual) > 2 * _JITTER_SAMPLES else 0.0
    if not period > 0.0 or usual.std() < _MIN_JITTER * period:
        return None
    restarts = across_restarts(steps)
    cuts = np.flatnonzero((steps > LONG_GAP_SECONDS) | restarts) + 1
    parts = np.split(time, cuts)
    courses = [_course(part, period) for part in parts]
    if np.concatenate([share for _, _, share in courses]).mean() < _MIN_RESULTANT:
        return None
    off = [late + slow for late, slow, _ in courses]
    far = np.concatenate([one[_JITTER_SAMPLES:] - one[:-_JITTER_SAMPLES] for one in off])
    near = np.concatenate([np.diff(one) for one in off])
    jitter = float((near - period * np.round(near / period)).std())
    if not len(far) or float(far.std()) > _MAX_WANDER * np.sqrt(_JITTER_SAMPLES) * jitter:
        return None
    even = [part - late for part, (late, _, _) in zip(parts, courses, strict=True)]
    for (before, after), cut in zip(pairwise(even), cuts, strict=True):
        if restarts[cut - 1]:  # its length is a sign, and not measured
            after += before[-1] + RESTART_GAP_SECONDS - after[0]
    return np.maximum.accumulate(np.concatenate(even))


def _course(time: FloatArray, period: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """By how much times are later than the even ones near them, all of shape (n,).

    The phase of a sample in the interval in which it lies does not depend on how many samples are
    missing before it, as its number would.

    Args:
        time: s, shape (n,), without long gaps.
        period: sampling interval, s, about.

    Returns:
        The jitter and the course of the even times about the best line, s; and the resultant length
        of the phases about each sample: 1 where there is no jitter, 0 where all are as likely.
    """
    angle = 2.0 * np.pi * (time - time[0]) / period
    slow = np.unwrap(np.angle(_running_mean(np.exp(1j * angle))))
    if len(time) > 2 * _JITTER_SAMPLES:  # the interval is a little longer or shorter
        angle -= angle * (angle @ (slow - slow.mean()) / (angle @ (angle - angle.mean())))
    phases = np.exp(1j * angle)
    near = _running_mean(phases)
    late = np.angle(phases * near.conj())
    slow = np.unwrap(np.angle(near))
    second = period / (2.0 * np.pi)
    return second * late, second * (slow - slow.mean()), np.abs(near)


def _running_mean(values: ComplexArray) -> ComplexArray:
    """Mean of each value and its neighbours; at the ends that of the first and last ones."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    width = min(2 * _JITTER_SAMPLES + 1, len(values))
    first = np.clip(np.arange(len(values)) - _JITTER_SAMPLES, 0, len(values) - width)
    return np.asarray((sums[first + width] - sums[first]) / width)


def _answered(samples: FileSamples) -> FileSamples:
    """Without samples that are zero on all axes: gravity and the Earth's field never are."""
    series, notes = dict(samples.series), []
    for name, most in _MAX_SILENT_SHARE.items():
        one = series.get(name)
        silent = None if one is None else true_on_all_axes(one.values == 0.0)
        if one is None or silent is None or not silent.any() or silent.all():
            continue
        if silent.mean() > most:
            continue
        time = one.time[~silent]  # one array for all sensors that are read together
        for other, beside in series.items():
            if other == name or (name == "accelerometer" and beside.time is one.time):
                series[other] = replace(beside, time=time, values=beside.values[~silent])
        notes.append(
            f"{plural(int(silent.sum()), 'sample')} of the {name} read exactly zero on all axes: "
            "the sensor did not answer, or the file was filled up; left out"
        )
    return FileSamples(series, (*samples.warnings, *notes))


def _signed(samples: FileSamples, guesses: Mapping[str, UnitGuess]) -> FileSamples:
    """With the negative numbers of counts that were written as unsigned ones."""
    series, warnings = dict(samples.series), list(samples.warnings)
    for name in (*_INERTIAL, _FIELD):
        one = series.get(name)
        values = as_signed(one.values) if one is not None and one.unit == COUNT else None
        if one is None or values is None:
            continue
        first = np.argwhere(values != one.values)[0]
        as_read, is_meant = (float(array[tuple(first)]) for array in (one.values, values))
        series[name] = replace(one, values=values)
        if name == "accelerometer" and name in guesses:
            again = guess_accelerometer_unit(values)
            if again.unit == COUNT:
                warnings = [again.why if text == guesses[name].why else text for text in warnings]
        warnings.append(
            f"negative readings of the {name} were written as unsigned numbers, like {as_read:.0f} "
            f"for {is_meant:.0f}: they are read as negative"
        )
    return FileSamples(series, tuple(warnings))


def _in_unit_of_field(samples: FileSamples, guesses: Mapping[str, UnitGuess]) -> FileSamples:
    """With the magnetometer in the unit that the field without its hard iron shows."""
    series, guess = samples.series.get(_FIELD), guesses.get(_FIELD)
    if guess is None or series is None or not len(series):
        return samples
    readings = series.values / unit_factor(_FIELD, guess.unit)
    found = guess_magnetometer_unit(readings)
    converted = Series(
        series.time, readings * unit_factor(_FIELD, found.unit), si_unit(_FIELD, found.unit)
    )
    warnings = [found.why if text == guess.why else text for text in samples.warnings]
    return FileSamples({**samples.series, _FIELD: converted}, tuple(warnings))
