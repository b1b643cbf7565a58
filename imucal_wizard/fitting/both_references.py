"""The gyroscope by gravity and field, once the magnetometer is aligned; and the clocks."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.fitting.compass import up_in
from imucal_wizard.fitting.passages import Crossing, field_at, passages
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray, Series
from imucal_wizard.solver.attitude import lay_out
from imucal_wizard.solver.directions import unit_vectors
from imucal_wizard.solver.magnetometer.report import MagnetometerFit
from imucal_wizard.solver.noise import has_rate, hold_noise
from imucal_wizard.solver.parameters import full_parameters, with_errors
from imucal_wizard.solver.rest import rest_of
from imucal_wizard.solver.result import FitReport, SensorFit
from imucal_wizard.solver.rms import root_mean_square
from imucal_wizard.solver.second_stage.attitude_fit import AttitudeFit, fit_attitude
from imucal_wizard.solver.second_stage.clock import clock_offset
from imucal_wizard.solver.second_stage.found import Added, SecondStage
from imucal_wizard.solver.second_stage.references import References, closed
from imucal_wizard.solver.slow_noise import slow_rate

DEFAULT = "vector"
"""The gyroscope's method where none was asked for."""
FEWEST_TURNS = 6
WORSE = 1.1
"""A closure that is larger by less than this says nothing: thirty turns know it to 13 %."""
MEDIAN_OF_TWO = 1.386
"""Median of the sum of two squared normal numbers of variance 1."""
MEDIAN_OF_ONE = 0.455
"""The same of one."""
SMALLEST_CLOSURE = 1e-9
LEAST = 0.05
"""Of a closure's variance, that all turns have alike at least."""


def up_of(fit: SensorFit, holds: list[Hold]) -> FloatArray:
    """Unit up in the body frame in each hold, shape (n, 3)."""
    force = np.array([hold.accelerometer for hold in holds]).reshape(-1, 3)
    return up_in(fit, force)


def with_gyroscope(
    report: FitReport,
    stage: SecondStage,
    turns: Sequence[Crossing],
    calm: Series,
    found: MagnetometerFit,
    aligned: SensorFit,
) -> tuple[SecondStage, SensorFit]:
    """Clock offset, and the gyroscope by both references.

    Args:
        report: of each sensor by itself.
        stage: what is known so far.
        turns: the gyroscope between the holds of the report.
        calm: all the magnetometer's undisturbed readings.
        found: its calibration in its own frame.
        aligned: the magnetometer in the accelerometer's frame.

    Returns:
        The stage with clock and gain, and the better of both fits; a method that was asked for is
        kept.
    """
    fit = report.sensors["gyroscope"]
    clock = clock_offset(passages(turns, fit, calm, aligned))
    stage = replace(stage, clock=clock)
    offset = 0.0 if clock is None else clock.seconds
    places, readings = field_at(report.holds, calm, found, offset)
    field = (readings - aligned.bias) @ aligned.matrix.T
    known = dict(zip(places, unit_vectors(field), strict=True))
    turns = [turn for turn in turns if turn.before in known and turn.after in known]
    if len(turns) < FEWEST_TURNS:
        note = f"{len(turns)} turns are too few to close the gyroscope by both references"
        return replace(stage, notes=(*stage.notes, note)), fit
    data = _references(report, turns, known)
    data = replace(data, spread=_spread(report, turns, data))
    try:
        better = _better(report, data, fit)
    except DataError as error:
        return replace(stage, notes=(*stage.notes, str(error))), fit
    added = _added(data, fit, better)
    stage = replace(stage, added=added)
    if added.heading_after > WORSE * added.heading_before:
        note = "the gyroscope's fit to gravity alone foretells turns better and is kept"
        return replace(stage, notes=(*stage.notes, note)), fit
    if fit.method != DEFAULT:
        note = f"the gyroscope stays with the method that was asked for: {fit.method}"
        return replace(stage, notes=(*stage.notes, note)), fit
    return stage, _by_both(fit, better)


def _better(report: FitReport, data: References, fit: SensorFit) -> AttitudeFit:
    """The gyroscope by both references, its biases as well known as slow noise lets them be.

    Raises:
        DataError: the turns do not carry it.
    """
    resting = [hold for hold in report.holds if has_rate(hold)]
    means = np.array([hold.gyroscope for hold in resting], float)
    sigma = np.maximum(means.std(axis=0), 1e-9 / np.linalg.norm(fit.matrix))
    better = fit_attitude(data, means, sigma, fit.matrix, fit.bias)
    slow = np.concatenate([np.zeros(9), slow_rate(resting)])
    return replace(better, covariance=better.covariance + np.diag(slow))


def _references(
    report: FitReport, turns: list[Crossing], known: dict[int, FloatArray]
) -> References:
    up = up_of(report.sensors["accelerometer"], list(report.holds))
    return References(
        lay_out([turn.time for turn in turns], [turn.rate for turn in turns]),
        np.array([up[turn.before] for turn in turns]),
        np.array([up[turn.after] for turn in turns]),
        np.array([known[turn.before] for turn in turns]),
        np.array([known[turn.after] for turn in turns]),
        np.ones((len(turns), 2)),
    )


def _spread(report: FitReport, turns: list[Crossing], data: References) -> FloatArray:
    """How much less a turn is known that lasts long, or whose ends were not steady, shape (m, 2).

    Across the vertical, and about it. What all turns have alike is how well the directions at
    their ends are known: of the field less well than of gravity.
    """
    fit = report.sensors["gyroscope"]
    density = hold_noise(report.holds).gyroscope_density
    walk = 0.0 if density is None else float((fit.matrix**2 @ density).mean())
    ends = rest_of(report.holds, fit.matrix).end
    own = ends[[turn.before for turn in turns]] + ends[[turn.after for turn in turns]]
    own += walk * np.add.reduceat(data.steps.dt, data.steps.offsets[:-1])
    usual, first = float(np.median(own)), closed(data, fit.matrix, fit.bias)
    squares = (first.tilt**2).sum(axis=1) / MEDIAN_OF_TWO, first.heading**2 / MEDIAN_OF_ONE
    found = []
    for square in squares:
        median = max(float(np.median(square)), SMALLEST_CLOSURE**2)
        alike = max(median - usual, LEAST * median)
        found.append(np.sqrt((alike + own) / (alike + usual)))
    return np.column_stack(found)


def _added(data: References, fit: SensorFit, better: AttitudeFit) -> Added:
    first = closed(data, fit.matrix, fit.bias)
    ratio = None
    if fit.covariance is not None:
        before, after = np.diag(fit.covariance)[:9], np.diag(better.covariance)[:9]
        seen = before > 0.0
        ratio = float(np.sqrt(after[seen] / before[seen]).mean()) if seen.any() else None
    closing = fit.rms_held_out if fit.unit == "rad" else None  # an offset's error is a rate
    return Added(
        len(data),
        closing or root_mean_square(first.tilt),
        root_mean_square(better.tilt_held_out),
        root_mean_square(first.heading),
        root_mean_square(better.heading_held_out),
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
        rms_fitted=root_mean_square(better.tilt),
        rms_held_out=root_mean_square(better.tilt_held_out),
        residuals=better.tilt,
        held_out=better.tilt_held_out,
        covariance=better.covariance,
        degrees_of_freedom=better.degrees_of_freedom,
        suspects=(),
        not_held_out="",
    )
