"""The noise of a recording at rest as text and as a document for other programs.

White noise N is the Allan deviation at 1 s, as Kalibr and IEEE 952 define it (two-sided spectrum);
data sheets quote the one-sided density ``√2 N``. PX4's filter adds ``(dt·p)²`` per step of ``dt =
10 ms`` to its variances (EKF2, ``predictCovariance``), so that its parameters are ``N/√dt`` and
``K/√dt``.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from imucal_wizard.core.errors import RecordingError
from imucal_wizard.core.input import read_schema
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quantities import finite_or_none, fixed, number, plus_minus
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.noise_coefficients import Coefficient
from imucal_wizard.estimate.noise_survey import NoiseResult, SensorAtRest
from imucal_wizard.report.plot import scatter

NOISE_SCHEMA = "imucal-wizard/noise/1"
PX4_STEP_SECONDS = 0.01
"""Period of PX4's filter (``EKF2_PREDICT_US``)."""
_PX4 = {"m/s^2": "ACC", "rad/s": "GYR"}
_MICRO_G = 1e6 / STANDARD_GRAVITY
_DEGREE = 180.0 / math.pi


@dataclass(frozen=True)
class NoiseUnits:
    """Units in which the coefficients of a sensor are usually quoted, with their factors from SI.

    Attributes:
        white: of N.
        bias_instability: of B.
        random_walk: of K.
        deviation: of the Allan deviation.
    """

    white: tuple[float, str]
    bias_instability: tuple[float, str]
    random_walk: tuple[float, str]
    deviation: tuple[float, str]


_USUAL = {
    "m/s^2": NoiseUnits(
        (_MICRO_G, "µg/√Hz"), (_MICRO_G, "µg"), (60.0 * _MICRO_G, "µg/√h"), (_MICRO_G, "µg")
    ),
    "rad/s": NoiseUnits(
        (60.0 * _DEGREE, "°/√h"),
        (3600.0 * _DEGREE, "°/h"),
        (3600.0 * 60.0 * _DEGREE, "°/h/√h"),
        (3600.0 * _DEGREE, "°/h"),
    ),
    "uT": NoiseUnits((1000.0, "nT/√Hz"), (1000.0, "nT"), (60_000.0, "nT/√h"), (1000.0, "nT")),
}
_COUNTS = NoiseUnits((1.0, "counts/√Hz"), (1.0, "counts"), (60.0, "counts/√h"), (1.0, "counts"))
_TITLES = {
    "white": "white noise",
    "bias_instability": "bias instability",
    "random_walk": "bias random walk",
}


def noise_document(result: NoiseResult) -> dict[str, Any]:
    """The document ``imucal-wizard/noise/1``."""
    warm = result.temperature
    return {
        "schema": NOISE_SCHEMA,
        "seconds": result.seconds,
        "warnings": list(result.warnings),
        "temperature": None
        if not len(warm)
        else {
            "lowest": float(warm[:, 1].min()),
            "highest": float(warm[:, 1].max()),
            "time": warm[:, 0].tolist(),
            "degC": warm[:, 1].tolist(),
        },
        "sensors": {name: _sensor_document(one) for name, one in result.sensors.items()},
    }


def _least(sensor: SensorAtRest, deviation: FloatArray, error: FloatArray) -> int | None:
    """Place of the least Allan deviation that is known well; None without any.

    The least of many that are hardly known is too small, so that long τ do not count.

    Args:
        sensor: at rest.
        deviation: at each τ, shape (t,).
        error: standard errors, 0 or NaN where they are not known, shape (t,).
    """
    known = (error > 0.0) & (deviation > 0.0) & (sensor.taus <= LONGEST_SHARE * sensor.seconds)
    return int(np.flatnonzero(known)[deviation[known].argmin()]) if known.any() else None


def _axes_document(sensor: SensorAtRest) -> dict[str, dict[str, Any]]:
    """The coefficients of each axis."""
    axes: dict[str, dict[str, Any]] = {}
    deviations = np.sqrt(sensor.allan.variance)
    for axis, fit, column in zip(AXES, sensor.fits, deviations.T, strict=False):
        least = _least(sensor, column, fit.error)
        axes[axis] = {
            **{
                key: value
                for name, one in fit.coefficients.items()
                for key, value in (
                    (name, one.value),
                    (f"{name}_standard_error", one.standard_error),
                    (f"{name}_below", one.below),
                )
            },
            "not_determined": [n for n, one in fit.coefficients.items() if not one.determined],
            "least_deviation": None if least is None else float(column[least]),
            "least_deviation_tau": None if least is None else float(sensor.taus[least]),
            "fitted_from": fit.first_tau,
            "p": fit.misfit_p,
        }
    return axes


