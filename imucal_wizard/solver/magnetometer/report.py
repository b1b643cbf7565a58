"""A magnetometer's estimate as a result: parameters, errors before and after, what was left out."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.ellipsoid.binned import fill
from imucal_wizard.ellipsoid.bins import centres
from imucal_wizard.ellipsoid.shape import Cloud, look
from imucal_wizard.ellipsoid.two_step import sphere
from imucal_wizard.readings import BoolArray, FloatArray, Series
from imucal_wizard.solver.magnetometer.disturbances import LeftOut
from imucal_wizard.solver.magnetometer.methods import Estimate
from imucal_wizard.solver.magnetometer.model import ENOUGH, FieldModel
from imucal_wizard.solver.magnetometer.parameters import (
    Scaled,
    converter,
    covariance_of,
    scaled,
    unit_of,
)
from imucal_wizard.solver.parameters import with_errors
from imucal_wizard.solver.result import SensorFit
from imucal_wizard.units import COUNT

OFF_CENTRE = 0.3
"""How far from the middle the covered directions have their centre of gravity where one side is
empty: half a sphere has it at 0.5, three quarters at 0.25."""
RESTLESS = 0.03
"""Noise of a sample, as a share of the field, from which on something beside the sensor makes it:
of the Earth's field the noisiest chips in use have 0.02."""


@dataclass(frozen=True, eq=False)
class Measured:
    """What is known before any method is chosen.

    Attributes:
        series: all readings.
        cloud: the same, dimensionless.
        kept: which of them are undisturbed, shape (n,).
        left_out: those that are not.
        areas: area of the sphere in which each lies, shape (n,).
        model: what the directions carry.
        field: the local field, µT, or None.
        warning: about the field's size, or "".
    """

    series: Series
    cloud: Cloud
    kept: BoolArray
    left_out: tuple[LeftOut, ...]
    areas: NDArray[np.intp]
    model: FieldModel
    field: float | None
    warning: str


@dataclass(frozen=True, eq=False)
class MagnetometerFit:
    """The fit and what belongs to a magnetometer alone.

    Attributes:
        fit: the result; its residuals are the mean errors of the directions that hold samples.
        magnitude: that corrected readings have: µT, or the reading's unit where det M = 1.
        relative_error: rms of ``(|corrected| − B)/B`` over directions (N's figure of merit).
        relative_error_held_out: the same on directions left out, or None.
        kept: which samples were used, shape (n,).
        left_out: those that were not, and when; sizes in the unit of corrected readings.
        filled: samples in each of the hundred areas of the sphere, shape (100,).
        calm: which samples of the whole stream were not disturbed, where the fit has seen only some
            of them, shape (m,); None where it has seen all.
    """

    fit: SensorFit
    magnitude: float
    relative_error: float
    relative_error_held_out: float | None
    kept: BoolArray
    left_out: tuple[LeftOut, ...]
    filled: FloatArray = field(repr=False)
    calm: BoolArray | None = field(default=None, repr=False)

    @property
    def undisturbed(self) -> BoolArray:
        """Which samples of the whole stream were not disturbed."""
        return self.kept if self.calm is None else self.calm


def report(measured: Measured, method: str, estimate: Estimate) -> MagnetometerFit:
    """Everything a method found, in units."""
    series, cloud, local = measured.series, measured.cloud, measured.field
    found = scaled(cloud, estimate.theta, local)
    unit = series.unit if local is None else "uT"
    size = found.magnitude
    error = float(np.sqrt(estimate.square.mean()))
    out = None if estimate.left_out is None else float(np.sqrt(estimate.left_out.mean()))
    per_reading = float(np.cbrt(np.linalg.det(found.matrix)))
    noise = _floor(measured, estimate.theta) * cloud.span * per_reading
    left_out = tuple(
        LeftOut(run.start, run.end, run.samples, run.size * cloud.span * per_reading, run.single)
        for run in measured.left_out
    )
    filled = fill(measured.areas[measured.kept])
    covariance = estimate.covariance
    fit = SensorFit(
        sensor="magnetometer",
        model=measured.model.terms,
        method=method,
        frame="own",
        matrix=found.matrix,
        bias=found.bias,
        bias_unit=series.unit,
        parameters=with_errors(
            converter(cloud, local),
            estimate.theta,
            covariance,
            lambda name: unit_of(name, series.unit, local),
            measured.model.dropped,
        ),
        unit=unit,
        rms_before=_before(measured, found),
        rms_fitted=error * size,
        rms_held_out=None if out is None else out * size,
        floor=noise,
        residuals=estimate.mean * size,
        held_out=None if estimate.left_out is None else np.sqrt(estimate.left_out) * size,
        covariance=None
        if covariance is None
        else covariance_of(cloud, estimate.theta, covariance, local),
        iterations=estimate.iterations,
        warnings=(
            *_warnings(measured, method, left_out, filled, unit),
            *_restless(noise, size, unit),
        ),
        degrees_of_freedom=estimate.freedom,
    )
    return MagnetometerFit(fit, size, error, out, measured.kept, left_out, filled)


