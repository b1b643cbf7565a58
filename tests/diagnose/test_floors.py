"""Three floors are told apart: within the holds, rounding, repeats."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.readings import Series
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.floors import Floors, floors_of, rounding_of
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.measurement.holds import Hold
from tests.diagnose.recordings import MG, along, fitted, moved, refitted


def floors(report: FitReport) -> Floors:
    return Benches(report).accelerometer.ladder[0].floors


@pytest.fixture(scope="module")
def report() -> FitReport:
    """26 poses and twelve of them again."""
    return fitted(poses="26+repeats", seed=5)[0]


def test_rounding_is_the_converters_step_over_the_root_of_twelve() -> None:
    """The virtual accelerometer has 14 bits over ±4 g, and noise of two steps."""
    benches = Benches(*fitted())
    rounding = benches.accelerometer.rounding
    assert rounding is not None
    assert rounding.error == pytest.approx(8.0 * 9.80665 / 2**14 / np.sqrt(12.0), rel=0.05)
    assert rounding.dithered
    floors = benches.accelerometer.ladder[0].floors
    assert floors.rounding == rounding.error
    assert floors.within < rounding.error


def test_a_noise_under_half_a_step_does_not_average_rounding_away() -> None:
    """Readings of a quiet sensor in steps of one: the floor cannot fall under 1/√12 of them."""
    rng = np.random.default_rng(0)
    time = np.arange(1000) / 100.0
    hold = Hold(0.0, 10.0, np.zeros(3), np.eye(3), None, None, 1000)
    for spread, dithered in ((0.3, False), (2.0, True)):
        values = np.round(rng.normal(0.3, spread, (1000, 3)))
        rounding = rounding_of(Series(time, values, "count"), [hold], 2.0)
        assert rounding is not None
        assert rounding.error == pytest.approx(2.0 / np.sqrt(12.0))
        assert rounding.dithered is dithered


def test_without_readings_the_rounding_is_not_known(report: FitReport) -> None:
    assert floors(report).rounding is None


def test_repeats_are_as_good_as_the_noise_within_or_worse(report: FitReport) -> None:
    """Moved by a quarter milli-g from hold to hold they differ by that, within their interval."""
    rng = np.random.default_rng(1)
    good = floors(moved(report, lambda _, hold: 0.0 * hold.accelerometer))
    bad = floors(moved(report, lambda _, hold: along(hold, rng.normal(0.0, 0.25 * MG))))
    assert good.repeats is not None
    assert bad.repeats is not None
    assert good.repeats.freedom == bad.repeats.freedom >= 12
    assert good.repeats.rms < 2.0 * good.within
    assert not bad.repeats.repeatable
    low, high = bad.repeats.interval
    assert low < 0.25 * MG < high < 2.0 * low


def test_pieces_of_one_rest_are_no_repeats(report: FitReport) -> None:
    """A disturbance that cuts every rest in two gives nothing to judge by that was not there."""
    whole = floors(report)
    cut = []
    for hold in report.holds:
        middle = 0.5 * (hold.start + hold.end)
        cut += [replace(hold, end=middle - 0.5), replace(hold, start=middle + 0.5)]
    found = floors(refitted(report, cut))
    assert whole.repeats is not None
    assert found.repeats is not None
    assert found.repeats.freedom == whole.repeats.freedom
    assert found.repeats.rms == pytest.approx(whole.repeats.rms * np.sqrt(2.0), rel=0.2)


def test_without_repeats_nothing_is_said_of_them() -> None:
    """One hold for each direction."""
    whole, _ = fitted()
    up = np.array([hold.accelerometer / np.linalg.norm(hold.accelerometer) for hold in whole.holds])
    once = [k for k in range(len(up)) if not (up[:k] @ up[k] > np.cos(np.radians(15.0))).any()]
    found = floors(refitted(whole, [whole.holds[k] for k in once]))
    assert found.repeats is None


def test_the_floor_of_rates_at_rest_is_a_rate(report: FitReport) -> None:
    """Of a gyroscope that never turned, the errors are those of rates, not of angles."""
    fit = report.sensors["accelerometer"]
    for unit, shown in (("rad", "rad/s"), ("rad/s", "rad/s"), ("m/s^2", "m/s^2")):
        assert floors_of(replace(fit, unit=unit)).unit == shown


def test_the_pose_before_the_first_hold_is_no_noise_within_it() -> None:
    """An effect of the pose before may have moved the first hold by any share of its size."""
    bench = Benches(*fitted("hysteresis:4:z", poses="26+repeats", seed=6)).accelerometer
    before = bench.ladder[-1].floors.within
    bench.add("hysteresis")
    after, table = bench.ladder[-1].floors.within, bench.fit.rows
    assert table is not None
    assert table.floor.max() > 5.0 * before
    assert after == pytest.approx(before, rel=0.02)