def _sensor_document(sensor: SensorAtRest) -> dict[str, Any]:
    deviations, unit, axes = np.sqrt(sensor.allan.variance), sensor.unit, _axes_document(sensor)
    return {
        "axes": axes,
        "tau": sensor.taus.tolist(),
        "deviation": dict(zip(AXES, deviations.T.tolist(), strict=True)),
        "deviation_standard_error": {
            axis: [finite_or_none(e) for e in fit.error]
            for axis, fit in zip(AXES, sensor.fits, strict=False)
        },
        "fitted": {axis: fit.curve.tolist() for axis, fit in zip(AXES, sensor.fits, strict=False)},
        "rate": 1.0 / sensor.period,
        "seconds_at_rest": sensor.seconds,
        "disturbances": [
            {"start": one.start, "end": one.end, "axis": one.axis, "ratio": one.ratio}
            for one in sensor.disturbances
        ],
        "units": {
            "white": f"{unit}/sqrt(Hz)",
            "bias_instability": unit,
            "random_walk": f"{unit}/s/sqrt(Hz)",
            "ramp": f"{unit}/s",
            "deviation": unit,
            "tau": "s",
        },
        "kalibr": _kalibr(unit, axes),
        "px4": _px4(unit, axes),
    }


def _axes_together(axes: Mapping[str, Mapping[str, Any]], name: str) -> float | None:
    """Root mean square of a coefficient over the axes that determine it; None if none does.

    Args:
        axes: of a document.
        name: of the coefficient.
    """
    known = [float(a[name]) for a in axes.values() if name not in a.get("not_determined", ())]
    return root_mean_square(np.array(known)) if known else None


def _kalibr(unit: str, axes: Mapping[str, Mapping[str, Any]]) -> dict[str, float | None] | None:
    """``noise_density`` and ``random_walk`` of Kalibr; None for readings in counts."""
    if unit not in _PX4:
        return None
    return {
        "noise_density": _axes_together(axes, "white"),
        "random_walk": _axes_together(axes, "random_walk"),
    }


def _px4(unit: str, axes: Mapping[str, Mapping[str, Any]]) -> dict[str, float | None] | None:
    """The parameters of PX4's filter; None for a sensor that has none, or counts."""
    if unit not in _PX4:
        return None
    word = _PX4[unit]
    both = ((f"EKF2_{word}_NOISE", "white"), (f"EKF2_{word}_B_NOISE", "random_walk"))
    found = {name: _axes_together(axes, key) for name, key in both}
    step = math.sqrt(PX4_STEP_SECONDS)
    return {name: None if value is None else value / step for name, value in found.items()}


_NO_DEVIATION = "a deviation is missing or negative"


def read_noise(path: Path) -> dict[str, Any]:
    """Read a document of noise back.

    Raises:
        RecordingError: it cannot be read, or is another kind of document.
    """
    data = read_schema(path, (NOISE_SCHEMA,), "the result of a noise measurement")
    try:
        found = msgspec.json.decode(data)
        for sensor in found["sensors"].values():
            coefficient_rows(sensor)
            lengths = {len(sensor["tau"]), *(len(one) for one in sensor["deviation"].values())}
            every = [*sensor["tau"], *(v for one in sensor["deviation"].values() for v in one)]
            if len(lengths) != 1 or not all(0.0 <= float(value) < math.inf for value in every):
                raise ValueError(_NO_DEVIATION)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise RecordingError(
            f"{path} is damaged or was edited by hand: {_fault(error)}. "
            "Take the file as it was written."
        ) from error
    return dict(found)


def _fault(error: Exception) -> str:
    """What a document of noise lacks, in words."""
    if isinstance(error, KeyError):
        return f'"{error.args[0]}" is missing'
    if isinstance(error, ValueError) and error.args == (_NO_DEVIATION,):
        return _NO_DEVIATION
    return "a value is of another kind than this program writes"


