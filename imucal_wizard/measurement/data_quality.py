"""Data-quality checks: one set with one set of limits, for streams and recordings.

Every check returns one sentence that says what was found and what to do, or "".
"""

import itertools
from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.errors import RecordingError
from imucal_wizard.core.gravity import (
    UNITS_BY_SIZE,
    acceleration_unit,
    are_whole_numbers,
    median_magnitude,
    unit_of_gravity,
)
from imucal_wizard.core.limits.data_quality import (
    GRAVITY_BLOCK_SECONDS,
    MAX_BURST_RATIO,
    MAX_COPIED,
    MAX_FORCE_STEP,
    MAX_GRAVITY_ERROR,
    MAX_GRAVITY_SPREAD,
    MAX_IDLE_VALUES,
    MAX_JITTER_SHARE,
    MAX_QUIET_RATIO,
    MAX_RATE_STEP,
    MAX_REMOVED_GRAVITY,
    MAX_REPEATED_SHARE,
    MAX_REST_STEPS,
    MAX_REST_VARIATION,
    MAX_STEP_RATIO,
    MAX_UNDITHERED_STEPS,
    MAX_UNEVEN_PART,
    MAX_ZERO_RATE_SHARE,
    MIN_CHECKED_SAMPLES,
    MIN_COPIES,
    MIN_COPIES_RATIO,
    MIN_GRAVITY,
    MIN_MISSING_SHARE,
    MIN_MISSING_STEP,
    MIN_POSITION_RATIO,
    MIN_RESTS,
)
from imucal_wizard.core.notices import Notice, NoticeKind
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quantities import plural, quantity
from imucal_wizard.core.readings import (
    BoolArray,
    FloatArray,
    Readings,
    Series,
    across_restarts,
    distinct,
    origin_of_times,
)
from imucal_wizard.core.statistics import (
    lengths,
    median,
    sample_quantile,
    true_on_all_axes,
)
from imucal_wizard.core.units import ACCELERATION_UNITS, COUNT, RATE_UNITS, STANDARD_GRAVITY
from imucal_wizard.measurement import clipping
from imucal_wizard.measurement.repeats import repeat_period, run_starts
from imucal_wizard.measurement.unsigned_counts import WORD_BITS

SAME_STEP = 0.01
"""Relative difference of a step from a decimal fraction of a unit, up to which digits may make it:
the steps of converters are halves of halves of a range, 2.4 % from 1 mg at the nearest."""
_STEPS_FROM = 5000
"""Samples from which the smallest step is determined."""


def check_recording(readings: Readings) -> tuple[str, ...]:
    """All warnings about a whole recording."""
    if len(readings) < MIN_CHECKED_SAMPLES:
        return (f"there are only {len(readings)} samples; record for longer",)
    sensors = [one for one in inertial_sensors(readings) if len(one[1]) >= MIN_CHECKED_SAMPLES]
    found = [check(readings) for check in READINGS_CHECKS]
    found += [coarse_steps(sensor, series) for sensor, series in sensors]
    found += [dead_axes(sensor, series) for sensor, series in sensors]
    found += [clipping.clipped_range(sensor, series) for sensor, series in sensors]
    return tuple(dict.fromkeys(text for text in found if text))


def inertial_sensors(readings: Readings) -> list[tuple[str, Series]]:
    """The inertial sensors of a recording by name."""
    both = (("accelerometer", readings.accelerometer), ("gyroscope", readings.gyroscope))
    return [(name, series) for name, series in both if series is not None]


