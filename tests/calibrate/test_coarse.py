"""Coarse readings, frozen ones, and a device held in the hand: the holds are found all the same."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.survey import diagnose_benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.recording import FitOptions, fit_collected, fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.data_quality import finer_steps
from imucal_wizard.measurement.rounding import integrated_rounding
from imucal_wizard.simulate.actions import Tremble
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.recording import recording_script
from imucal_wizard.simulate.sensor import SensorModel
from tests.calibrate.sessions import recorded, session, with_accelerometer

MILLI_G = STANDARD_GRAVITY / 1000.0
DEGREE = np.pi / 180.0
RESTS = 1 + 18 + 3 + 6
"""A first rest, the poses, the starts of the turns, two turns about each axis."""


@cache
def _exact(rate: float, density: float, trembling: bool, seed: int = 0) -> Readings:
    """Readings that are not rounded; ``density`` in mg/√Hz."""
    hand = VirtualHand(rate, seed)
    first, *others = recording_script("18", np.random.default_rng(5 + seed), hold=4.0, rotations=2)
    hand.perform([first, *([Tremble(True)] if trembling else []), *others])
    drawn = SensorModel.drawn(seed)
    model = replace(
        drawn,
        accelerometer=replace(drawn.accelerometer, step=0.0, density=density * MILLI_G),
        gyroscope=replace(drawn.gyroscope, step=0.0),
    )
    return recorded(hand, model, rate)


def _in_steps(readings: Readings, step_a: float, step_g: float) -> Readings:
    def rounded(series: Series, step: float) -> Series:
        values = np.round(series.values / step) * step if step else series.values
        return replace(series, values=values)

    assert readings.gyroscope is not None
    return replace(
        readings,
        accelerometer=rounded(readings.accelerometer, step_a),
        gyroscope=rounded(readings.gyroscope, step_g),
    )


def _errors(report: FitReport) -> tuple[float, float, float]:
    """Of the accelerometer's bias (mg) and of both matrices, against the sensor's own."""
    model = SensorModel.drawn(0)
    force, rate = report.sensors["accelerometer"], report.sensors["gyroscope"]
    bias = np.abs(force.bias - model.accelerometer.bias).max() / MILLI_G
    off = [
        float(np.abs(fit.matrix @ triad.sensitivity - np.eye(3)).max())
        for fit, triad in ((force, model.accelerometer), (rate, model.gyroscope))
    ]
    return float(bias), *off  # type: ignore[return-value] # two of them


COARSE = [
    (0.01 * STANDARD_GRAVITY, 0.01),
    (0.1, DEGREE),
    (STANDARD_GRAVITY / 64.0, DEGREE / 16.0),  # eight bits over ±2 g
]


@pytest.mark.parametrize("density", [0.03, 0.15, 0.6])
@pytest.mark.parametrize("steps", range(len(COARSE)))
def test_every_rest_is_found_in_coarse_readings(steps: int, density: float) -> None:
    """Two printed decimals of g, one of m/s², eight bits: most windows show no noise at all.

    Every other one is held by a hand that trembles, so that each step and each noise has both.
    """
    step_a, step_g = COARSE[steps]
    trembling = (steps + round(density / 0.15)) % 2 == 1
    report = fit_readings(_in_steps(_exact(100.0, density, trembling), step_a, step_g))
    assert RESTS - 1 <= len(report.holds) <= RESTS + 1
    assert len({hold.pose for hold in report.holds if hold.pose}) == 18
    bias, force, rate = _errors(report)
    assert bias < 0.3 * step_a / MILLI_G
    assert force < 0.6 * step_a / STANDARD_GRAVITY
    assert rate < 0.025


@pytest.mark.parametrize("rate", [50.0, 400.0, pytest.param(1000.0, marks=pytest.mark.study)])
@pytest.mark.parametrize("trembling", [False, True])
def test_the_sampling_rate_changes_nothing_in_it(rate: float, trembling: bool) -> None:
    """Five samples in a tenth of a second or a hundred."""
    readings = _in_steps(_exact(rate, 0.15, trembling), 0.01 * STANDARD_GRAVITY, 0.01)
    report = fit_readings(readings)
    assert RESTS - 1 <= len(report.holds) <= RESTS + 1
    assert len({hold.pose for hold in report.holds if hold.pose}) == 18


@pytest.mark.parametrize("rate", [50.0, 100.0, 400.0])
def test_a_hand_may_tremble_a_thousand_times_the_quietest_variance(rate: float) -> None:
    """The first rest is on a table and everything else in the hand, without any rounding."""
    report = fit_readings(_exact(rate, 0.03, True))
    assert RESTS - 1 <= len(report.holds) <= RESTS + 1
    assert (report.sensors["accelerometer"].rms_held_out or 1.0) < 0.5 * MILLI_G


@pytest.mark.parametrize("density", [0.03, 0.15, 0.6])
def test_the_floor_counts_what_rounding_does(density: float) -> None:
    """It is about what the fit leaves, and the verdict does not take rounding for physics."""
    step = 0.01 * STANDARD_GRAVITY
    report = fit_readings(_in_steps(_exact(100.0, density, False), step, 0.0))
    fit = report.sensors["accelerometer"]
    error = np.sqrt(fit.rms_fitted * (fit.rms_held_out or 0.0))
    assert 0.6 < error / (fit.floor or 0.0) < 1.4
    coarse = [text for text in report.warnings if "larger than their noise" in text]
    assert bool(coarse) == (density < 0.6)
    if coarse:
        assert "accelerometer's readings come in steps of 10 mg" in coarse[0]
        assert "Print decimal numbers with more digits" in coarse[0]


@pytest.mark.parametrize("density", [0.15, 0.3, 0.35])
def test_averages_err_by_rounding_as_much_as_is_counted(density: float) -> None:
    """Against the averages before rounding, with a tenth to a quarter of a step of noise.

    Three sessions of some 27 holds and three axes: their rms is known to 7 %.
    """
    step, said, seen = 0.01 * STANDARD_GRAVITY, [], []
    for seed in range(3):
        exact = _exact(100.0, density, False, seed)
        rounded = _in_steps(exact, step, 0.0)
        for hold in fit_readings(rounded).holds:
            true, read = (hold.readings(one.accelerometer).values for one in (exact, rounded))
            assert hold.accelerometer_scatter is not None
            said.append(hold.accelerometer_scatter - read.var(axis=0) / (len(read) - 1))
            seen.append((read - true).mean(axis=0) ** 2 - step**2 / 12.0 / len(read))
    assert 0.85 < np.sqrt(np.mean(said) / np.mean(seen)) < 1.2


def test_counts_are_not_asked_for_more_digits() -> None:
    """A converter of 10 bits in the upper bits of 16: its steps are 64 counts wide."""
    readings = _exact(100.0, 0.03, False)
    per_count = STANDARD_GRAVITY / 8192.0

    def counted(series: Series | None) -> Series:
        assert series is not None
        return Series(series.time, 64.0 * np.round(series.values / per_count / 64.0), "count")

    report = fit_readings(replace(readings, accelerometer=counted(readings.accelerometer)))
    coarse = [text for text in report.warnings if "larger than their noise" in text]
    assert "steps of 64 count" in coarse[0]
    assert coarse[0].endswith("not those of printed digits: set a smaller range")


def test_a_logger_that_stood_still_does_not_set_the_limits() -> None:
    """Fifteen seconds of one and the same number are quieter than any rest."""

    def freeze(values: FloatArray) -> FloatArray:
        values[400:1900] = values[400]
        return values

    readings = with_accelerometer(session(), freeze)
    gyroscope = readings.gyroscope
    assert gyroscope is not None
    rates = gyroscope.values.copy()
    rates[400:1900] = rates[400]
    report = fit_readings(replace(readings, gyroscope=replace(gyroscope, values=rates)))
    assert len({hold.pose for hold in report.holds if hold.pose}) == 18
    assert len(report.holds) >= 38


@pytest.mark.parametrize("method", ["vector", "offset"])
@pytest.mark.parametrize("density", [0.03, 0.15])
def test_the_standard_error_of_a_rate_bias_counts_a_shift_that_all_rests_share(
    density: float, method: str
) -> None:
    """All of them read the same bias, and rounding shifts it alike: their scatter is silent."""
    step = 0.01
    bias = SensorModel.drawn(0).gyroscope.bias
    options = FitOptions(gyroscope_method=method)
    report = fit_readings(_in_steps(_exact(100.0, density, False), 0.0, step), options)
    known = {one.name: one for one in report.sensors["gyroscope"].parameters}
    for axis, true in zip("xyz", bias, strict=True):
        found = known[f"bias_{axis}"]
        assert found.standard_error is not None
        assert abs(found.value - true) < 3.5 * found.standard_error
        assert found.standard_error < step / np.sqrt(12.0)


def test_rotations_tell_a_rate_bias_better_than_rests_that_all_show_one_step() -> None:
    """With rounding of 0.01 rad/s and quiet rests the rotations alone give a tenth of a step."""
    step = 0.01
    report = fit_readings(_in_steps(_exact(100.0, 0.03, False), 0.0, step))
    known = {one.name: one for one in report.sensors["gyroscope"].parameters}
    errors = [known[f"bias_{axis}"].standard_error or np.inf for axis in "xyz"]
    assert max(errors) < step / 10.0


@pytest.mark.study
def test_a_rate_bias_that_rotations_tell_is_as_certain_as_stated() -> None:
    """Six coarse sessions: a rotation that begins and ends at rest is shifted there as well."""
    step, off = 0.01, []
    for seed in range(40, 46):
        report = fit_readings(_in_steps(_exact(100.0, 0.03, False, seed), 0.0, step))
        known = {one.name: one for one in report.sensors["gyroscope"].parameters}
        for axis, true in zip("xyz", SensorModel.drawn(seed).gyroscope.bias, strict=True):
            one = known[f"bias_{axis}"]
            off.append(abs(one.value - true) / (one.standard_error or 0.0))
    # 18 parameters; how the shift wanes as a motion begins is known for usual motions only
    assert np.mean(np.array(off) < 1.96) > 0.8


def _verdict_in_whole_degrees(seed: int) -> Verdict:
    readings = _in_steps(_exact(100.0, 0.15, False, seed), 0.0, DEGREE)
    report = fit_readings(readings)
    assert not any("trembles" in text for text in report.warnings)
    return diagnose_benches(Benches(report, readings), {}, automatic=False)[1].verdict


def test_a_gyroscope_in_whole_degrees_per_second_is_no_missing_effect() -> None:
    """Rounding in motion is noise: no effect has its shape, no hold moved and no hand trembles."""
    assert _verdict_in_whole_degrees(72) is Verdict.COMPLETE


@pytest.mark.study
def test_gyroscopes_in_whole_degrees_per_second_are_complete_but_for_chance() -> None:
    """A model is not called complete in one of twenty sessions by chance."""
    verdicts = [_verdict_in_whole_degrees(seed) for seed in range(74, 78)]
    assert verdicts.count(Verdict.COMPLETE) >= 3
    assert not set(verdicts) & {Verdict.MISSING, Verdict.DISTURBED}


def test_a_coarse_gyroscope_may_be_mounted_turned_by_a_quarter() -> None:
    """Its steps belong to its own axes; the same readings give the same errors."""
    readings = _in_steps(_exact(100.0, 0.15, False, 72), 0.0, DEGREE)
    assert readings.gyroscope is not None
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    values = readings.gyroscope.values @ turn.T
    turned = replace(readings, gyroscope=replace(readings.gyroscope, values=values))
    here, there = (fit_readings(one).sensors["gyroscope"] for one in (readings, turned))
    np.testing.assert_allclose(there.matrix @ turn, here.matrix, atol=1e-6)
    assert there.floor == pytest.approx(here.floor, rel=1e-4)


MOTIONS: dict[str, Callable[[np.random.Generator], FloatArray]] = {
    "it passes steps": lambda rng: np.cumsum(rng.uniform(0.1, 0.4, 4000)),
    "it is fast": lambda rng: 60.0 * np.sin(rng.uniform(0.5, 2.0) * np.arange(300)),
    "it stays on a step": lambda rng: np.full(100, rng.uniform(-5.0, 5.0)),
}


@pytest.mark.parametrize("motion", MOTIONS)
def test_the_sum_of_rounded_readings_errs_as_their_runs_say(motion: str) -> None:
    """Against the errors of 1,000 motions, to a factor of 1.5 in their variance."""
    rng = np.random.default_rng(21)
    error: list[float] = []
    said: list[float] = []
    for _ in range(1000):
        rate = MOTIONS[motion](rng)
        rounded = np.round(rate)
        error.append(float((rounded - rate).sum()))
        said.append(float(integrated_rounding(rounded[:, None], np.ones(1))[0]))
    assert 1.0 / 1.5 < np.mean(np.square(error)) / np.mean(said) < 1.5


def test_a_slow_turn_errs_less_than_its_runs_say_but_not_by_much() -> None:
    """Smooth random rates of two steps rms: a variance that is too large by three at most."""
    rng, window = np.random.default_rng(22), np.hanning(60)
    error: list[float] = []
    said: list[float] = []
    for _ in range(400):
        wave = np.convolve(rng.standard_normal(400), window, "valid")
        rate = 2.0 * wave / np.linalg.norm(window) + rng.uniform(-0.5, 0.5)
        rounded = np.round(rate)
        error.append(float((rounded - rate).sum()))
        said.append(float(integrated_rounding(rounded[:, None], np.ones(1))[0]))
    assert 1.0 / 3.0 < np.mean(np.square(error)) / np.mean(said) < 1.0


def test_a_device_without_a_gyroscope_counts_rounding_live_too() -> None:
    """No rotation keeps samples then; the procedure itself has seen the steps of all of them."""
    step = 0.01 * STANDARD_GRAVITY
    readings = replace(_in_steps(_exact(100.0, 0.03, False), step, 0.0), gyroscope=None)
    machine = StateMachine(rate=100.0)
    machine.command("start")
    machine.feed(readings)
    seen = machine.collected()
    assert seen.rotations == ()
    assert seen.steps is not None
    assert seen.steps[0] == pytest.approx(np.full(3, step))
    report = fit_collected(seen, {"accelerometer": "m/s^2"}, 100.0)
    # without noise to speak of, averages lie anywhere within a step
    rows = report.sensors["accelerometer"].rows
    assert rows is not None
    assert np.sqrt(np.mean(rows.own)) == pytest.approx(step / np.sqrt(12.0), rel=0.1)
    assert any("larger than their noise" in text for text in report.warnings)


@pytest.mark.parametrize(
    ("step", "unit", "digits"),
    [
        (0.01, "m/s^2", True),
        (1e-3 * STANDARD_GRAVITY, "m/s^2", True),
        (16.0 / 4096.0 * STANDARD_GRAVITY, "m/s^2", False),
        (2.0 / 2048.0 * STANDARD_GRAVITY, "m/s^2", False),
        (np.radians(0.1), "rad/s", True),
        (np.radians(2000.0 / 32768.0), "rad/s", False),
    ],
)
def test_more_digits_are_asked_for_only_where_digits_make_the_steps(
    step: float, unit: str, digits: bool
) -> None:
    """A converter's steps are no decimal fraction of a unit."""
    assert ("more digits" in finer_steps(step, unit)) == digits
