"""A gyroscope's own noise in holds of a hand that sways and trembles."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, firwin, lfilter, sosfilt

from benchmarks.hand_motion import Device, G, placed, recorded
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.hold_search import find_holds
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.estimate.rest_spectrum import _quietest, rest_spectrum
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.simulate.recording import simulate_recording

NOISE = 1e-4
"""White noise, rad/s/√Hz, two-sided."""
HOLDS, SECONDS = 25, 3.2


def _moving(time: FloatArray, tremor: tuple[float, float], rng: np.random.Generator) -> FloatArray:
    """A sway of 1 °/s below 1 Hz and a tremor of 5 °/s between two frequencies, rad/s, (n, 3)."""
    rate = np.zeros((len(time), 3))
    for size, (low, high) in ((1.0, (0.1, 1.0)), (5.0, tremor)):
        for frequency, phase in rng.uniform([low, 0.0], [high, 2.0 * np.pi], (8, 2)):
            wave = np.sin(2.0 * np.pi * frequency * time[:, None] + phase + np.arange(3.0))
            rate += np.radians(size) / 2.0 * wave
    return rate


def _read(time: FloatArray, rate: FloatArray) -> Readings:
    """A recording of the gyroscope, beside an accelerometer that is not asked."""
    return Readings(Series(time, np.zeros(rate.shape), "m/s^2"), Series(time, rate, "rad/s"))


def _holds(rate: float, density: float = 1.0) -> list[Hold]:
    """Holds whose mean rates have noise of that power density at the lowest frequencies, rad²/s."""
    bare = np.zeros(3), np.eye(3), np.zeros(3), density / SECONDS * np.eye(3)
    return [Hold(4.0 * k, 4.0 * k + SECONDS, *bare, round(SECONDS * rate)) for k in range(HOLDS)]


@pytest.mark.parametrize(
    ("rate", "tremor"),
    [
        (25.0, (8.0, 12.0)),
        (25.0, (5.0, 8.0)),
        (50.0, (9.0, 11.0)),
        (100.0, (4.0, 7.0)),
        (100.0, (8.0, 12.0)),
        (400.0, (6.0, 10.0)),
        (1600.0, (8.0, 12.0)),
    ],
)
def test_noise_is_told_from_sway_and_tremor_a_hundred_thousand_times_as_strong(
    rate: float, tremor: tuple[float, float]
) -> None:
    """White noise of three sizes on the axes, each to a half: two bands of 25 holds."""
    rng = np.random.default_rng(4)
    time = np.arange(round(4.0 * HOLDS * rate)) / rate
    sizes = NOISE * np.array([0.7, 1.0, 1.5])
    noise = sizes * np.sqrt(rate) * rng.standard_normal((len(time), 3))
    moving = _moving(time, tremor, rng)
    density = float(np.var(moving)) * SECONDS
    found = rest_spectrum(_read(time, moving + noise), _holds(rate, density))
    assert found is not None
    np.testing.assert_allclose(found.quiet, sizes**2, rtol=0.5)


@pytest.mark.parametrize("corner", [7.0, 10.0, 20.0])
def test_a_filter_hides_no_noise(corner: float) -> None:
    """100 samples/s after a filter, which takes half of the noise at its corner, more above."""
    rng = np.random.default_rng(5)
    time = np.arange(round(4.0 * HOLDS * 1000.0)) / 1000.0
    noise = NOISE * np.sqrt(1000.0) * rng.standard_normal((len(time), 3))
    moving = _moving(time, (8.0, 12.0), rng)
    passed = sosfilt(butter(2, corner / 500.0, output="sos"), moving + noise, axis=0)
    density = float(np.var(moving)) * SECONDS
    found = rest_spectrum(_read(time[::10], passed[::10]), _holds(100.0, density))
    assert found is not None
    assert 0.4 < found.quiet.mean() / NOISE**2 < 1.3


@pytest.mark.parametrize(
    ("rate", "taps"),
    [
        (100.0, np.ones(8)),
        (100.0, np.ones(16)),
        (1000.0, np.ones(160)),
        (1000.0, firwin(400, 5.0, fs=1000.0)),
        (200.0, firwin(100, 5.0, fs=200.0)),
    ],
)
def test_what_a_filter_far_below_a_quarter_of_the_rate_lessens_is_no_hand(
    rate: float, taps: FloatArray
) -> None:
    """Means of many samples, whose power has zeros, and filters at 5 Hz: at least half is left."""
    rng = np.random.default_rng(6)
    time = np.arange(round(4.0 * HOLDS * rate)) / rate
    noise = NOISE * np.sqrt(rate) * rng.standard_normal((len(time), 3))
    passed = lfilter(taps / taps.sum(), 1.0, noise, axis=0)
    found = rest_spectrum(_read(time, passed), _holds(rate, NOISE**2))
    assert found is not None
    assert 0.5 < found.quiet.mean() / NOISE**2 < 1.2


@pytest.mark.parametrize("seconds", [2.0, 30.0])
def test_the_noise_is_the_same_in_holds_of_any_length(seconds: float) -> None:
    """A hundred holds; a median over them knows a band to a tenth, and three axes are averaged."""
    rng = np.random.default_rng(7)
    time = np.arange(round(100 * (seconds + 1.0) * 50.0)) / 50.0
    noise = NOISE * np.sqrt(50.0) * rng.standard_normal((len(time), 3))
    first = _holds(50.0)[0]
    holds = [
        replace(first, start=begin, end=begin + seconds, samples=round(50.0 * seconds))
        for begin in (seconds + 1.0) * np.arange(100)
    ]
    found = rest_spectrum(_read(time, noise), holds)
    assert found is not None
    assert found.quiet.mean() == pytest.approx(NOISE**2, rel=0.06)


def test_holds_of_a_few_samples_have_no_spectrum() -> None:
    time = np.arange(400.0) / 4.0
    assert rest_spectrum(_read(time, np.zeros((400, 3))), _holds(4.0)) is None


def test_a_fit_looks_at_the_rests_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """For the noise of its holds and for what sampling loses in its rotations."""
    seen: list[int] = []

    def counted(
        levels: FloatArray, freedom: FloatArray, lowest: FloatArray | None
    ) -> tuple[FloatArray, bool]:
        seen.append(len(levels))
        return _quietest(levels, freedom, lowest)

    monkeypatch.setattr("imucal_wizard.estimate.rest_spectrum._quietest", counted)
    simulate_recording(tmp_path / "short.csv", rate=25.0, poses="6", rotations=1, hold=3.0)
    report = fit_readings(read_files([tmp_path / "short.csv"]))
    assert report.sensors["gyroscope"].experiment is not None
    assert seen == [len(report.holds)]


@pytest.mark.parametrize(
    ("tremor", "sway", "restless", "level"),
    [(20.0, 0.0, 0.0, True), (5.0, 0.3, 0.0, True), (0.0, 0.0, 0.2, False)],
)
def test_a_hand_that_leaves_high_bands_alone_shows_the_level_of_the_noise(
    tremor: float, sway: float, restless: float, level: bool
) -> None:
    """Up to 25 Hz; a hand that moves the device at all frequencies shows more than the noise."""
    rng, device = np.random.default_rng(14), Device()
    motion = placed(device, rng, tremor=tremor, sway=sway, restless=restless)
    readings = recorded(motion, device, rng)
    found = rest_spectrum(readings, find_holds(readings, G)[0])
    assert found is not None
    assert found.level is level
    true = np.radians(device.rate_noise) ** 2 / 2.0
    # a band of 1 Hz in twenty holds of three seconds is known to a tenth
    assert bool(np.abs(found.quiet / true - 1.0).max() < 0.3) is level


@pytest.mark.parametrize("seed", [31, 32, 33])
def test_slow_noise_on_a_table_is_not_taken_for_a_hand(seed: int) -> None:
    """The gyroscope's noise has a time constant of a third of a second beside its white noise.

    It turns nothing, as the directions of the accelerometer show, so it counts in full: the figure
    is that of the power which holds of three seconds see, half of that at the frequency zero.
    """
    rng, device = np.random.default_rng(seed), Device()
    readings = recorded(placed(device, rng, turns=2), device, rng)
    assert readings.gyroscope is not None
    keeps, size = np.exp(-1.0 / (0.33 * device.rate)), np.radians(0.035)
    push = rng.standard_normal((len(readings.gyroscope) + 500, 3))
    slow = lfilter([size * np.sqrt(1.0 - keeps**2)], [1.0, -keeps], push, axis=0)[500:]
    noisy = replace(readings.gyroscope, values=readings.gyroscope.values + slow)
    report = fit_readings(replace(readings, gyroscope=noisy))
    found = report.sensors["gyroscope"]
    assert found.rms_held_out is not None
    assert found.floor is not None
    assert found.floor > 0.4 * found.rms_held_out
    experiment = found.experiment
    assert isinstance(experiment, GyroscopeExperiment)
    assert not experiment.noise_at_rest.held