def _repeated_samples(readings: Readings) -> str:
    """Warning about samples that repeat the previous one on every axis.

    A device that prints too fast does so in motion, too, a few times each. A sensor whose noise is
    below its step repeats itself while it rests, and then changes by a single step, which is not
    counted.
    """
    together = _together(readings)
    moves = [np.abs(np.diff(one, axis=0)).max(axis=1) for one in together]
    starts = run_starts(*together)
    runs = np.diff(np.append(starts, len(readings)))
    steps = [_smallest_step(one[:_STEPS_FROM]) for one in together]
    far = np.any(
        [move > MAX_REST_STEPS * step for move, step in zip(moves, steps, strict=True)], axis=0
    )
    counted = np.append(True, far)[starts] & (
        runs < GRAVITY_BLOCK_SECONDS * readings.accelerometer.rate
    )
    short = runs[counted]
    share = 1.0 - len(short) / float(short.sum()) if len(short) else 0.0
    if share <= MAX_REPEATED_SHARE:
        known = np.concatenate([[False], far, [False]])
        alone = known[starts] & known[np.append(starts[1:], len(readings))] & (runs <= MAX_COPIED)
        return _copies_in_noise(readings, together, int((runs[alone] - 1).sum()))
    return (
        f"{share:.0%} of the samples repeat the one before: the device prints faster than its "
        "sensor measures, or too few digits. Print once per new measurement; otherwise the noise "
        "and the limits of stillness are wrong."
    )


def _slow_sensor(readings: Readings) -> str:
    """Warning about a sensor that is slower than the lines, where another one keeps up with them.

    In motion: readings of a sensor that rests repeat where its step is larger than its noise.
    """
    times = {}
    for name, series in inertial_sensors(readings):
        if not len(series):
            return ""
        move = np.abs(np.diff(series.values, axis=0)).max(axis=1)
        far = move > MAX_REST_STEPS * _smallest_step(series.values[:_STEPS_FROM])
        starts = run_starts(series.values)
        ends = np.append(starts[1:], len(series))
        known = np.concatenate([[False], far, [False]])
        times[name] = repeat_period((ends - starts)[known[starts] & known[ends]]) or 1.0
    slow = [name for name, each in times.items() if each > 1.0]
    if len(slow) != 1 or len(times) == 1:
        return ""
    (name,) = slow
    return (
        f"Each reading of the {name} is repeated {times[name]:.3g} times: the sensor is "
        "slower than the lines. Set both sensors to one output rate."
    )


def _copies_in_noise(readings: Readings, together: Sequence[FloatArray], count: int) -> str:
    """Warning about samples that repeat the previous one where noise changes the others.

    How often it leaves each axis as it was, the samples around show; all axes stay by chance as
    often as the product of these shares says.

    Args:
        readings: samples.
        together: values of the sensors that are read together, each of shape (n, 3).
        count: samples that repeat the previous one, in short runs between larger changes.
    """
    if count < MIN_COPIES:
        return ""
    stays = np.concatenate([np.diff(one, axis=0) == 0.0 for one in together], axis=1)
    size = max(MIN_CHECKED_SAMPLES, round(GRAVITY_BLOCK_SECONDS * readings.accelerometer.rate))
    begins = np.arange(0, max(len(stays) - size, 0) + 1, size)
    there = np.diff(np.append(begins, len(stays)))
    shares = (np.add.reduceat(stays, begins, axis=0, dtype=float) + 0.5) / (there[:, None] + 1.0)
    by_chance = float(there @ shares.prod(axis=1))
    if count < MIN_COPIES + MIN_COPIES_RATIO * by_chance:
        return ""
    return (
        f"{plural(count, 'sample')} of {len(readings)} repeat the one before on all axes, which "
        "noise changes in the others: rows may have come twice, or the sensor was read before "
        "it had measured. If the times do not show it, the angles of rotations are wrong."
    )


def _frozen_values(readings: Readings) -> str:
    """Warning if no value ever changes."""
    if not all((one == one[0]).all() for one in _together(readings)):
        return ""
    return (
        "No value changes at all: the sensor does not answer and its last values are repeated, or "
        "too few digits are printed to show noise. Check its wiring, and print more digits."
    )


def _together(readings: Readings) -> list[FloatArray]:
    """The values of the sensors that are read together."""
    return [one.values for _, one in inertial_sensors(readings) if len(one) == len(readings)]


