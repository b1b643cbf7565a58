"""Reads the files of one session, in any format, to one ``Readings``.

The bytes go through the same decoders, columns, units and clocks as those of a stream. A file has
no arrival times, its first line is complete, and no questions can be asked.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from imucal_wizard.acquire.decode import format_names, is_binary
from imucal_wizard.acquire.decode.base import Column, MalformedLine
from imucal_wizard.acquire.decode.delimited import split_fields
from imucal_wizard.acquire.decode.lines import end_of_lines
from imucal_wizard.acquire.decode.vocabulary import SENSOR_CHANNELS, column_of_name
from imucal_wizard.acquire.detect import Detector
from imucal_wizard.acquire.files import Batch, RecordingOptions, is_session
from imucal_wizard.acquire.files.file_bytes import (
    MAX_BYTES,
    NotTextError,
    decode_text,
    read_bytes,
)
from imucal_wizard.acquire.files.whole_recording import (
    FileSamples,
    known_by_all_readings,
    told_of_gaps,
)
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import AUTO, StreamSetup, named_columns
from imucal_wizard.acquire.stream_corrections import with_signs
from imucal_wizard.core.errors import RecordingError, SessionError, UsageError
from imucal_wizard.core.input import readable_bytes, unpacked
from imucal_wizard.core.limits.data_quality import MIN_DATE_SECONDS, RESTART_GAP_SECONDS
from imucal_wizard.core.notices import begun
from imucal_wizard.core.output import sanitise, without_control_characters
from imucal_wizard.core.readings import (
    Readings,
    Series,
    join_readings,
    join_series,
    origin_of_times,
)
from imucal_wizard.core.units import COUNT, SI_UNIT, UNIT_FACTORS
from imucal_wizard.measurement.clock_drift import clock_drift
from imucal_wizard.measurement.data_quality import (
    check_recording,
    recorded_at_once,
    refuse_without_gravity,
)

IMU_TK = "imu_tk"
"""Text pairs of imu_tk: one file for each sensor, lines ``t x y z`` with the time in seconds."""
_PAIR = ("accelerometer", "gyroscope")
_TRIAD = "columns t,ax,ay,az"
"""What would help with a file of ``t x y z`` without names."""
_SERIES = ("accelerometer", "gyroscope", "magnetometer", "temperature", "current")
_BESIDE = ("temperature", "current")
"""Auxiliary quantities that may occur in several files."""
FED_BYTES = 1 << 19
"""Bytes fed at once, up to the end of the line. Smaller pieces cost more time, each its own; larger
ones leave the processor's cache."""
_MAX_MISFITS = 0.3
"""Share of malformed lines above which a file is not what it was taken for."""
_MANY_MISFITS = 0.05
"""Share of malformed lines above which the link was bad."""


