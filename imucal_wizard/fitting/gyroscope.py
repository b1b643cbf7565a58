"""The gyroscope of a recording: usable rotations chosen, three methods fitted side by side."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.fitting.comparison import by_single_axis, comparison, integral, single_axis
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.accelerometer import AccelerometerFit
from imucal_wizard.solver.attitude import lay_out
from imucal_wizard.solver.closure import Turns, errors
from imucal_wizard.solver.gyroscope import VectorFit, fit_vector
from imucal_wizard.solver.gyroscope_start import aided_start
from imucal_wizard.solver.noise import hold_noise
from imucal_wizard.solver.parameters import full_parameters, with_errors
from imucal_wizard.solver.result import AxisComparison, SensorFit
from imucal_wizard.units import COUNT

ONE_AXIS_SHARE = 0.9
"""Share of all turning that is about one body axis, for Q's single-axis methods."""
LEVEL = 0.35
"""Largest component of up along that axis (20° off level): gravity must see the turn."""
SMALLEST_TURN = np.radians(5.0)
"""A motion that turns less than this is a disturbed hold, not a rotation."""


@dataclass(frozen=True, eq=False)
class GyroscopeReport:
    """What became of the gyroscope.

    Attributes:
        fit: the result, or None when it cannot be fitted.
        rotations: all rotations, with axis and problem filled in.
        angles: angle turned in each, rad.
        comparison: static, dynamic and vector results per axis.
        warnings: why something is missing.
    """

    fit: SensorFit | None
    rotations: tuple[Rotation, ...]
    angles: tuple[float, ...] = ()
    comparison: tuple[AxisComparison, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Bench:
    """The usable rotations with all that belongs to them."""

    turns: Turns
    usable: tuple[int, ...]
    stills: FloatArray
    still_floor: FloatArray
    direction_sigma: float
    density: FloatArray


def fit_gyroscope(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    accelerometer: AccelerometerFit,
    unit: str,
    method: str = "vector",
) -> GyroscopeReport:
    """Fit the gyroscope with gravity, as the accelerometer saw it, as the reference."""
    bench = _prepare(holds, rotations, accelerometer)
    if bench is None:
        return GyroscopeReport(
            None,
            tuple(rotations),
            tuple(0.0 for _ in rotations),
            warnings=("the gyroscope is not calibrated: no usable rotation between two holds",),
        )
    nominal = unit != COUNT
    try:
        start = _start(bench, rotations, accelerometer, nominal)
        vector = fit_vector(bench.turns, bench.stills, bench.still_floor, start, nominal)
    except DataError as error:
        return GyroscopeReport(
            None,
            tuple(rotations),
            tuple(0.0 for _ in rotations),
            warnings=(f"the gyroscope is not calibrated: {error}",),
        )
    named, angles = _name_axes(rotations, vector, accelerometer, holds)
    up = {id(hold): direction for hold, direction in zip(holds, accelerometer.up, strict=True)}
    single = single_axis([named[i] for i in bench.usable], up, vector)
    fit = _sensor_fit(bench, vector, unit)
    if method != "vector":
        fit = by_single_axis(bench.turns, fit, single, method)
    return GyroscopeReport(fit, named, angles, comparison(single, vector), fit.warnings)


def _prepare(
    holds: Sequence[Hold], rotations: Sequence[Rotation], accelerometer: AccelerometerFit
) -> _Bench | None:
    places = {id(hold): index for index, hold in enumerate(holds)}
    usable = [i for i, r in enumerate(rotations) if r.problem is None and len(r.time) > 2]
    stills = [hold.gyroscope for hold in holds if hold.gyroscope is not None]
    if not usable or not stills:
        return None
    before = [places[id(rotations[i].before)] for i in usable]
    after = [places[id(rotations[i].after)] for i in usable]
    steps = lay_out([rotations[i].time for i in usable], [rotations[i].rate for i in usable])
    turns = Turns(steps, accelerometer.up[before], accelerometer.up[after])
    density = hold_noise(holds).gyroscope_density
    density = np.zeros(3) if density is None else density
    duration = float(np.median([hold.end - hold.start for hold in holds]))
    sigma = float(np.sqrt(accelerometer.direction_variance.mean()))
    return _Bench(
        turns, tuple(usable), np.array(stills), np.sqrt(density / duration), sigma, density
    )


def _start(
    bench: _Bench,
    rotations: Sequence[Rotation],
    accelerometer: AccelerometerFit,
    nominal: bool,
) -> FloatArray:
    """The better of the nominal matrix and the one the accelerometer suggests."""
    fit = accelerometer.fit
    bias = bench.stills.mean(axis=0)
    tried = [np.eye(3)] if nominal else []
    inside = [rotations[i].accelerometer for i in bench.usable]
    known = [(force - fit.bias) @ fit.matrix.T for force in inside if force is not None]
    if len(known) == len(inside):
        aided = aided_start(bench.turns, known, bias)
        if aided is not None:
            tried.append(aided)
    if not tried:
        raise DataError(
            "its unit is raw counts and the accelerometer during the turns was not kept"
        )
    return min(tried, key=lambda matrix: float((errors(bench.turns, matrix, bias) ** 2).sum()))


def _sensor_fit(bench: _Bench, vector: VectorFit, unit: str) -> SensorFit:
    theta = np.concatenate([vector.matrix.ravel(), vector.bias])
    sensitivity_unit = f"{unit}/(rad/s)" if unit == COUNT else "1"
    scales = {f"{axis}{axis}": f"sensitivity_{axis}" for axis in "xyz"}
    dropped = tuple(scales.get(name, f"cross_{name}") for name in vector.dropped)
    parameters = with_errors(
        lambda t: full_parameters(t[:9].reshape(3, 3), t[9:]),
        theta,
        vector.covariance,
        lambda name: (
            unit
            if name.startswith("bias")
            else (sensitivity_unit if name.startswith("sensitivity") else "rad")
        ),
        dropped,
    )
    return SensorFit(
        sensor="gyroscope",
        model=("bias", "scale", "non-orthogonality"),
        method="vector",
        frame="accelerometer",
        matrix=vector.matrix,
        bias=vector.bias,
        bias_unit=unit,
        parameters=parameters,
        unit="rad",
        rms_before=_rms(_before(bench, vector, unit)),
        rms_fitted=_rms(vector.closure),
        rms_held_out=None if vector.held_out is None else _rms(vector.held_out),
        floor=_floor(bench, vector),
        residuals=np.linalg.norm(vector.closure, axis=1),
        held_out=None if vector.held_out is None else np.linalg.norm(vector.held_out, axis=1),
        covariance=vector.covariance,
        iterations=vector.iterations,
        warnings=_not_carried(dropped),
    )


def _not_carried(dropped: Sequence[str]) -> tuple[str, ...]:
    if not dropped:
        return ()
    names = ", ".join(dropped)
    advice = "Turn about each axis in both senses"
    return (f"the rotations do not carry {names}: left at the nominal value. {advice}",)


def _before(bench: _Bench, vector: VectorFit, unit: str) -> FloatArray:
    """Closure with the nominal conversion only; for counts, with one common scale and the bias."""
    if unit != COUNT:
        return errors(bench.turns, np.eye(3), np.zeros(3))
    scale = float(np.mean(np.diag(vector.matrix)))
    return errors(bench.turns, scale * np.eye(3), bench.stills.mean(axis=0))


def _floor(bench: _Bench, vector: VectorFit) -> float:
    """Closure that noise alone would make, rad rms: angle random walk and both directions.

    Two components of each are seen; the one about gravity is not.
    """
    steps = bench.turns.steps
    durations = np.add.reduceat(steps.dt, steps.offsets[:-1])
    per_second = float(((vector.matrix**2) @ bench.density).mean())
    walk = 2.0 * per_second * float(durations.mean())
    return float(np.sqrt(walk + 4.0 * bench.direction_sigma**2))


def _name_axes(
    rotations: Sequence[Rotation],
    vector: VectorFit,
    accelerometer: AccelerometerFit,
    holds: Sequence[Hold],
) -> tuple[tuple[Rotation, ...], tuple[float, ...]]:
    """Each rotation with the axis it was about, and its angle."""
    places = {id(hold): index for index, hold in enumerate(holds)}
    named, angles = [], []
    for rotation in rotations:
        if len(rotation.time) < 3:
            named.append(rotation)
            angles.append(0.0)
            continue
        rate = (rotation.rate - vector.bias) @ vector.matrix.T
        total = integral(rate, rotation.time)
        turned = float(integral(np.linalg.norm(rate, axis=1)[:, None], rotation.time)[0])
        axis = int(np.argmax(np.abs(total)))
        up = accelerometer.up[places[id(rotation.before)]]
        about = abs(total[axis]) > ONE_AXIS_SHARE * np.linalg.norm(total)
        clear = about and abs(total[axis]) > SMALLEST_TURN and abs(up[axis]) < LEVEL
        named.append(replace(rotation, axis="xyz"[axis] if clear else None))
        angles.append(float(total[axis] if clear else turned))
    return tuple(named), tuple(angles)


def _rms(vectors: FloatArray) -> float:
    return float(np.sqrt(np.mean((vectors**2).sum(axis=1))))
