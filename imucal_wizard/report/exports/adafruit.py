"""Adafruit: ``sensor_calib.json``, and the 68-byte packet of MotionCal beside it.

The firmware computes ``a − accel_zerog`` (m/s²), ``g − gyro_zerorate`` (rad/s) and ``S (m −
hardiron)`` (µT) in single precision, S symmetric. The packet is ``75 54``, sixteen floats
(accelerometer offsets, gyroscope offsets, hard iron, field, S as 00, 11, 22, 01, 02, 12) and a
CRC-16 (polynomial A001 reversed, start FFFF) over all before it.
"""

import json
import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.gauge import symmetric
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.proof import Correction, Samples
from imucal_wizard.report.reduced import Kept

_PACKET = "-packet.bin"
_HEAD = b"\x75\x54"
_FLOATS = 16
_PLACES = (0, 4, 8, 1, 2, 5)
"""Of the six entries of S that the packet has, in the row-major matrix."""


def turned_by(matrix: FloatArray) -> float:
    """Angle between a matrix's frame and that of its symmetric form, rad."""
    rotation, _ = symmetric(matrix)
    return float(np.arccos(np.clip(0.5 * (np.trace(rotation) - 1.0), -1.0, 1.0)))


def lost_alignment(calibration: Calibration) -> tuple[str, ...]:
    """What the symmetric form of the magnetometer's matrix loses."""
    if "magnetometer" not in calibration.sensors:
        return ()
    angle = np.degrees(turned_by(np.array(calibration["magnetometer"].matrix)))
    if angle < 1e-6:
        return ()
    return (f"alignment of the magnetometer with the accelerometer: {angle:.2f}° between them",)


def _crc(data: bytes) -> int:
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    del settings
    zeros = {
        name: np.array(calibration[name].bias) if name in calibration.sensors else np.zeros(3)
        for name in ("accelerometer", "gyroscope", "magnetometer")
    }
    soft, field = np.eye(3), 0.0
    if "magnetometer" in calibration.sensors:
        sensor = calibration["magnetometer"]
        soft = symmetric(np.array(sensor.matrix))[1]
        readings = np.array([one.reading for one in calibration.field_means]).reshape(-1, 3)
        sizes = np.linalg.norm((readings - sensor.bias) @ soft.T, axis=1)
        field = float(sizes.mean()) if len(sizes) else 0.0
    document = {
        "mag_hardiron": zeros["magnetometer"].tolist(),
        "mag_softiron": soft.ravel().tolist(),
        "mag_field": field,
        "gyro_zerorate": zeros["gyroscope"].tolist(),
        "accel_zerog": zeros["accelerometer"].tolist(),
    }
    numbers = [
        *zeros["accelerometer"],
        *zeros["gyroscope"],
        *zeros["magnetometer"],
        field,
        *soft.ravel()[list(_PLACES)],
    ]
    body = _HEAD + struct.pack(f"<{_FLOATS}f", *numbers)
    packet = body + struct.pack("<H", _crc(body))
    return {"": json.dumps(document).encode() + b"\n", _PACKET: packet}


def _received(packet: bytes) -> FloatArray:
    """The floats of a packet, checked as the firmware does.

    Raises:
        ValueError: it is no packet.
    """
    if len(packet) != 4 + 4 * _FLOATS or packet[:2] != _HEAD or _crc(packet) != 0:
        raise ValueError("no packet of MotionCal")
    return np.frombuffer(packet[2:-2], "<f4").astype(np.float32)


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """The firmware's three formulas, in single precision.

    Raises:
        ValueError: the files are of another kind, or do not say the same.
    """
    del settings
    sent = _received(files[_PACKET]) if _PACKET in files else None
    if "" not in files:  # the packet of an earlier export alone
        return {}
    document = json.loads(files[""])
    single = {key: np.array(value, np.float32) for key, value in document.items()}
    soft = single["mag_softiron"].reshape(3, 3)
    zeros = (single["accel_zerog"], single["gyro_zerorate"], single["mag_hardiron"])
    same = np.concatenate([*zeros, soft.ravel()[list(_PLACES)]])
    if sent is not None and not (np.delete(sent, 9) == same).all():  # 9: the field
        raise ValueError("packet and JSON differ")

    def minus(offset: NDArray[np.float32]) -> Correction:
        return lambda samples: (samples.reading.astype(np.float32) - offset).astype(np.float64)

    def field(samples: Samples) -> FloatArray:
        away = samples.reading.astype(np.float32) - single["mag_hardiron"]
        return np.asarray((away @ soft.T).astype(np.float64))

    found: dict[str, Correction] = {}
    for name, key in (("accelerometer", "accel_zerog"), ("gyroscope", "gyro_zerorate")):
        if single[key].any():
            found[name] = minus(single[key])
    return found | ({"magnetometer": field} if single["mag_hardiron"].any() else {})


def _sent(files: Files) -> bytes:
    return files[_PACKET]


def _echoed(files: Files, lines: Sequence[str]) -> str | None:
    """Whether the board's ``Cal1`` and ``Cal2`` lines say what the packet does.

    The first has the offsets, the hard iron and the field with three decimals, the second the nine
    entries of S with four.
    """
    packet = _received(files[_PACKET])
    soft = packet[10:][[0, 3, 4, 3, 1, 5, 4, 5, 2]]
    wanted = (("Cal1:", packet[:10], 1e-3), ("Cal2:", soft, 1e-4))
    wrong = ""
    for word, values, last_digit in wanted:
        echo = next((one for one in reversed(lines) if one.startswith(word)), None)
        if echo is None:
            return None
        try:
            found = np.array(echo.removeprefix(word).split(","), np.float64)
        except ValueError:
            return None
        if found.shape != values.shape:
            wrong = f"it echoes {len(found)} numbers after {word} and not {len(values)}"
        elif (np.abs(found - values) > last_digit + 1e-6 * np.abs(values)).any():
            wrong = wrong or f"it echoes {echo}"
    return wrong


_OFFSET = Kept(base=("bias",))
TARGET = ExportTarget(
    name="adafruit",
    title="Adafruit: sensor_calib.json and the packet of MotionCal",
    formula="a − accel_zerog;  g − gyro_zerorate;  S (m − hardiron), S symmetric",
    suffix=".json",
    cannot_hold=(
        "scale and non-orthogonality of accelerometer and gyroscope",
        "effects",
        "standard errors",
    ),
    keeps={"accelerometer": _OFFSET, "gyroscope": _OFFSET, "magnetometer": Kept()},
    write=_write,
    read=_read,
    counts=False,
    loses=lost_alignment,
    sent=_sent,
    echoed=_echoed,
)
