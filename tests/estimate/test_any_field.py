"""Whatever a magnetometer sends ends in numbers that are numbers, or in words."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
from imucal_wizard.estimate.methods import MethodNames
from tests.estimate.field_truth import OFFSET, all_over, recorded, six_circles

KINDS = (
    "sphere",
    "circles",
    "part of a sphere",
    "five places",
    "noise",
    "small integers",
    "a line",
    "overflows",
    "one axis weak",
    "a wandering",
    "an axis silent",
    "rectified",
)

METHODS = tuple(MethodNames("magnetometer"))


def made(kind: str, rng: np.random.Generator, count: int, noise: float, step: float) -> FloatArray:
    """Readings of one kind, shape (n, 3)."""
    if kind == "circles":
        faces = tuple(int(face) for face in rng.choice(6, int(rng.integers(1, 7))))
        share, wobble = float(rng.uniform(0.1, 1.0)), float(rng.choice([0.0, 1.0, 5.0, 20.0]))
        directions = six_circles(rng, 2.0, faces=faces, share=share, wobble=wobble)
    else:
        directions = all_over(rng, count)
    if kind == "part of a sphere":
        directions = directions[directions[:, 2] > rng.uniform(-1.0, 0.9)]
    if kind == "five places":
        directions = np.repeat(directions[:5], 40, axis=0)
    values = recorded(directions, rng, noise=noise, step=step).series.values
    if kind == "noise":
        values = rng.standard_normal((count, 3)) * float(rng.choice([1e-12, 1.0, 1e12]))
    if kind == "small integers":
        values = rng.integers(-2, 3, (count, 3)).astype(float)
    if kind == "a line":
        values = values[:, :1] * np.array([1.0, -2.0, 0.5])
    if kind == "overflows":
        values[rng.random(len(values)) < rng.uniform(0.0, 0.6)] = float(rng.choice([0, 1e9, -4096]))
    if kind == "one axis weak":
        values = values * np.array([1.0, float(rng.choice([1e-6, 0.01, 1e6])), 1.0])
    if kind == "a wandering":
        values = np.cumsum(rng.standard_normal((count, 3)), axis=0)
    if kind == "an axis silent":
        values[:, int(rng.integers(3))] = 0.0
    if kind == "rectified":
        values = np.abs(values - OFFSET)
    return values


@settings(max_examples=60, deadline=None)
@given(
    kind=st.sampled_from(KINDS),
    seed=st.integers(0, 10_000),
    count=st.sampled_from([61, 150, 600]),
    noise=st.sampled_from([0.0, 0.1, 4.0, 40.0, 200.0]),
    step=st.sampled_from([0.0, 1.0, 20.0, 200.0]),
    clock=st.sampled_from(["even", "standing", "ragged"]),
    method=st.sampled_from(METHODS),
)
def test_every_input_ends_in_a_result_or_an_error(
    kind: str, seed: int, count: int, noise: float, step: float, clock: str, method: str
) -> None:
    """No traceback, no number that is none, no calibration that leaves an eighth of the field."""
    rng = np.random.default_rng(seed)
    values = made(kind, rng, count, noise, step)
    time = np.arange(len(values)) / 80.0
    if clock == "standing":
        time = 0.0 * time
    if clock == "ragged":
        time = np.sort(rng.uniform(0.0, 1e5, len(values)))
    try:
        found = fit_magnetometer(Series(time, values, "count"), method=method)
    except DataError:
        return
    fit = found.fit
    assert np.isfinite(fit.matrix).all()
    assert np.linalg.eigvalsh(fit.matrix)[0] > 0.0
    assert np.isfinite([*fit.bias, fit.rms_fitted, found.magnitude]).all()
    for parameter in fit.parameters:
        assert parameter.standard_error is None or np.isfinite(parameter.standard_error)
    if method == "orthogonal":
        assert found.relative_error < 0.2
