"""What carries no calibration is refused in words, and what only looks like it is not."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from benchmarks.magnetometer import MOTIONS, Noise, recording
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.estimate.magnetometer.fit import fit_magnetometer
from tests.estimate.field_truth import (
    CORRECTION,
    MAGNITUDE,
    OFFSET,
    TEN_BITS,
    recorded,
    six_circles,
    true_parameters,
)


def _plain(values: FloatArray) -> Series:
    return Series(np.arange(len(values)) / 80.0, values, "count")


def _dead(rng: np.random.Generator) -> Series:
    values = recorded(six_circles(rng), rng).series.values.copy()
    values[:, 1] = 17.0
    return _plain(values)


def _saturated(rng: np.random.Generator) -> Series:
    values = recorded(six_circles(rng), rng).series.values.copy()
    values[:, 2] = np.minimum(values[:, 2], np.round(OFFSET[2] + 0.8 * MAGNITUDE))
    return _plain(values)


def _alternating(rng: np.random.Generator) -> Series:
    values = recorded(six_circles(rng), rng).series.values
    return _plain(values + 400.0 * rng.standard_normal(values.shape))


def _one_circle(rng: np.random.Generator, share: float = 1.0, wobble: float = 6.0) -> Series:
    return recorded(six_circles(rng, faces=(0,), share=share, wobble=wobble), rng).series


def _still(rng: np.random.Generator, count: int = 3000) -> Series:
    return recorded(np.tile([0.3, 0.4, 0.866], (count, 1)), rng).series


def _elsewhere(rng: np.random.Generator, scale: float) -> Series:
    return recorded(six_circles(rng), rng, scale=scale, unit="uT", step=0.0).series


BAD: dict[str, Callable[[np.random.Generator], Series]] = {
    "circle": partial(_one_circle, wobble=1.0),
    "half circle": partial(_one_circle, share=0.5),
    "wide half circle": partial(_one_circle, share=0.5, wobble=12.0),
    "still": _still,
    "few": partial(_still, count=20),
    "absent": lambda _: _plain(np.full((3000, 3), -1.0)),
    "dead axis": _dead,
    "saturated": _saturated,
    "too large": partial(_elsewhere, scale=0.3),
    "too small": partial(_elsewhere, scale=0.02),
    "alternating current": _alternating,
}


def _bad(name: str) -> Series:
    rng = np.random.default_rng(10)
    series = BAD[name.removesuffix(" with wild samples")](rng)
    if name in BAD:
        return series
    wild = rng.random(len(series)) < 0.02
    off = wild[:, None] * 1500.0 * rng.standard_normal(series.values.shape)
    return replace(series, values=series.values + off)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("circle", "one plane"),
        ("half circle", "one plane"),
        ("wide half circle", "of 100 directions"),
        ("still", "does not turn"),
        ("circle with wild samples", "one plane"),
        ("half circle with wild samples", "one plane"),
        ("still with wild samples", "does not turn"),
        ("few", "too few"),
        ("absent", "missing or asleep"),
        ("dead axis", "axis y"),
        ("saturated", "axis z of the magnetometer is saturated"),
        ("too large", "not the Earth's"),
        ("too small", "not the Earth's"),
        ("alternating current", "does not turn|not one constant field"),
    ],
)
@pytest.mark.parametrize("method", ["orthogonal", "two-step"])
def test_insufficient_data_are_refused_with_the_reason(name: str, says: str, method: str) -> None:
    """Whatever the method, no result that looks like one."""
    with pytest.raises(DataError, match=says):
        fit_magnetometer(_bad(name), method=method)


@pytest.mark.parametrize("axes", [(2,), (0, 1, 2)])
@pytest.mark.parametrize("share", [0.8, 0.5, 0.2, 0.0])
@pytest.mark.parametrize("step", [1.0, 8.0])
def test_a_range_however_small_is_seen_as_saturated(
    axes: tuple[int, ...], share: float, step: float
) -> None:
    """On one axis or on all, with noise of several steps and of half of one."""
    rng = np.random.default_rng(38)
    series = recorded(six_circles(rng), rng, step=step).series
    values = series.values.copy()
    for axis in axes:
        end = np.round((OFFSET[axis] + share * MAGNITUDE) / step) * step
        values[:, axis] = np.minimum(values[:, axis], end)
    with pytest.raises(DataError, match=f"axis [{''.join('xyz'[k] for k in axes)}] .*saturated"):
        fit_magnetometer(replace(series, values=values))


def test_a_rest_in_a_quiet_place_at_the_end_of_an_axis_is_no_saturation() -> None:
    """There the noise is a tenth of a step; while the device turned it was a whole one."""
    rng = np.random.default_rng(40)
    turned, rest = six_circles(rng), np.tile([-1.0, 0.0, 0.0], (600, 1))
    turned = turned[turned[:, 0] > -0.95]
    level = 4.0 * np.repeat([1.0, 0.1], [len(turned), len(rest)])
    field = np.concatenate([turned, rest])
    noise = (level[:, None] * rng.standard_normal(field.shape)) @ CORRECTION.T
    found = fit_magnetometer(recorded(field, rng, noise=0.0, step=4.0, extra=noise).series)
    off = {one.name: one.value - true_parameters()[one.name] for one in found.fit.parameters}
    assert max(abs(off[name]) for name in ("bias_x", "bias_y", "bias_z")) < 1.0  # a quarter step


@pytest.mark.parametrize("rate", [8.0, 25.0, 80.0])
@pytest.mark.parametrize("step", [0.5, 8.0, 16.0])
def test_rests_at_the_end_of_an_axis_are_no_saturation(rate: float, step: float) -> None:
    """Half a minute on each face, straight up and down, at any rate, in fine steps and coarse."""
    rng = np.random.default_rng(39)
    turned = six_circles(rng, wobble=2.0)[:: round(80.0 / rate)]
    rests = np.repeat(np.concatenate([np.eye(3), -np.eye(3)]), round(30.0 * rate), axis=0)
    found = fit_magnetometer(recorded(np.concatenate([turned, rests]), rng, step=step).series)
    assert found.fit.model == ("bias", "soft-iron")


def test_quantised_circles_are_not_taken_for_saturation() -> None:
    """At ten bits the axis that points down reads one value in a whole circle."""
    rng = np.random.default_rng(11)
    made = recorded(six_circles(rng, wobble=1.0), rng, step=TEN_BITS, noise=1.0)
    assert fit_magnetometer(made.series).fit.model == ("bias", "soft-iron")


def test_a_fit_at_the_limit_of_the_test_for_an_excess_arrives() -> None:
    """Of this sensor in ten bits the fit with an excess led to that without it, and back again."""
    rng = np.random.default_rng([16302, 271])
    series = recording(MOTIONS["six circles of 20 s"], Noise(), TEN_BITS, rng)[-1]
    found = {one.name: one.value for one in fit_magnetometer(series).fit.parameters}
    assert found == pytest.approx(true_parameters(), rel=0.01, abs=0.01)
