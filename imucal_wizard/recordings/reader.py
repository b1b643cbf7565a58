"""The one way in: files of one session, in whatever format, to one ``Readings``."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from imucal_wizard.devices import formats
from imucal_wizard.errors import RecordingError, UsageError
from imucal_wizard.output import harmless
from imucal_wizard.readings import Readings, Series
from imucal_wizard.recordings.checks import check
from imucal_wizard.recordings.columns import BESIDE, Samples
from imucal_wizard.recordings.delimited import read_text
from imucal_wizard.recordings.exchanged import refuse
from imucal_wizard.recordings.imu_tk import read_imu_tk
from imucal_wizard.recordings.options import RecordingOptions
from imucal_wizard.recordings.text import is_database
from imucal_wizard.units import SI_UNIT

_IMU_TK = "imu_tk"


def format_names() -> tuple[str, ...]:
    """Names that ``--as`` takes; a session is known by its content."""
    return (_IMU_TK, *formats.format_names())


def read(
    paths: Sequence[Path], options: RecordingOptions | None = None, *, field_alone: bool = False
) -> Readings:
    """The readings in the files of one session.

    Files that hold different sensors, each with its own times, become one recording.

    Args:
        paths: the files.
        options: what is known about them beyond their content.
        field_alone: a magnetometer alone will do; the accelerometer then has no samples.

    Raises:
        RecordingError: a file cannot be read, or lacks something; the message says what to give.
        UsageError: the options do not fit the files.
    """
    options = options or RecordingOptions()
    if not paths:
        raise UsageError("no recording was given; name at least one file")
    samples = _each(paths, options)
    series, warnings = _merge(paths, samples)
    if field_alone and set(series) & {"accelerometer", "magnetometer"} == {"magnetometer"}:
        return _field_alone(series, warnings)
    _need_accelerometer(paths, series, warnings)
    readings = Readings(
        series["accelerometer"],
        series.get("gyroscope"),
        series.get("magnetometer"),
        series.get("temperature"),
        current=series.get("current", series.get("throttle")),
    )
    warnings += _apart(readings)
    try:
        refuse(readings)
    except RecordingError as error:
        raise RecordingError(f"{_names(paths)}: {error}") from None
    return replace(readings, warnings=tuple(dict.fromkeys((*warnings, *check(readings)))))


def _field_alone(series: dict[str, Series], warnings: Sequence[str]) -> Readings:
    """A magnetometer, with what stands beside it."""
    return Readings(
        Series(np.zeros(0), np.zeros((0, 3)), SI_UNIT["accelerometer"]),
        None,
        series["magnetometer"],
        series.get("temperature"),
        tuple(warnings),
        series.get("current", series.get("throttle")),
    )


def _need_accelerometer(
    paths: Sequence[Path], series: dict[str, Series], warnings: Sequence[str]
) -> None:
    if not series:
        raise RecordingError(f"{_names(paths)}: no sensor is left. {'; '.join(warnings)}".rstrip())
    if "accelerometer" not in series:
        names = ", ".join(sorted(series))
        raise RecordingError(
            f"{_names(paths)}: there is no accelerometer, only {names}; give the file that holds it"
            " as well, or name the columns with --columns"
        )


def _each(paths: Sequence[Path], options: RecordingOptions) -> list[Samples]:
    if options.as_format not in (None, *format_names()):
        known = ", ".join(format_names())
        raise UsageError(f"--as {options.as_format} is not known; give one of {known}")
    if options.as_format == _IMU_TK:
        return read_imu_tk(paths, options)
    samples = []
    for path in paths:
        try:
            samples.append(_one(path, options))
        except RecordingError as error:
            says = str(error)
            raise RecordingError(says if str(path) in says else f"{path}: {says}") from None
    return samples


def _one(path: Path, options: RecordingOptions) -> Samples:
    if options.as_format is None and is_database(path):
        from imucal_wizard.recordings.session import read_session

        return read_session(path, options)
    return read_text(path, options)


def _merge(
    paths: Sequence[Path], samples: Sequence[Samples]
) -> tuple[dict[str, Series], list[str]]:
    """Each sensor from the file that holds it.

    Raises:
        RecordingError: two files hold the same sensor.
    """
    series: dict[str, Series] = {}
    source: dict[str, Path] = {}
    warnings: list[str] = []
    for path, one in zip(paths, samples, strict=False):
        prefix = f"{harmless(path.name)}: " if len(paths) > 1 else ""
        warnings += [prefix + text for text in one.warnings]
        for sensor, found in one.series.items():
            if sensor in BESIDE and sensor in series:
                continue
            if sensor in series:
                raise RecordingError(
                    f"{source[sensor]} and {path} both hold the {sensor}; files given together"
                    " hold different sensors of one session, so give these one at a time"
                )
            series[sensor], source[sensor] = found, path
    return series, warnings


def _apart(readings: Readings) -> list[str]:
    """A warning when the times of two sensors do not meet.

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


def _names(paths: Sequence[Path]) -> str:
    return ", ".join(str(path) for path in paths)
