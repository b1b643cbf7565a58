"""What is drawn: the newest seconds of all channels, and how the device lies."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imucal_wizard.acquire.decode.base import Column
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.run.snapshot import StreamStatus
from imucal_wizard.run.snapshot_maker import TRACE_SECONDS, AttitudeFilter, Ring, Traces


def _readings(time: FloatArray, a: FloatArray, g: FloatArray, unit: str = "m/s^2") -> Readings:
    return Readings(Series(time, a, unit), Series(time, g, "rad/s"))


def _index(count: int) -> FloatArray:
    return np.column_stack([np.arange(count, dtype=np.float64)] * 3)


@given(st.integers(1, 20), st.lists(st.integers(0, 30), max_size=8))
def test_a_ring_keeps_the_newest_rows_in_order(size: int, counts: list[int]) -> None:
    ring, fed = Ring(size, 1), 0
    for count in counts:
        ring.add(np.arange(fed, fed + count, dtype=float)[:, None])
        fed += count
    np.testing.assert_array_equal(ring.newest()[:, 0], np.arange(max(0, fed - size), fed))


@given(st.lists(st.integers(1, 900), min_size=1, max_size=12))
def test_the_samples_drawn_do_not_depend_on_how_they_came(counts: list[int]) -> None:
    total = sum(counts)
    time, a = np.arange(total) / 1000.0, _index(total)
    pieces, whole = Traces(1000.0), Traces(1000.0)
    whole.feed(_readings(time, a, -a))
    start = 0
    for count in counts:
        part = slice(start, start + count)
        pieces.feed(_readings(time[part], a[part], -a[part]))
        start += count
    np.testing.assert_array_equal(pieces.drawn(), whole.drawn())


@pytest.mark.parametrize("rate", [10.0, 100.0, 1666.0, 8000.0])
def test_traces_span_ten_seconds_with_a_bounded_number_of_points(rate: float) -> None:
    traces = Traces(rate)
    count = round(rate * 15)
    traces.feed(_readings(np.arange(count) / rate, _index(count), _index(count)))
    drawn = traces.drawn()
    assert len(drawn) <= 1010
    assert (drawn[-1, 0] - drawn[0, 0]) / rate == pytest.approx(TRACE_SECONDS, rel=0.02, abs=0.11)


def test_without_a_gyroscope_there_are_no_rates_to_draw() -> None:
    traces = Traces(100.0)
    traces.feed(replace(_readings(np.arange(10) / 100.0, _index(10), _index(10)), gyroscope=None))
    assert np.isnan(traces.drawn()[:, 3:]).all()
    assert np.isfinite(traces.drawn()[:, :3]).all()


def test_the_newest_field_stays_until_a_slow_magnetometer_says_another() -> None:
    traces, time = Traces(100.0), np.arange(10) / 100.0
    assert traces.magnetometer is None
    field = Series(time[:2], np.array([[1.0, 2.0, 3.0], [20.0, -5.0, 40.0]]), "uT")
    traces.feed(replace(_readings(time, _index(10), _index(10)), magnetometer=field))
    traces.feed(_readings(time + 0.1, _index(10), _index(10)))
    assert traces.magnetometer == (20.0, -5.0, 40.0)


def test_the_drawing_follows_gravity() -> None:
    attitude = AttitudeFilter()
    up = np.array([0.0, 1.0, 0.0])
    time = np.arange(50) / 100.0
    attitude.feed(_readings(time, np.tile(9.8 * up, (50, 1)), np.zeros((50, 3))), None)
    assert attitude.matrix is not None
    np.testing.assert_allclose(attitude.matrix @ up, [0, 0, 1], atol=1e-12)


def test_the_drawing_turns_with_the_gyroscope_about_the_vertical() -> None:
    attitude = AttitudeFilter()
    time = np.arange(100) / 100.0
    still = np.tile([0.0, 0.0, 9.8], (100, 1))
    attitude.feed(_readings(time, still, np.zeros((100, 3))), None)
    turning = np.tile([0.0, 0.0, np.pi / 2], (100, 1))
    attitude.feed(_readings(time, still, turning), None)
    assert attitude.matrix is not None
    np.testing.assert_allclose(attitude.matrix @ [1.0, 0.0, 0.0], [0, 1, 0], atol=1e-9)


def test_a_resting_device_is_not_drawn_as_turning_whatever_the_gyroscopes_bias() -> None:
    """A minute at rest with a bias of 2 °/s, then a quarter turn: the bias turns nothing."""
    attitude = AttitudeFilter()
    time, still = np.arange(100) / 100.0, np.tile([0.0, 0.0, 9.8], (100, 1))
    bias = np.radians([1.0, -0.5, 2.0])
    for _ in range(60):
        attitude.feed(_readings(time, still, np.tile(bias, (100, 1))), None, at_rest=True)
    assert attitude.matrix is not None
    np.testing.assert_allclose(attitude.matrix, np.eye(3), atol=1e-9)
    turning = np.tile(bias + np.array([0.0, 0.0, np.pi / 2]), (100, 1))
    attitude.feed(_readings(time, still, turning), None)
    np.testing.assert_allclose(attitude.matrix @ [1.0, 0.0, 0.0], [0, 1, 0], atol=1e-9)


def test_upside_down_is_drawn_upside_down() -> None:
    attitude = AttitudeFilter()
    time = np.arange(10) / 100.0
    for z in (9.8, -9.8):
        for _ in range(40):
            a = np.tile([0.0, 0.0, z], (10, 1))
            attitude.feed(_readings(time, a, np.zeros((10, 3))), None)
    assert attitude.matrix is not None
    np.testing.assert_allclose(attitude.matrix @ [0.0, 0.0, -1.0], [0, 0, 1], atol=1e-2)


def test_with_counts_the_procedure_says_where_up_is() -> None:
    attitude = AttitudeFilter()
    counts = np.tile([33000.0, 33000.0, 36500.0], (10, 1))
    readings = _readings(np.arange(10) / 100.0, counts, counts, "count")
    attitude.feed(readings, None)
    assert attitude.matrix is None
    attitude.feed(readings, (1.0, 0.0, 0.0))
    assert attitude.matrix is not None
    np.testing.assert_allclose(attitude.matrix @ [1.0, 0.0, 0.0], [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize(
    ("gravity", "unit", "right"),
    [(9.6, "m/s^2", True), (1.0, "m/s^2", False), (4096.0, "count", None), (None, "m/s^2", None)],
)
def test_the_preview_knows_a_gravity_that_cannot_be(
    gravity: float | None, unit: str, right: bool | None
) -> None:
    assert StreamStatus(gravity=gravity, accelerometer_unit=unit).gravity_right is right


def test_few_printed_decimals_hide_the_noise_but_counts_have_none() -> None:
    assert StreamStatus(digits=2).few_digits
    assert not StreamStatus(digits=3).few_digits
    assert not StreamStatus(digits=0, accelerometer_unit="count").few_digits
    assert not StreamStatus(digits=0).few_digits


@pytest.mark.parametrize(("unit", "enough"), [("m/s^2", 3), ("g", 4), ("mg", 1), ("cm/s^2", 1)])
def test_printed_decimals_count_in_the_unit_that_is_printed(unit: str, enough: int) -> None:
    """0.1 mg is a step of 0.001 m/s², and 0.001 g is one of 0.01 m/s²."""
    columns = tuple(Column(channel, unit) for channel in ("ax", "ay", "az"))
    assert not StreamStatus(digits=enough, columns=columns).few_digits
    if enough > 1:
        assert StreamStatus(digits=enough - 1, columns=columns).few_digits
