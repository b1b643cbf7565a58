"""The text formats of well-known firmware as a table; a new one is one entry.

Sources: the print statements of the named firmware and its documentation.
"""

from collections import Counter
from collections.abc import Sequence
from functools import partial

from imucal_wizard.acquire.decode.base import Column, Format, TextLine, axes
from imucal_wizard.acquire.decode.labelled import LabelledDecoder, LineKind
from imucal_wizard.core.records import dataclass


@dataclass(frozen=True)
class FirmwareText:
    """A text format whose columns and units are known.

    Attributes:
        name: name under which the user can choose it.
        title: firmware that prints it.
        kinds: the kinds of line that make up one sample.
        note: message to its users, or ``""``.
        min_lines: lines of each kind needed to recognise the format.
    """

    name: str
    title: str
    kinds: tuple[LineKind, ...]
    note: str = ""
    min_lines: int = 3


def _skip(*names: str) -> tuple[Column, ...]:
    return tuple(Column("", "", name) for name in names)


_TEMPERATURE = Column("temp", "degC", "temperature")
_MICROSECONDS = Column("t", "us", "time")
_VECTORNAV = (*axes("m", "G"), *axes("a", "m/s^2"), *axes("g", "rad/s"))
_LSB = 9.8 / 8192  # the firmware makes the integer from m/s² with exactly this factor

FIRMWARE_TEXTS: tuple[FirmwareText, ...] = (
    FirmwareText(
        "raw-uni",
        "Adafruit_AHRS calibration, SensorLab imucal (MotionCal lines)",
        (
            LineKind(
                "Raw:",
                (*axes("a", "m/s^2"), *_skip(*(f"raw {place}" for place in range(4, 10)))),
                (_LSB, _LSB, _LSB, 1, 1, 1, 1, 1, 1),
            ),
            LineKind(
                "Uni:",
                _skip("uni 1", "uni 2", "uni 3") + axes("g", "rad/s") + axes("m", "uT"),
            ),
        ),
        "The accelerometer is taken from the Raw: lines, which are eight times finer than Uni:, "
        "and overflows beyond 4 g.",
    ),
    FirmwareText(
        "raw",
        "MotionCal lines, Raw: alone",
        (LineKind("Raw:", axes("a", "count") + axes("g", "count") + axes("m", "count")),),
        min_lines=10,
    ),
    FirmwareText(
        "uni",
        "MotionCal lines, Uni: alone",
        (LineKind("Uni:", axes("a", "m/s^2") + axes("g", "rad/s") + axes("m", "uT")),),
        min_lines=10,
    ),
    FirmwareText(
        "sparkfun-scaled",
        "SparkFun ICM-20948 Example1_Basics",
        (
            LineKind(
                "Scaled.",
                (*axes("a", "mg"), *axes("g", "deg/s"), *axes("m", "uT"), _TEMPERATURE),
            ),
        ),
    ),
    FirmwareText(
        "sparkfun-raw",
        "SparkFun ICM-20948 Example1_Basics, raw counts",
        (
            LineKind(
                "RAW.",
                (*axes("a", "count"), *axes("g", "count"), *axes("m", "count"), _TEMPERATURE),
                (1, 1, 1, 1, 1, 1, 1, 1, 1, 1 / 333.87),
            ),
        ),
        "Temperature is printed as counts: only its changes are right.",
    ),
    FirmwareText(
        "razor-ahrs",
        "SparkFun 9DoF Razor AHRS 1.4, raw text (#osrt)",
        (
            LineKind("#A-R=", axes("a", "count"), (-1, -1, -1)),
            LineKind("#M-R=", axes("m", "count")),
            LineKind("#G-R=", axes("g", "count")),
        ),
        "This firmware prints gravity instead of specific force: the sign is inverted.",
    ),
    FirmwareText(
        "i2cdev",
        "i2cdevlib MPU6050_raw",
        (LineKind("a/g:", axes("a", "count") + axes("g", "count")),),
    ),
    FirmwareText(
        "vnimu",
        "VectorNav VNIMU, uncompensated",
        (
            LineKind(
                "$VNIMU,",
                (*_VECTORNAV, _TEMPERATURE, *_skip("pressure")),
                checked=True,
            ),
        ),
    ),
    FirmwareText(
        "vnymr",
        "VectorNav VNYMR, compensated",
        (
            LineKind(
                "$VNYMR,",
                (*_skip("yaw", "pitch", "roll"), *_VECTORNAV),
                checked=True,
            ),
        ),
        "VNYMR is already compensated by the device: set it to VNIMU ($VNWRG,06,19*XX).",
    ),
    FirmwareText(
        "ximu3",
        "x-IMU3, ASCII mode",
        (
            LineKind("I,", (_MICROSECONDS, *axes("g", "deg/s"), *axes("a", "g"))),
            LineKind("M,", _skip("time") + axes("m", ""), in_every_sample=False),
            LineKind("T,", (*_skip("time"), _TEMPERATURE), in_every_sample=False),
        ),
    ),
    FirmwareText(
        "adafruit-mpu6050",
        "Adafruit_MPU6050 basic_readings",
        (
            LineKind("Acceleration X:", axes("a", "m/s^2")),
            LineKind("Rotation X:", axes("g", "rad/s")),
            LineKind("Temperature:", (_TEMPERATURE,)),
        ),
    ),
    FirmwareText(
        "adafruit-bno055",
        "Adafruit_BNO055 read_all_data",
        (
            LineKind("Accl:", axes("a", "m/s^2")),
            LineKind("Gyro:", axes("g", "deg/s")),
            LineKind("Mag:", axes("m", "uT"), in_every_sample=False),
            LineKind("temperature:", (_TEMPERATURE,), in_every_sample=False),
        ),
        "In its fusion modes the BNO055 has already removed its own offsets: switch it to AMG, "
        "a non-fusion mode, before calibrating.",
    ),
)
"""Formats with a keyword at the start of each line."""


class _Detector:
    """Recognises a format by enough lines of each kind that belongs to every sample."""

    def __init__(self, preset: FirmwareText) -> None:
        self._preset = preset
        self._seen: Counter[str] = Counter()

    def feed(self, _data: bytes, lines: Sequence[TextLine]) -> bool:
        """Whether the format is certain."""
        kinds = self._preset.kinds
        self._seen.update(
            k.prefix for line in lines for k in kinds if line.text.startswith(k.prefix)
        )
        return (
            min(self._seen[k.prefix] for k in kinds if k.in_every_sample) >= self._preset.min_lines
        )


def _decoder(preset: FirmwareText, columns: tuple[Column, ...], whole: bool) -> LabelledDecoder:
    return LabelledDecoder(preset.kinds, columns, preset.name, whole=whole)


def _detector(preset: FirmwareText, _columns: tuple[Column, ...]) -> _Detector:
    return _Detector(preset)


FORMATS = tuple(
    Format(one.name, one.title, partial(_decoder, one), partial(_detector, one), one.note, rank=1)
    for one in FIRMWARE_TEXTS
)