def noise_for_export(document: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """White noise and random walk of each sensor for other programs, SI.

    What no axis determines is left out, and so are sensors that send counts.
    """
    return {
        name: {
            key: value
            for key in ("white", "random_walk")
            if (value := _axes_together(sensor["axes"], key)) is not None
        }
        for name, sensor in document["sensors"].items()
        if sensor["units"].get("deviation") in _PX4
    }


def usual_units(unit: str) -> NoiseUnits:
    """Units of the coefficients of a sensor whose readings have this unit."""
    return _USUAL.get(unit, _COUNTS)


def coefficient_rows(sensor: Mapping[str, Any]) -> list[list[str]]:
    """White noise, bias instability and random walk of each axis, from a document.

    Args:
        sensor: one of ``sensors``.
    """
    usual, rows = usual_units(sensor["units"]["deviation"]), []
    for key, title in _TITLES.items():
        factor, unit = getattr(usual, key)
        cells = []
        for axis in sensor["axes"].values():
            one = Coefficient(
                value=axis[key],
                standard_error=axis[f"{key}_standard_error"],
                determined=key not in axis["not_determined"],
                below=axis[f"{key}_below"],
            )
            cells.append(_cell(one, factor))
        rows.append([title, *cells, unit])
    return rows


def noise_text(result: NoiseResult, width: int) -> str:
    """The result in lines.

    Args:
        result: of the recording.
        width: columns of the plots.
    """
    lines = [f"{_time_in_words(result.seconds)} in all"]
    for name, sensor in result.sensors.items():
        lines += ["", *_sensor_lines(name, sensor, width)]
    warm = result.temperature
    if len(warm):
        low, high = warm[:, 1].min(), warm[:, 1].max()
        lines += ["", f"TEMPERATURE {fixed(low, 2)} to {fixed(high, 2)} °C"]
        if high > low:
            lines += scatter(
                warm[:, 0],
                warm[:, 1] - low,
                width,
                TEMPERATURE_ROWS,
                x_label="time in s",
                y_text=lambda above: fixed(low + above, 2),
            )
    lines += [f"▲ {text}" for text in result.warnings]
    return "\n".join(lines)


def _sensor_lines(name: str, sensor: SensorAtRest, width: int) -> list[str]:
    usual = usual_units(sensor.unit)
    head = f"{name.upper()}  {number(1.0 / sensor.period, 4)} samples/s, "
    lines = [head + f"{_time_in_words(sensor.seconds)} at rest"]
    lines += [
        f"▲ motion at {_time_in_words(one.start)} for {number(one.end - one.start, 2)} s "
        f"({one.axis}: {number(one.ratio, 2)} × its usual scatter); left out"
        for one in sensor.disturbances[:MAX_NAMED]
    ]
    if len(sensor.disturbances) > MAX_NAMED:
        lines.append(f"▲ and {len(sensor.disturbances) - MAX_NAMED} more")
    if not sensor.fits:
        return [*lines, "  too short for coefficients"]
    lines.append(f"{'':20}" + "".join(f"{axis:^18}" for axis in AXES))
    for key, title in _TITLES.items():
        factor, unit = getattr(usual, key)
        cells = [_cell(fit.coefficients[key], factor) for fit in sensor.fits]
        lines.append(f"  {title:18}" + "".join(f"{cell:^18}" for cell in cells) + unit)
    lines += _allan_lines(sensor, width, ALLAN_ROWS)
    return [*lines, *_program_lines(sensor)]


def _allan_lines(sensor: SensorAtRest, width: int, height: int) -> list[str]:
    """The least Allan deviation, rms of the axes, and a plot of those known; none before any is."""
    factor, unit = usual_units(sensor.unit).deviation
    deviation = np.sqrt(np.mean(sensor.allan.variance, axis=1))
    error = np.sqrt(np.mean([fit.error**2 for fit in sensor.fits], axis=0))
    curve = np.sqrt(np.mean([fit.curve**2 for fit in sensor.fits], axis=0))
    known = (error > 0.0) & (error < MAX_SHOWN_ERROR * deviation) & (deviation > 0.0)
    if not known.any():
        return []
    # of the root of the mean of the variances of the axes
    parts = np.array([fit.error for fit in sensor.fits]).T ** 2 * sensor.allan.variance
    tiny = np.finfo(float).tiny
    of_mean = np.sqrt(parts.sum(axis=1)) / (parts.shape[1] * np.maximum(deviation, tiny))
    least, heads = _least(sensor, deviation, of_mean), []
    if least is not None:
        value = plus_minus(deviation[least] * factor, of_mean[least] * factor)
        at = number(sensor.taus[least], 2)
        heads = [f"  least Allan deviation {value} {unit} at τ = {at} s"]
    size = width, height
    rows = _plot(sensor.taus[known], (deviation * factor)[known], (curve * factor)[known], size)
    caption = f"  Allan deviation in {unit}, rms of the axes; × is the fitted curve"
    return [*heads, *rows[:-1], rows[-1].rstrip(), caption]


def live_noise_text(
    sensors: Mapping[str, SensorAtRest], progress: str, width: int, height: int
) -> str:
    """What is known while the measurement goes on, for a screen of this size.

    Args:
        sensors: so far.
        progress: when each τ will be known.
        width: columns.
        height: rows.
    """
    shown = {name: one for name, one in sensors.items() if one.fits}
    rows = max((height - 2) // max(len(shown), 1) - LIVE_HEAD_ROWS, MIN_PLOT_ROWS)
    lines = [progress]
    for name, sensor in shown.items():
        lines += [name.upper(), *_allan_lines(sensor, width, rows)]
    return "\n".join(lines)


ALLAN_ROWS, TEMPERATURE_ROWS = 14, 7
"""Rows of the plots of a finished measurement."""
LIVE_HEAD_ROWS = 3
"""Rows of a sensor beside its plot, while the measurement goes on."""
MIN_PLOT_ROWS = 6
"""A plot with fewer rows shows no slope."""
MAX_NAMED = 8
"""Disturbances that are listed one by one."""
MAX_SHOWN_ERROR = 0.5
"""Relative error of an Allan deviation beyond which it is not drawn."""


LONGEST_SHARE = 0.1
"""Of the time at rest, up to which a τ may have the least Allan deviation: one of 24 % error."""
PERIOD_ROUNDING = 0.01
"""By which the measured time between samples may exceed a τ that it is equal to."""


def _cell(one: Coefficient, factor: float) -> str:
    if not one.below:
        return "–"
    if not one.determined:
        return f"below {number(one.below * factor, 2)}"
    return plus_minus(one.value * factor, one.standard_error * factor)


def _plot(
    taus: FloatArray, deviation: FloatArray, curve: FloatArray, size: tuple[int, int]
) -> list[str]:
    """Allan deviation against τ, both logarithmic."""
    least = float(min(deviation.min(), curve.min()))
    return scatter(
        np.log10(taus),
        np.log10(deviation / least),
        *size,
        x_label="τ in s",
        model=np.log10(curve / least),
        y_text=lambda y: number(least * 10.0**y, 2),
        x_text=lambda x: number(10.0**x, 2),
    )


def _program_lines(sensor: SensorAtRest) -> list[str]:
    """Parameters of Kalibr and PX4, in their units."""
    lines, axes = [], _axes_document(sensor)
    both = ("Kalibr", _kalibr(sensor.unit, axes)), ("PX4", _px4(sensor.unit, axes))
    for program, values in both:
        known = {k: v for k, v in (values or {}).items() if v is not None}
        if known:
            words = ", ".join(f"{name} {number(value, 3)}" for name, value in known.items())
            lines.append(f"  {program}: {words}")
    return lines


def _time_in_words(seconds: float) -> str:
    """A time in hours, minutes and seconds: ``1 h 02 min``, ``3 min 20 s``, ``12 s``."""
    whole = round(seconds)
    hours, minutes = whole // 3600, whole // 60 % 60
    if hours:
        return f"{hours} h {minutes:02} min"
    return f"{minutes} min {whole % 60:02} s" if minutes else f"{whole} s"


def progress_line(
    sensors: Mapping[str, SensorAtRest], seconds: float, taus: Sequence[float]
) -> str:
    """How well each τ is known by now, or when to 10 %: the sensor that takes longest counts.

    A sensor has no τ below the time between its samples.
    """
    parts = []
    for tau in taus:
        slow = (1.0 + PERIOD_ROUNDING) * tau
        those = [one for one in sensors.values() if one.period <= slow]
        if not those:
            continue
        until = max(one.seconds_until_known(tau) - seconds * one.rest for one in those)
        at = f"τ {number(tau, 1) if tau < 1 else fixed(tau, 0)} s"
        parts.append(f"{at} known" if until <= 0.0 else f"{at} in {_time_in_words(until)}")
    return f"{_time_in_words(seconds)}: " + " · ".join(parts)
