"""Gravity tells the accelerometer's unit; the host's clock tells the time's; the rest is asked."""

import math

import numpy as np
import pytest

from imucal_wizard.acquire import column_guess
from imucal_wizard.core.gravity import unit_of_gravity
from imucal_wizard.core.readings import FloatArray


def ramp(count: int, step: float = 1.0) -> FloatArray:
    """Numbers that grow by one step each."""
    return np.arange(count, dtype=np.float64) * step


def at(size: float, noise: float = 0.003) -> FloatArray:
    """Readings of a device at rest, tilted, whose gravity has this size."""
    rng = np.random.default_rng(0)
    direction = np.array([0.48, -0.6, 0.64])
    values: FloatArray = size * (direction + rng.normal(0, noise, (50, 3)))
    return values


@pytest.mark.parametrize(
    ("size", "unit"),
    [
        (9.80665, "m/s^2"),
        (9.4, "m/s^2"),
        (1.0, "g"),
        (1.05, "g"),
        (1000.0, "mg"),
        (2048.0, "count"),
        (16384.0, "count"),
        (8362.0, "count"),
        (133.48, "count"),
        (0.02, ""),
    ],
)
def test_the_size_of_gravity_tells_the_unit(size: float, unit: str) -> None:
    found = column_guess.guess_accelerometer_unit(at(size))
    assert found.unit == unit
    assert "ravity reads" in found.why


@pytest.mark.parametrize(
    ("size", "unit"), [(1000.0, "mg"), (256.0, "count"), (3000.0, "count"), (16384.0, "count")]
)
def test_whole_numbers_are_counts_unless_they_are_milli_g(size: float, unit: str) -> None:
    """The same rule as for files: one stream, recorded, is not read in another unit."""
    assert column_guess.guess_accelerometer_unit(np.round(at(size))).unit == unit


@pytest.mark.parametrize(
    ("size", "unit"),
    [
        (9.81, "m/s^2"), (8.4, "m/s^2"), (1.1, "g"), (880.0, "mg"),
        (8.2, None), (1.2, None), (0.0, None), (16384.0, None), (math.nan, None),
    ],
)  # fmt: skip
def test_one_gravity_has_its_size_in_one_unit_or_in_none(size: float, unit: str | None) -> None:
    """To 15 %, with bias and scale."""
    assert unit_of_gravity(size, 0.15) == unit


def test_counts_around_mid_scale_are_offset_binary() -> None:
    values = np.round(32768 + 415 * 9.8 * at(1.0))
    found = column_guess.guess_accelerometer_unit(values)
    assert found.unit == "count"
    assert "offset" in found.why


@pytest.mark.parametrize(
    ("size", "unit"), [(48.0, "uT"), (0.48, "G"), (480.0, "mG"), (48000.0, "nT"), (3000.0, "count")]
)
def test_the_size_of_the_field_tells_the_magnetometers_unit(size: float, unit: str) -> None:
    assert column_guess.guess_magnetometer_unit(at(size)).unit == unit


def test_a_magnet_beside_the_sensor_does_not_change_the_unit() -> None:
    """The readings surround (-48, -223, -35) at a distance of 50."""
    directions = np.random.default_rng(6).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    found = column_guess.guess_magnetometer_unit(50.0 * directions + (-48.0, -223.0, -35.0))
    assert found.unit == "uT"
    assert "reads 50" in found.why


@pytest.mark.parametrize(("step", "unit"), [(0.01, "s"), (10.0, "ms"), (10_000.0, "us")])
def test_the_unit_of_time_follows_from_the_hosts_clock(step: float, unit: str) -> None:
    arrivals = 50 + ramp(100, 0.01)
    assert column_guess.guess_time_unit(5 * step + ramp(100, step), arrivals).unit == unit


@pytest.mark.parametrize(("step", "unit"), [(0.01, "s"), (10.0, "ms"), (10_000.0, "us")])
def test_without_arrivals_the_step_alone_decides(step: float, unit: str) -> None:
    assert column_guess.guess_time_unit(ramp(100, step), np.zeros(100)).unit == unit


def test_an_unusable_time_column_is_reported() -> None:
    arrivals = ramp(100, 0.01)
    assert column_guess.guess_time_unit(np.zeros(100), arrivals).unit == ""
    assert column_guess.guess_time_unit(ramp(100, 0.33), arrivals).unit == ""


def _columns(*parts: FloatArray) -> FloatArray:
    return np.column_stack(parts) if parts else np.zeros((50, 0))


GYRO = np.random.default_rng(5).normal(0.01, 0.002, (50, 3))
TIME = ramp(50, 12.5)
HEAT = np.full(50, 25.0)


@pytest.mark.parametrize(
    ("values", "names", "sure"),
    [
        (at(9.8), "ax ay az", True),
        (_columns(at(1.0), GYRO), "ax ay az gx gy gz", True),
        (_columns(GYRO, at(1.0)), "gx gy gz ax ay az", True),
        (_columns(TIME, at(1000.0), GYRO, HEAT), "t ax ay az gx gy gz temp", True),
        (_columns(ramp(50), at(1.0), GYRO), "counter ax ay az gx gy gz", True),
        (_columns(at(1.0), GYRO, at(45.0)), "ax ay az gx gy gz mx my mz", True),
        (_columns(at(9.8), GYRO, TIME), "ax ay az gx gy gz t", True),
        (_columns(at(133.0), GYRO), "ax ay az gx gy gz", False),
        (_columns(at(1.0), at(1.0)), "ax ay az gx gy gz", False),
        (_columns(at(9.8), HEAT, HEAT), "- - - - -", False),
        # whole counts of an MPU6050 whose gyroscope's bias happens to be 9.8 counts
        (_columns(np.round(at(16384.0)), np.round(at(9.8, 0.05))), "ax ay az gx gy gz", False),
        # counts of an accelerometer beside a bias of 1 °/s
        (_columns(np.round(at(16384.0)), at(1.0, 0.01)), "gx gy gz ax ay az", False),
        (_columns(at(1.0, 0.3), GYRO), "ax ay az gx gy gz", False),
        (_columns(at(1.0), at(45.0), GYRO), "ax ay az gx gy gz mx my mz", False),
        (_columns(), "", False),
    ],
)
def test_columns_are_proposed_and_taken_only_where_gravity_is_plain(
    values: FloatArray, names: str, sure: bool
) -> None:
    found, certain = column_guess.guess_channels(values)
    assert [c or "-" for c in found] == names.split()
    assert certain is sure