def dead_axes(sensor: str, series: Series) -> str:
    """Warning about axes that never change while another one does, or that are identical."""
    values = series.values
    spans = [np.ptp(column) for column in values.T]
    dead = [AXES[axis] for axis in range(3) if spans[axis] == 0.0]
    if dead and max(len(distinct(values[:, axis])) for axis in range(3)) > MAX_IDLE_VALUES:
        return Notice(
            f"The {sensor}'s {' and '.join(dead)} axis never changes: it is dead, or its column "
            "is another one. Check the columns and the sensor.",
            NoticeKind.DEAD,
            sensor,
        )
    for one, other in itertools.combinations(range(3), 2):
        if spans[one] > 0.0 and np.array_equal(values[:, one], values[:, other]):
            return (
                f"The {sensor}'s {AXES[one]} and {AXES[other]} axes are the same in every sample: "
                f"one column was given twice. Check the sketch and the names of the columns."
            )
    return ""


def _zero_rate(readings: Readings) -> str:
    """Warning about a gyroscope that reads exactly zero while the accelerometer shows noise."""
    gyroscope = readings.gyroscope
    if gyroscope is None or not len(gyroscope):
        return ""
    if float(np.mean(true_on_all_axes(gyroscope.values == 0.0))) <= MAX_ZERO_RATE_SHARE:
        return ""
    if bool(np.all(np.ptp(readings.accelerometer.values, axis=0) == 0)):
        return ""
    step = _smallest_step(gyroscope.values)
    steps = f"of its steps of {quantity(step, gyroscope.unit, 2)}" if step else "a step"
    return (
        "The gyroscope reads exactly zero at rest: the device removes its own bias (BNO055 in a "
        "fusion mode, WitMotion with automatic calibration), or bias and noise are less than half "
        f"{steps}. Switch to raw data (BNO055: AMG mode; WitMotion: register 0x63 = "
        "1), print more digits or set a smaller range, or its bias cannot be found."
    )


def coarse_steps(sensor: str, series: Series, printed: float | None = None) -> str:
    """Warning about steps that are too coarse for a calibration.

    Noise above half a step dithers it away in the mean of a hold; such steps do no harm.

    Args:
        sensor: ``accelerometer`` or ``gyroscope``.
        series: its samples.
        printed: the step of the printed digits in the unit of the samples, if known.
    """
    if series.unit == COUNT:
        return ""
    values = series.values[:_STEPS_FROM]
    step = _smallest_step(values) if printed is None else printed
    limit = MAX_FORCE_STEP if sensor == "accelerometer" else MAX_RATE_STEP
    if not step > limit or _quietest_noise(values) * MAX_UNDITHERED_STEPS >= step:
        return ""
    if sensor == "accelerometer":
        words = f"{step / STANDARD_GRAVITY * 1000:.2g} mg ({step * 1000:.3g} mm/s²)"
    else:
        words = f"{np.degrees(step):.2g} °/s"
    return Notice(
        f"The readings of the {sensor} come in steps of {words}. {finer_steps(step, series.unit)}.",
        NoticeKind.STEPS_OF_SAMPLES,
        sensor,
    )


def finer_steps(step: float, unit: str) -> str:
    """What makes steps finer: those of printed digits are a decimal fraction of a unit.

    Args:
        step: of the readings, in ``unit``.
        unit: SI or counts.
    """
    known = {**ACCELERATION_UNITS, **RATE_UNITS} if unit != COUNT else {}
    digits = np.log10([step / size for size in known.values()])
    if len(digits) and np.abs(10.0 ** (digits - np.round(digits)) - 1.0).min() < SAME_STEP:
        return (
            "Print decimal numbers with more digits (Arduino: Serial.print(x, 5)), or raw counts; "
            "if these steps are the sensor's, set a smaller range"
        )
    return "These steps are the sensor's, not those of printed digits: set a smaller range"


