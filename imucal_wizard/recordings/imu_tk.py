"""Text pairs of imu_tk: one file for each sensor, lines ``t x y z`` with the time in seconds."""

from collections.abc import Sequence
from pathlib import Path

from imucal_wizard.devices.formats.base import Column
from imucal_wizard.errors import RecordingError, UsageError
from imucal_wizard.recordings.columns import Samples, to_samples
from imucal_wizard.recordings.header import SENSOR_CHANNELS
from imucal_wizard.recordings.layout import Layout
from imucal_wizard.recordings.options import RecordingOptions
from imucal_wizard.recordings.table import read_table
from imucal_wizard.recordings.text import decode, read_bytes
from imucal_wizard.units import COUNT

_ORDER = ("accelerometer", "gyroscope")


def read_imu_tk(paths: Sequence[Path], options: RecordingOptions) -> list[Samples]:
    """The accelerometer in the first file and the gyroscope in the second; counts by default.

    Raises:
        UsageError: more than two files are given.
        RecordingError: a file cannot be read.
    """
    if len(paths) > len(_ORDER):
        raise UsageError(
            f"--as imu_tk reads the accelerometer's and the gyroscope's file, not {len(paths)}"
            " files; give ACC.mat GYRO.mat in this order"
        )
    samples = []
    for path, sensor in zip(paths, _ORDER, strict=False):
        try:
            samples.append(_read_one(path, sensor, options))
        except RecordingError as error:
            raise RecordingError(f"{path}: {error}") from None
    return samples


def _read_one(path: Path, sensor: str, options: RecordingOptions) -> Samples:
    unit = options.unit(sensor) or COUNT
    columns = (Column("t", "s"), *(Column(name, unit) for name in SENSOR_CHANNELS[sensor]))
    table = read_table(decode(read_bytes(path)), Layout(None, 4, (0, 1, 2, 3)), 1)
    samples = to_samples(table.values, columns, options)
    return Samples(samples.series, table.warnings + samples.warnings)
