"""What each effect moves, by hand: one row, numbers that can be checked on paper."""

import math
from itertools import pairwise

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.effect import Circumstances

MILLI_G = 9.80665e-3
DEGREE = math.pi / 180.0


def moment(**changed: float | tuple[float, float, float]) -> Circumstances:
    """One row: 0.6 g along x and −0.8 g along y, 100 °/s about x and −20 about z, 30 °C, 4 min.

    The session's mean is 25 °C, its middle 2 min; the hold before had 0.5 g along −z; 0.2 g rms of
    vibration.
    """

    def row(name: str, value: float | tuple[float, float, float]) -> FloatArray:
        return np.array([changed.get(name, value)], np.float64)

    return Circumstances(
        force=STANDARD_GRAVITY * row("force", (0.6, -0.8, 0.0)),
        rate=DEGREE * row("rate", (100.0, 0.0, -20.0)),
        temperature=row("temperature", 30.0),
        time=row("time", 240.0),
        previous=STANDARD_GRAVITY * row("previous", (0.0, 0.0, -0.5)),
        vibration=(STANDARD_GRAVITY * row("vibration", 0.2)) ** 2,
        reference_temperature=25.0,
        reference_time=120.0,
    )


ACCELEROMETER: dict[str, tuple[float, float, float]] = {
    "second-order": (0.36, 0.64, 0.0),
    "asymmetry": (0.6, 0.8, 0.0),
    "odd-quadratic": (0.36, -0.64, 0.0),
    "third-order": (0.216, -0.512, 0.0),
    "dead-zone": (-1.0, 1.0, 0.0),
    "scale-drift": (2e-3 * 0.6, 2e-3 * -0.8, 0.0),
    "scale-step": (0.6e-3, -0.8e-3, 0.0),
    "bias-temperature": (5.0, 5.0, 5.0),
    "scale-temperature": (5e-3 * 0.6, 5e-3 * -0.8, 0.0),
    "warm-up": (math.exp(-240.0 / 180.0),) * 3,
    "bias-drift": (2.0, 2.0, 2.0),
    "bias-step": (1.0, 1.0, 1.0),
    "hysteresis": (0.0, 0.0, -0.5),
    "vibration-rectification": (0.04, 0.04, 0.04),
}
"""mg on x, y and z for 1 shown unit (mg/g², mg/g …, ppm/°C) on that axis."""
GYROSCOPE: dict[str, tuple[float, float, float]] = {
    "second-order": (0.01, 0.0, 0.0004),
    "asymmetry": (0.1, 0.0, 0.02),
    "third-order": (0.1, 0.0, -0.0008),
    "scale-drift": (2e-4, 0.0, -4e-5),
    "scale-step": (1e-4, 0.0, -2e-5),
    "bias-temperature": (5.0, 5.0, 5.0),
    "scale-temperature": (5e-4, 0.0, -1e-4),
    "warm-up": (math.exp(-240.0 / 180.0),) * 3,
    "bias-drift": (2.0, 2.0, 2.0),
    "bias-step": (1.0, 1.0, 1.0),
}
"""°/s on x, y and z for 1 shown unit (ppm/(°/s), 1e-3, 1e-7/(°/s)², ppm/°C …) on that axis."""


@pytest.mark.parametrize("name", ACCELEROMETER)
def test_an_accelerometer_effect_moves_each_axis_by_its_own_parameter(name: str) -> None:
    """The closed form in mg on the diagonal, nothing off it."""
    columns = effect(name).columns("accelerometer", moment())
    np.testing.assert_allclose(columns[0], MILLI_G * np.diag(ACCELEROMETER[name]), atol=1e-15)


@pytest.mark.parametrize("name", GYROSCOPE)
def test_a_gyroscope_effect_moves_each_axis_by_its_own_parameter(name: str) -> None:
    """The closed form in °/s on the diagonal, nothing off it."""
    columns = effect(name).columns("gyroscope", moment())
    np.testing.assert_allclose(columns[0], DEGREE * np.diag(GYROSCOPE[name]), atol=1e-15)


def named(name: str, sensor: str, c: Circumstances) -> dict[str, FloatArray]:
    """Each parameter's column at the first row, in mg or °/s."""
    columns = effect(name).columns(sensor, c)[0] / (MILLI_G if sensor[0] == "a" else DEGREE)
    keys = [parameter.name for parameter in effect(name).parameters(sensor)]
    return dict(zip(keys, columns.T, strict=True))