def read_files(
    paths: Sequence[Path],
    options: RecordingOptions | None = None,
    *,
    field_alone: bool = False,
    on_table: bool = False,
) -> Readings:
    """The readings in the files of one session.

    Files with different sensors, each with its own times, become one recording; files with the same
    sensors, like one for each position, follow one another. The times of a clock that counts from a
    date (1970) count from the first sample instead.

    Args:
        paths: the files.
        options: the user's statements about them.
        field_alone: whether a magnetometer alone is sufficient; the accelerometer then has no
            samples.
        on_table: a rate table turned the device: a gyroscope alone is sufficient.

    Raises:
        RecordingError: a file cannot be read, or lacks something; the message says what.
        UsageError: the options do not fit the files.
    """
    options = options or RecordingOptions()
    if not paths:
        raise UsageError("no recording was given; name at least one file")
    refuse_unknown_format(options)
    if options.as_format == IMU_TK and len(paths) > len(_PAIR):
        raise UsageError(
            f"{IMU_TK} is the accelerometer's and the gyroscope's file, not {len(paths)} files; "
            f"give ACC.mat GYRO.mat in this order"
        )
    try:
        files = [_one(path, options, i) for i, path in enumerate(paths)]
    except RecordingError as error:
        if len(paths) != len(_PAIR) or error.settings != (_TRIAD,):
            raise
        raise RecordingError(
            f"{error} If they are the accelerometer's and the gyroscope's file of one session, "
            "state that format, and give them in this order.",
            settings=(f"as_format {IMU_TK}",),
        ) from None
    kinds = {frozenset(one.series) - set(_BESIDE) for one in files}
    if len(files) > 1 and len(kinds) == 1 and any(kinds):
        paths, files = _in_order_of_date(paths, files)
        files = _one_after_another(paths, files)
    series, warnings = _merged(paths, files)
    series = _from_beginning(series)
    none = Series(np.zeros(0), np.zeros((0, 3)), SI_UNIT["accelerometer"])
    if on_table and "gyroscope" in series:
        return _left_out(_readings({"accelerometer": none, **series}, warnings), options.without)
    if field_alone and set(series) & {"accelerometer", "magnetometer"} == {"magnetometer"}:
        return _left_out(_readings({**series, "accelerometer": none}, warnings), options.without)
    names = ", ".join(map(str, paths))
    if not series:
        raise RecordingError(f"{names}: no sensor is left. {'; '.join(warnings)}".rstrip())
    if "accelerometer" not in series:
        alone = "; without the wizard's steps, a magnetometer alone is fitted"
        raise RecordingError(
            f"{names}: there is no accelerometer, only {', '.join(sorted(series))}; give the file"
            f" that holds it as well, or name the columns{alone * ('magnetometer' in series)}",
            settings=("columns",),
        )
    readings = _readings(series, warnings)
    warnings += _apart(readings)
    try:
        refuse_without_gravity(readings)
    except RecordingError as error:
        raise RecordingError(f"{names}: {error}", settings=error.settings) from None
    warnings = list(dict.fromkeys((*warnings, *check_recording(readings), *clock_drift(readings))))
    return _left_out(replace(readings, warnings=tuple(warnings)), options.without)


def _left_out(readings: Readings, spans: Sequence[tuple[float, float]]) -> Readings:
    """The readings without those of some spans, after whose gaps no rotation goes on.

    Raises:
        UsageError: there are no samples in a span, or none beside them.
    """
    for start, end in spans:
        series = {name: one for name in _SERIES if (one := getattr(readings, name)) is not None}
        rows = {id(one.time): (one.time < start) | (one.time > end) for one in series.values()}
        times = {id(one.time): one.time[rows[id(one.time)]] for one in series.values()}
        span = f"from {start:.10g} to {end:.10g} s"
        if all(there.all() for there in rows.values()):
            first, last = (
                edge(float(edge(one.time)) for one in series.values() if len(one))
                for edge in (min, max)
            )
            raise UsageError(
                f"there are no samples {span}: these are from {first:.10g} to {last:.10g} s",
                settings=("without",),
            )
        if not any(len(time) for time in times.values()):
            raise UsageError(f"there are samples {span} only", settings=("without",))
        kept = {
            name: replace(one, time=times[id(one.time)], values=one.values[rows[id(one.time)]])
            for name, one in series.items()
        }
        note = f"the samples {span} are left out, as stated"
        readings = replace(readings, **kept, warnings=(*readings.warnings, note))
    return readings


def refuse_unknown_format(options: RecordingOptions) -> None:
    """Refuse a format that is not known.

    Raises:
        UsageError: it is not.
    """
    known = IMU_TK, *format_names()  # sessions are recognised by their content
    if options.as_format not in (None, *known):
        raise UsageError(
            f"the format {options.as_format} is not known; give one of {', '.join(known)}",
            settings=("as_format",),
        )


def _from_beginning(series: dict[str, Series]) -> dict[str, Series]:
    """The series with times from the first sample on, if their clock counts from a date."""
    first = min((float(one.time[0]) for one in series.values() if len(one)), default=0.0)
    origin = origin_of_times(first)
    if not origin:
        return series
    return {name: replace(one, time=one.time - origin) for name, one in series.items()}