def _smallest_step(values: FloatArray) -> float:
    """Smallest step between distinct values of the axis with the finest resolution; 0 if none."""
    steps = []
    for axis in values.T:
        differences = np.diff(distinct(axis))
        differences = differences[differences > 1e-9 * max(1.0, float(np.abs(axis).max()))]
        if len(differences):
            steps.append(float(differences.min()))
    return min(steps, default=0.0)


def _quietest_noise(values: FloatArray) -> float:
    """Noise of the quietest stretch, from differences of neighbouring samples; the largest axis."""
    count = len(values) // MIN_CHECKED_SAMPLES
    if not count:
        return 0.0
    steps = np.diff(values, axis=0, prepend=values[:1])[: count * MIN_CHECKED_SAMPLES]
    squares = (steps**2).reshape(count, MIN_CHECKED_SAMPLES, 3).mean(axis=1)
    return float(np.sqrt(squares[squares.sum(axis=1).argmin()].max() / 2.0))


def _wrong_gravity(readings: Readings) -> str:
    """Warning if the magnitude of gravity at rest does not fit the unit."""
    series = readings.accelerometer
    size = None if series.unit == COUNT else _gravity_at_rest(series)
    if size is None or dead_axes("accelerometer", series):  # without an axis no unit fits
        return ""
    if size < MIN_GRAVITY and _feels_gravity(readings.gyroscope):
        return (
            "The gyroscope's columns show gravity and the accelerometer's do not: they are "
            "exchanged. Correct the names that the device prints, or state which column is "
            "which."
        )
    likely = _unit_taken_for_another(size)
    if size < MIN_GRAVITY and not likely:
        return (
            f"The acceleration is only {size:.2g} m/s² at rest: the device has removed gravity "
            f"(linear acceleration), or the unit is wrong. Let it print the raw acceleration, or "
            f"correct the unit."
        )
    if abs(size / STANDARD_GRAVITY - 1.0) < MAX_GRAVITY_ERROR:
        return ""
    advice = f"it looks like {likely}: set that unit" if likely else "correct the unit or the range"
    text = f"Gravity reads {size:.4g} m/s² instead of 9.81; {advice}."
    return Notice(text, NoticeKind.GRAVITY_OF_SAMPLES, "accelerometer")


def _gravity_at_rest(series: Series) -> float | None:
    """Median magnitude in the blocks in which it is steady; None if it never is."""
    sizes = lengths(series.values)
    length = max(4, round(GRAVITY_BLOCK_SECONDS * series.rate))
    count = len(sizes) // length
    blocks = sizes[: count * length].reshape(count, length)
    means = blocks.mean(axis=1)
    still = (blocks.std(axis=1) <= MAX_REST_VARIATION * means) | (means < MIN_GRAVITY)
    return median(means[still]) if still.any() else None


def _feels_gravity(series: Series | None) -> bool:
    """Whether rates steadily have the magnitude of 1 g in a common unit."""
    if series is None or series.unit == COUNT or not len(series):
        return False
    sizes = lengths(series.values)
    size = median(sizes)
    near = any(unit_of_gravity(size / factor, 0.15) for factor in RATE_UNITS.values())
    return near and float(np.std(sizes)) < 0.05 * size


def unsigned_counts(readings: Readings) -> str:
    """Warning about resting axes that may be negative counts sent as unsigned numbers.

    Counts with an offset lie about the middle of the range: at rest, no two of their axes are in
    the outer quarters of it. A reading that passes through zero shows which they are.
    """
    for sensor, series in inertial_sensors(readings):
        if series.unit != COUNT or not len(series):
            continue
        rest = np.array([median(axis) for axis in series.values.T])
        top = next((2.0**bits for bits in WORD_BITS if rest.max() < 2.0**bits), np.inf)
        if rest.min() >= 0.0 and rest.max() >= 0.75 * top and rest.min() <= 0.25 * top:
            return (
                f"Readings of the {sensor} like {rest.max():.0f} may be negative ones, sent as "
                "unsigned numbers: turn the device over once before the start, which shows it, or "
                "let it send signed numbers (int16_t)."
            )
    return ""


