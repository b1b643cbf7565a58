"""The recordings and the commands that are run on each of them."""

import functools
import lzma
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tests.shared_data import shared_data

DATA = Path(__file__).parent / "data"
EXPECTED = Path(__file__).parent / "expected"

SHARED = "shared:"
"""Prefix of a file among the optional real recordings."""


@dataclass(frozen=True)
class Case:
    """Files of one session, how they are read, and the commands to run on them.

    Attributes:
        files: names in ``data`` without ``.xz``, or paths in the shared data.
        commands: each the name of a command and its options.
        note: how the recording was made.
        reading: options that say how the files are to be read.
        study: commands that take long; run with the studies.
    """

    files: tuple[str, ...]
    commands: tuple[str, ...]
    note: str
    reading: str = ""
    study: tuple[str, ...] = ()

    def arguments(self, command: str) -> list[str]:
        """The whole command line after the program's name."""
        name, *options = command.split()
        paths = [str(located(file)) for file in self.files]
        return [name, *paths, *self.reading.split(), *options, "--json", "-"]


FIT, COMPARE, BENCH, AUTO = "fit", "compare", "bench", "bench --auto"
UNITS_SAID = "--columns ax,ay,az,gx,gy,gz --rate 100 --accel-unit m/s^2 --gyro-unit rad/s"

CASES = {
    "eighteen-poses": Case(
        ("eighteen-poses.csv",),
        (FIT,),
        "simulate --rate 50 --seed 11",
        study=(COMPARE, BENCH),
    ),
    "magnetometer": Case(
        ("magnetometer.csv",),
        (FIT,),
        "simulate --rate 25 --seed 12 --poses 6 --magnetometer",
        study=(COMPARE, BENCH),
    ),
    "counts": Case(
        ("counts.csv",),
        (FIT, BENCH, "fit --method newton --gyro-method dynamic"),
        "simulate --rate 50 --seed 13, columns in counts of 16384 per g and 16.4 per °/s",
    ),
    "second-order": Case(
        ("second-order.csv",),
        (FIT,),
        "simulate --rate 25 --seed 14 --poses 26+repeats --hidden second-order:5:y; no gyroscope",
        study=(AUTO,),
    ),
    "bias-temperature": Case(
        ("bias-temperature.csv",),
        (),
        "simulate --rate 25 --seed 15 --poses 26+repeats --hidden bias-temperature:2:z; "
        "no gyroscope",
        study=(AUTO,),
    ),
    "g-sensitivity": Case(
        ("g-sensitivity.csv",),
        (),
        "simulate --rate 50 --seed 16 --hidden gyroscope/g-sensitivity:0.2:x",
        study=(AUTO,),
    ),
    "field-temperature": Case(
        ("field-temperature.csv",),
        (),
        "simulate --rate 25 --seed 17 --poses 6 --magnetometer "
        "--hidden magnetometer/bias-temperature:0.5:x",
        study=(AUTO,),
    ),
    "noisy": Case(
        ("noisy.csv",),
        (FIT,),
        "simulate --rate 50 --seed 18, with white noise of 0.08 m/s² and 0.01 rad/s added",
        study=(BENCH,),
    ),
    "other-columns": Case(
        ("other-columns.csv",),
        (FIT,),
        "the first 18 poses again: time in ms last, accelerations in mg, rates in deg/s first",
    ),
    "no-header": Case(
        ("no-header.csv",),
        (FIT,),
        "the first 18 poses again, without header and time",
        "--columns gx,gy,gz,-,ax,ay,az --rate 50 --accel-unit g --gyro-unit deg/s",
    ),
    "two-files": Case(
        ("two-files-accelerometer.csv", "two-files-gyroscope.csv"),
        ("fit --method six-position --gyro-method static",),
        "simulate --rate 50 --seed 19 --poses 6, a file for each sensor",
    ),
    "six-faces": Case(
        ("six-faces.csv",),
        (FIT, BENCH),
        "simulate --rate 50 --seed 20 --poses 6, no gyroscope",
    ),
    "flat": Case(("flat.csv",), (FIT, BENCH), "the first 15 s of the first: insufficient"),
    "session-whole": Case(
        ("whole.imucal",),
        (FIT, BENCH),
        "the wizard unattended: --auto --seed 21 --rotations 2",
    ),
    "session-undone": Case(
        ("undone.imucal",),
        (FIT,),
        "a session in which the operator took a pose back and that was left before its end",
        study=("fit --all-samples",),
    ),
    "session-magnetometer": Case(
        ("field.imucal",),
        (FIT, BENCH),
        "the wizard unattended: --auto --seed 22 --rotations 1 --poses 8 --magnetometer",
    ),
    "xsens": Case(
        (SHARED + "imu_tk_xsens/xsens_acc.mat", SHARED + "imu_tk_xsens/xsens_gyro.mat"),
        (FIT, COMPARE, BENCH),
        "imu_tk's Xsens MTi in raw counts",
        "--as imu_tk",
    ),
    "mikoff-0": Case(
        (SHARED + "mikoff_mpu9150/imu0.log",), (FIT,), "an MPU-9150", UNITS_SAID, (BENCH,)
    ),
    "mikoff-1": Case(
        (SHARED + "mikoff_mpu9150/imu1.log",), (), "another MPU-9150", UNITS_SAID, (FIT,)
    ),
    "imucal": Case(
        (SHARED + "imucal_example/example_ferraris_session.csv",),
        (FIT,),
        "imucal's example: six faces and three full turns",
        "--rate 102.4 --accel-unit m/s^2 --gyro-unit deg/s",
    ),
}

TOLD_ALIKE = (
    "counts",
    "second-order",
    "six-faces",
    "session-whole",
    "session-magnetometer",
    "xsens",
)
"""Cases of which all commands must tell the same figures: ``tests/test_one_figure.py`` runs
``fit``, ``bench`` and ``compare`` on them. Gyroscopes by gravity, and by gravity and field; counts;
sessions; a missing effect; too few directions; a real sensor."""
ALIKE_COMMANDS = (FIT, BENCH, COMPARE)


def located(file: str) -> Path:
    """The path of a recording; skips the test where the real ones are not there."""
    if file.startswith(SHARED):
        return shared_data(file.removeprefix(SHARED))
    return _unpacked(file)


@functools.cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    """Where this run unpacks recordings; removed at its end."""
    return tempfile.TemporaryDirectory(prefix="golden-")


@functools.cache
def _unpacked(file: str) -> Path:
    path = Path(_folder().name) / file
    path.write_bytes(lzma.decompress((DATA / f"{file}.xz").read_bytes()))
    return path