def _readings(series: dict[str, Series], warnings: Sequence[str]) -> Readings:
    return Readings(
        series["accelerometer"],
        series.get("gyroscope"),
        series.get("magnetometer"),
        series.get("temperature"),
        tuple(warnings),
        series.get("current"),
    )


def _one(path: Path, options: RecordingOptions, place: int) -> FileSamples:
    with naming_file(path):
        if options.as_format is None and is_session(path):
            return _read_session(path, options)
        return _read(path, options, place)


@contextmanager
def naming_file(path: Path) -> Iterator[None]:
    """Add the name of a file to errors that do not have it.

    Raises:
        RecordingError: with the name.
    """
    try:
        yield
    except RecordingError as error:
        if str(path) in str(error):
            raise
        raise RecordingError(f"{path}: {error}", settings=error.settings) from None


def _read(path: Path, options: RecordingOptions, place: int) -> FileSamples:
    """The samples in a file of text or of binary frames."""
    data = unpacked(read_bytes(path), readable_bytes(MAX_BYTES))
    setup = setup_of_file(options, place)
    if is_binary(setup.format):
        return _samples(data, setup)
    try:
        text, notes = decode_text(data)
    except NotTextError:
        if found := binary_format(data):
            return _samples(data, replace(setup, format=found))
        raise
    samples = _samples(text, setup, file=path.name)
    return FileSamples(samples.series, (*notes, *samples.warnings))


def setup_of_file(options: RecordingOptions, place: int) -> StreamSetup:
    """What the user says of a file.

    Args:
        options: the statements.
        place: of the file among those of a pair.

    Raises:
        RecordingError: every column is left out.
        UsageError: a name is not a column.
    """
    name = options.as_format or AUTO
    setup = with_options(StreamSetup(format=name if name != IMU_TK else "csv"), options)
    if options.as_format != IMU_TK:
        return setup
    sensor = _PAIR[place]
    unit = getattr(options, f"{sensor}_unit") or COUNT
    axes = (Column(channel, unit, channel) for channel in SENSOR_CHANNELS[sensor])
    return replace(setup, columns=(Column("t", "s", "t"), *axes))


def binary_format(data: bytes) -> str:
    """The binary format of these bytes, or ""."""
    detector = Detector(whole=True)
    pieces = data[: 1 << 16].splitlines(keepends=True)
    return next(filter(is_binary, map(detector.feed, pieces)), "")


def _samples(data: bytes, setup: StreamSetup, file: str = "") -> FileSamples:
    """The samples in the bytes of a recording.

    Args:
        data: all of them.
        setup: what is known of them.
        file: name of the file, which may name the sensor of its bare axes.

    Raises:
        RecordingError: something is unknown; the message says what to state.
    """
    intake = Intake(setup, recording=True)
    samples = _decode_pieces(intake, ([piece] for piece in line_pieces(data)))
    named = named_by_file(setup, intake, file)
    if named is not setup:
        intake = Intake(named, recording=True)
        samples = _decode_pieces(intake, ([piece] for piece in line_pieces(data)))
    if samples is None:
        raise unreadable(intake, setup)
    samples = known_by_all_readings(samples, intake.guesses)
    left_out = misfits(intake)
    missing = intake.without_number
    if missing:
        left_out += (f"{missing}; left out",)
    return FileSamples(samples.series, (*samples.warnings, *left_out))


def named_by_file(setup: StreamSetup, intake: Intake, file: str) -> StreamSetup:
    """The setup with the sensor that the name of the file implies (``Accelerometer.csv``).

    Args:
        setup: returned as it is if the file's name adds nothing.
        intake: fed with the beginning of the file; it knows the names of the columns.
        file: name of the file, or "".
    """
    names = [c.name for c in intake.columns]
    by_file = tuple(column_of_name(name, file) for name in names)
    bare = {name.lower() for name in names} >= {"x", "y", "z"}
    if setup.columns or not bare or by_file == tuple(map(column_of_name, names)):
        return setup
    return replace(setup, columns=by_file)