def _decimals_of_counts(readings: Readings) -> str:
    """Warning about readings that are said to be counts and are not whole numbers."""
    found = [
        sensor
        for sensor, series in inertial_sensors(readings)
        if series.unit == COUNT and len(series) and not are_whole_numbers(series.values)
    ]
    if not found:
        return ""
    return (
        f"The readings of the {' and the '.join(found)} have decimals, and counts are whole "
        "numbers: they may be averages of counts, or in a unit. Check the unit."
    )


READINGS_CHECKS = (
    _wrong_gravity,
    _frozen_values,
    _repeated_samples,
    _slow_sensor,
    _zero_rate,
    unsigned_counts,
    _decimals_of_counts,
)
"""Checks of both inertial sensors together, for recordings and for windows of a stream."""


def _unit_taken_for_another(size: float) -> str:
    """The confusion of units that explains the magnitude of gravity, in words, or ""."""
    for taken in UNITS_BY_SIZE:
        unit = unit_of_gravity(size / ACCELERATION_UNITS[taken], 0.1)
        if unit not in (None, taken):
            return f"{unit} taken for {taken}"
    return ""


ARRIVAL_TIMES = (
    "the times jitter as if they were taken on arrival; let the device print its own time, or "
    "leave the column out and give the rate"
)
"""Message about times that are neither even nor the device's own."""


def missing_samples(time: FloatArray) -> str:
    """Warning about missing samples, or about times taken at arrival."""
    steps = np.diff(time)
    usual = median(steps) if len(steps) else 0.0
    long = (usual > 0.0) & (steps > MAX_STEP_RATIO * usual)
    gaps = np.flatnonzero(long & ~across_restarts(steps))  # the loss at a restart is unknown
    if not len(gaps):
        return ""
    ratios, origin = steps[gaps] / usual, origin_of_times(float(time[0]))
    uneven = median(np.abs(ratios - np.round(ratios))) > MAX_UNEVEN_PART
    bursts = median(ratios) > MAX_BURST_RATIO
    if len(gaps) > MAX_JITTER_SHARE * len(steps) and (uneven or bursts):
        return ARRIVAL_TIMES
    # a time that was given twice, or late, makes a long step, too, in which nothing is missing
    near = np.append(steps, usual)
    short = np.maximum(usual - np.maximum(near[gaps - 1], 0.0), 0.0)
    short += np.maximum(usual - near[gaps + 1], 0.0)
    real = steps[gaps] - short > MIN_MISSING_STEP * usual
    # several late samples in a row look like a missing one, so that a few of these prove nothing
    if real.mean() < MIN_MISSING_SHARE:
        shown = "" if real.any() else ", although they show no gap"
        return (
            f"{plural(len(gaps), 'sample')} came with a time too early or too late, the first at "
            f"{time[gaps[0]] - origin:.6g} s: the times are uneven{shown}. Let the device print "
            "its own time, or leave the column out and give the rate"
        )
    gaps, ratios = gaps[real], ratios[real]
    longest = gaps[np.argmax(steps[gaps])]
    lost = int(np.round(ratios - 1.0).sum())
    missing = f"{plural(lost, 'sample')} {'is' if lost == 1 else 'are'} missing"
    return (
        f"about {missing} in {plural(len(gaps), 'gap')}, the longest {steps[longest]:.3g} s at "
        f"{time[longest] - origin:.6g} s; rotations whose angle they leave open are not used"
    )


