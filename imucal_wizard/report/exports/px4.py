"""PX4: a ``.params`` file of QGroundControl.

    a = (raw − thermal − OFF) ⊙ SCALE,    w = raw − thermal − OFF,    m = S (raw + P COMP − OFF)
    thermal = x0 + x1 d + x2 d² + x3 d³,  d = clamp(T, TMIN, TMAX) − TREF

in m/s², rad/s and gauss, single precision; S is symmetric, with ODIAG x, y, z at 01, 02, 12. P is
the throttle from 0 to 1 (CAL_MAG_COMP_TYP 1) or the current of the first battery in kA (2). Each
line is vehicle, component, name, value, type (9 for a float, 6 for a whole number).
"""

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.gauge import symmetric
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
from imucal_wizard.report.calibration_file import Calibration, SavedEffect
from imucal_wizard.report.exports import ExportSettings, ExportTarget, Files
from imucal_wizard.report.exports.adafruit import lost_alignment
from imucal_wizard.report.proof import Correction, Samples
from imucal_wizard.report.reduced import Kept

_MICROTESLA_PER_GAUSS = 100.0
_WORDS = {"accelerometer": "ACC", "gyroscope": "GYRO", "magnetometer": "MAG"}
_THERMAL = {"accelerometer": "TC_A", "gyroscope": "TC_G"}
_SCALED = ("accelerometer", "magnetometer")
"""Sensors that have scales in PX4."""
_FLOAT, _INTEGER = 9, 6
_POWER = {"µT/%": (1, 100.0), "µT/A": (2, 1000.0)}
"""CAL_MAG_COMP_TYP by the unit of the effect, and how much of the recorded quantity P = 1 is."""
_OFF_DIAGONAL = ((0, 1), (0, 2), (1, 2))


def _axes(values: dict[str, float], sensor: str, slot: int) -> Axes:
    word = f"CAL_{_WORDS[sensor]}{slot}_{{axis}}"
    scales = three(values, word + "SCALE", 1.0) if sensor in _SCALED else np.ones(3)
    return Axes(three(values, word + "OFF", 0.0), scales)


def _soft_iron(values: dict[str, float], slot: int) -> FloatArray:
    """S of the magnetometer, shape (3, 3)."""
    soft = np.diag(three(values, f"CAL_MAG{slot}_{{axis}}SCALE", 1.0))
    for (i, j), one in zip(
        _OFF_DIAGONAL, three(values, f"CAL_MAG{slot}_{{axis}}ODIAG", 0.0), strict=True
    ):
        soft[i, j] = soft[j, i] = one
    return soft


def _present(settings: ExportSettings) -> dict[str, float]:
    """Parameters that the vehicle had while it was recorded; none for the bare sensor.

    Raises:
        UsageError: it corrected the temperature, which does not compose.
    """
    values = named_values(settings.present)
    if values.get("CAL_MAG_COMP_TYP", 0.0):
        raise UsageError(
            "the vehicle corrected the field of its currents while it was recorded "
            "(CAL_MAG_COMP_TYP): set that to 0 and record again"
        )
    if any(values.get(f"TC_{word}_ENABLE") == 1.0 for word in "AG"):
        raise UsageError(
            "the vehicle corrected the temperature while it was recorded (TC_A_ENABLE or "
            "TC_G_ENABLE 1): switch that off and record again"
        )
    return values


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    present, slot = _present(settings), settings.slot
    rows: dict[str, float | int] = {}
    for name, sensor in calibration.sensors.items():
        word = f"CAL_{_WORDS[name]}{slot}"
        if f"{word}_ID" in present:
            rows[f"{word}_ID"] = int(present[f"{word}_ID"])
        if name not in _THERMAL:
            rows |= _field(calibration, present, slot)
            continue
        both = (_axes(present, name, slot) if present else NEUTRAL).then(axes_of(sensor))
        for place, axis in enumerate("XYZ"):
            rows[f"{word}_{axis}OFF"] = float(both.offset[place])
            if name in _SCALED:
                rows[f"{word}_{axis}SCALE"] = float(both.scale[place])
        check_range(word + "_{axis}SCALE", both.scale, 0.1, 3.0)
        rise = warming(name, sensor)
        if rise is not None and calibration.temperature is not None:
            thermal = _THERMAL[name]
            rows[f"{thermal}_ENABLE"] = 1
            if f"{word}_ID" in present:
                rows[f"{thermal}{slot}_ID"] = int(present[f"{word}_ID"])
            for place in range(3):
                for order in range(4):
                    linear = float(rise[0][place] / both.scale[place])
                    rows[f"{thermal}{slot}_X{order}_{place}"] = linear if order == 1 else 0.0
            low, high = calibration.temperature
            ends = {"TREF": rise[1], "TMIN": low, "TMAX": high}
            rows |= {f"{thermal}{slot}_{end}": value for end, value in ends.items()}
    lines = [
        head(calibration),
        "# Vehicle-Id Component-Id Name Value Type",
    ]
    for key, number in rows.items():
        whole = isinstance(number, int)
        text = str(number) if whole else f"{number:.9g}"
        lines.append(f"1\t1\t{key}\t{text}\t{_INTEGER if whole else _FLOAT}")
    return {"": ("\n".join(lines) + "\n").encode()}