def line_pieces(data: bytes) -> Iterator[tuple[bytes, float]]:
    """Whole lines that stay in the processor's cache, each with an arrival time, not used."""
    start = 0
    while start < len(data):
        end = end_of_lines(data, start + FED_BYTES)
        yield data[start:end], 0.0
        start = end


def _decode_pieces(intake: Intake, batches: Iterable[Batch]) -> FileSamples | None:
    """The samples in batches of pieces with their arrival times; None if there are none.

    A batch that is one piece has the arrivals of its last and of its first bytes.
    """
    parts = [
        intake.feed(*batch) if isinstance(batch, tuple) else intake.feed_all(batch)
        for batch in batches
    ]
    found = [part for part in (*parts, intake.flush()) if part is not None]
    if not found:
        return None
    readings = with_signs(join_readings(found), intake.signs)
    series = {name: getattr(readings, name) for name in _SERIES}
    there = {name: one for name, one in series.items() if one is not None and len(one)}
    return FileSamples(there, intake.warnings)


def misfits(intake: Intake) -> tuple[str, ...]:
    """A warning about lines that do not fit the columns.

    Raises:
        RecordingError: they are too many.
    """
    count, rows = intake.malformed, intake.malformed + intake.rows
    malformed = intake.first_malformed
    if not count:
        return ()
    many = "1 line does" if count == 1 else f"{count} of {rows} lines do"
    message = f"{many} not fit the columns"
    if malformed is not None:
        message += f", first line {malformed.number}: '{sanitise(malformed.line, 48)}'"
    if count > max(2, _MAX_MISFITS * rows):
        raise RecordingError(
            f"{message}; name the columns of this file, or repair it", settings=("columns",)
        )
    if count > _MANY_MISFITS * rows:
        return (f"{message}; left out. Check the cable and the speed before the next recording",)
    return (f"{message}; left out",)


def unreadable(intake: Intake, setup: StreamSetup) -> RecordingError:
    """The reason why there are no samples, and the settings that would help."""
    notes, needs = intake.warnings, intake.needs
    # with the rate: which column is the time, which the width of a line does not tell
    of_width = not needs or ("columns" in needs and "rate" not in needs)
    if intake.first_malformed is not None and of_width:
        return _other_width(intake.first_malformed)
    if needs == ("sensor",):
        return RecordingError(f"no sensor is left. {' '.join(notes)}")
    if not needs:
        return RecordingError(
            intake.problem
            or "it contains no line of data, neither numbers nor a known format; record again"
        )
    sentences, settings = list(notes), []
    if "columns" in needs or (not setup.columns and not intake.named):
        names = ",".join(c.channel or "-" for c in intake.columns)
        settings.append(f"columns {names}")
    if "rate" in needs:
        settings.append("rate 100")
    for sensor in ("accelerometer", "gyroscope"):
        if f"{sensor} unit" in needs:
            settings.append(f"{sensor}_unit {next(iter(UNIT_FACTORS[sensor]))}")
        if sensor == "gyroscope" and "gyroscope unit" in needs:
            sentences.append(
                "The unit of the gyroscope is not stated, and a gyroscope at rest does not show it:"
                f" give one of {', '.join(UNIT_FACTORS[sensor])}, {COUNT}"
            )
    return RecordingError(" ".join(sentences), settings=tuple(settings))


def _other_width(malformed: MalformedLine) -> RecordingError:
    """The error if no line has as many fields as columns are named."""
    width = len(split_fields(malformed.line))
    message = f"{malformed.width} columns are named, but the first line of data has {width}"
    if malformed.width < width <= 2 * malformed.width and b"." not in malformed.line:
        return RecordingError(
            f"{message} fields and no decimal point: its numbers seem to be written with a decimal"
            " comma between commas; export it again with points, or with semicolons between the"
            " columns"
        )
    return RecordingError(
        f"{message}: '{sanitise(malformed.line, 48)}'; name all {width} columns (- skips a column)",
        settings=("columns",),
    )


