"""Whatever is held and turned: a sentence that says what to do, or finite numbers."""

import itertools
from dataclasses import fields, replace

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from imucal_wizard.core.errors import ImucalError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.recording import FitOptions, fit_collected
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.measurement.holds import Collected, Hold, Rotation

NUMBERS = st.one_of(
    st.floats(-20.0, 20.0),
    st.sampled_from([0.0, 9.80665, -9.80665, 1.0, 32768.0, 1e-9, 1e12, -1e12]),
)
STRANGE = st.one_of(NUMBERS, st.sampled_from([np.nan, np.inf, -np.inf, 1e308]))
METHODS = st.sampled_from(["least_squares", "newton", "six-position"])


@st.composite
def _hold(draw: st.DrawFn, start: float, numbers: st.SearchStrategy[float]) -> Hold:
    sigma = draw(st.sampled_from([0.0, 1e-3, 1.0, np.nan]))
    vector = arrays(float, 3, elements=numbers)
    return Hold(
        start=start,
        end=start + draw(st.sampled_from([0.1, 1.0, 5.0])),
        accelerometer=draw(vector),
        accelerometer_covariance=sigma**2 * np.eye(3),
        gyroscope=draw(vector),
        gyroscope_covariance=sigma**2 * np.eye(3),
        samples=draw(st.integers(1, 1000)),
        hand_held=draw(st.booleans()),
    )


@st.composite
def _rotation(draw: st.DrawFn, before: Hold, after: Hold) -> Rotation:
    count = draw(st.integers(0, 40))
    steps = draw(arrays(float, count, elements=st.sampled_from([0.0, 0.01, 0.01, 0.05, -0.01])))
    values = arrays(float, (count, 3), elements=STRANGE)
    force = draw(st.one_of(st.none(), values))
    return Rotation(before, after, before.end + np.cumsum(steps), draw(values), accelerometer=force)


@st.composite
def _collected(draw: st.DrawFn, numbers: st.SearchStrategy[float]) -> Collected:
    holds = [draw(_hold(10.0 * i, numbers)) for i in range(draw(st.integers(0, 14)))]
    pairs = itertools.pairwise(holds)
    rotations = [draw(_rotation(*pair)) for pair in pairs if draw(st.booleans())]
    return Collected(tuple(holds), tuple(rotations), validation=tuple(holds[-1:]))


def _finite(value: object) -> bool:
    """Whether every number in a result is finite, however deep."""
    if isinstance(value, float | np.ndarray):
        return bool(np.isfinite(value).all())
    if isinstance(value, tuple | list):
        return all(map(_finite, value))
    if isinstance(value, dict):
        return all(map(_finite, value.values()))
    return True


def _check(collected: Collected, unit: str, options: FitOptions) -> FitReport | None:
    units = {"accelerometer": unit, "gyroscope": "count" if unit == "count" else "rad/s"}
    refusal = ""
    try:
        report = fit_collected(collected, units, 100.0, options)
    except ImucalError as error:
        refusal = str(error)
    if refusal:
        assert len(refusal.split()) > 5
        return None
    for fit in report.sensors.values():
        for field in fields(fit):
            if field.name != "parameters":
                assert _finite(getattr(fit, field.name)), field.name
        for parameter in fit.parameters:
            assert _finite(parameter.value), parameter
            assert _finite(parameter.standard_error), parameter
    assert _finite(report.angles)
    for row in report.comparison:
        assert _finite([getattr(row, field.name) for field in fields(row)])
    return report


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(collected=_collected(NUMBERS), unit=st.sampled_from(["m/s^2", "count"]), method=METHODS)
def test_any_numbers_give_a_sentence_or_finite_results(
    collected: Collected, unit: str, method: str
) -> None:
    """Random holds and rotations, of any size."""
    _check(collected, unit, FitOptions(method=method))


@settings(max_examples=30, deadline=None, suppress_health_check=list(HealthCheck))
@given(collected=_collected(STRANGE))
def test_values_that_are_not_numbers_give_an_error_or_finite_results(collected: Collected) -> None:
    """Not even NaN, infinity or overflow come through."""
    _check(collected, "m/s^2", FitOptions())


@settings(max_examples=50, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    up=arrays(float, (12, 3), elements=st.sampled_from([-1.0, 0.0, 1.0, 0.5, -0.7])),
    noise=arrays(float, (12, 3), elements=st.floats(-1e-2, 1e-2)),
    rates=arrays(float, (11, 3), elements=st.sampled_from([0.0, 1.0, -2.0, 400.0])),
    method=METHODS,
)
def test_nearly_sensible_data_give_a_sentence_or_finite_results(
    up: FloatArray, noise: FloatArray, rates: FloatArray, method: str
) -> None:
    """Directions that may coincide or lie in a plane, rotations that may have no part in them."""
    lengths = np.maximum(np.linalg.norm(up, axis=1), 0.1)[:, None]
    forces = 9.80665 * up / lengths + noise
    quiet = 1e-6 * np.eye(3)
    holds = [
        Hold(10.0 * i, 10.0 * i + 3.0, force, quiet, noise[i], quiet, 300)
        for i, force in enumerate(forces)
    ]
    time = np.linspace(0.0, 1.0, 30)
    bump = np.sin(np.pi * time) ** 2
    rotations = [
        Rotation(
            holds[i],
            holds[i + 1],
            10.0 * i + 3.0 + time,
            np.outer(bump, rate),
            accelerometer=np.outer(1.0 - time, forces[i]) + np.outer(time, forces[i + 1]),
        )
        for i, rate in enumerate(rates)
    ]
    _check(Collected(tuple(holds), tuple(rotations)), "m/s^2", FitOptions(method=method))


def test_rates_too_large_to_be_integrated_give_no_angle(plain: FitReport) -> None:
    """A rotation in which a gyroscope reads 1e308 rad/s does not spoil the others."""
    wrong = replace(plain.rotations[0], rate=np.full_like(plain.rotations[0].rate, 1e308))
    collected = Collected(plain.holds, (wrong, *plain.rotations[1:]))
    units = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}
    found = fit_collected(collected, units, 100.0, FitOptions())
    assert found.angles[0] is None
    assert None not in found.angles[1:]
