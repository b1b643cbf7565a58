"""What well-known firmware prints, as a table: a new one is one entry.

Sources: the print statements of the named firmware and its documentation.
"""

from collections import Counter
from collections.abc import Sequence
from functools import partial

from imucal_wizard.acquire.decode.base import Column, Format, Line
from imucal_wizard.acquire.decode.labelled import Kind, LabelledDecoder
from imucal_wizard.core.records import dataclass


@dataclass(frozen=True)
class Preset:
    """A text format whose columns and units are known.

    Attributes:
        name: as ``--format`` takes it.
        title: who prints it.
        kinds: the lines that make up one sample.
        note: what a user of it should know, or ``""``.
        patience: how many lines of each kind must have come before the format is plain.
    """

    name: str
    title: str
    kinds: tuple[Kind, ...]
    note: str = ""
    patience: int = 3


def _three(letter: str, unit: str) -> tuple[Column, ...]:
    return tuple(Column(letter + axis, unit, letter + axis) for axis in "xyz")


def _skip(*names: str) -> tuple[Column, ...]:
    return tuple(Column("", "", name) for name in names)


_TEMPERATURE = Column("temp", "degC", "temperature")
_MICROSECONDS = Column("t", "us", "time")
_VECTORNAV = (*_three("m", "G"), *_three("a", "m/s^2"), *_three("g", "rad/s"))
_LSB = 9.8 / 8192  # the firmware makes the integer from m/s² with exactly this factor

PRESETS: tuple[Preset, ...] = (
    Preset(
        "raw-uni",
        "Adafruit_AHRS calibration, SensorLab imucal (MotionCal lines)",
        (
            Kind(
                "Raw:",
                (*_three("a", "m/s^2"), *_skip(*(f"raw {place}" for place in range(4, 10)))),
                (_LSB, _LSB, _LSB, 1, 1, 1, 1, 1, 1),
            ),
            Kind(
                "Uni:",
                _skip("uni 1", "uni 2", "uni 3") + _three("g", "rad/s") + _three("m", "uT"),
            ),
        ),
        "The accelerometer is taken from the Raw: lines, which are eight times finer than Uni:, "
        "and overflows beyond 4 g.",
    ),
    Preset(
        "raw",
        "MotionCal lines, Raw: alone",
        (Kind("Raw:", _three("a", "count") + _three("g", "count") + _three("m", "count")),),
        patience=10,
    ),
    Preset(
        "uni",
        "MotionCal lines, Uni: alone",
        (Kind("Uni:", _three("a", "m/s^2") + _three("g", "rad/s") + _three("m", "uT")),),
        patience=10,
    ),
    Preset(
        "sparkfun-scaled",
        "SparkFun ICM-20948 Example1_Basics",
        (
            Kind(
                "Scaled.",
                (*_three("a", "mg"), *_three("g", "deg/s"), *_three("m", "uT"), _TEMPERATURE),
            ),
        ),
    ),
    Preset(
        "sparkfun-raw",
        "SparkFun ICM-20948 Example1_Basics, raw counts",
        (
            Kind(
                "RAW.",
                (*_three("a", "count"), *_three("g", "count"), *_three("m", "count"), _TEMPERATURE),
                (1, 1, 1, 1, 1, 1, 1, 1, 1, 1 / 333.87),
            ),
        ),
        "Temperature is printed as counts: only its changes are right.",
    ),
    Preset(
        "razor-ahrs",
        "SparkFun 9DoF Razor AHRS 1.4, raw text (#osrt)",
        (
            Kind("#A-R=", _three("a", "count"), (-1, -1, -1)),
            Kind("#M-R=", _three("m", "count")),
            Kind("#G-R=", _three("g", "count")),
        ),
        "This firmware prints gravity instead of specific force: the sign is turned.",
    ),
    Preset(
        "i2cdev",
        "i2cdevlib MPU6050_raw",
        (Kind("a/g:", _three("a", "count") + _three("g", "count")),),
    ),
    Preset(
        "vnimu",
        "VectorNav VNIMU, uncompensated",
        (
            Kind(
                "$VNIMU,",
                (*_VECTORNAV, _TEMPERATURE, *_skip("pressure")),
                checked=True,
            ),
        ),
    ),
    Preset(
        "vnymr",
        "VectorNav VNYMR, compensated",
        (
            Kind(
                "$VNYMR,",
                (*_skip("yaw", "pitch", "roll"), *_VECTORNAV),
                checked=True,
            ),
        ),
        "VNYMR is already compensated by the device: set it to VNIMU ($VNWRG,06,19*XX).",
    ),
    Preset(
        "ximu3",
        "x-IMU3, ASCII mode",
        (
            Kind("I,", (_MICROSECONDS, *_three("g", "deg/s"), *_three("a", "g"))),
            Kind("M,", _skip("time") + _three("m", ""), often=False),
            Kind("T,", (*_skip("time"), _TEMPERATURE), often=False),
        ),
    ),
    Preset(
        "adafruit-mpu6050",
        "Adafruit_MPU6050 basic_readings",
        (
            Kind("Acceleration X:", _three("a", "m/s^2")),
            Kind("Rotation X:", _three("g", "rad/s")),
            Kind("Temperature:", (_TEMPERATURE,)),
        ),
    ),
    Preset(
        "adafruit-bno055",
        "Adafruit_BNO055 read_all_data",
        (
            Kind("Accl:", _three("a", "m/s^2")),
            Kind("Gyro:", _three("g", "deg/s")),
            Kind("Mag:", _three("m", "uT"), often=False),
            Kind("temperature:", (_TEMPERATURE,), often=False),
        ),
        "In its fusion modes the BNO055 has already taken its own offsets out: switch it to AMG, "
        "a non-fusion mode, before calibrating.",
    ),
)
"""Formats with a word at the start of each line."""


class _Detector:
    """So many lines of each kind that belongs to every sample."""

    def __init__(self, preset: Preset) -> None:
        self._preset = preset
        self._seen: Counter[str] = Counter()

    def feed(self, _data: bytes, lines: Sequence[Line]) -> bool:
        """Whether the format is certain."""
        kinds = self._preset.kinds
        self._seen.update(
            k.prefix for line in lines for k in kinds if line.text.startswith(k.prefix)
        )
        return min(self._seen[k.prefix] for k in kinds if k.often) >= self._preset.patience


def _decoder(preset: Preset, columns: tuple[Column, ...], whole: bool) -> LabelledDecoder:
    return LabelledDecoder(preset.kinds, columns, preset.name, whole=whole)


def _detector(preset: Preset, _columns: tuple[Column, ...]) -> _Detector:
    return _Detector(preset)


FORMATS = tuple(
    Format(one.name, one.title, partial(_decoder, one), partial(_detector, one), one.note, rank=1)
    for one in PRESETS
)