def _read_session(path: Path, options: RecordingOptions) -> FileSamples:
    """The samples of a session, decoded from its bytes.

    Raises:
        SessionError: the file cannot be read.
        RecordingError: its bytes do not give samples.
    """
    from imucal_wizard.acquire.files.session_salvage import read_session  # SQLite

    made: list[Intake] = []

    def decode(
        about: dict[str, Any], batches: Iterator[Batch]
    ) -> tuple[Intake, FileSamples | None]:
        setup = session_setup(path, about, options)
        first = next(batches, None)
        if first is None:
            raise RecordingError("nothing was received in this session; resume it and measure")
        intake = Intake(setup, check_values=False)  # all is checked later
        made.append(intake)
        return intake, _decode_pieces(intake, chain([first], batches))

    (intake, samples), damage = read_session(
        path, decode, FED_BYTES, lambda: made[-1].longest_pause if made else 0.0
    )
    if samples is None:
        raise RecordingError(
            _why_nothing(intake), settings=tuple(need.replace(" ", "_") for need in intake.needs)
        )
    told = told_of_gaps(samples)
    warnings = [*([damage] if damage else []), *told.warnings]
    if intake.lost and told.warnings == samples.warnings:
        warnings.append(
            f"{intake.lost} samples are missing; rotations whose angle they leave open are not used"
        )
    if intake.malformed:
        warnings.append(f"{intake.malformed} lines or frames could not be read; left out")
    return FileSamples(samples.series, tuple(warnings))


def session_setup(path: Path, about: dict[str, Any], options: RecordingOptions) -> StreamSetup:
    """The setup of a session with the user's statements.

    Args:
        path: the session.
        about: its settings.
        options: the statements.

    Raises:
        RecordingError: every column is left out.
        SessionError: the setup is damaged.
        UsageError: a name is not a column.
    """
    try:
        setup = StreamSetup.from_json(about.get("setup", {}))
    except (UsageError, AttributeError) as error:
        raise SessionError(f"{path} lacks its settings ({error}); begin a new session") from error
    return with_options(setup, options)


def _why_nothing(intake: Intake) -> str:
    if intake.needs:
        return f"the stream does not state its {', '.join(intake.needs)}"
    if intake.problem:
        return intake.problem
    if intake.format:
        return "its rate cannot be determined from so few samples; give the samples per second"
    return "no format known here was found in it; say which it is"


def with_options(setup: StreamSetup, options: RecordingOptions) -> StreamSetup:
    """The setup with the user's statements.

    Raises:
        RecordingError: every column is left out.
        UsageError: a name is not a column.
    """
    columns = setup.columns
    if options.columns:
        columns = named_columns(",".join(options.columns))
        if not any(c.channel for c in columns):
            raise RecordingError(
                "the given columns leave every column out; name at least ax,ay,az",
                settings=("columns",),
            )
    return replace(
        setup,
        columns=columns,
        rate=options.rate or setup.rate,
        accelerometer_unit=options.accelerometer_unit or setup.accelerometer_unit,
        gyroscope_unit=options.gyroscope_unit or setup.gyroscope_unit,
        magnetometer_unit=options.magnetometer_unit or setup.magnetometer_unit,
    )


def _merged(
    paths: Sequence[Path], samples: Sequence[FileSamples]
) -> tuple[dict[str, Series], list[str]]:
    """Each sensor from the file that contains it.

    Raises:
        RecordingError: two files hold the same sensor.
    """
    series: dict[str, Series] = {}
    source: dict[str, Path] = {}
    warnings: list[str] = []
    for path, one in zip(paths, samples, strict=True):
        prefix = f"{without_control_characters(path.name)}: " if len(paths) > 1 else ""
        warnings += [begun(prefix, text) for text in one.warnings]
        for sensor, found in one.series.items():
            if sensor in _BESIDE and sensor in series:
                continue
            if sensor in series:
                raise RecordingError(
                    f"{source[sensor]} and {path} both hold the {sensor}; of files given together "
                    "either all hold the same sensors or each holds other ones, so give these "
                    "one at a time"
                )
            series[sensor], source[sensor] = found, path
    return series, warnings


