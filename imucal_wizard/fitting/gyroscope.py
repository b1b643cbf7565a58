"""The gyroscope of a recording: three methods fitted side by side."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.fitting.comparison import comparison, single_axis
from imucal_wizard.fitting.rounded import rate_shift
from imucal_wizard.fitting.single_axis_fit import by_single_axis
from imucal_wizard.fitting.turning import name_axes, silent_axes
from imucal_wizard.fitting.turns import Bench, examined, make_bench, paths
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.accelerometer import AccelerometerFit
from imucal_wizard.solver.closure import errors
from imucal_wizard.solver.gains import nominal_of
from imucal_wizard.solver.gyroscope import VectorFit, fit_vector
from imucal_wizard.solver.gyroscope_offset import fit_offset
from imucal_wizard.solver.gyroscope_start import start_matrix
from imucal_wizard.solver.outliers import Suspect, suspect_rotation
from imucal_wizard.solver.parameters import full_parameters, unit_of, with_errors
from imucal_wizard.solver.result import AxisComparison, SensorFit
from imucal_wizard.solver.rms import root_mean_square
from imucal_wizard.units import COUNT

ALL_NEEDED = (
    "without one of the rotations the others do not carry these gains, so none could be left out "
    "to check it: add some"
)


@dataclass(frozen=True, eq=False)
class GyroscopeReport:
    """What became of the gyroscope.

    Attributes:
        fit: the result, or None when it cannot be fitted; its residuals are those of the rotations
            without a problem, in order.
        rotations: all rotations, with axis and problem filled in.
        angles: angle turned in each, rad; None where nothing tells it.
        comparison: static, dynamic and vector results per axis.
        warnings: why something is missing.
        suspect: the rotation that does not fit with all others (index into ``rotations``), if any.
    """

    fit: SensorFit | None
    rotations: tuple[Rotation, ...]
    angles: tuple[float | None, ...] = ()
    comparison: tuple[AxisComparison, ...] = ()
    warnings: tuple[str, ...] = ()
    suspect: Suspect | None = None


def fit_gyroscope(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    accelerometer: AccelerometerFit,
    unit: str,
    method: str = "vector",
) -> GyroscopeReport:
    """Fit the gyroscope with gravity, as the accelerometer saw it, as the reference.

    The method ``offset`` looks at the holds alone.

    Raises:
        DataError: ``method`` is ``static`` or ``dynamic`` and an axis has too few rotations about
            it, or ``offset`` and there is but one position.
    """
    rotations = examined(rotations)
    if method == "offset":
        turned = [rotation for rotation in rotations if rotation.problem is None]
        rounding = rate_shift(holds, turned) if turned else 0.0
        offset = fit_offset(holds, accelerometer.labels, unit, rounding)
        return replace(_none(rotations, ""), fit=offset, warnings=offset.warnings)
    bench = make_bench(holds, rotations, accelerometer)
    if bench is None:
        return _none(rotations, "no usable rotation between two holds")
    silent = silent_axes([rotations[i] for i in bench.usable], bench)
    try:
        vector = _vector(bench, rotations, accelerometer, unit)
        fit = _sensor_fit(bench, vector, unit)
    except DataError as error:
        return _none(rotations, str(error), silent)
    named, angles = name_axes(rotations, vector, accelerometer, holds)
    up = {id(hold): direction for hold, direction in zip(holds, accelerometer.up, strict=True)}
    single = single_axis([named[i] for i in bench.usable], up, vector)
    if method != "vector":
        fit = by_single_axis(bench.turns, fit, single, method, vector)
    return GyroscopeReport(
        fit,
        named,
        angles,
        comparison(single, vector),
        (*silent, *fit.warnings),
        _suspect(bench, vector),
    )


def _none(rotations: Sequence[Rotation], why: str, besides: Sequence[str] = ()) -> GyroscopeReport:
    return GyroscopeReport(
        None,
        tuple(rotations),
        (None,) * len(rotations),
        warnings=(*besides, f"the gyroscope is not calibrated: {why}"),
    )


def _vector(
    bench: Bench, rotations: Sequence[Rotation], accelerometer: AccelerometerFit, unit: str
) -> VectorFit:
    known = unit != COUNT
    inside = paths([rotations[i] for i in bench.usable], accelerometer)
    start = start_matrix(bench.turns, inside, bench.stills.mean(axis=0), known)
    return fit_vector(
        bench.turns,
        bench.stills,
        bench.still_floor,
        start,
        nominal_of(start, known),
        bench.noise(start),
        bench.slow,
    )


def _sensor_fit(bench: Bench, vector: VectorFit, unit: str) -> SensorFit:
    parameters = with_errors(
        lambda t: full_parameters(vector.nominal.ordered(t[:9].reshape(3, 3)), t[9:]),
        np.concatenate([vector.matrix.ravel(), vector.bias]),
        vector.covariance if vector.degrees_of_freedom > 0 else None,
        lambda name: unit_of(name, unit, "rad/s"),
        vector.dropped,
    )
    suspect = _stands_out(vector)
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
        rms_before=root_mean_square(_before(bench, vector, unit)),
        rms_fitted=root_mean_square(vector.closure),
        rms_held_out=None if vector.held_out is None else root_mean_square(vector.held_out),
        floor=_floor(bench, vector),
        residuals=np.linalg.norm(vector.closure, axis=1),
        held_out=None if vector.held_out is None else np.linalg.norm(vector.held_out, axis=1),
        covariance=vector.covariance,
        iterations=vector.iterations,
        warnings=(*_not_carried(vector.dropped), *_weighing_less(bench, vector)),
        degrees_of_freedom=vector.degrees_of_freedom,
        suspects=() if suspect is None else (suspect.index,),
        not_held_out="" if vector.held_out is not None else ALL_NEEDED,
    )


def _not_carried(dropped: Sequence[str]) -> tuple[str, ...]:
    if not dropped:
        return ()
    names = ", ".join(dropped)
    advice = "Turn about each axis in both senses, with that axis level"
    return (f"the rotations do not carry {names}: left at the nominal value. {advice}",)


def _weighing_less(bench: Bench, vector: VectorFit) -> tuple[str, ...]:
    count = bench.unsteady(vector.matrix)
    if not count:
        return ()
    says = (
        f"{count} of {len(bench.usable)} rotations begin or end while the device was not steady: "
        "they weigh less, and their closure shows the hand"
    )
    return (says,)


def _before(bench: Bench, vector: VectorFit, unit: str) -> FloatArray:
    """Closure with the nominal conversion only; for counts, with one common scale and the bias."""
    if unit != COUNT:
        return errors(bench.turns, np.eye(3), np.zeros(3))
    common = np.zeros((3, 3))
    size = np.abs(vector.matrix.ravel()[list(vector.nominal.scales)]).mean()
    common.flat[list(vector.nominal.scales)] = size * np.array(vector.nominal.signs)
    return errors(bench.turns, common, bench.stills.mean(axis=0))


def _floor(bench: Bench, vector: VectorFit) -> float:
    """Closure that noise alone would make, rad rms, over its two components that are seen."""
    return float(np.sqrt(2.0 * bench.noise(vector.matrix).mean()))


def _suspect(bench: Bench, vector: VectorFit) -> Suspect | None:
    found = _stands_out(vector)
    return None if found is None else replace(found, index=bench.usable[found.index])


def _stands_out(vector: VectorFit) -> Suspect | None:
    return suspect_rotation(vector.weighted, vector.drops, vector.degrees_of_freedom)
