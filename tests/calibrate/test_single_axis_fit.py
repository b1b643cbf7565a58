"""Q's static and dynamic approach as the result: what is held out is what a refit would err."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.gyroscope_fit import gyroscope_minimum
from imucal_wizard.estimate.recording import (
    FitOptions,
    fit_accelerometer,
    fit_collected,
    fit_readings,
)
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.estimate.rotation_set import examined
from imucal_wizard.measurement.holds import Collected, Rotation
from imucal_wizard.model.rows.source import Parameters
from imucal_wizard.model.terms import Terms
from tests.calibrate.sessions import session, true

UNITS = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}


def _fitted(plain: FitReport, rotations: list[Rotation], method: str) -> FitReport:
    options = FitOptions(gyroscope_method=method)
    collected = Collected(plain.holds, tuple(rotations))
    return fit_collected(collected, UNITS, 100.0, options)


@cache
def _by(method: str) -> FitReport:
    """The session with this method of the accelerometer."""
    return fit_readings(session(), FitOptions(method=method))


def _closures(plain: FitReport, matrix: FloatArray, bias: FloatArray) -> FloatArray:
    """Closure of each rotation of the session under some calibration, rad."""
    accelerometer = fit_accelerometer(plain.holds, STANDARD_GRAVITY, "m/s^2")
    rotations = examined(plain.rotations)
    experiment = gyroscope_minimum(plain.holds, rotations, accelerometer, "rad/s").experiment
    rows = experiment.closure.at(Parameters(matrix, bias), Terms("gyroscope", ()))
    return np.asarray(np.linalg.norm(rows.residual.reshape(-1, 2), axis=1))


@pytest.mark.parametrize("method", ["static", "dynamic"])
def test_the_papers_gyroscope_methods_may_be_the_result(method: str, plain: FitReport) -> None:
    """Three scales about the axes, no cross-axis gain, the closure judged as for the vector fit."""
    fit = fit_readings(session(), FitOptions(gyroscope_method=method)).sensors["gyroscope"]
    assert fit.method == method
    assert (fit.matrix == np.diag(np.diag(fit.matrix))).all()
    assert np.diag(fit.matrix) == pytest.approx(np.diag(true().gyroscope_matrix), rel=3e-3)
    assert fit.rms_fitted > plain.sensors["gyroscope"].rms_fitted
    # what the vector fit says of its own errors is not said of these
    assert (fit.held_out_interval, fit.rows, fit.minimum, fit.rms_late) == (None,) * 4
    for parameter in fit.parameters:
        if parameter.name.startswith("cross"):
            assert (parameter.value, parameter.carried) == (0.0, False)
        else:
            assert parameter.standard_error
    assert "cross-axis" in fit.warnings[0]


@pytest.mark.parametrize("method", ["static", "dynamic"])
@pytest.mark.study
def test_each_rotation_is_held_out_of_its_own_method(plain: FitReport, method: str) -> None:
    """The approach applied to all other rotations closes it exactly so badly."""
    rotations = list(plain.rotations)
    fit = _fitted(plain, rotations, method).sensors["gyroscope"]
    assert fit.held_out is not None
    assert fit.rms_held_out == pytest.approx(float(np.sqrt(np.mean(fit.held_out**2))), rel=1e-12)
    axes = [rotation.axis for rotation in plain.rotations]
    chosen = [*np.flatnonzero([axis is not None for axis in axes])[::3], axes.index(None)]
    for index in chosen:
        others = [one for place, one in enumerate(rotations) if place != index]
        refit = _fitted(plain, others, method).sensors["gyroscope"]
        closure = _closures(plain, refit.matrix, refit.bias)[index]
        assert fit.held_out[index] == pytest.approx(closure, rel=1e-9)


@pytest.mark.parametrize("method", ["static", "dynamic"])
def test_its_error_held_out_shows_what_it_lacks(plain: FitReport, method: str) -> None:
    """The sensor is skewed and turned by degrees, which three scales cannot mend."""
    report = _fitted(plain, list(plain.rotations), method)
    fit = report.sensors["gyroscope"]
    assert (fit.rms_held_out or 0.0) > 3.0 * (fit.floor or 0.0)


@pytest.mark.parametrize(("method", "fewest"), [("static", 1), ("dynamic", 3)])
def test_the_last_rotations_that_it_needs_cannot_be_left_out(
    plain: FitReport, method: str, fewest: int
) -> None:
    """And that is said, with the axis and what to do."""
    about_y = [one for one in plain.rotations if one.axis == "y"]
    rotations = [one for one in plain.rotations if one not in about_y[fewest:]]
    report = _fitted(plain, rotations, method)
    fit = report.sensors["gyroscope"]
    assert fit.rms_held_out is None
    assert fit.held_out is None
    said = fit.not_held_out
    assert f"the {method} approach needs every rotation about y" in said
    assert "add some" in said


@pytest.mark.parametrize(("method", "taken"), [("static", 1), ("dynamic", 2)])
def test_its_degrees_of_freedom_are_those_of_the_poorest_axis(
    plain: FitReport, method: str, taken: int
) -> None:
    """Four turns about y, six about the others; a mean takes one number from them, a line two."""
    about_y = [one for one in plain.rotations if one.axis == "y"]
    rotations = [one for one in plain.rotations if one not in about_y[4:]]
    fit = _fitted(plain, rotations, method).sensors["gyroscope"]
    assert fit.degrees_of_freedom == 4 - taken


def test_the_six_position_method_is_judged_by_the_poses_it_does_not_use() -> None:
    """No face can be left out; the edges were never in its formulae."""
    report = _by("six-position")
    fit = report.sensors["accelerometer"]
    faces = {f"{sign}{axis}" for sign in "+-" for axis in "xyz"}
    poses = [hold.pose for hold in report.holds]
    assert fit.rms_held_out is None
    assert {poses[index] for index in fit.unused}.isdisjoint(faces)
    assert {pose for place, pose in enumerate(poses) if place not in fit.unused} >= faces
    assert "needs all of these positions" in fit.not_held_out


def test_a_gyroscope_in_which_axes_are_swapped_is_held_out_as_well(plain: FitReport) -> None:
    """Scale and bias go to the sensor axis that feels the body axis, left out or not."""
    swapped = [
        replace(one, rate=one.rate[:, [1, 0, 2]], before=one.before, after=one.after)
        for one in plain.rotations
    ]
    holds = [replace(hold, gyroscope=_swapped(hold.gyroscope)) for hold in plain.holds]
    places = {(hold.start, hold.end): hold for hold in holds}
    swapped = [
        replace(
            one,
            before=places[one.before.start, one.before.end],
            after=places[one.after.start, one.after.end],
        )
        for one in swapped
    ]
    options = FitOptions(gyroscope_method="dynamic")
    report = fit_collected(Collected(tuple(holds), tuple(swapped)), UNITS, 100.0, options)
    straight = _fitted(plain, list(plain.rotations), "dynamic").sensors["gyroscope"]
    fit = report.sensors["gyroscope"]
    assert fit.matrix == pytest.approx(straight.matrix[:, [1, 0, 2]], rel=1e-6)
    assert fit.rms_held_out == pytest.approx(straight.rms_held_out, rel=1e-6)


def _swapped(mean: FloatArray | None) -> FloatArray:
    assert mean is not None
    return mean[[1, 0, 2]]


@pytest.mark.parametrize("method", ["newton", "six-position", "two-step"])
def test_the_misfit_of_an_accelerometers_method_is_no_noise_of_the_rotations(method: str) -> None:
    """The six-position method leaves 11 mg, and with them the rotations 1.1°; noise makes 0.02°."""
    floors = []
    for name in ("least_squares", method):
        fit = _by(name).sensors["gyroscope"]
        assert fit.floor is not None
        floors.append((fit.floor, fit.floor_fitted))
    assert floors[1] == pytest.approx(floors[0], rel=0.1)