def _field(
    calibration: Calibration, present: dict[str, float], slot: int
) -> dict[str, float | int]:
    """Hard and soft iron and the field of currents, gauss, after what the vehicle did already."""
    sensor, before = calibration["magnetometer"], _soft_iron(present, slot)
    # S₂ (S₁ (m − o₁) − b₂) = S₂ S₁ (m − o₁ − S₁⁻¹ b₂), in the symmetric gauge
    soft = symmetric(np.array(sensor.matrix) @ before)[1]
    offset = _axes(present, "magnetometer", slot).offset + np.linalg.solve(
        before, np.array(sensor.bias) / _MICROTESLA_PER_GAUSS
    )
    word = f"CAL_MAG{slot}"
    rows: dict[str, float | int] = {}
    for axis, zero, scale, (i, j) in zip("XYZ", offset, np.diag(soft), _OFF_DIAGONAL, strict=True):
        rows[f"{word}_{axis}OFF"] = float(zero)
        rows[f"{word}_{axis}SCALE"] = float(scale)
        rows[f"{word}_{axis}ODIAG"] = float(soft[i, j])
    for one in sensor.effects:
        # M (y − b) − k I = M (y − b − M⁻¹ k I), in gauss of what the vehicle reads before S₁
        kind, unity = _POWER[one.unit]
        per_power = np.linalg.solve(np.array(sensor.matrix), np.array(one.sizes)) * unity
        power = -np.linalg.solve(before, per_power / _MICROTESLA_PER_GAUSS)
        rows["CAL_MAG_COMP_TYP"] = kind
        rows |= {f"{word}_{axis}COMP": float(k) for axis, k in zip("XYZ", power, strict=True)}
    return rows


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """PX4's formulas, with parameters in single precision.

    Raises:
        ValueError: the file sets none of the parameters.
    """
    values = {name: float(np.float32(one)) for name, one in named_values(files[""]).items()}
    present, slot = _present(settings), settings.slot

    def inertial(sensor: str) -> Correction:
        axes, before = _axes(values, sensor, slot), _axes(present, sensor, slot)
        word = _THERMAL[sensor]
        enabled = values.get(f"{word}_ENABLE") == 1.0

        def correct(samples: Samples) -> FloatArray:
            raw = before.raw(samples.reading)
            if enabled:
                low, high, at = (values[f"{word}{slot}_{end}"] for end in ("TMIN", "TMAX", "TREF"))
                d = np.nan_to_num(np.clip(samples.where.temperature, low, high) - at)[:, None]
                for order in range(4):
                    x = np.array([values[f"{word}{slot}_X{order}_{axis}"] for axis in range(3)])
                    raw = raw - x * d**order
            return np.asarray((raw - axes.offset) * axes.scale)

        return correct

    powered = values.get("CAL_MAG_COMP_TYP", 0.0)
    power = three(values, f"CAL_MAG{slot}_{{axis}}COMP", 0.0)

    def magnetic(samples: Samples) -> FloatArray:
        zero = _axes(present, "magnetometer", slot).offset
        gauss = samples.reading / _MICROTESLA_PER_GAUSS
        raw = gauss @ np.linalg.inv(_soft_iron(present, slot)).T + zero
        unity = dict(_POWER.values()).get(int(powered))
        if unity is not None:
            raw = raw + samples.where.current[:, None] / unity * power
        away = raw - _axes(values, "magnetometer", slot).offset
        return np.asarray(_MICROTESLA_PER_GAUSS * away @ _soft_iron(values, slot).T)

    each = {"accelerometer": inertial("accelerometer"), "gyroscope": inertial("gyroscope")}
    found = {
        name: one
        for name, one in (each | {"magnetometer": magnetic}).items()
        if f"CAL_{_WORDS[name]}{slot}_XOFF" in values
    }
    if not found:
        raise ValueError("no CAL parameters")
    return found


def _of_currents(one: SavedEffect) -> bool:
    """Whether an effect is the field of a measured current or throttle."""
    return one.term == "current" and one.unit in _POWER


def _notes(calibration: Calibration, settings: ExportSettings) -> tuple[str, ...]:
    here = (
        "to prove it there: load it in QGroundControl (Parameters, Tools), start the vehicle anew; "
        f"at rest the length of vehicle_acceleration is {calibration.gravity.value:.2f} m/s² in "
        "each pose, up to the error below"
    )
    there = (here,) if "accelerometer" in calibration.sensors else ()
    if settings.present is not None:
        return there
    ids = "CAL_ACC0_ID and so on in the vehicle must be those of the sensors calibrated"
    return ASSUMED, ids, *there


TARGET = ExportTarget(
    name="px4",
    title="PX4: parameter file of QGroundControl",
    formula="a = (raw − thermal − OFF) · SCALE;  w = raw − thermal − OFF;  "
    "m = S (raw + P · COMP − OFF)",
    suffix=".params",
    cannot_hold=(
        "non-orthogonality of the accelerometer",
        "scale and cross-axis gains of the gyroscope",
        "effects other than bias-temperature and current",
        "standard errors",
    ),
    keeps={
        "accelerometer": Kept(("bias", "scale"), follows_temperature),
        "gyroscope": Kept(("bias",), follows_temperature),
        "magnetometer": Kept(takes=_of_currents),
    },
    write=_write,
    read=_read,
    counts=False,
    loses=lost_alignment,
    notes=_notes,
    composes=("CAL_",),
    uses=("slot",),
    corrects=lambda settings, sensor: _axes(_present(settings), sensor, settings.slot),
)