def refuse_without_gravity(readings: Readings) -> None:
    """Refuse a recording whose accelerometer does not respond to gravity.

    At rest, an accelerometer reads the same magnitude in every orientation and a gyroscope the same
    bias. The unit does not matter, so counts can be judged, too.

    Raises:
        RecordingError: the gyroscope responds to gravity instead, or the device has removed it.
    """
    gyroscope = readings.gyroscope
    if gyroscope is not None and sensors_exchanged(readings.accelerometer, gyroscope):
        raise RecordingError(
            "accelerometer and gyroscope are exchanged: gx,gy,gz show gravity in every position and"
            " ax,ay,az do not; name the columns in their true order, or give the accelerometer's"
            " file first",
            settings=("columns",),
        )
    series = readings.accelerometer
    if series.unit == COUNT:
        return
    size = median_magnitude(series.values)
    if (
        size < MAX_REMOVED_GRAVITY * STANDARD_GRAVITY
        and acceleration_unit(size, whole=False) is None
        and _feels(series) < MIN_POSITION_RATIO
    ):
        raise RecordingError(
            f"the accelerations measure only {size:.3g} m/s^2 at rest: the device has removed"
            " gravity (linear acceleration), or the columns belong to another sensor; record the"
            " raw accelerometer, or name its columns",
            settings=("columns",),
        )


MANY_BLOCKS = 5_000
"""Blocks that show which sensor feels gravity; of more, spread over hours, a part is looked at."""


def sensors_exchanged(accelerometer: Series, gyroscope: Series) -> bool:
    """Whether the gyroscope's columns respond to gravity and the accelerometer's do not."""
    felt = _feels(gyroscope, accelerometer)
    if not felt > MIN_POSITION_RATIO:
        return False
    sizes = lengths(_rests(gyroscope, accelerometer)[0])
    even = float(sizes.std()) < MAX_GRAVITY_SPREAD * float(sizes.mean())
    return even and _feels(accelerometer) < felt / MIN_POSITION_RATIO


def recorded_at_once(one: Series, other: Series) -> bool:
    """Whether two series of one kind are two sensors of one session.

    They have the same steps of time and move at the same times, but only one of them responds to
    gravity: the rests of the other are all alike.
    """
    if len(one) != len(other) or not np.allclose(np.diff(one.time), np.diff(other.time)):
        return False
    still, other_still = _quiet(one)[2], _quiet(other)[2]
    moved = int(np.count_nonzero(~(still | other_still)))
    apart = int(np.count_nonzero(still ^ other_still))
    exchanged = sensors_exchanged(one, other) or sensors_exchanged(other, one)
    return exchanged and moved >= MIN_RESTS and apart < moved


def _feels(series: Series, beside: Series | None = None) -> float:
    """Ratio of the variation between rests to their noise; 0 if there are too few rests.

    Args:
        series: of one sensor.
        beside: of the other one, which rests then, too: a motor turns a device as evenly as it
            rests, and gravity shows that it turns.
    """
    means, noise = _rests(series, beside)
    if len(means) < MIN_RESTS or not noise.any():
        return 0.0
    return float(np.sqrt(means.var(axis=0).sum()) / median(noise[noise > 0.0]))


def _rests(series: Series, beside: Series | None = None) -> tuple[FloatArray, FloatArray]:
    """Means (k, 3) and noise (k,) of the quiet blocks; the arguments are those of ``_feels``."""
    means, noise, quiet = _quiet(series)
    if beside is not None and np.array_equal(beside.time, series.time):
        quiet &= _quiet(beside)[2]
    return means[quiet], noise[quiet]


def _quiet(series: Series) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Means (k, 3) and noise (k,) of all blocks, and which of them are quiet."""
    size = max(2, round(GRAVITY_BLOCK_SECONDS * series.rate))
    count = len(series) // size
    if count < MIN_RESTS:
        return np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=np.bool_)
    blocks = series.values[: count * size].reshape(count, size, 3)[:: 1 + count // MANY_BLOCKS]
    # by axis, then block: sums of numbers that follow one another take a fifth of the time
    blocks = np.ascontiguousarray(np.moveaxis(blocks, 2, 0))
    noise = np.sqrt(blocks.var(axis=2).sum(axis=0))
    quiet: BoolArray = noise <= MAX_QUIET_RATIO * sample_quantile(noise, 0.1)
    return blocks.mean(axis=2).T, noise, quiet