def _in_order_of_date(
    paths: Sequence[Path], files: Sequence[FileSamples]
) -> tuple[list[Path], list[FileSamples]]:
    """Files with the same sensors in the order in which they were recorded, if their times tell it.

    Raises:
        RecordingError: by their times, two of them were recorded at once.
    """
    known = []
    for path, one in zip(paths, files, strict=True):
        times = [series.time for series in one.series.values()]
        ends = min(float(time[0]) for time in times), max(float(time[-1]) for time in times)
        known.append((ends, path, one))
    if all(start >= MIN_DATE_SECONDS for (start, _), _, _ in known):  # else each may count from 0
        known.sort(key=lambda one: one[0])
        for ((_, end), path, _), ((start, _), other, _) in pairwise(known):
            if start < end:
                raise RecordingError(
                    f"by their times, {path} and {other} were recorded at once, with the same "
                    "sensors: they are of two devices, so give them one at a time"
                )
    return [path for _, path, _ in known], [one for _, _, one in known]


def _one_after_another(paths: Sequence[Path], files: Sequence[FileSamples]) -> list[FileSamples]:
    """Files that hold the same sensors as one, each later than the one before.

    Raises:
        RecordingError: a sensor has different units in them, or two of them are the same or of two
            sensors.
    """
    joined: dict[str, list[Series]] = {}
    main = joined.setdefault(next(name for name in files[0].series if name not in _BESIDE), [])
    origin = 0.0
    for path, one in zip(paths, files, strict=True):
        first = min(float(series.time[0]) for series in one.series.values())
        times = {id(own.time): own.time - first + origin for own in one.series.values()}
        for name, series in one.series.items():
            before = joined.setdefault(name, [])
            if before and before[0].unit != series.unit:
                raise RecordingError(
                    f"{path}: the {name} is in {series.unit}, but before it was "
                    f"in {before[0].unit}; give the same unit for all files"
                )
            before.append(replace(series, time=times[id(series.time)]))
        if any(np.array_equal(main[-1].values, part.values) for part in main[:-1]):
            raise RecordingError(f"{path} has the same samples as another file")
        for other, part in zip(paths, main[:-1], strict=False):
            if recorded_at_once(part, main[-1]):
                raise RecordingError(
                    f"{other} and {path} are of one session by their times and their motion, and "
                    "only one of them shows gravity: they are the accelerometer's file and the "
                    "gyroscope's. Name the columns of each, or state the format of the pair and "
                    "give the accelerometer's file first.",
                    settings=(f"as_format {IMU_TK}",),
                )
        origin = RESTART_GAP_SECONDS + max(float(own[-1].time[-1]) for own in joined.values())
    whole: dict[str, Series] = {}
    time = np.concatenate([part.time for part in main])
    for name, parts in joined.items():
        at_once = len(parts) == len(main) and all(
            a.time is b.time for a, b in zip(parts, main, strict=True)
        )
        found = join_series(parts, time if at_once else None)
        if found is not None:
            whole[name] = found
    return [FileSamples({} if i else whole, one.warnings) for i, one in enumerate(files)]


def _apart(readings: Readings) -> list[str]:
    """A warning if the times of two sensors hardly overlap.

    Raises:
        RecordingError: they do not overlap at all.
    """
    warnings = []
    own = readings.accelerometer.time
    for name in ("gyroscope", "magnetometer"):
        series = getattr(readings, name)
        if series is None or series.time is own:
            continue
        overlap = min(own[-1], series.time[-1]) - max(own[0], series.time[0])
        if overlap <= 0:
            raise RecordingError(
                f"the times of accelerometer ({own[0]:.6g} to {own[-1]:.6g} s) and {name}"
                f" ({series.time[0]:.6g} to {series.time[-1]:.6g} s) do not overlap; give files"
                " whose times have one origin"
            )
        if overlap < 0.9 * (own[-1] - own[0]):
            warnings.append(f"the {name} covers only {overlap:.4g} s of the accelerometer's time")
    return warnings