def test_a_product_acts_on_the_axis_named_first() -> None:
    """``yxy`` is what y reads of a_x·a_y; a product with a level axis is nothing."""
    products = named("cross-product", "accelerometer", moment())
    assert list(products) == ["xxy", "xxz", "xyz", "yxy", "yxz", "yyz", "zxy", "zxz", "zyz"]
    np.testing.assert_allclose(products["yxy"], [0.0, -0.48, 0.0])
    np.testing.assert_allclose(products["zxy"], [0.0, 0.0, -0.48])
    np.testing.assert_array_equal(products["xyz"], np.zeros(3))
    rates = named("cross-product", "gyroscope", moment())
    np.testing.assert_allclose(rates["xxz"], [-0.02, 0.0, 0.0])


def test_a_cubic_cross_term_is_a_gain_by_the_product_of_two_forces() -> None:
    """``yxx`` is what y reads of a_y·a_x², ``yxy`` of a_y·a_x·a_y; no term has a level axis."""
    cubic = named("cubic-cross", "accelerometer", moment())
    assert list(cubic)[:5] == ["xxy", "xxz", "xyy", "xyz", "xzz"]
    assert len(cubic) == 15
    np.testing.assert_allclose(cubic["yxy"], [0.0, 0.6 * 0.64, 0.0])
    np.testing.assert_array_equal(cubic["xyz"], np.zeros(3))
    np.testing.assert_allclose(cubic["yxx"], [0.0, -0.8 * 0.36, 0.0])
    np.testing.assert_allclose(cubic["xyy"], [0.6 * 0.64, 0.0, 0.0])
    np.testing.assert_array_equal(cubic["zyy"], np.zeros(3))


def test_a_lagging_zero_falls_short_while_the_device_warms() -> None:
    """A minute at 0.01 °C/s makes −0.6 mg; 0.02 °C of noise, 0.02 mg rms, and up to 0.08."""
    time = np.arange(0.0, 1200.0, 12.0)
    rng = np.random.default_rng(1)
    turning = np.where(time < 600.0, 0.01 * time, 12.0 - 0.01 * time)
    none = np.zeros((100, 3))
    warm = 20.0 + turning + 0.02 * rng.standard_normal(100)
    held = Circumstances(none, none, warm, time, none, np.zeros(100))
    late = effect("thermal-lag").error("accelerometer", held, np.array([0.0, 60.0, 0.0]))
    assert not late[:, [0, 2]].any()
    np.testing.assert_allclose(late[3:45, 1] / MILLI_G, -0.6, atol=0.08)
    np.testing.assert_allclose(late[55:97, 1] / MILLI_G, 0.6, atol=0.08)


@pytest.mark.parametrize("settled", [90.0, 180.0])
def test_an_exponential_warm_up_has_an_exponential_slope(settled: float) -> None:
    """At a time constant of twice the stretch that is averaged it is right within 3 %."""
    time = np.arange(0.0, 320.0, 0.5)
    warm = 25.0 - 12.0 * np.exp(-time / settled)
    none = np.zeros((len(time), 3))
    held = Circumstances(none, none, warm, time, none, np.zeros(len(time)))
    slope = held.warming - held.warming.mean()
    known = np.column_stack([np.ones(len(time)), warm])
    left = slope - known @ np.linalg.lstsq(known, slope, rcond=None)[0]
    assert np.std(left) < 0.03 * np.std(slope)


def test_a_changing_clock_moves_all_axes_by_one_share() -> None:
    """Two minutes after the middle, 1 ppm/min makes 2 ppm of every rate."""
    (share,) = named("clock", "gyroscope", moment()).values()
    np.testing.assert_allclose(share, [2e-4, 0.0, -4e-5])


def test_a_late_axis_makes_products_of_rates_on_the_other_two() -> None:
    """At 100 °/s about x and −20 about z, 1 ms of x makes 1e-3 · 100 · −20 · π/180 °/s on y."""
    late = named("axis-delay", "gyroscope", moment())
    np.testing.assert_allclose(late["x"], [0.0, -2.0 * DEGREE, 0.0])
    np.testing.assert_allclose(late["z"], [0.0, 2.0 * DEGREE, 0.0])
    assert "opposite sign" in effect("axis-delay").stories["gyroscope"].needs


