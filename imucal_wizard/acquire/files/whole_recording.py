"""What only a whole file shows: samples that are silent, repeated or copied, signs, jitter, a unit.

The first rows of a file are read like those of a stream; these steps follow on the whole file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.acquire.column_guess import (
    UnitGuess,
    guess_accelerometer_unit,
    guess_magnetometer_unit,
    unit_note,
)
from imucal_wizard.acquire.copied_samples import copies, copies_note
from imucal_wizard.acquire.even_times import JITTER_NOTE, evenly_arrived, without_jitter
from imucal_wizard.acquire.silent_samples import (
    FIELD,
    INERTIAL,
    MAX_SILENT_SHARE,
    SilentSamples,
    heard_rows,
    sends_zeros,
    silent_note,
)
from imucal_wizard.core.notices import NoticeKind, of_kind
from imucal_wizard.core.readings import FloatArray, IntArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import COUNT, si_unit, unit_factor
from imucal_wizard.measurement.data_quality import missing_samples
from imucal_wizard.measurement.repeats import measured_rows, repeats_note
from imucal_wizard.measurement.unsigned_counts import as_signed, changed_sign, signs_note


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
    """The samples without silent ones, each measurement once, with times, signs and unit as shown.

    Args:
        samples: of one file.
        guesses: the units that were guessed from its first rows, by sensor.
    """
    samples = told_of_gaps(_evenly_timed(_measured_once(_without_silent(samples))))
    # a copy leaves a gap in which nothing need be missing
    return _in_unit_of_field(_signed(_without_copies(samples), guesses), guesses)


def told_of_gaps(samples: FileSamples) -> FileSamples:
    """With what is said of missing samples of the inertial sensors.

    Args:
        samples: of one file.
    """
    sensor = next((name for name in INERTIAL if name in samples.series), None)
    said = missing_samples(samples.series[sensor].time) if sensor else ""
    return replace(samples, warnings=(*samples.warnings, *filter(None, [said])))


def _measured_once(samples: FileSamples) -> FileSamples:
    """With each measurement of the inertial sensors once, where a faster loop repeats it.

    The steps between the repeats look like noise, and the repeats themselves like the end of the
    range. A magnetometer's are left to its fit.
    """
    together = _together(samples)
    rows = measured_rows(*(one.values for one in together.values())) if together else None
    if rows is None:
        return samples
    count = len(next(iter(together.values())))
    note = repeats_note(" and the ".join(together), count / len(rows))
    return _with_rows(samples, together, rows, note)


def _together(samples: FileSamples) -> dict[str, Series]:
    """The inertial sensors, if they are read together; empty if not."""
    own = {name: samples.series[name] for name in INERTIAL if name in samples.series}
    times = {id(one.time) for one in own.values()}
    return own if len(times) == 1 else {}


def _with_rows(
    samples: FileSamples, together: Mapping[str, Series], rows: IntArray, note: Sequence[str]
) -> FileSamples:
    """The samples with some of those of sensors that are read together, and a note."""
    series = dict(samples.series)
    time = next(iter(together.values())).time[rows]
    for name, one in together.items():
        series[name] = replace(one, time=time, values=one.values[rows])
    return FileSamples(series, (*samples.warnings, *note))


def _without_copies(samples: FileSamples) -> FileSamples:
    """Without blocks of samples that are exact copies of the block before them."""
    together = _together(samples)
    if not together:
        return samples
    blocks = copies(np.concatenate([one.values for one in together.values()], axis=1))
    if not blocks:
        return samples
    time = next(iter(together.values())).time
    kept = np.ones(len(time), bool)
    for one in blocks:
        kept[one.first : one.first + one.size] = False
    note = copies_note(time, blocks)
    return _with_rows(samples, together, np.flatnonzero(kept), (note,))


def _evenly_timed(samples: FileSamples) -> FileSamples:
    """With even times where the given ones only jitter about them."""
    found: dict[int, FloatArray | None] = {}
    for one in samples.series.values():
        if id(one.time) not in found:
            arrived = evenly_arrived(one.time)
            found[id(one.time)] = without_jitter(one.time) if arrived is None else arrived
    series = dict(samples.series)
    for name, one in samples.series.items():
        even = found[id(one.time)]
        if even is not None:
            series[name] = replace(one, time=even)
    if all(even is None for even in found.values()):
        return samples
    return FileSamples(series, (*samples.warnings, JITTER_NOTE))


def _without_silent(samples: FileSamples) -> FileSamples:
    """Without the samples in which a sensor did not answer."""
    series, notes = dict(samples.series), []
    for name in MAX_SILENT_SHARE:
        one = series.get(name)
        if one is None or not len(one) or sends_zeros(name, one):
            continue
        heard = SilentSamples().heard(one.values)
        if heard is None:
            continue
        series |= heard_rows(series, name, heard)
        notes.append(silent_note(name, int((~heard).sum())))
    return FileSamples(series, (*samples.warnings, *notes))


def _signed(samples: FileSamples, guesses: Mapping[str, UnitGuess]) -> FileSamples:
    """With the negative numbers of counts that were written as unsigned ones."""
    series, warnings = dict(samples.series), list(samples.warnings)
    for name in (*INERTIAL, FIELD):
        one = series.get(name)
        values = as_signed(one.values) if one is not None and one.unit == COUNT else None
        if one is None or values is None:
            continue
        series[name] = replace(one, values=values)
        if name == "accelerometer" and name in guesses:
            again = guess_accelerometer_unit(values)
            if again.unit == COUNT:
                warnings = _guessed_again(warnings, name, again)
        if changed := changed_sign(one.values, values):
            warnings.append(signs_note(name, *changed))
    return FileSamples(series, tuple(warnings))


def _in_unit_of_field(samples: FileSamples, guesses: Mapping[str, UnitGuess]) -> FileSamples:
    """With the magnetometer in the unit that the field without its hard iron shows."""
    series, guess = samples.series.get(FIELD), guesses.get(FIELD)
    if guess is None or series is None or not len(series):
        return samples
    readings = series.values / unit_factor(FIELD, guess.unit)
    found = guess_magnetometer_unit(readings)
    converted = Series(
        series.time, readings * unit_factor(FIELD, found.unit), si_unit(FIELD, found.unit)
    )
    warnings = _guessed_again(samples.warnings, FIELD, found)
    return FileSamples({**samples.series, FIELD: converted}, tuple(warnings))


def _guessed_again(warnings: Sequence[str], sensor: str, guess: UnitGuess) -> list[str]:
    """The warnings with another guess of the unit of a sensor's readings."""
    before = of_kind(warnings, NoticeKind.UNIT_OF_SIZE, sensor=sensor)
    return [unit_note(sensor, guess) if text in before else text for text in warnings]
