"""The mean force in a hold in the hand is that of its mean attitude."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from benchmarks.hand_motion import Device, G, Motion, placed, recorded
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.estimate.hold_search import find_holds
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.estimate.sway import without_sway
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.report.calibrated_device import (
    CalibratedDevice,
    RecheckSettings,
    recheck_readings,
)
from imucal_wizard.report.calibration_record import from_report
from imucal_wizard.sessions.stored_readings import made_of

MG = 1e-3 * G
DEVICE = Device(noise=0.01, flicker=0.0, bits=24)


def rocking(degrees: float, seed: int) -> Motion:
    """A session in a hand that rocks the device at 1 to 9 Hz."""
    return placed(DEVICE, np.random.default_rng(seed), rocking=degrees, turns=1)


def felt(motion: Motion) -> Readings:
    """By sensors without errors."""
    rate = Series(motion.time, motion.rate, "rad/s")
    return Readings(Series(motion.time, motion.force, "m/s^2"), rate)


def true_force(motion: Motion, hold: Hold) -> FloatArray:
    """Mean force in a hold, in the world, by the true attitudes."""
    rows = np.flatnonzero((motion.time >= hold.start) & (motion.time < hold.end - 1e-4))
    return np.asarray(motion.attitude[rows].apply(motion.force[rows]).mean(axis=0))


def noisy(readings: Readings) -> Readings:
    """With the noise without which no hold is found."""
    rng, force = np.random.default_rng(2), readings.accelerometer
    values = force.values + 1e-3 * rng.standard_normal(force.values.shape)
    return replace(readings, accelerometer=replace(force, values=values))


@pytest.mark.parametrize(("degrees", "seed"), [(0.3, 1), (0.3, 2), (0.8, 1), (0.8, 4)])
def test_a_hold_that_rocks_has_the_force_of_its_mean_attitude(degrees: float, seed: int) -> None:
    """The mean of its readings does not: the sensor moves about a point beside it, too."""
    motion = rocking(degrees, seed)
    readings = noisy(felt(motion))
    holds = find_holds(readings, G)[0]
    assert len(holds) > 20
    corrected = without_sway(holds, readings, 1.0, None)
    lengths = np.array([
        [np.linalg.norm(one.accelerometer) for one in (before, after)]
        + [np.linalg.norm(true_force(motion, before))]
        for before, after in zip(holds, corrected, strict=True)
    ])  # fmt: skip
    raw, left = (lengths[:, :2] - lengths[:, 2:]).T / MG
    assert np.sqrt((raw**2).mean()) > 0.7 * (degrees / 0.8) ** 2
    assert np.sqrt((left**2).mean()) < 0.1 * np.sqrt((raw**2).mean())


def test_noise_of_the_rates_is_taken_for_no_sway() -> None:
    """Noise of 0.5 °/s in 1 Hz turns a hold of 3 s by 0.25° rms, beside 1.4° that are true.

    A hold in which the rates are noise stays as it is.
    """
    rng = np.random.default_rng(3)
    time = np.arange(300) / 100.0
    density, rocked = np.radians(0.5) ** 2, np.radians(2.0)
    angle = rocked * np.sin(2.0 * np.pi * 2.0 * time)
    rate = np.column_stack([4.0 * np.pi * rocked * np.cos(4.0 * np.pi * time), 0 * time, 0 * time])
    force = Series(time, G * np.column_stack([0 * time, np.sin(angle), np.cos(angle)]), "m/s^2")
    hold = Hold(
        start=0.0,
        end=3.0,
        accelerometer=force.values.mean(axis=0),
        accelerometer_covariance=np.eye(3) * 1e-8,
        gyroscope=np.zeros(3),
        gyroscope_covariance=np.eye(3),
        samples=300,
    )
    left = []
    for _ in range(400):
        noise = np.sqrt(density * 100.0) * rng.standard_normal((300, 3))
        readings = Readings(force, Series(time, rate + noise, "rad/s"))
        means = [
            np.linalg.norm(without_sway([hold], readings, 1.0, known)[0].accelerometer) - G
            for known in (np.full(3, density), None)
        ]
        left.append(means)
        still = replace(readings, gyroscope=Series(time, noise, "rad/s"))
        assert without_sway([hold], still, 1.0, np.full(3, density))[0] is hold
    (known, unknown), doubt = np.mean(left, axis=0) / MG, np.std(left, axis=0) / MG / 20.0
    assert abs(known) < 3.0 * doubt[0]
    assert unknown < -5.0 * doubt[1]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_bias_that_drifts_from_hold_to_hold_turns_none(seed: int) -> None:
    """0.5 °/s over the session would turn a hold of 3 s on a table by 0.4°: 0.02 mg."""
    readings = recorded(rocking(0.0, seed), DEVICE, np.random.default_rng(seed))
    assert readings.gyroscope is not None
    time = readings.gyroscope.time
    drift = np.radians(0.5) * (time / time[-1])[:, None] * [1.0, -1.0, 1.0]
    drifting = replace(readings.gyroscope, values=readings.gyroscope.values + drift)
    readings = replace(readings, gyroscope=drifting)
    holds = find_holds(readings, G)[0]
    for before, after in zip(holds, without_sway(holds, readings, 1.0, None), strict=True):
        assert np.abs(after.accelerometer - before.accelerometer).max() < 1e-3 * MG


def test_a_gyroscope_in_another_unit_changes_nothing() -> None:
    """A sway of 46° rms is none: degrees were taken for radians."""
    readings = noisy(felt(rocking(0.8, 4)))
    holds = find_holds(readings, G)[0]
    for before, after in zip(holds, without_sway(holds, readings, 57.3, None), strict=True):
        assert after is before


def test_a_rate_that_is_no_number_leaves_its_hold_as_it_is() -> None:
    """All others are corrected."""
    readings = noisy(felt(rocking(0.8, 4)))
    assert readings.gyroscope is not None
    holds = find_holds(readings, G)[0]
    values = readings.gyroscope.values.copy()
    values[np.searchsorted(readings.gyroscope.time, holds[3].start + 1.0)] = np.nan
    broken = replace(readings, gyroscope=replace(readings.gyroscope, values=values))
    found = without_sway(holds, broken, 1.0, None)
    assert [k for k, one in enumerate(found) if one is holds[k]] == [3]
    assert all(np.isfinite(one.accelerometer).all() for one in found)


def test_counts_are_corrected_once_their_size_is_known() -> None:
    """The same bias to a tenth of its standard error as in units, far from that without."""
    readings = recorded(rocking(0.8, 7), DEVICE, np.random.default_rng(7))
    assert readings.gyroscope is not None
    counts = Series(readings.gyroscope.time, 1e6 * readings.gyroscope.values, "count")
    in_units, in_counts, without = (
        fit_readings(replace(readings, gyroscope=one)).sensors["accelerometer"]
        for one in (readings.gyroscope, counts, None)
    )
    error = in_units.parameters[0].standard_error
    assert error is not None
    assert np.abs(in_counts.bias - in_units.bias).max() < 0.1 * error
    assert np.abs(without.bias - in_units.bias).max() > 3.0 * error


def test_a_recheck_in_a_rocking_hand_agrees_with_the_truth() -> None:
    """Its holds are corrected as those of a calibration are; the samples stay theirs."""
    rng = np.random.default_rng(6)
    state = rng.bit_generator.state
    report = fit_readings(recorded(rocking(0.0, 6), DEVICE, rng))
    made = from_report(report, "a table", "2026-01-01T00:00:00+00:00")
    known = CalibratedDevice(made, RecheckSettings(datetime(2026, 1, 1, 1, tzinfo=UTC)))
    rng.bit_generator.state = state
    moving = recorded(rocking(0.8, 6), DEVICE, rng)
    errors = []
    for readings in (moving, replace(moving, gyroscope=None)):
        error = recheck_readings(known, readings).sensors["accelerometer"].error
        assert error is not None
        errors.append(error)
    assert errors[0] < 0.5 * errors[1], errors
    holds = fit_readings(moving).holds
    assert made_of(moving, holds)


@pytest.mark.parametrize(("degrees", "seed"), [(0.3, 1), (0.5, 2)])
def test_the_order_of_turns_in_a_rocking_hold_is_known(degrees: float, seed: int) -> None:
    """The turns from the beginning to the mean attitude and on to the end, against true attitudes.

    Every sample has the true rate over the interval that follows it.
    """
    motion = rocking(degrees, seed)
    readings = noisy(felt(motion))
    holds = find_holds(readings, G)[0]
    left, unordered = [], []
    for one in without_sway(holds, readings, 1.0, None):
        rows = np.flatnonzero((motion.time >= one.start) & (motion.time < one.end - 1e-4))
        attitudes, assumed = motion.attitude[rows], one.gyroscope_order
        assert assumed is not None
        step = 1.0 / DEVICE.rate
        halves = 0.5 * step * (motion.rate[rows[1:]] + motion.rate[rows[:-1]])
        angle = np.vstack([np.zeros(3), np.cumsum(halves, axis=0)])
        # the trapezoidal rule is half a sample ahead of the attitudes, at each end and in the mean
        ahead = 0.5 * step * (motion.rate[rows] - motion.rate[rows[0]])
        linear = np.array([angle.mean(axis=0), angle[-1] - angle.mean(axis=0)])
        linear -= [ahead.mean(axis=0), ahead[-1] - ahead.mean(axis=0)]
        middle = attitudes.mean()
        true = np.array([
            (attitudes[0].inv() * middle).as_rotvec(),
            (middle.inv() * attitudes[-1]).as_rotvec(),
        ])  # fmt: skip
        left.append(true - linear - assumed)
        unordered.append(true - linear)
    assert np.sqrt(np.mean(np.square(left))) < 0.3 * np.sqrt(np.mean(np.square(unordered)))


def test_without_a_gyroscope_the_force_shows_a_slow_sway() -> None:
    """Holds are short by what a sway of 0.5° below 1 Hz makes; then by less than a seventh of that.

    Averages over a fifth of a second lessen the variance of a wave of 1 Hz by an eighth.
    """
    raw, left = [], []
    for seed in range(1, 4):
        motion = placed(DEVICE, np.random.default_rng(seed), sway=0.5, tremor=2.0)
        readings = replace(noisy(felt(motion)), gyroscope=None)
        holds = find_holds(readings, G)[0]
        for before, after in zip(holds, without_sway(holds, readings, 1.0, None), strict=True):
            true = np.linalg.norm(true_force(motion, before))
            raw.append(float(np.linalg.norm(before.accelerometer) - true) / MG)
            left.append(float(np.linalg.norm(after.accelerometer) - true) / MG)
    assert np.mean(raw) < -0.04
    assert abs(np.mean(left)) < abs(np.mean(raw)) / 7.0