def _before(measured: Measured, found: Scaled) -> float:
    """Error with the nominal conversion only, rms over directions; for counts, of N's sphere."""
    kept, series = measured.kept, measured.series
    if series.unit == COUNT:
        points = measured.cloud.points[:, kept]
        centre, radius = sphere(points)
        points -= centre[:, None]
        lengths = np.sqrt(np.einsum("in,in->n", points, points))
        error = (lengths / radius - 1.0) * found.magnitude
    else:
        lengths = np.linalg.norm(series.values[kept], axis=1)
        error = lengths - (lengths.mean() if measured.field is None else measured.field)
    areas = measured.areas[kept]
    count = np.bincount(areas)
    square = np.bincount(areas, error**2)[count > 0] / count[count > 0]
    return float(np.sqrt(square.mean()))


def _floor(measured: Measured, theta: FloatArray) -> float:
    """Noise of a sample's distance from its neighbour in time, which no model can explain."""
    distance = look(theta, measured.cloud.points)[0]
    both = measured.kept[1:] & measured.kept[:-1]
    steps = np.diff(distance)[both]
    return float(np.sqrt(0.5 * np.mean(steps**2))) if len(steps) else 0.0


def _warnings(
    measured: Measured, method: str, left_out: tuple[LeftOut, ...], filled: FloatArray, unit: str
) -> tuple[str, ...]:
    notes = [measured.warning, measured.model.reason, *_left_out_notes(left_out, method, unit)]
    seen = int((filled > 0).sum())
    if measured.model.reason == "" and seen < ENOUGH and _one_sided(filled):
        notes.append(
            f"{seen} of {len(filled)} directions are covered and one side is empty: the error "
            "there is extrapolated. Turn the device to the faces that are missing"
        )
    return tuple(note for note in notes if note)


def _one_sided(filled: FloatArray) -> bool:
    """Whether the covered directions have a centre of gravity far from the middle."""
    return float(np.linalg.norm(centres()[filled > 0].mean(axis=0))) > OFF_CENTRE


def _restless(noise: float, size: float, unit: str) -> tuple[str, ...]:
    """What to say of noise that no magnetometer has by itself."""
    if noise <= RESTLESS * size:
        return ()
    jump, share = f"{noise:.2g} {_shown(unit)}", f"{100.0 * noise / size:.0f} %"
    says = (
        f"the field jumps by {jump} ({share} of it) from one sample to the next: is there a "
        "loudspeaker, a motor or the mains beside it? Measure elsewhere once"
    )
    return (says,)


def _shown(unit: str) -> str:
    return "µT" if unit == "uT" else unit


def _left_out_notes(left_out: tuple[LeftOut, ...], method: str, unit: str) -> list[str]:
    unit = _shown(unit)
    verb = "left out" if method == "orthogonal" else "not judged, but used as the method says"
    notes = []
    for run in left_out:
        if run.single:
            notes.append(
                f"{run.samples} single samples of the magnetometer lie up to {run.size:.3g} {unit} "
                f"off the others: {verb}"
            )
        else:
            notes.append(
                f"the field was disturbed from {run.start:.1f} to {run.end:.1f} s by up to "
                f"{run.size:.3g} {unit} (iron, a magnet or a loudspeaker passed): "
                f"{run.samples} samples {verb}"
            )
    return notes