def test_products_of_forces_on_the_other_axes_are_a_second_order_term_at_one_g() -> None:
    """In the magnitude x³ = x − x·y² − x·z²: a bias, and equal products on y and on z."""
    c = moment(force=(0.48, -0.64, 0.6))
    square, products = (named(n, "accelerometer", c) for n in ("second-order", "cross-product"))
    up = c.force[0] / STANDARD_GRAVITY  # of 1 g
    along = {name: column @ up for name, column in {**products, **square}.items()}
    np.testing.assert_allclose(along["x"], up[0] - along["yxy"] - along["zxz"], rtol=1e-9)
    # not across gravity, where a gyroscope's rotations feel it
    across = square["x"] + products["yxy"] + products["zxz"] - np.array([1.0, 0.0, 0.0])
    np.testing.assert_allclose(across, up[0] * up - np.array([1.0, 0.0, 0.0]))
    needs = effect("second-order").stories["accelerometer"].needs
    assert "exactly the same" in needs
    assert "directions differ" in needs


def test_g_sensitivity_is_output_then_input() -> None:
    """``zx`` is what the z gyroscope feels of gravity along x; squares have no sign."""
    linear = named("g-sensitivity", "gyroscope", moment())
    square = named("g2-sensitivity", "gyroscope", moment())
    assert list(linear) == ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"]
    np.testing.assert_allclose(linear["zx"], [0.0, 0.0, 0.6])
    np.testing.assert_allclose(linear["xy"], [-0.8, 0.0, 0.0])
    np.testing.assert_allclose(square["xy"], [0.64, 0.0, 0.0])
    product = named("anisoelastic", "gyroscope", moment())
    np.testing.assert_allclose(product["zxy"], [0.0, 0.0, -0.48])


def test_the_earth_turns_about_up() -> None:
    """15 °/h upwards are felt as 15 °/h along the up direction, whatever gravity is."""
    rate = effect("earth-rate").error("gyroscope", moment(), np.array([15.0]))
    np.testing.assert_allclose(rate[0], 15.0 * DEGREE / 3600.0 * np.array([0.6, -0.8, 0.0]))
    fallen = effect("earth-rate").columns("gyroscope", moment(force=(0.0, 0.0, 0.0)))
    np.testing.assert_array_equal(fallen, np.zeros((1, 3, 1)))


def test_nothing_is_felt_where_nothing_is_known() -> None:
    """No hold before, no temperature, no vibration: no error, and no NaN."""
    nan = math.nan
    blank = moment(previous=(nan, nan, nan), temperature=nan, vibration=nan)
    names = "hysteresis", "bias-temperature", "scale-temperature", "vibration-rectification"
    for name in names:
        columns = effect(name).columns("accelerometer", blank)
        np.testing.assert_array_equal(columns, np.zeros((1, 3, 3)))


def test_warm_up_tries_time_constants_and_a_step_every_moment_between_holds() -> None:
    """A step needs three holds on either side; its error begins with the hold after the moment."""
    warm, step = effect("warm-up"), effect("bias-step")
    session = Circumstances(
        force=np.zeros((8, 3)),
        rate=np.zeros((8, 3)),
        temperature=np.full(8, 25.0),
        time=np.array([0.0, 10.0, 20.0, 30.0, 50.0, 60.0, 70.0, 80.0]),
        previous=np.zeros((8, 3)),
        vibration=np.zeros(8),
    )
    constants = [float(tau) for tau in warm.variants(session) if tau is not None]
    assert (constants[0], constants[-1]) == (60.0, 1200.0)
    np.testing.assert_allclose(
        warm.columns("accelerometer", session, 60.0)[5], MILLI_G * math.exp(-1.0) * np.eye(3)
    )
    assert step.variants(session) == (25.0, 40.0, 55.0)
    jump = step.columns("accelerometer", session, 40.0)[:, 2, 2] / MILLI_G
    np.testing.assert_allclose(jump, [0, 0, 0, 0, 1, 1, 1, 1])
    assert step.variants(session.select(slice(0, 5))) == (None,)


def test_neighbouring_time_constants_leave_no_gap() -> None:
    """A warm-up between two of them is explained to 99 % by one of them, biases aside."""
    t = np.arange(0.0, 1200.0, 30.0)

    def course(tau: float) -> FloatArray:
        centred = np.exp(-t / tau) - np.exp(-t / tau).mean()
        return np.asarray(centred / np.linalg.norm(centred), np.float64)

    variants = [tau for tau in effect("warm-up").variants(moment()) if tau is not None]
    for low, high in pairwise(variants):
        between = course(math.sqrt(low * high))
        assert max(between @ course(low), between @ course(high)) > 0.99
