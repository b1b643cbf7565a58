"""ArduPilot: a ``.param`` file.

    a = SCAL ⊙ (raw − tcal(T) + tcal(T_cal) − OFFS),    w = raw − tcal(T) + tcal(T_cal) − OFFS
    tcal(T) = 1e-6 (c₁ d + c₂ d² + c₃ d³),  d = T − 35 °C, T held within TMIN and TMAX

in m/s² and rad/s, single precision. Of the temperature our effect is linear: only c₁ is not zero.
"""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.report.axes import (
    ASSUMED,
    NEUTRAL,
    Axes,
    axes_of,
    check_range,
    follows_temperature,
    head,
    named_values,
    three,
    warming,
)
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.proof import Correction, Samples
from imucal_wizard.report.reduced import Kept

_WORDS = {"accelerometer": "ACC", "gyroscope": "GYR"}
_NAMES = {
    "accelerometer": (
        ("INS_ACCOFFS_{axis}", "INS_ACCSCAL_{axis}"),
        ("INS_ACC2OFFS_{axis}", "INS_ACC2SCAL_{axis}"),
        ("INS_ACC3OFFS_{axis}", "INS_ACC3SCAL_{axis}"),
    ),
    "gyroscope": (
        ("INS_GYROFFS_{axis}", ""),
        ("INS_GYR2OFFS_{axis}", ""),
        ("INS_GYR3OFFS_{axis}", ""),
    ),
}
"""Offsets and scales of the sensors of each IMU."""
_TCAL_REFERENCE = 35.0


def _names(sensor: str, slot: int) -> tuple[str, str]:
    """Names of offsets and scales; "" where there are no scales."""
    return _NAMES[sensor][slot]


def _axes(values: dict[str, float], sensor: str, slot: int) -> Axes:
    offset, scale = _names(sensor, slot)
    scales = three(values, scale, 1.0) if scale else np.ones(3)
    return Axes(three(values, offset, 0.0), scales)


def _present(settings: ExportSettings, sensor: str) -> Axes:
    """What the vehicle did to the readings while they were recorded.

    Raises:
        UsageError: it corrected the temperature, which does not compose.
    """
    if settings.present is None:
        return NEUTRAL
    values = named_values(settings.present)
    if values.get(f"INS_TCAL{settings.slot + 1}_ENABLE", 0.0) == 1.0:
        raise UsageError(
            "the vehicle corrected the temperature while it was recorded (INS_TCAL_ENABLE 1): "
            "switch that off and record again"
        )
    return _axes(values, sensor, settings.slot)


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    lines, slot = [head(calibration)], settings.slot
    linear: dict[str, FloatArray] = {}
    for name, sensor in calibration.sensors.items():
        both = _present(settings, name).then(axes_of(sensor))
        offset, scale = _names(name, slot)
        rows = {offset: both.offset}
        if scale:
            check_range(offset, both.offset, -3.5, 3.5)
            check_range(scale, both.scale, 0.8, 1.2)
            rows[scale] = both.scale
        rise = warming(name, sensor)
        if rise is not None:
            per_degree, reference = rise
            linear[name] = 1e6 * per_degree / both.scale
            lines.append(f"INS_{_WORDS[name]}{slot + 1}_CALTEMP {reference:.9g}")
        lines += _rows(rows)
    # ENABLE is for all sensors of an IMU: what the vehicle has of the others must not act either
    for name, word in _WORDS.items() if linear else ():
        curve = linear.get(name, np.zeros(3)), np.zeros(3), np.zeros(3)
        names = [f"INS_TCAL{slot + 1}_{word}{order}_{{axis}}" for order in (1, 2, 3)]
        lines += _rows(dict(zip(names, curve, strict=True)))
    if linear and calibration.temperature is not None:
        low, high = calibration.temperature
        lines += [
            f"INS_TCAL{slot + 1}_ENABLE 1",
            f"INS_TCAL{slot + 1}_TMIN {low:.9g}",
            f"INS_TCAL{slot + 1}_TMAX {high:.9g}",
        ]
    return {"": ("\n".join(lines) + "\n").encode()}


def _rows(values: Mapping[str, FloatArray]) -> list[str]:
    """Parameters of three axes, by their name with ``{axis}``."""
    return [
        f"{name.format(axis=axis)} {value:.9g}"
        for name, each in values.items()
        for axis, value in zip("XYZ", each, strict=True)
    ]


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """ArduPilot's formula in single precision.

    Raises:
        ValueError: the file sets none of the parameters.
    """
    values = {name: float(np.float32(one)) for name, one in named_values(files[""]).items()}
    number = settings.slot + 1

    def correction(sensor: str) -> Correction:
        axes, before = _axes(values, sensor, settings.slot), _present(settings, sensor)
        word = f"INS_TCAL{number}_{_WORDS[sensor]}"
        curve = [three(values, f"{word}{order}_{{axis}}", 0.0) for order in (1, 2, 3)]
        enabled = values.get(f"INS_TCAL{number}_ENABLE") == 1.0
        at = values.get(f"INS_{_WORDS[sensor]}{number}_CALTEMP", _TCAL_REFERENCE)

        def tcal(temperature: FloatArray) -> FloatArray:
            d = temperature[:, None] - _TCAL_REFERENCE
            return np.asarray(1e-6 * sum(c * d ** (k + 1) for k, c in enumerate(curve)))

        def correct(samples: Samples) -> FloatArray:
            raw = before.raw(samples.reading)
            if enabled:
                low, high = (values[f"INS_TCAL{number}_{end}"] for end in ("TMIN", "TMAX"))
                warm = np.clip(samples.where.temperature, low, high)
                raw = raw - np.nan_to_num(tcal(warm) - tcal(np.array([at])))
            return np.asarray((raw - axes.offset) * axes.scale)

        return correct

    found = {
        sensor: correction(sensor)
        for sensor in _WORDS
        if _names(sensor, settings.slot)[0].format(axis="X") in values
    }
    if not found:
        raise ValueError("no INS parameters")
    return found


def _notes(calibration: Calibration, settings: ExportSettings) -> tuple[str, ...]:
    notes = ["INS_ACC_ID and INS_GYR_ID in the vehicle must be those of the sensors calibrated"]
    if settings.present is None:
        notes.append(ASSUMED)
    if "gyroscope" in calibration.sensors:
        notes.append("each start measures the gyroscope's bias anew unless INS_GYR_CAL is 0")
    return tuple(notes)


TARGET = ExportTarget(
    name="ardupilot",
    title="ArduPilot: parameter file",
    formula="a = SCAL · (raw − (tcal(T) − tcal(Tcal)) − OFFS);  w the same without SCAL",
    suffix=".param",
    cannot_hold=(
        "non-orthogonality of the accelerometer",
        "scale and cross-axis gains of the gyroscope",
        "magnetometer",
        "effects other than bias-temperature",
        "standard errors",
    ),
    keeps={
        "accelerometer": Kept(("bias", "scale"), follows_temperature),
        "gyroscope": Kept(("bias",), follows_temperature),
    },
    write=_write,
    read=_read,
    counts=False,
    notes=_notes,
    composes=("INS_ACC", "INS_GYR"),
    uses=("slot",),
    corrects=_present,
)
