"""The second stage on a recording: magnetometer aligned, clocks compared, turns closed twice."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.fitting.compass import ROWS, Compass, up_in
from imucal_wizard.fitting.passages import Crossing, field_at, passages
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray, Series
from imucal_wizard.solver.attitude import lay_out
from imucal_wizard.solver.magnetometer.report import MagnetometerFit
from imucal_wizard.solver.parameters import full_parameters, with_errors
from imucal_wizard.solver.result import FitReport, Parameter, SensorFit
from imucal_wizard.solver.second_stage.clock import clock_offset
from imucal_wizard.solver.second_stage.dip import Alignment, align, rotation_vector
from imucal_wizard.solver.second_stage.found import Added, Headings, SecondStage
from imucal_wizard.solver.second_stage.references import (
    AttitudeFit,
    References,
    closed,
    fit_attitude,
)

FEWEST_TURNS = 6
WORSE = 1.1
"""A closure that is larger by less than this says nothing: thirty turns know it to 13 %."""


def with_second_stage(
    report: FitReport, series: Series | None, turns: Sequence[Crossing]
) -> FitReport:
    """The report with the magnetometer in the accelerometer's frame and what follows from it.

    Where the still positions do not carry the alignment the report stays as it is but for a note.

    Args:
        report: of each sensor by itself.
        series: all the magnetometer's readings, those at rest among them.
        turns: the gyroscope between the holds of the report; none without one.
    """
    found = report.magnetic
    if found is None or series is None or "accelerometer" not in report.sensors:
        return report
    try:
        return _second_stage(report, series, turns, found)
    except DataError as error:
        note = f"the magnetometer stays in its own frame: {error}"
        return replace(report, warnings=(*report.warnings, note))


def _second_stage(
    report: FitReport, series: Series, turns: Sequence[Crossing], found: MagnetometerFit
) -> FitReport:
    places, field = field_at(report.holds, series, found)
    up = _up(report.sensors["accelerometer"], [report.holds[i] for i in places])
    alignment = align(up, _unit(field), _doubt(found.fit, field))
    aligned = _aligned(found.fit, alignment)
    compass = Compass(report.sensors["accelerometer"], found.fit, alignment)
    stage = SecondStage(alignment, _headings(report, compass, places, series))
    sensors = {**report.sensors, "magnetometer": aligned}
    if "gyroscope" in report.sensors:
        stage, better = _with_gyroscope(report, stage, turns, series, aligned)
        sensors["gyroscope"] = better
    return replace(report, sensors=sensors, second_stage=stage)


def _up(fit: SensorFit, holds: list[Hold]) -> FloatArray:
    force = np.array([hold.accelerometer for hold in holds]).reshape(-1, 3)
    return up_in(fit, force)


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


def _doubt(fit: SensorFit, field: FloatArray) -> FloatArray | None:
    """Change of each unit field with each principal doubt about hard and soft iron, (n, 3, k)."""
    if fit.covariance is None:
        return None
    values, vectors = np.linalg.eigh(fit.covariance)
    seen = values > 1e-12 * values[-1]
    offsets = field @ np.linalg.inv(fit.matrix).T
    out = []
    for change in (vectors[:, seen] * np.sqrt(values[seen])).T:
        matrix = np.zeros((3, 3))
        matrix[ROWS], matrix[ROWS[::-1]] = change[3:], change[3:]
        moved = field + offsets @ matrix.T - change[:3] @ fit.matrix.T
        out.append(_unit(moved) - _unit(field))
    return np.stack(out, axis=-1) if out else None


def _aligned(fit: SensorFit, alignment: Alignment) -> SensorFit:
    """The magnetometer's fit in the accelerometer's frame: ``M = R P``."""
    vector = rotation_vector(alignment.rotation)
    errors = np.sqrt(np.diag(alignment.covariance))
    angles = tuple(
        Parameter(f"misalignment_{axis}", float(v), float(e), "rad")
        for axis, v, e in zip("xyz", vector, errors, strict=True)
    )
    return replace(
        fit,
        frame="accelerometer",
        model=(*fit.model, "misalignment"),
        matrix=alignment.rotation @ fit.matrix,
        parameters=(*fit.parameters, *angles),
        covariance=None,
    )


def _headings(report: FitReport, compass: Compass, places: list[int], series: Series) -> Headings:
    """In each of these holds."""
    _, readings = field_at(report.holds, series, None, places)
    force = np.array([report.holds[i].accelerometer for i in places])
    found = compass.bearings(force, readings)
    return Headings(found.before, found.after, found.error, np.array(places))


def _with_gyroscope(
    report: FitReport,
    stage: SecondStage,
    turns: Sequence[Crossing],
    series: Series,
    aligned: SensorFit,
) -> tuple[SecondStage, SensorFit]:
    """Clock offset, and the gyroscope by both references."""
    fit = report.sensors["gyroscope"]
    clock = clock_offset(passages(turns, fit, series, aligned))
    stage = replace(stage, clock=clock)
    offset = 0.0 if clock is None else clock.seconds
    places, field = field_at(report.holds, series, None, clock=offset)
    known = dict(zip(places, _unit((field - aligned.bias) @ aligned.matrix.T), strict=True))
    turns = [turn for turn in turns if turn.before in known and turn.after in known]
    if len(turns) < FEWEST_TURNS:
        note = f"{len(turns)} turns are too few to close the gyroscope by both references"
        return replace(stage, notes=(*stage.notes, note)), fit
    data = _references(report, turns, known)
    means = np.array([h.gyroscope for h in report.holds if h.gyroscope is not None], float)
    sigma = np.maximum(means.std(axis=0), 1e-9 / np.linalg.norm(fit.matrix))
    try:
        better = fit_attitude(data, means, sigma, fit.matrix, fit.bias)
    except DataError as error:
        return replace(stage, notes=(*stage.notes, str(error))), fit
    added = _added(data, fit, better)
    stage = replace(stage, added=added)
    if added.heading_after > WORSE * added.heading_before:
        note = "the gyroscope's fit to gravity alone foretells turns better and is kept"
        return replace(stage, notes=(*stage.notes, note)), fit
    return stage, _by_both(fit, better)


def _references(
    report: FitReport, turns: list[Crossing], known: dict[int, FloatArray]
) -> References:
    up = _up(report.sensors["accelerometer"], list(report.holds))
    return References(
        lay_out([turn.time for turn in turns], [turn.rate for turn in turns]),
        np.array([up[turn.before] for turn in turns]),
        np.array([up[turn.after] for turn in turns]),
        np.array([known[turn.before] for turn in turns]),
        np.array([known[turn.after] for turn in turns]),
    )


def _added(data: References, fit: SensorFit, better: AttitudeFit) -> Added:
    first = closed(data, fit.matrix, fit.bias)
    ratio = None
    if fit.covariance is not None:
        before, after = np.diag(fit.covariance)[:9], np.diag(better.covariance)[:9]
        seen = before > 0.0
        ratio = float(np.sqrt(after[seen] / before[seen]).mean()) if seen.any() else None
    return Added(
        len(data),
        fit.rms_held_out or _rms(np.linalg.norm(first.tilt, axis=1)),
        _rms(better.tilt_held_out),
        _rms(first.heading),
        _rms(better.heading_held_out),
        ratio,
    )


def _by_both(fit: SensorFit, better: AttitudeFit) -> SensorFit:
    """The gyroscope's fit with the parameters of the second stage."""
    units = {parameter.name: parameter.unit for parameter in fit.parameters}
    parameters = with_errors(
        lambda t: full_parameters(t[:9].reshape(3, 3), t[9:]),
        np.concatenate([better.matrix.ravel(), better.bias]),
        better.covariance,
        lambda name: units.get(name, "rad"),
        (),
    )
    return replace(
        fit,
        model=("bias", "scale", "non-orthogonality"),
        method="vector + field",
        matrix=better.matrix,
        bias=better.bias,
        parameters=parameters,
        rms_fitted=_rms(better.tilt),
        rms_held_out=_rms(better.tilt_held_out),
        residuals=better.tilt,
        held_out=better.tilt_held_out,
        covariance=better.covariance,
        degrees_of_freedom=better.degrees_of_freedom,
        suspects=(),
        not_held_out="",
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.asarray(values) ** 2)))
